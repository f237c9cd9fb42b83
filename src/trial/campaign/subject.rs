//! A robot of a campaign and its capability, computed once for all its episodes.

use crate::kinds::Kind;
use crate::model::{Robot, SharedRange};
use crate::random::RandomStream;
use crate::trial::TrialError;

/// How far outside its range a limp joint may lie, as a share of the range's width.
const OUTSIDE_SHARE: f64 = 0.1;

/// A robot of a campaign.
#[derive(Debug)]
pub struct Subject {
    robot: Robot,
    kind: Box<dyn Kind>,
}

impl Subject {
    /// `robot`, which is of this `kind`.
    ///
    /// # Errors
    /// If it exists on paper only.
    pub fn new(robot: Robot, kind: Box<dyn Kind>) -> Result<Subject, TrialError> {
        if robot.buses.is_empty() || robot.joints.iter().any(|joint| joint.servo.is_none()) {
            let said =
                format!("{}: it has no servos that could go wrong: it exists on paper only", robot.name);
            return Err(TrialError::Unfit(said));
        }
        Ok(Subject { robot, kind })
    }

    /// The robot, as its file describes it.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// A number from the robot's name that differs between robots: their episodes have nothing in common.
    pub(super) fn stream(&self) -> u64 {
        self.robot.name.bytes().fold(0_u64, |sum, byte| sum.wrapping_mul(31).wrapping_add(u64::from(byte)))
            << 32
    }

    /// Its kind.
    pub fn kind(&self) -> &dyn Kind {
        &*self.kind
    }
}

/// Any pose in which the limp `robot` may be found, also a little outside its ranges, rad; the same for the same
/// seed. No servo is beyond its count range: such a position could not be told from one at the other end.
pub(super) fn any_pose_rad(robot: &Robot, seed: u64) -> Vec<f64> {
    let mut chance = RandomStream::new(seed, 0);
    let joints = robot.joints.iter();
    let mut pose_rad: Vec<f64> = joints
        .map(|joint| {
            let ((low, high), (least, most)) = (joint.range_rad, joint.servo_range_rad());
            let beyond = OUTSIDE_SHARE * (high - low);
            chance.between((low - beyond).max(least), (high + beyond).min(most))
        })
        .collect();
    // Hinges that share a range do not lie outside it.
    for (hinges, range) in SharedRange::of_robot(robot) {
        range.bring_in(&mut pose_rad[hinges]);
    }
    pose_rad
}
