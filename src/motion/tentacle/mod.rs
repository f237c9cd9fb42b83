//! Arms that move like an octopus' (Ishizuka 2008).

mod generator;

use crate::model::{Robot, TentacleMotion};
use crate::motion::StrokeCommand;
pub use generator::TentacleGenerator;

/// What arms need to know of the robot, worked out when it loads, and what they are to do.
#[derive(Debug, Clone)]
pub struct TentaclePlan {
    /// The robot's own settings.
    pub settings: TentacleMotion,
    /// Joint angles of the parked arms, all chains, rad.
    pub park_pose_rad: Vec<f64>,
    /// What to do when the operator says no more than to go.
    pub command: StrokeCommand,
}

impl TentaclePlan {
    /// A plan for the arms of `robot` to do as `command` says.
    pub fn new(robot: &Robot, settings: &TentacleMotion, command: StrokeCommand) -> TentaclePlan {
        let mut park_pose_rad = vec![0.0; robot.joints.len()];
        for arm in &settings.arms {
            let hinges = robot.chains[arm.chain].joints.clone();
            // The first hinge of each joint lifts.
            hinges.step_by(arm.hinges).for_each(|lift| park_pose_rad[lift] = arm.park_lift_rad);
        }
        TentaclePlan { settings: settings.clone(), park_pose_rad, command }
    }
}
