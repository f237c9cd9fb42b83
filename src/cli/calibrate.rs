//! `hippocamp calibrate`: guides a person who moves the robot by hand, and writes the unit file.

use std::io;
use std::path::PathBuf;

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, TryRecvError};
use time::OffsetDateTime;
use toml::value::Date;

use super::drivers::Driver;
use super::guard::Guard;
use super::operator::{OnHardware, Signals, Terminal};
use super::ports::{self, PortOption};
use super::sim::typed;
use super::{BadInput, COMPLETED, CalibrateArguments, FAILED, STOPPED_BY_SAFETY, say};
use crate::calibration::{CalibrateError, CalibrationEnd, Person, calibrate as calibrate_robot};
use crate::config::{self, Unit, UnitFile, default_unit_path, load_unit, nearest, rewrite_unit, write_unit};
use crate::model::Robot;
use crate::output::{Outputs, WriteMode};

/// Calibrates the robot, or continues a calibration; returns the exit code.
pub(super) fn calibrate(options: &CalibrateArguments) -> Result<u8> {
    let robot = config::load(&options.robot)?.robot;
    let path = options.unit.clone().unwrap_or_else(|| default_unit_path(&options.robot));
    Outputs::of_reading([&options.robot]).claim("the unit file", &path, WriteMode::UnitFile)?;
    let unit_file = path.exists().then(|| load_unit(&path)).transpose()?;
    let Some(mut unit) = unit_to_go_on_with(options, &robot, unit_file.as_ref())? else {
        say!("{} is calibrated: nothing to do (--again calibrates it once more)", robot.name);
        return Ok(COMPLETED);
    };
    let ports = ports::devices_for_tools(&robot, unit_file.as_ref(), &options.ports)?;
    for port in ports.iter().filter(|port| port.is_bus()).map(PortOption::to_unit_bus) {
        if !unit.buses.iter().any(|bus| bus.name == port.name) {
            unit.buses.push(port);
        }
    }
    let guard = Guard::start(&options.robot, &ports)?;
    let lines = ports::open(&robot, &ports)?;
    let hardware = OnHardware { processor: None, heart: guard.heart()? };
    let mut operator = Terminal::new(Signals::catch()?, Driver::Plan, None, Some(hardware));
    let mut person = AtTerminal::new(path, !options.is_unattended)?;
    let work = || {
        let unattended = options.is_unattended;
        Ok(calibrate_robot(&robot, &mut unit, lines, &mut person, &mut operator, unattended, today()?))
    };
    let CalibrationEnd { result, .. } = guard.over(work, |ended| ended.is_end_heard)?;
    let path = person.path.display();
    match result {
        Ok(()) => {
            say!("{} is calibrated; kept in {path}.", robot.name);
            Ok(COMPLETED)
        }
        Err(error) => {
            let code =
                if matches!(error, CalibrateError::Stopped { .. }) { STOPPED_BY_SAFETY } else { FAILED };
            let kept = match person.is_kept {
                true => format!("the finished part is kept in {path}: the same command continues from there"),
                false => "nothing was kept yet: the same command starts from the beginning".to_owned(),
            };
            say::complain(&format!("hippocamp: {error}"));
            say::complain(&kept);
            Ok(code)
        }
    }
}

/// The unit's known calibration, without the parts to be done again; `None` if nothing is left to do.
fn unit_to_go_on_with(
    options: &CalibrateArguments,
    robot: &Robot,
    unit_file: Option<&UnitFile>,
) -> Result<Option<Unit>> {
    let file_name = options.robot.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let joints: Vec<&str> =
        robot.joints.iter().filter(|joint| joint.servo.is_some()).map(|joint| joint.name.as_str()).collect();
    if joints.is_empty() {
        return Err(BadInput(format!("{} has no servos: it exists on paper only", robot.name)).into());
    }
    for name in options.again.iter().flatten() {
        if !joints.contains(&name.as_str()) {
            let near = nearest(name, joints.iter().copied());
            let advice = near.map(|near| format!("; did you mean {near}?")).unwrap_or_default();
            let all = joints.join(", ");
            return Err(BadInput(format!("--again {name}: expected one of {all}{advice}")).into());
        }
    }
    let Some(file) = unit_file else {
        return Ok(Some(Unit { robot_file: file_name, ..Unit::default() }));
    };
    let mut unit = file.unit.clone();
    if unit.robot_file != file_name {
        let expected =
            format!("{file_name:?}, the robot file it is used with; name another unit file with --unit");
        return Err(config::ConfigError::from(file.fault("robot_file", expected)).into());
    }
    match options.again.as_deref() {
        Some([]) => unit.joints.clear(),
        again => {
            let mut built = robot.clone();
            file.apply(&mut built)?;
            if unit.calibrated_on.is_some() {
                // The measurements do not show what was changed since.
                file.check_calibrated(&built, &options.robot).context(
                    "the calibration cannot continue: calibrate all joints from the beginning with --again",
                )?;
                if again.is_none() {
                    return Ok(None);
                }
            }
            let again = again.unwrap_or_default();
            unit.joints.retain(|entry| !again.contains(&entry.name));
        }
    }
    (unit.calibrated_on, unit.calibration_hash) = (None, None);
    Ok(Some(unit))
}

/// Today's date, UTC.
fn today() -> Result<Date> {
    let day = OffsetDateTime::now_utc().date();
    let year = u16::try_from(day.year()).context("the clock")?;
    Ok(Date { year, month: u8::from(day.month()), day: day.day() })
}

/// A person at a terminal, or a script in their place.
pub(super) struct AtTerminal {
    path: PathBuf,
    /// True if something was saved; the previous file lies beside it.
    is_kept: bool,
    signals: Signals,
    /// Lines typed by the person; `None` if the command asks nothing.
    lines: Option<Receiver<String>>,
    has_enough: bool,
}

impl AtTerminal {
    pub(super) fn new(path: PathBuf, is_asked: bool) -> Result<AtTerminal> {
        let lines = is_asked.then(typed::lines).transpose().context("standard input cannot be read")?;
        Ok(AtTerminal { path, is_kept: false, signals: Signals::catch()?, lines, has_enough: false })
    }
}

impl Person for AtTerminal {
    fn hear(&mut self, words: &str) {
        say!("{words}");
    }

    fn answer(&mut self) -> Option<String> {
        match self.lines.as_ref()?.try_recv() {
            Ok(line) => Some(line),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                // No more answers will come.
                self.has_enough = true;
                None
            }
        }
    }

    fn wants_to_stop(&mut self) -> bool {
        self.has_enough |= self.signals.is_stop_ordered();
        self.has_enough
    }

    fn keep(&mut self, unit: &Unit) -> io::Result<()> {
        if self.is_kept {
            return rewrite_unit(&self.path, unit);
        }
        write_unit(&self.path, unit)?;
        self.is_kept = true;
        Ok(())
    }
}
