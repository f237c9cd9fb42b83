//! The status line, printed by a thread of its own so that a slow terminal never delays the loop.

use std::io::{IsTerminal, Write};
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender, bounded};

use crate::motion::Activity;
use crate::run::Status;
use crate::signals::Permission;

/// Time of the run between two status lines on a terminal, and elsewhere, s.
const TERMINAL_EVERY_S: f64 = 0.2;
const FILE_EVERY_S: f64 = 5.0;

/// What is printed.
enum Line {
    Status(Status),
    /// A line of its own.
    Note(&'static str),
}

/// A status line on standard error.
pub(super) struct StatusLine {
    sender: Option<Sender<Line>>,
    printer: Option<JoinHandle<()>>,
    every_s: f64,
    next_s: f64,
    /// What cannot wait for the next line was said.
    has_said_loss: bool,
}

impl StatusLine {
    pub(super) fn start() -> StatusLine {
        let is_terminal = std::io::stderr().is_terminal();
        let (sender, receiver) = bounded(4);
        StatusLine {
            sender: Some(sender),
            printer: Some(std::thread::spawn(move || print_all(&receiver, is_terminal))),
            every_s: if is_terminal { TERMINAL_EVERY_S } else { FILE_EVERY_S },
            next_s: 0.0,
            has_said_loss: false,
        }
    }

    /// Shows `status` if it is time for another line. Never waits: a line the printer has no room for is lost.
    pub(super) fn show(&mut self, status: &Status) {
        if status.time_s >= self.next_s || (status.is_recording_lost && !self.has_said_loss) {
            self.has_said_loss = status.is_recording_lost;
            self.next_s = status.time_s + self.every_s;
            if let Some(sender) = &self.sender {
                let _ = sender.try_send(Line::Status(*status));
            }
        }
    }

    /// Shows `words` that stay. Never waits: false if there is no room for them now.
    pub(super) fn note(&mut self, words: &'static str) -> bool {
        self.sender.as_ref().is_none_or(|sender| sender.try_send(Line::Note(words)).is_ok())
    }
}

impl Drop for StatusLine {
    fn drop(&mut self) {
        // Closing the channel ends the printer.
        self.sender = None;
        if let Some(printer) = self.printer.take() {
            let _ = printer.join();
        }
    }
}

fn print_all(lines: &Receiver<Line>, is_terminal: bool) {
    let mut out = std::io::stderr().lock();
    for line in lines {
        let (line, is_passing) = match line {
            Line::Status(status) => (line_of(&status), is_terminal),
            Line::Note(words) => (words.to_owned(), false),
        };
        let clear = if is_terminal { "\r\x1b[2K" } else { "" };
        // A closed terminal is no reason to stop a walking robot.
        let _ = if is_passing {
            // A line that wraps would be left behind by the next. The width may change at any time.
            write!(out, "{clear}{}", cut(&line, terminal_columns()))
        } else {
            writeln!(out, "{clear}{line}")
        };
        let _ = out.flush();
    }
    if is_terminal {
        let _ = writeln!(out);
    }
}

/// Columns of the terminal on standard error; where it does not tell, what all have had for fifty years.
fn terminal_columns() -> usize {
    let columns = rustix::termios::tcgetwinsize(std::io::stderr()).map_or(0, |size| usize::from(size.ws_col));
    if columns == 0 { 80 } else { columns }
}

/// As much of `line`, which is ASCII, as fits.
fn cut(line: &str, columns: usize) -> &str {
    line.get(..columns).unwrap_or(line)
}

/// The most important first: a narrow terminal shows the beginning.
fn line_of(status: &Status) -> String {
    let activity = match (status.permission, status.activity) {
        (Permission::Hold, _) => "HELD BY SAFETY".to_owned(),
        (Permission::Stop, _) => "STOPPED BY SAFETY".to_owned(),
        (_, Activity::Limp) => "limp".to_owned(),
        (_, Activity::Rising) => "rising".to_owned(),
        (_, Activity::Standing) => "standing".to_owned(),
        (_, Activity::Walking) => format!("walking {:.3} m/s", status.speed_m_s),
        (_, Activity::Jogging) => "turning one joint".to_owned(),
        (_, Activity::Stopping) => "stopping".to_owned(),
        (_, Activity::Done) => "done".to_owned(),
    };
    let servos = if status.lowest_v.is_finite() {
        format!(", {:.0} C, {:.1} V", status.hottest_c, status.lowest_v)
    } else {
        String::new()
    };
    let late = match status.late_cycles {
        0 => String::new(),
        1 => ", 1 late cycle".to_owned(),
        count => format!(", {count} late cycles"),
    };
    let loss = if status.is_recording_lost { ", THE RECORDING BROKE OFF" } else { "" };
    format!("{:6.1} s {activity}{servos}{loss}{late}", status.time_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALKING: Status = Status {
        time_s: 59.94,
        activity: Activity::Walking,
        speed_m_s: 0.1234,
        permission: Permission::Move,
        late_cycles: 0,
        hottest_c: 41.2,
        lowest_v: 11.84,
        is_recording_lost: false,
    };

    #[test]
    fn what_matters_fits_forty_columns() {
        assert_eq!(line_of(&WALKING), "  59.9 s walking 0.123 m/s, 41 C, 11.8 V");
        for permission in [Permission::Move, Permission::Hold, Permission::Stop] {
            let line = line_of(&Status { permission, late_cycles: 12345, ..WALKING });
            let shown = cut(&line, 40);
            assert!(shown.len() <= 40 && shown.contains(" C, 11.8 V"), "{shown}");
            assert_eq!(cut(&line, 200), line);
        }
        assert_eq!(cut("rising", 0), "");
    }

    #[test]
    fn a_robot_that_safety_stopped_has_no_walking_speed() {
        for permission in [Permission::Hold, Permission::Stop] {
            let line = line_of(&Status { permission, ..WALKING });
            assert!(line.contains("BY SAFETY") && !line.contains("m/s"), "{line}");
        }
    }

    #[test]
    fn late_cycles_are_told_once_there_are_some() {
        let line = |late_cycles| line_of(&Status { late_cycles, ..WALKING });
        assert!(!line(0).contains("late"));
        assert!(line(1).ends_with(", 1 late cycle") && line(2).ends_with(", 2 late cycles"));
    }
}
