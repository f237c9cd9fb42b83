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

/// A status line on standard error.
pub(super) struct StatusLine {
    sender: Option<Sender<Status>>,
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
                let _ = sender.try_send(*status);
            }
        }
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

fn print_all(statuses: &Receiver<Status>, is_terminal: bool) {
    let mut out = std::io::stderr().lock();
    for status in statuses {
        let line = line_of(&status);
        // A closed terminal is no reason to stop a walking robot.
        let _ = if is_terminal { write!(out, "\r\x1b[2K{line}") } else { writeln!(out, "{line}") };
        let _ = out.flush();
    }
    if is_terminal {
        let _ = writeln!(out);
    }
}

fn line_of(status: &Status) -> String {
    let activity = match (status.permission, status.activity) {
        (Permission::Hold, _) => "HELD BY SAFETY",
        (Permission::Stop, _) => "STOPPED BY SAFETY",
        (_, Activity::Limp) => "limp",
        (_, Activity::Rising) => "rising",
        (_, Activity::Standing) => "standing",
        (_, Activity::Walking) => "walking",
        (_, Activity::Jogging) => "turning one joint",
        (_, Activity::Stopping) => "stopping",
        (_, Activity::Done) => "done",
    };
    let servos = if status.lowest_v.is_finite() {
        format!(", at most {:.0} C, at least {:.1} V", status.hottest_c, status.lowest_v)
    } else {
        String::new()
    };
    let loss = if status.is_recording_lost { ", THE RECORDING BROKE OFF" } else { "" };
    format!(
        "{:6.1} s  {activity}, {:.3} m/s{servos}, {} late cycles{loss}",
        status.time_s, status.speed_m_s, status.late_cycles
    )
}
