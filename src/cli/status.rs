//! The status line, printed by a thread of its own so that a slow terminal never delays the loop.

use std::io::{IsTerminal, Write};
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender, bounded};

use crate::model::Gait;
use crate::motion::{Activity, GaitChoice, Order};
use crate::run::Status;
use crate::signals::Permission;

/// Time of the run between two status lines on a terminal, and elsewhere, s.
const TERMINAL_EVERY_S: f64 = 0.2;
const FILE_EVERY_S: f64 = 5.0;
/// Lines and notes that may wait for a slow terminal.
const WAITING: usize = 16;
/// Slower turns are not worth a word, rad/s.
const TURN_SHOWN_RAD_S: f64 = 1e-4;

/// What is printed.
#[derive(Debug, Clone, Copy)]
enum Shown {
    Status(Status, Order),
    Note(&'static str),
}

/// A status line on standard error.
pub(super) struct StatusLine {
    sender: Option<Sender<Shown>>,
    printer: Option<JoinHandle<()>>,
    every_s: f64,
    next_s: f64,
}

impl StatusLine {
    /// Of a robot with these gaits.
    pub(super) fn start(gaits: &[Gait]) -> StatusLine {
        let is_terminal = std::io::stderr().is_terminal();
        let (sender, receiver) = bounded(WAITING);
        let gaits = gaits.iter().map(|gait| gait.name.clone()).collect();
        let printer = Printer { is_terminal, gaits };
        StatusLine {
            sender: Some(sender),
            printer: Some(std::thread::spawn(move || printer.print_all(&receiver))),
            every_s: if is_terminal { TERMINAL_EVERY_S } else { FILE_EVERY_S },
            next_s: 0.0,
        }
    }

    /// Shows `status` and what was ordered if it is time for another line. Never waits: a line the printer has
    /// no room for is lost.
    pub(super) fn show(&mut self, status: &Status, order: Order) {
        if status.time_s >= self.next_s {
            self.next_s = status.time_s + self.every_s;
            self.send(Shown::Status(*status, order));
        }
    }

    /// Shows a line that stays. Never waits either.
    pub(super) fn note(&self, note: &'static str) {
        self.send(Shown::Note(note));
    }

    fn send(&self, shown: Shown) {
        if let Some(sender) = &self.sender {
            let _ = sender.try_send(shown);
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

/// The thread that prints.
struct Printer {
    is_terminal: bool,
    gaits: Vec<String>,
}

impl Printer {
    fn print_all(&self, all: &Receiver<Shown>) {
        let mut out = std::io::stderr().lock();
        for shown in all {
            // A closed terminal is no reason to stop a walking robot.
            let _ = match (shown, self.is_terminal) {
                (Shown::Status(status, order), true) => {
                    write!(out, "\r\x1b[2K{}", cut(&self.line_of(&status, order), columns()))
                }
                (Shown::Status(status, order), false) => writeln!(out, "{}", self.line_of(&status, order)),
                (Shown::Note(note), true) => writeln!(out, "\r\x1b[2K{note}"),
                (Shown::Note(note), false) => writeln!(out, "{note}"),
            };
            let _ = out.flush();
        }
        if self.is_terminal {
            let _ = writeln!(out);
        }
    }

    fn line_of(&self, status: &Status, order: Order) -> String {
        let doing = self.doing(status);
        let motion = match order {
            Order::Drive(command) => {
                let asked = self.choice(command.gait);
                let gait = match command.gait {
                    _ if status.permission != Permission::Move => doing.to_owned(),
                    GaitChoice::Auto if status.gait.is_some() => format!("{doing} (auto)"),
                    GaitChoice::Stand if status.activity == Activity::Standing => doing.to_owned(),
                    _ if asked == doing => doing.to_owned(),
                    _ => format!("{doing} -> {asked}"),
                };
                let turn = turn_words(status.yaw_rate_rad_s, command.yaw_rate_rad_s);
                format!("{gait}, {:.3} of {:.3} m/s{turn}", status.speed_m_s, command.speed_m_s)
            }
            _ => format!("{doing}, {:.3} m/s", status.speed_m_s),
        };
        let servos = if status.lowest_v.is_finite() {
            format!(", {:.0} C, {:.1} V", status.hottest_c, status.lowest_v)
        } else {
            String::new()
        };
        format!("{:6.1} s  {motion}{servos}, {} late cycles", status.time_s, status.late_cycles)
    }

    fn doing(&self, status: &Status) -> &str {
        match (status.permission, status.activity) {
            (Permission::Hold, _) => "HELD BY SAFETY",
            (Permission::Stop, _) => "STOPPED BY SAFETY",
            (_, Activity::Limp) => "limp",
            (_, Activity::Rising) => "rising",
            (_, Activity::Standing) => "standing",
            (_, Activity::Walking) => {
                status.gait.and_then(|index| self.gaits.get(index)).map_or("walking", String::as_str)
            }
            (_, Activity::Jogging) => "turning one joint",
            (_, Activity::Stopping) => "stopping",
            (_, Activity::Done) => "done",
        }
    }

    fn choice(&self, choice: GaitChoice) -> &str {
        match choice {
            GaitChoice::Stand => "stand",
            GaitChoice::Auto => "auto",
            GaitChoice::Gait(index) => self.gaits.get(index).map_or("?", String::as_str),
        }
    }
}

/// How fast the robot turns, and how fast it is to, both towards the side it is to turn to.
fn turn_words(turns_rad_s: f64, asked_rad_s: f64) -> String {
    if turns_rad_s.abs().max(asked_rad_s.abs()) < TURN_SHOWN_RAD_S {
        return String::new();
    }
    let is_asked = asked_rad_s.abs() >= TURN_SHOWN_RAD_S;
    let is_left = if is_asked { asked_rad_s > 0.0 } else { turns_rad_s > 0.0 };
    let (sign, side) = if is_left { (1.0, "left") } else { (-1.0, "right") };
    // Nothing is 0, not -0.
    let [turns, asked] = [turns_rad_s, asked_rad_s].map(|rate| sign * rate.to_degrees() + 0.0);
    format!(", {turns:.1} of {asked:.1} deg/s {side}")
}

/// Columns of the terminal; none if it does not say.
fn columns() -> Option<usize> {
    let size = rustix::termios::tcgetwinsize(std::io::stderr()).ok()?;
    Some(usize::from(size.ws_col)).filter(|columns| *columns > 0)
}

/// As much of `line` as stays on one line of a terminal, which could not be taken back otherwise.
fn cut(line: &str, columns: Option<usize>) -> &str {
    let end = columns.and_then(|columns| line.char_indices().nth(columns.saturating_sub(1)));
    end.map_or(line, |(end, _)| &line[..end])
}
