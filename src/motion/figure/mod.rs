//! A figure on two feet: poses, one after the other, its soles where they are.
//!
//! ```text
//! pose asked for -> time to get there -> curve of trunk and arms (glide) -> soles under a leaning trunk (poise)
//! ```

mod glide;
mod poise;

use glam::DVec3;

use super::legged::LeggedGenerator;
use crate::model::FigureMotion;
pub use poise::{Poise, Stance};

/// A figure from limp to limp.
pub type FigureGenerator = LeggedGenerator<Poise>;

/// What a figure needs to know of the robot, worked out when it loads, and what it is to do.
#[derive(Debug, Clone)]
pub struct FigurePlan {
    /// The robot's own settings.
    pub settings: FigureMotion,
    /// Middles of the soles on the ground, level, x from the middle between them, m: left, right.
    pub soles: [DVec3; 2],
    /// How far ahead of the soles' middle the trunk is sitting, m; and in each pose. The centre of mass is over it then.
    pub sit_forward_m: f64,
    /// See `sit_forward_m`.
    pub forward_m: Vec<f64>,
    /// Joint angles of the sitting robot, rad.
    pub sit_pose_rad: Vec<f64>,
    /// Joint angles of each pose, those of the legs too, rad.
    pub pose_rad: Vec<Vec<f64>>,
    /// The pose to take when the operator says no more than to go, index into the settings' poses.
    pub pose: usize,
}

impl FigurePlan {
    /// How the trunk is carried in pose number `pose`; as in the stand where there is no such pose.
    pub fn stance(&self, pose: usize) -> Stance {
        let of = |pose: usize| Some((self.settings.poses.get(pose)?, self.forward_m.get(pose)?));
        let Some((pose, forward_m)) = of(pose).or_else(|| of(0)) else { return Stance::default() };
        Stance {
            rise_m: pose.height_m - self.settings.stand_height_m,
            pitch_rad: pose.pitch_rad,
            roll_rad: pose.roll_rad,
            sway_m: pose.sway_m,
            forward_m: *forward_m,
        }
    }
}
