//! A robot to try, and what it can do: worked out once for all its episodes.

use super::chance::Chance;
use crate::capability::Capability;
use crate::model::{Robot, SharedRange};
use crate::motion::Plan;
use crate::trial::TrialError;

/// How far outside its range a limp joint may lie, share of the range's width.
const OUTSIDE_SHARE: f64 = 0.1;

/// A robot of a campaign.
#[derive(Debug)]
pub struct Subject {
    robot: Robot,
    capability: Capability,
}

impl Subject {
    /// `robot`, which can do as `capability` says.
    ///
    /// # Errors
    /// Where it exists on paper only.
    pub fn new(robot: Robot, capability: Capability) -> Result<Subject, TrialError> {
        if robot.buses.is_empty() || robot.joints.iter().any(|joint| joint.servo.is_none()) {
            let said =
                format!("{}: it has no servos that could go wrong: it exists on paper only", robot.name);
            return Err(TrialError::Unfit(said));
        }
        Ok(Subject { robot, capability })
    }

    /// The robot, as its file has it.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// A number that other robots have not, by its name: their episodes have nothing in common.
    pub(super) fn stream(&self) -> u64 {
        self.robot.name.bytes().fold(0_u64, |sum, byte| sum.wrapping_mul(31).wrapping_add(u64::from(byte)))
            << 32
    }

    /// What it can do.
    pub fn capability(&self) -> &Capability {
        &self.capability
    }
}

/// Any pose that the limp `robot` may be found in, a little outside its ranges too, rad; the same for the same seed. No
/// servo is found where it has no counts: what lies beyond them would be told from what lies at the other end by no one.
pub(super) fn any_pose_rad(robot: &Robot, seed: u64) -> Vec<f64> {
    let mut chance = Chance::new(seed, 0);
    let joints = robot.joints.iter();
    let mut pose_rad: Vec<f64> = joints
        .map(|joint| {
            let ((low, high), (least, most)) = (joint.range_rad, joint.servo_range_rad());
            let beyond = OUTSIDE_SHARE * (high - low);
            chance.between((low - beyond).max(least), (high + beyond).min(most))
        })
        .collect();
    // Where hinges stop together no joint lies outside.
    for (hinges, range) in SharedRange::of_robot(robot) {
        range.bring_in(&mut pose_rad[hinges]);
    }
    pose_rad
}

/// The pose in which a robot with this plan sits, or its arms are parked, rad.
pub(super) fn resting_pose_rad(plan: &Plan) -> &[f64] {
    match plan {
        Plan::Horse(plan) => &plan.sit_pose_rad,
        Plan::Figure(plan) => &plan.sit_pose_rad,
        Plan::Tentacle(plan) => &plan.park_pose_rad,
    }
}
