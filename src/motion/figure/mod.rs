//! A figure on two feet: poses, one after the other, with its soles in place.
//!
//! ```text
//! pose asked for -> time to get there -> curve of trunk and arms (glide) -> soles under a leaning trunk (poise)
//! ```

mod pose_motion;
mod quintic;

use glam::DVec3;

use super::legged::LeggedGenerator;
use crate::model::{FigureMotion, Robot};
use crate::motion::{Generate, Intent, Planned};
pub use pose_motion::{PoseMotion, TrunkPosture};

/// A figure from limp to limp.
pub type FigureGenerator = LeggedGenerator<PoseMotion>;

/// Data about the robot that a figure's motion needs, computed when it loads, and the pose it starts with.
#[derive(Debug, Clone)]
pub struct FigurePlan {
    /// The robot's own settings.
    pub settings: FigureMotion,
    /// Centres of the soles on the ground, level, x from the middle between them, m: left, right.
    pub soles: [DVec3; 2],
    /// Distance of the trunk forward of the soles' middle when sitting, m, and in each pose. The centre of
    /// mass is then over that middle.
    pub sit_forward_m: f64,
    /// See `sit_forward_m`.
    pub forward_m: Vec<f64>,
    /// Joint angles of the sitting robot, rad.
    pub sit_pose_rad: Vec<f64>,
    /// Joint angles of each pose, including those of the legs, rad.
    pub pose_rad: Vec<Vec<f64>>,
    /// The pose to take if the operator says no more than to go, index into the settings' poses.
    pub pose: usize,
}

impl FigurePlan {
    /// The trunk's posture in pose number `pose`; as in the stand if there is no such pose.
    pub fn stance(&self, pose: usize) -> TrunkPosture {
        let of = |pose: usize| Some((self.settings.poses.get(pose)?, self.forward_m.get(pose)?));
        let Some((pose, forward_m)) = of(pose).or_else(|| of(0)) else { return TrunkPosture::default() };
        TrunkPosture {
            rise_m: pose.height_m - self.settings.stand_height_m,
            pitch_rad: pose.pitch_rad,
            roll_rad: pose.roll_rad,
            sway_m: pose.sway_m,
            forward_m: *forward_m,
        }
    }
}

impl Planned for FigurePlan {
    fn resting_pose_rad(&self) -> &[f64] {
        &self.sit_pose_rad
    }

    fn intent(&self) -> Intent<'_> {
        let poses = &self.settings.poses;
        let pose = poses.get(self.pose).or(poses.first());
        Intent::Take { pose: pose.map_or("", |pose| &pose.name) }
    }

    fn done(&self) -> &'static str {
        "stood for the time asked"
    }

    fn generator(&self, robot: &Robot, move_for_s: f64) -> Box<dyn Generate> {
        Box::new(FigureGenerator::new(robot, PoseMotion::standing(robot, self.clone()), move_for_s))
    }
}
