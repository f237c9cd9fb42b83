//! Everything the program says goes out here, to standard output or standard error, a line at a time.
//!
//! Whatever comes from outside (names, paths, texts of servos and files) is in these lines, and none of it is obeyed by
//! the terminal: each line is made [`printable`], so that no text steers the terminal or begins a line of its own.

#![allow(clippy::disallowed_methods, reason = "the place that all others leave it to")]

use std::fmt::Arguments;
use std::io::{self, Write};
use std::sync::OnceLock;

use crate::printable::printable;

/// Prints a line to standard output. That nobody reads it is no reason for a robot to fail: [`end`] tells of it.
macro_rules! say {
    () => { $crate::cli::say::line(format_args!("")) };
    ($($text:tt)*) => { $crate::cli::say::line(format_args!($($text)*)) };
}

/// Why standard output does not take what is said; none so far.
static LOST: OnceLock<String> = OnceLock::new();

/// A line for standard output.
pub(super) fn line(text: Arguments<'_>) {
    let text = text.to_string();
    note(write_line(&mut io::stdout().lock(), &text));
}

/// The lines of a text whose newlines are the program's own.
pub(super) fn lines(text: &str) {
    text.lines().for_each(|text| line(format_args!("{text}")));
}

/// A question, which is answered in the same line.
pub(super) fn ask(question: &str) {
    let mut out = io::stdout().lock();
    note(write!(out, "{} ", printable(question)).and_then(|()| out.flush()));
}

/// A line for standard error.
pub(super) fn complain(text: &str) {
    // Where else could it be said?
    let _ = write_line(&mut io::stderr().lock(), text);
}

fn write_line(out: &mut impl Write, text: &str) -> io::Result<()> {
    // In one piece: other processes write to the same terminal.
    out.write_all(format!("{}\n", printable(text)).as_bytes())
}

/// Notes what became of writing to standard output. A reader who has gone away has seen enough.
pub(super) fn note(written: io::Result<()>) {
    if let Err(error) = written
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| error.to_string());
    }
}

/// What `code` becomes at the program's end: a result that did not reach standard output is no success, and is told.
pub(super) fn end(code: u8) -> u8 {
    note(io::stdout().flush());
    let Some(why) = LOST.get() else { return code };
    complain(&format!("hippocamp: not all was printed: standard output could not be written: {why}"));
    if code == super::COMPLETED { super::FAILED } else { code }
}
