//! A robot to try, and what it can do: worked out once for all its episodes.

use crate::capability::Capability;
use crate::model::Robot;
use crate::motion::Plan;
use crate::trial::TrialError;

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
            let said = format!("{}: it has no servos that could go wrong: it exists on paper only", robot.name);
            return Err(TrialError::Unfit(said));
        }
        Ok(Subject { robot, capability })
    }

    /// The robot, as its file has it.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// What it can do.
    pub fn capability(&self) -> &Capability {
        &self.capability
    }
}

/// The pose in which a robot with this plan sits, or its arms are parked, rad.
pub(super) fn resting_pose_rad(plan: &Plan) -> &[f64] {
    match plan {
        Plan::Horse(plan) => &plan.sit_pose_rad,
        Plan::Figure(plan) => &plan.sit_pose_rad,
        Plan::Tentacle(plan) => &plan.park_pose_rad,
    }
}
