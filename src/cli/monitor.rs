//! `hippocamp monitor`: prints a live table of what every servo reports, or lines of JSON; writes nothing to any
//! servo.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use anyhow::Result;
use serde::Serialize;

use super::load::load_file;
use super::operator::Signals;
use super::ports::{self, Choice};
use super::run::simulated_world;
use super::unit;
use super::{BadInput, COMPLETED, MonitorArguments, say};
use crate::bus::{Ports, SimPorts};
use crate::model::Robot;
use crate::monitor::{LastGoal, Monitor, Row};
use crate::printable::printable;
use crate::units::Time;

/// Time between two looks.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Time between two tables on a terminal, and elsewhere, s.
const TERMINAL_EVERY_S: f64 = 0.2;
const FILE_EVERY_S: f64 = 1.0;
/// Seed for the start angles of a simulated robot's limp joints.
const SEED: u64 = 1;

/// Shows what the robot's servos report until the user ends it; returns the exit code.
pub(super) fn monitor(options: &MonitorArguments) -> Result<u8> {
    for (name, value) in [("--for", options.for_s), ("--every", options.every_s)] {
        if value.is_some_and(|seconds| !(seconds > 0.0 && seconds.is_finite())) {
            return Err(BadInput(format!("{name}: expected a number of seconds above 0")).into());
        }
    }
    let unit = unit::find(&options.robot, options.unit.unit.as_deref())?;
    let mut file = load_file(&options.robot, unit.as_ref())?;
    options.unit.take_physics_off(&mut file.robot, unit.as_ref());
    let robot = &file.robot;
    if robot.buses.is_empty() {
        return Err(BadInput(format!("{} has no servos: it exists on paper only", robot.name)).into());
    }
    let choice = ports::choose_to_look(&options.unit, robot, unit.as_ref())?;
    let head = format!("{} on {choice}", robot.name);
    if unit.is_none_or(|unit| unit.unit.joints.is_empty()) && matches!(choice, Choice::Devices(_)) {
        ports::warn("not calibrated: the angles are those of a robot whose horns sit as its file assumes");
    }
    match choice {
        Choice::Simulated { is_virtual } => {
            let world = simulated_world(robot, options.faults.as_deref(), SEED)?;
            watch(options, robot, SimPorts::of(world, is_virtual), &head)
        }
        Choice::Devices(_) if options.faults.is_some() => Err(BadInput(
            "--faults: only simulated buses have them; add --simulate, or leave it out".to_owned(),
        )
        .into()),
        Choice::Devices(ports) => watch(options, robot, ports::open(robot, &ports)?, &head),
    }
}

fn watch(options: &MonitorArguments, robot: &Robot, ports: impl Ports, head: &str) -> Result<u8> {
    let signals = Signals::catch()?;
    let mut screen = Screen::new(options.is_json);
    let every_s = options.every_s.unwrap_or(if screen.is_terminal { TERMINAL_EVERY_S } else { FILE_EVERY_S });
    let mut monitor = Monitor::new(robot, ports);
    let start = monitor.ports_mut().now();
    let (mut deadline, mut show_at_s) = (start, 0.0);
    loop {
        monitor.ports_mut().wait_until(deadline);
        deadline = next_deadline(deadline, monitor.ports_mut().now());
        monitor.look();
        let time_s = monitor.ports_mut().now().since(start).as_secs_f64();
        if time_s >= show_at_s {
            show_at_s = time_s + every_s - 0.5 * LOOK_EVERY.as_secs_f64();
            if let Err(error) = screen.show(robot, head, time_s, monitor.rows()) {
                // This command only shows: if its output fails, it ends.
                say::note(Err(error));
                return Ok(COMPLETED);
            }
        }
        if options.for_s.is_some_and(|for_s| time_s >= for_s) || signals.is_stop_ordered() {
            return Ok(COMPLETED);
        }
    }
}

/// The next deadline; skips those that have already passed.
fn next_deadline(deadline: Time, now: Time) -> Time {
    let next = deadline + LOOK_EVERY;
    if now.since(next).is_zero() { next } else { now }
}

/// Standard output, on which each table replaces the one before.
struct Screen {
    is_json: bool,
    is_terminal: bool,
    /// Lines of the previous table, which the next one replaces.
    drawn: usize,
}

#[allow(clippy::disallowed_methods, reason = "draws over itself, in lines made printable")]
impl Screen {
    fn new(is_json: bool) -> Screen {
        Screen { is_json, is_terminal: !is_json && std::io::stdout().is_terminal(), drawn: 0 }
    }

    fn show<'m>(
        &mut self,
        robot: &Robot,
        head: &str,
        time_s: f64,
        rows: impl Iterator<Item = Row<'m>>,
    ) -> std::io::Result<()> {
        let mut out = std::io::stdout().lock();
        if self.is_json {
            let joints = rows.map(|row| JointLine::of(robot, &row)).collect();
            let json = serde_json::to_string(&Line { time_s, joints })?;
            writeln!(out, "{}", printable(&json))?;
            return out.flush();
        }
        let mut lines = table(robot, head, time_s, rows);
        if self.is_terminal {
            fit(&mut lines, rustix::termios::tcgetwinsize(std::io::stdout()).ok());
            if self.drawn > 0 {
                write!(out, "\x1b[{}A", self.drawn)?;
            }
            self.drawn = lines.len();
        }
        let clear = if self.is_terminal { "\r\x1b[2K" } else { "" };
        for line in lines {
            writeln!(out, "{clear}{}", printable(&line))?;
        }
        out.flush()
    }
}

/// Cuts the table to the size of the terminal; if the terminal does not report it, to 80 columns, the default for
/// fifty years.
fn fit(lines: &mut Vec<String>, size: Option<rustix::termios::Winsize>) {
    let (rows, columns) = size.map_or((0, 0), |size| (usize::from(size.ws_row), usize::from(size.ws_col)));
    // The cursor needs the line below.
    let room = if rows == 0 { usize::MAX } else { rows.saturating_sub(1).max(1) };
    if lines.len() > room {
        let left_out = lines.len() - room + 1;
        lines.truncate(room - 1);
        lines.push(format!("... {left_out} more: make the window taller"));
    }
    let columns = if columns == 0 { 80 } else { columns };
    for line in lines {
        if let Some((end, _)) = line.char_indices().nth(columns) {
            line.truncate(end);
        }
    }
}

fn table<'m>(robot: &Robot, head: &str, time_s: f64, rows: impl Iterator<Item = Row<'m>>) -> Vec<String> {
    let width = robot.joints.iter().map(|joint| joint.name.len()).max().unwrap_or(0);
    let mut lines = vec![
        format!("{head}, {time_s:.1} s; nothing is written to any servo; Ctrl-C ends"),
        format!("{:width$}  goal deg     deg   deg/s  load %     V   C  alarms", "joint"),
    ];
    lines.extend(rows.map(|row| format!("{:width$}  {}", row.joint.name, words(robot, &row))));
    lines
}

fn words(robot: &Robot, row: &Row<'_>) -> String {
    let state = &row.state;
    if row.is_lost {
        let bus = &robot.buses[row.servo.bus].name;
        let since = match state.is_known {
            true => format!("LOST for {:.1} s", state.age_s),
            false => "NOT HEARD yet".to_owned(),
        };
        return format!("{since}: servo {} on bus {bus}; check its plug and its power", row.servo.id);
    }
    let goal = match row.goal {
        LastGoal::Unknown => "?".to_owned(),
        LastGoal::Limp => "limp".to_owned(),
        LastGoal::Angle(rad) => format!("{:.1}", rad.to_degrees()),
    };
    format!(
        "{goal:>8} {:>7.1} {:>7.1} {:>7.1} {:>5.1} {:>3.0}  {}",
        state.position_rad.to_degrees(),
        state.speed_rad_s.to_degrees(),
        100.0 * state.load_share,
        state.voltage_v,
        state.temperature_c,
        row.alarms
    )
}

/// One line of `--json`. Angles in degrees, for people.
#[derive(Serialize)]
struct Line<'m> {
    /// Time since the command began, s.
    time_s: f64,
    joints: Vec<JointLine<'m>>,
}

#[derive(Serialize)]
struct JointLine<'m> {
    name: &'m str,
    bus: &'m str,
    id: u8,
    is_lost: bool,
    /// Time since it last answered, s; `None` if it never did; the optional fields below are then `None` too.
    age_s: Option<f64>,
    /// `None` if unknown, or if it does not answer now.
    has_torque: Option<bool>,
    /// `None` also if it has no torque.
    goal_deg: Option<f64>,
    position_deg: Option<f64>,
    speed_deg_s: Option<f64>,
    /// Share of stall torque.
    load_percent: Option<f64>,
    voltage_v: Option<f64>,
    temperature_c: Option<f64>,
    /// In words, joined by commas; empty if there are none.
    alarms: String,
}

impl<'m> JointLine<'m> {
    fn of(robot: &'m Robot, row: &Row<'m>) -> JointLine<'m> {
        let state = row.state;
        let known = |value: f64| state.is_known.then_some(value);
        JointLine {
            name: &row.joint.name,
            bus: &robot.buses[row.servo.bus].name,
            id: row.servo.id.0,
            is_lost: row.is_lost,
            age_s: known(state.age_s),
            has_torque: match row.goal {
                LastGoal::Unknown => None,
                LastGoal::Limp => Some(false),
                LastGoal::Angle(_) => Some(true),
            },
            goal_deg: match row.goal {
                LastGoal::Angle(rad) => Some(rad.to_degrees()),
                LastGoal::Unknown | LastGoal::Limp => None,
            },
            position_deg: known(state.position_rad.to_degrees()),
            speed_deg_s: known(state.speed_rad_s.to_degrees()),
            load_percent: known(100.0 * state.load_share),
            voltage_v: known(state.voltage_v),
            temperature_c: known(state.temperature_c),
            alarms: row.alarms.clone(),
        }
    }
}
