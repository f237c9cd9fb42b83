//! `hippocamp doctor`: finds what is wrong with a real robot, and how to mend it.

use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use super::ports;
use super::unit;
use super::{BadInput, COMPLETED, DoctorArguments, FAILED, interrupt, say};
use crate::config::{self, ConfigError, UnitFile, default_unit_path};
use crate::doctor::{Line, Lines, Verdict, examine};
use crate::model::Robot;

/// All findings.
#[derive(Serialize)]
struct Report<'r> {
    robot: &'r str,
    faults: usize,
    warnings: usize,
    lines: &'r [Line],
}

/// Examines the robot and prints the findings; returns the exit code.
pub(super) fn doctor(options: &DoctorArguments) -> Result<u8> {
    let stop = interrupt::catch()?;
    let mut robot = config::load(&options.robot)?.robot;
    if robot.buses.is_empty() {
        return Err(BadInput(format!("{} has no servos: it exists on paper only", robot.name)).into());
    }
    let unit = unit::find(&options.robot, options.unit.as_deref())?;
    let ports = ports::devices_for_tools(&robot, unit.as_ref(), &options.ports)?;
    let devices = ports::devices(&robot, &ports)?;

    let mut tell = |line: &Line| {
        if !options.is_json {
            show(line);
        }
    };
    let mut files = Lines::new(&mut tell);
    look_at_files(&mut robot, &options.robot, unit.as_ref(), &mut files);
    let mut lines = files.into_all();
    // Read after the unit file, which may give the IMU's baud rate.
    let imu = ports::imu_device(&robot, &ports);
    lines.extend(examine(&robot, &devices, imu.as_ref(), stop, &mut tell));
    let count = |verdict| lines.iter().filter(|line| line.verdict == verdict).count();
    let (faults, warnings) = (count(Verdict::Fault), count(Verdict::Warning));
    if options.is_json {
        let report = Report { robot: &robot.name, faults, warnings, lines: &lines };
        say::lines(&serde_json::to_string_pretty(&report)?);
    } else {
        say!();
        say!("{}: {}, {}", robot.name, counted(faults, "fault"), counted(warnings, "warning"));
    }
    if stop.load(std::sync::atomic::Ordering::Relaxed) {
        anyhow::bail!("interrupted before everything was checked");
    }
    Ok(if faults == 0 { COMPLETED } else { FAILED })
}

/// Checks the unit file against the robot file, and applies its servo data to `robot`.
fn look_at_files(robot: &mut Robot, robot_file: &Path, unit: Option<&UnitFile>, lines: &mut Lines<'_>) {
    const ABOUT: &str = "unit file";
    let Some(unit) = unit else {
        return lines.fault(
            ABOUT,
            format!("{} is not there", default_unit_path(robot_file).display()),
            "'hippocamp setup' and 'hippocamp calibrate' make it; no robot moves without it",
        );
    };
    let mut tell = |error: ConfigError, cure: &str| {
        for fault in error.faults {
            lines.fault(ABOUT, fault.to_string(), cure);
        }
    };
    if let Err(error) = unit.apply(robot) {
        return tell(error, "'hippocamp calibrate' with --again");
    }
    match unit.check_calibrated(robot, robot_file) {
        Ok(()) => lines.ok(ABOUT, "calibrated, and unchanged since"),
        Err(error) => tell(error, "'hippocamp calibrate'"),
    }
    for warning in unit.warnings(robot) {
        lines.warning(ABOUT, warning.to_string(), "see the message");
    }
}

fn show(line: &Line) {
    let verdict = match line.verdict {
        Verdict::Ok => "ok     ",
        Verdict::Warning => "warning",
        Verdict::Fault => "FAULT  ",
    };
    say!("{verdict}  {}: {}", line.about, line.found);
    if let Some(cure) = line.cure.as_ref().filter(|cure| !cure.is_empty()) {
        say!("           -> {cure}");
    }
}

fn counted(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}"),
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    }
}
