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
mod performer;
mod progress;
pub mod pseudo_targets;
pub mod route;
mod settled;
pub mod stroke;
pub mod tour;
pub mod variation;
pub mod winder;
pub mod winding;

use crate::model::{Robot, TentacleMotion};
use crate::motion::{Stroke, StrokeCommand};
pub use generator::TentacleGenerator;
use grip::Grip;
pub use performer::Performer;

/// The strokes by key angles, in the order of [`TentaclePlan::tempo_max`].
pub const KEYED: [Stroke; 3] = [Stroke::Sway, Stroke::Walk, Stroke::Swim];

/// Data about the robot that its arms' motion needs, computed when it loads, and the command they start with.
#[derive(Debug, Clone)]
pub struct TentaclePlan {
    /// The robot's own settings.
    pub settings: TentacleMotion,
    /// Joint angles of the parked arms, all chains, rad.
    pub park_pose_rad: Vec<f64>,
    /// Fastest swaying, walking and swimming, as multiples of the robot file's tempo.
    pub tempo_max: [f64; 3],
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
        TentaclePlan { settings: settings.clone(), park_pose_rad, tempo_max: [f64::INFINITY; 3], command }
    }
}
