//! Motions of octopus arms (Ishizuka 2008): targets for the ends of an arm's groups, its tip or all its links.
//!
//! Key angles, pseudo-targets and what follows from them are functions of phase or time and settings; inverse
//! kinematics turns them into joint angles. Frames: `in_arm` is the arm's own frame at its root, x along the
//! straight arm, y left, z up.

mod arm_plan;
mod follower;
mod generator;
mod grip;
pub mod key_angles;
pub mod key_stroke;
mod perform;
mod performer;
mod progress;
pub mod pseudo_targets;
mod rhythm;
pub mod route;
mod settled;
pub mod strokes;
pub mod tour;
pub mod variation;
pub mod winder;
pub mod winding;

use crate::model::{Robot, TentacleMotion};
use crate::motion::{Generate, Intent, Planned, StrokeCommand};
pub use generator::TentacleGenerator;
use grip::Grip;
pub use performer::Performer;
use strokes::STROKES;

/// Data about the robot that its arms' motion needs, computed when it loads, and the command they start with.
#[derive(Debug, Clone)]
pub struct TentaclePlan {
    /// The robot's own settings.
    pub settings: TentacleMotion,
    /// Joint angles of the parked arms, all chains, rad.
    pub park_pose_rad: Vec<f64>,
    /// Fastest tempo of each stroke, in the order of [`STROKES`], as a multiple of the robot file's; infinite for
    /// strokes without a rhythm.
    pub tempo_max: Vec<f64>,
    /// The command to carry out if the operator says no more than to go.
    pub command: StrokeCommand,
}

impl TentaclePlan {
    /// A plan for the arms of `robot` to carry out `command`, without a limit on its tempo.
    pub fn new(robot: &Robot, settings: &TentacleMotion, command: StrokeCommand) -> TentaclePlan {
        let mut park_pose_rad = vec![0.0; robot.joints.len()];
        for arm in &settings.arms {
            let chain = &robot.chains[arm.chain];
            // The first hinge of each joint is its lift. An arm on tendons parks straight.
            if chain.tendons.is_none() {
                let lifts = chain.joints.clone().step_by(arm.hinges);
                lifts.for_each(|lift| park_pose_rad[lift] = arm.park_lift_rad);
            }
        }
        let tempo_max = vec![f64::INFINITY; STROKES.len()];
        TentaclePlan { settings: settings.clone(), park_pose_rad, tempo_max, command }
    }
}

impl Planned for TentaclePlan {
    fn resting_pose_rad(&self) -> &[f64] {
        &self.park_pose_rad
    }

    fn intent(&self) -> Intent<'_> {
        Intent::Perform(self.command)
    }

    fn done(&self) -> &'static str {
        "moved for the time asked"
    }

    fn generator(&self, robot: &Robot, move_for_s: f64) -> Box<dyn Generate> {
        Box::new(TentacleGenerator::new(robot, self.clone(), move_for_s))
    }
}
