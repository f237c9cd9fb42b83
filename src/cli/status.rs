//! The status line, printed by a thread of its own so that a slow terminal never delays the loop.

use std::io::{IsTerminal, Write};
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender, bounded};

use crate::kinds::{Kind, Words};
use crate::model::Robot;
use crate::motion::{Activity, Order};
use crate::observe::{CycleRecord, End, Observer};
use crate::printable::printable;
use crate::signals::Status;
use crate::signals::{Outage, Permission};
use crate::stopwatch::Stage;

/// Time of the run between two status lines on a terminal, and elsewhere, s.
const TERMINAL_EVERY_S: f64 = 0.2;
const FILE_EVERY_S: f64 = 5.0;
/// Lines that may wait for a slow terminal.
const WAITING: usize = 16;

/// A message to print.
#[expect(clippy::large_enum_variant, reason = "the loop hands it over without allocating")]
enum Line {
    Status(Status, Order),
    /// A line that stays.
    Note(&'static str),
    /// A line that stays: a joint out of service, and when.
    Outage(f64, Outage),
    /// The last.
    End,
}

/// A status line on standard error.
pub(super) struct StatusLine {
    sender: Sender<Line>,
    /// `None` once it has printed all.
    printer: Option<JoinHandle<()>>,
    every_s: f64,
    next_s: f64,
    /// True once the objection of an observer, which cannot wait for the next line, was printed.
    has_said_objection: bool,
    /// Outages for which the printer had no room yet.
    untold: Vec<(f64, Outage)>,
}

/// Lines that stay, between those of the status.
#[derive(Clone)]
pub(super) struct Notes(Sender<Line>);

/// Most outages that wait for a slow terminal; the report lists any further ones.
const UNTOLD_MAX: usize = 64;

/// Time after which an IMU that was not heard is missing, s.
const IMU_FIRST_S: f64 = 1.0;

impl StatusLine {
    /// Starts the status line of `robot`, which is of this `kind`.
    #[allow(clippy::disallowed_methods, reason = "only checks its type")]
    pub(super) fn start(robot: &Robot, kind: &dyn Kind) -> StatusLine {
        let is_terminal = std::io::stderr().is_terminal();
        let (sender, receiver) = bounded(WAITING);
        let names = StatusFormat(kind.words());
        let robot = robot.clone();
        StatusLine {
            sender,
            printer: Some(std::thread::spawn(move || print_all(&receiver, is_terminal, &names, &robot))),
            every_s: if is_terminal { TERMINAL_EVERY_S } else { FILE_EVERY_S },
            next_s: 0.0,
            has_said_objection: false,
            untold: Vec::with_capacity(UNTOLD_MAX),
        }
    }

    /// Takes notes for lines between its own.
    pub(super) fn notes(&self) -> Notes {
        Notes(self.sender.clone())
    }

    /// Prints what is still to be printed, and no more.
    fn finish(&mut self) {
        if let Some(printer) = self.printer.take() {
            let _ = self.sender.send(Line::End);
            let _ = printer.join();
        }
    }
}

impl Observer for StatusLine {
    /// Shows the status and the order of the cycle if the next line is due. Never waits: drops a line if the printer has
    /// no room for it.
    fn observe(&mut self, cycle: &CycleRecord<'_>) {
        let status = &cycle.status;
        if let Some(outage) = status.outage
            && self.untold.len() < UNTOLD_MAX
        {
            self.untold.push((status.time_s, outage));
        }
        if let Some((time_s, outage)) = self.untold.first()
            && self.sender.try_send(Line::Outage(*time_s, *outage)).is_ok()
        {
            self.untold.remove(0);
        }
        let is_objection = status.objection.is_some();
        if status.time_s >= self.next_s || (is_objection && !self.has_said_objection) {
            self.has_said_objection = is_objection;
            self.next_s = status.time_s + self.every_s;
            let _ = self.sender.try_send(Line::Status(*status, cycle.facts.order));
        }
    }

    fn stage(&self) -> Stage {
        Stage::Orders
    }

    fn end(&mut self, _end: &mut End, _has_stopped_run: bool) {
        self.finish();
    }
}

impl Drop for StatusLine {
    fn drop(&mut self) {
        self.finish();
    }
}

impl Notes {
    /// Shows `words` on a line that stays. Never waits: false if there is no room for them now.
    pub(super) fn say(&self, words: &'static str) -> bool {
        self.0.try_send(Line::Note(words)).is_ok()
    }
}

#[allow(clippy::disallowed_methods, reason = "draws over itself, in lines made printable")]
fn print_all(lines: &Receiver<Line>, is_terminal: bool, names: &StatusFormat, robot: &Robot) {
    let mut out = std::io::stderr().lock();
    for line in lines {
        let (line, is_passing) = match line {
            Line::Status(status, order) => (names.line_of(&status, order), is_terminal),
            Line::Note(words) => (words.to_owned(), false),
            Line::Outage(time_s, outage) => (format!("{time_s:6.1} s {}", outage.describe(robot)), false),
            Line::End => break,
        };
        let line = printable(&line);
        let clear = if is_terminal { "\r\x1b[2K" } else { "" };
        // A closed terminal is no reason to stop a walking robot.
        let _ = if is_passing {
            // A wrapped line would stay on screen when the next replaces it. The width may change at any time.
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

/// Columns of the terminal on standard error; if it does not report them, 80, the default for fifty years.
#[allow(clippy::disallowed_methods, reason = "only checks its type")]
fn terminal_columns() -> usize {
    let columns = rustix::termios::tcgetwinsize(std::io::stderr()).map_or(0, |size| usize::from(size.ws_col));
    if columns == 0 { 80 } else { columns }
}

/// The part of `line`, which is ASCII, that fits.
fn cut(line: &str, columns: usize) -> &str {
    line.get(..columns).unwrap_or(line)
}

/// The line for people; the robot's kind has the words for its motion.
struct StatusFormat(Box<dyn Words>);

impl StatusFormat {
    /// The most important part first: a narrow terminal shows only the beginning.
    fn line_of(&self, status: &Status, order: Order) -> String {
        let doing = match (status.permission, status.activity) {
            (Permission::Hold, _) => "HELD BY SAFETY".to_owned(),
            (Permission::Stop, _) => "STOPPED BY SAFETY".to_owned(),
            (_, Activity::Limp) => "limp".to_owned(),
            (_, Activity::Rising) => "rising".to_owned(),
            (_, Activity::Parked) => "parked".to_owned(),
            (_, Activity::Standing | Activity::Walking | Activity::Performing) => self.0.doing(status, order),
            (_, Activity::Jogging) => "turning one joint".to_owned(),
            (_, Activity::Falling) => "FALLING".to_owned(),
            (_, Activity::Lying) => "lying where it fell".to_owned(),
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
        let frozen = match status.frozen {
            0 => String::new(),
            count => format!(", {count} frozen"),
        };
        let objection = status.objection.map_or_else(String::new, |why| format!(", {}", why.to_uppercase()));
        // An IMU that has just been switched on cannot have been heard yet.
        let unfelt = if status.is_imu_lost && status.time_s >= IMU_FIRST_S { ", NO IMU" } else { "" };
        format!("{:6.1} s {doing}{servos}{frozen}{unfelt}{objection}{late}", status.time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALKING: Status = Status {
        time_s: 59.94,
        activity: Activity::Walking,
        gait: Some(1),
        speed_m_s: 0.1234,
        hottest_c: 41.2,
        lowest_v: 11.84,
        ..Status::LIMP
    };

    fn horse() -> Box<dyn Kind> {
        let robot = crate::config::parse(include_str!("../../config/horse.toml"), "horse").unwrap().robot;
        crate::kinds::of(&robot).unwrap()
    }

    fn line_of(status: &Status) -> String {
        line(status, Order::Go)
    }

    fn line(status: &Status, order: Order) -> String {
        StatusFormat(horse().words()).line_of(status, order)
    }

    #[test]
    fn important_status_fits_forty_columns() {
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
    fn the_status_of_a_robot_stopped_by_safety_shows_no_walking_speed() {
        for permission in [Permission::Hold, Permission::Stop] {
            let line = line_of(&Status { permission, ..WALKING });
            assert!(line.contains("BY SAFETY") && !line.contains("m/s"), "{line}");
        }
    }

    #[test]
    fn a_lost_imu_is_shown() {
        assert!(line_of(&Status { is_imu_lost: true, ..WALKING }).ends_with(", NO IMU"));
    }

    #[test]
    fn late_cycles_are_shown_once_there_are_some() {
        let line = |late_cycles| line_of(&Status { late_cycles, ..WALKING });
        assert!(!line(0).contains("late"));
        assert!(line(1).ends_with(", 1 late cycle") && line(2).ends_with(", 2 late cycles"));
    }
}
