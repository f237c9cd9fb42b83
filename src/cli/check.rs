//! `hippocamp check`: prints what the robot is and what it can do.

use std::path::Path;

use anyhow::Result;

use super::load::load;
use super::{BadInput, check_physics, write_whole};
use crate::bus::costs;
use crate::model::Robot;
use crate::output::{Outputs, WriteMode};
use crate::urdf;

/// Checks the robot file at `path`, prints what the robot can do, and writes its URDF if asked to; `physics` asks for what
/// its simulated body reaches.
pub(super) fn check(path: &Path, urdf_file: Option<&Path>, physics: bool) -> Result<()> {
    let place = |file| Outputs::of_reading([path]).claim("--urdf", file, WriteMode::Whole);
    let place = urdf_file.map(place).transpose()?;
    let loaded = load(path, None)?;
    let robot = &loaded.file.robot;
    let urdf = place.map(|place| urdf::of_robot(robot).map(|text| (place, text)));
    let urdf = urdf.transpose().map_err(|error| BadInput(format!("--urdf: {error}")))?;
    let mass_kg = robot.mass_kg();
    say!(
        "{}: {} chains, {} joints, {mass_kg:.2} kg, loop at {} Hz",
        robot.name,
        robot.chains.len(),
        robot.joints.len(),
        robot.rate_hz
    );
    print_joints(robot);
    loaded.kind.describe(robot).lines().for_each(|line| say!("{line}"));
    print_buses(robot);
    if physics {
        check_physics::measure(robot, &*loaded.kind)?;
    }
    if let Some((place, text)) = urdf {
        write_whole(&place, &text)?;
        say!();
        say!("URDF written to {}", place.path().display());
    }
    Ok(())
}

fn print_joints(robot: &Robot) {
    say!();
    say!("{:<24} {:>16}  {:>9}  servo", "joint", "range deg", "rate deg/s");
    for joint in &robot.joints {
        let (low, high) = joint.range_rad;
        let range = format!("{:.1} .. {:.1}", low.to_degrees(), high.to_degrees());
        let (rate, servo) = match &joint.servo {
            None => ("-".to_owned(), "none".to_owned()),
            Some(servo) => (
                format!("{:.0}", (robot.safety.rate_share * servo.model.no_load_speed_rad_s).to_degrees()),
                format!(
                    "{} id {} on bus {}{}",
                    servo.model.name,
                    servo.id,
                    robot.buses[servo.bus].name,
                    if servo.reversed { ", reversed" } else { "" }
                ),
            ),
        };
        say!("{:<24} {range:>16}  {rate:>9}  {servo}", joint.name);
    }
}

fn print_buses(robot: &Robot) {
    if robot.buses.is_empty() {
        say!();
        say!("No buses: this robot exists on paper only and cannot be run.");
        return;
    }
    say!();
    say!("{:<24} {:>16}  {:>9} {:>10} {:>12}", "bus", "exchange ms", "wire ms", "adapter ms", "at most Hz");
    for bus in costs::of_robot(robot) {
        say!(
            "{:<24} {:>16.3}  {:>9.3} {:>10.3} {:>12.0}",
            bus.name,
            bus.total().as_secs_f64() * 1e3,
            bus.wire.as_secs_f64() * 1e3,
            bus.adapter.as_secs_f64() * 1e3,
            bus.highest_rate_hz()
        );
    }
}
