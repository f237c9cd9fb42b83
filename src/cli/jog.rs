//! `hippocamp jog`: turns one joint to an angle, and prints where it went.

use anyhow::Result;

use super::drivers::Driver;
use super::guard::Guard;
use super::load::load;
use super::operator::{OnHardware, Signals, Terminal};
use super::ports::{self, Choice};
use super::run::{exit_code, outcome_words};
use super::unit;
use super::{BadInput, JogArguments};
use crate::bus::{Ports, SimPorts};
use crate::config::nearest;
use crate::jog::{JogReport, jog as jog_robot};
use crate::model::{Joint, Robot};
use crate::simulation;

/// Seed for the start angles of the simulated robot's limp joints.
const SEED: u64 = 1;

/// Turns the joint as `options` say; returns the exit code.
pub(super) fn jog(options: &JogArguments) -> Result<u8> {
    let unit = unit::find(&options.robot, options.unit.unit.as_deref())?;
    let mut loaded = load(&options.robot, unit.as_ref())?;
    options.unit.take_physics_off(&mut loaded.file.robot, unit.as_ref());
    let robot = &loaded.file.robot;
    let (index, joint) = find_joint(robot, &options.joint)?;
    let goal_rad = goal_rad(joint, options.angle_deg)?;
    let choice = ports::choose(&options.unit, robot, &options.robot, unit.as_ref())?;
    let line = format!("{}: {} to {:.1} degrees on {choice}", robot.name, joint.name, goal_rad.to_degrees());
    let report = match choice {
        Choice::Simulated { is_virtual } => {
            let world = simulation::world(robot, SEED, &hw_sim::FaultScript::default())
                .map_err(|error| BadInput(error.to_string()))?;
            say!("{line}");
            drive(robot, index, goal_rad, SimPorts::of(world, is_virtual), None)?
        }
        Choice::Devices(ports) => {
            let guard = Guard::start(&options.robot, &ports)?;
            let ports = ports::open(robot, &ports)?;
            say!("{line}");
            let hardware = OnHardware { processor: options.unit.processor, heart: guard.heart()? };
            guard
                .over(|| drive(robot, index, goal_rad, ports, Some(hardware)), |report| report.is_end_heard)?
        }
    };
    say!("{}: {}", outcome_words(report.outcome), report.reason);
    let goal_deg = report.goal_rad.to_degrees();
    match report.measured_rad {
        Some(rad) => say!("{}: goal {goal_deg:.2}, measured {:.2} degrees", joint.name, rad.to_degrees()),
        None => say!("{}: goal {goal_deg:.2} degrees, not moved", joint.name),
    }
    Ok(exit_code(report.outcome))
}

/// Jogs the joint until it is done, or until the operator or safety stops it.
fn drive(
    robot: &Robot,
    joint: usize,
    goal_rad: f64,
    ports: impl Ports,
    hardware: Option<OnHardware>,
) -> Result<JogReport> {
    let terminal = Terminal::new(Signals::catch()?, Driver::Plan, None, hardware);
    Ok(jog_robot(robot, joint, goal_rad, ports, terminal)?)
}

/// The joint of this name.
fn find_joint<'r>(robot: &'r Robot, name: &str) -> Result<(usize, &'r Joint), BadInput> {
    let names = || robot.joints.iter().map(|joint| joint.name.as_str());
    let Some(found) = robot.joints.iter().enumerate().find(|(_, joint)| joint.name == name) else {
        let advice = nearest(name, names()).map(|near| format!("; did you mean {near}?")).unwrap_or_default();
        let names = names().collect::<Vec<_>>().join(", ");
        return Err(BadInput(format!("joint {name}: expected one of {names}{advice}")));
    };
    if found.1.servo.is_none() {
        return Err(BadInput(format!("joint {name} has no servo: this robot exists on paper only")));
    }
    Ok(found)
}

/// The angle asked for, clamped to the joint's range; prints a note if it had to be.
fn goal_rad(joint: &Joint, angle_deg: f64) -> Result<f64, BadInput> {
    if !angle_deg.is_finite() {
        return Err(BadInput(format!("{angle_deg} degrees: expected a number")));
    }
    let (low, high) = joint.goal_range_rad();
    let goal_rad = angle_deg.to_radians().clamp(low, high);
    // Whole counts make the range a little narrower; that needs no note.
    let (low_deg, high_deg) = (joint.range_rad.0.to_degrees(), joint.range_rad.1.to_degrees());
    if angle_deg < low_deg - 1e-9 || angle_deg > high_deg + 1e-9 {
        say!(
            "{angle_deg} degrees is outside the range of {}, {low_deg:.1} to {high_deg:.1}: held at {:.1}",
            joint.name,
            goal_rad.to_degrees()
        );
    }
    Ok(goal_rad)
}
