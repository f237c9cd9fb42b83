//! The weight that each joint holds up in its worst pose.

use std::fmt::Write;
use std::ops::Range;

use crate::model::{Robot, TendonDrive, TentacleMotion};

/// Standard gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.806_65;

/// Share of stall torque that a servo may hold for long: makers advise no more than a fifth.
pub const LASTING_SHARE: f64 = 0.2;

/// The static load of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The joint, index into [`Robot::joints`].
    pub joint: usize,
    /// Torque on it with the arm stretched out level from this joint on, less what the arm's support carries,
    /// N m: no pose needs more.
    pub torque_nm: f64,
    /// The same torque as a share of its servo's stall torque; `None` without a servo.
    pub share_of_stall: Option<f64>,
}

impl Load {
    /// True if the servo gets hot when it holds this load for long.
    pub fn is_heavy(&self) -> bool {
        self.share_of_stall.is_some_and(|share| share > LASTING_SHARE)
    }
}

/// Lines of the load that each joint holds, for people.
pub fn table(robot: &Robot, loads: &[Load]) -> String {
    let mut text = format!("{:<24} {:>16}  {:>9}\n", "joint", "load N m", "of stall");
    for load in loads {
        let share = load.share_of_stall.map_or("-".to_owned(), |share| format!("{:.1} %", share * 100.0));
        let warning = if load.is_heavy() { "  MORE THAN IT CAN HOLD FOR LONG" } else { "" };
        let name = &robot.joints[load.joint].name;
        // Writing to a string does not fail.
        let _ = writeln!(text, "{name:<24} {:>16.4}  {share:>9}{warning}", load.torque_nm);
    }
    text
}

/// The load of every winch of an arm on tendons: the moment about its section's root, divided by the cords'
/// lever and multiplied by the spool's.
fn of_winches(robot: &Robot, drive: &TendonDrive, winches: Range<usize>, gravity_m_s2: f64) -> Vec<Load> {
    let (mut mass_kg, mut moment_kg_m) = (0.0, 0.0);
    let pairs = drive.sections().iter().zip(winches.step_by(2)).rev();
    let of_section = |(section, lift): (&crate::model::tendon::Section, usize)| {
        let section_kg: f64 = robot.joints[lift..lift + 2].iter().map(|joint| joint.mass_kg).sum();
        let length_m = section.joints as f64 * section.link_m;
        moment_kg_m += mass_kg * length_m + section_kg * 0.5 * length_m;
        mass_kg += section_kg;
        let torque_nm = moment_kg_m * gravity_m_s2 * section.spool_radius_m / section.cord_radius_m;
        [lift + 1, lift].map(|joint| {
            let servo = robot.joints[joint].servo;
            let share = servo.map(|servo| torque_nm / servo.model.stall_torque_nm);
            Load { joint, torque_nm, share_of_stall: share }
        })
    };
    let mut loads: Vec<Load> = pairs.flat_map(of_section).collect();
    loads.reverse();
    loads
}

/// The load of every joint of the arms, in the robot's order.
pub fn of_joints(robot: &Robot, tentacle: &TentacleMotion) -> Vec<Load> {
    let mut loads = Vec::new();
    for arm in &tentacle.arms {
        let chain = &robot.chains[arm.chain];
        let range = chain.joints.clone();
        let carried_by_servos = GRAVITY_M_S2 * (1.0 - tentacle.carried_share);
        if let Some(drive) = &chain.tendons {
            loads.extend(of_winches(robot, drive, range, carried_by_servos));
            continue;
        }
        // From the tip inwards: the mass after a joint, and its moment about the joint when stretched.
        let (mut mass_kg, mut moment_kg_m) = (0.0, 0.0);
        let of_arm = range.rev().map(|joint| {
            let of = &robot.joints[joint];
            moment_kg_m += mass_kg * of.link_m.length() + of.mass_kg * of.center_m.length();
            mass_kg += of.mass_kg;
            let torque_nm = moment_kg_m * carried_by_servos;
            let share = of.servo.map(|servo| torque_nm / servo.model.stall_torque_nm);
            Load { joint, torque_nm, share_of_stall: share }
        });
        let mut of_arm: Vec<Load> = of_arm.collect();
        of_arm.reverse();
        loads.extend(of_arm);
    }
    loads
}
