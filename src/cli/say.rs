//! All output of the program goes through here, to standard output or standard error, a line at a time.
//!
//! These lines may contain foreign text (names, paths, texts of servos and files). Each line is made [`printable`],
//! so that such text can neither control the terminal nor begin a line of its own.

#![allow(clippy::disallowed_methods, reason = "the place that all others leave it to")]

use std::fmt::Arguments;
use std::io::{self, Write};
use std::sync::OnceLock;

use crate::printable::printable;

/// Prints a line to standard output. A failed write must not stop a robot: [`end`] reports it.
macro_rules! say {
    () => { $crate::cli::say::line(format_args!("")) };
    ($($text:tt)*) => { $crate::cli::say::line(format_args!($($text)*)) };
}

/// Why standard output takes no more text; empty so far.
static LOST: OnceLock<String> = OnceLock::new();

/// Prints a line to standard output.
pub(super) fn line(text: Arguments<'_>) {
    let text = text.to_string();
    note(write_line(&mut io::stdout().lock(), &text));
}

/// Prints the lines of a text whose newlines are the program's own.
pub(super) fn lines(text: &str) {
    text.lines().for_each(|text| line(format_args!("{text}")));
}

/// Prints a question; the user answers in the same line.
pub(super) fn ask(question: &str) {
    let mut out = io::stdout().lock();
    note(write!(out, "{} ", printable(question)).and_then(|()| out.flush()));
}

/// Prints a line to standard error.
pub(super) fn complain(text: &str) {
    // There is no other place to report a failure here.
    let _ = write_line(&mut io::stderr().lock(), text);
}

fn write_line(out: &mut impl Write, text: &str) -> io::Result<()> {
    // In a single write: other processes write to the same terminal.
    out.write_all(format!("{}\n", printable(text)).as_bytes())
}

/// Notes the result of a write to standard output. A reader that has closed the pipe, or a terminal that is gone,
/// is no error.
pub(super) fn note(written: io::Result<()>) {
    if let Err(error) = written
        && error.kind() != io::ErrorKind::BrokenPipe
        && !is_terminal_gone(&error)
    {
        LOST.get_or_init(|| error.to_string());
    }
}

/// True if the terminal was closed: the error is that of a broken disk, but the file is a character device.
fn is_terminal_gone(error: &io::Error) -> bool {
    use std::os::fd::AsFd;
    let is_device = rustix::fs::fstat(io::stdout().as_fd()).is_ok_and(|found| {
        rustix::fs::FileType::from_raw_mode(found.st_mode) == rustix::fs::FileType::CharacterDevice
    });
    error.raw_os_error() == Some(rustix::io::Errno::IO.raw_os_error()) && is_device
}

/// The exit code at the program's end: if output was lost, prints why and turns success into failure.
pub(super) fn end(code: u8) -> u8 {
    note(io::stdout().flush());
    let Some(why) = LOST.get() else { return code };
    complain(&format!("hippocamp: not all was printed: standard output could not be written: {why}"));
    if code == super::COMPLETED { super::FAILED } else { code }
}
