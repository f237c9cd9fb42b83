//! The command on a terminal of its own.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs::File;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::process::{Command, Stdio};

use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

/// Both ends of a terminal this many columns wide: ours, and the program's.
fn terminal(columns: u16) -> (File, OwnedFd) {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let ours = openpt(flags).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let program = ioctl_tiocgptpeer(&ours, flags).unwrap();
    tcsetwinsize(&program, Winsize { ws_row: 24, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 }).unwrap();
    (File::from(ours), program)
}

fn hippocamp(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

#[test]
fn the_status_line_fits_a_narrow_terminal() {
    let (mut ours, program) = terminal(40);
    let mut command = hippocamp(&["run", "config/horse.toml", "--virtual", "--for", "5"]);
    let mut child = command.stdout(Stdio::null()).stderr(program).spawn().unwrap();
    // The command keeps the program's end open as well.
    drop(command);
    // A terminal without a program reads as an error on Linux; what came before stays.
    let mut shown = Vec::new();
    let _ = ours.read_to_end(&mut shown);
    assert!(child.wait().unwrap().success());
    let shown = String::from_utf8(shown).unwrap();
    let lines: Vec<&str> = shown.split("\r\x1b[2K").skip(1).map(str::trim_end).collect();
    assert!(lines.iter().any(|line| line.contains("walking 0.")), "{lines:?}");
    assert!(lines.iter().all(|line| line.len() <= 40), "{lines:?}");
}

#[test]
fn a_guard_started_by_hand_explains_itself_and_touches_nothing() {
    let (_ours, program) = terminal(80);
    let guard = hippocamp(&["guard", "config/horse.toml"]).stdin(program).output().unwrap();
    let said = String::from_utf8(guard.stderr).unwrap();
    assert_eq!(guard.status.code(), Some(2), "{said}");
    assert!(said.contains("for internal use") && said.contains("nothing was touched"), "{said}");
    assert!(guard.stdout.is_empty());
}
