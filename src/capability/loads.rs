//! The weight each joint of an arm holds up in its worst pose.

use crate::model::{Robot, TentacleMotion};

/// Standard gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.806_65;

/// A share of stall torque that a servo may hold for long: makers advise no more than a fifth.
pub const LASTING_SHARE: f64 = 0.2;

/// What a joint holds up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The joint, index into [`Robot::joints`].
    pub joint: usize,
    /// Torque on it with the arm stretched out level from this joint on, less what the carrier carries, N m: no pose
    /// asks for more.
    pub torque_nm: f64,
    /// The same as a share of its servo's stall torque; none without a servo.
    pub share_of_stall: Option<f64>,
}

/// The load of every joint of the arms, in the robot's order.
pub fn of_joints(robot: &Robot, tentacle: &TentacleMotion) -> Vec<Load> {
    let mut loads = Vec::new();
    for arm in &tentacle.arms {
        let range = robot.chains[arm.chain].joints.clone();
        let carried_by_servos = GRAVITY_M_S2 * (1.0 - tentacle.carried_share);
        // From the tip inwards: the mass behind a joint, and its moment about the joint when stretched.
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
