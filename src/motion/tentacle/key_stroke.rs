//! A stroke of one arm by key angles: how its pseudo-targets turn in a plane (Ishizuka 2008, 3.3).

use glam::DVec3;

use super::arm_plan::ArmPlan;
use super::key_angles::{KEYS, KeyAngles, KeyInterpolation};
use super::pseudo_targets::{Turn, places};
use super::rhythm::OfArm;
use crate::model::GROUPS;
use crate::signals::ArmTarget;

/// Random numbers that the key angles of one stroke take.
pub(super) const KEY_NUMBERS: u64 = (KEYS * GROUPS) as u64;

/// Role of an arm among its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Position on its side, 1 (front) to 4 (rear).
    pub role: u8,
    /// True on the right.
    pub is_right: bool,
    /// Rotation of the plane of walking strokes about the arm from level, rad: 0 is left-right, pi/2 up-down.
    pub walk_plane_rad: f64,
}

/// A stroke of key angles in a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyStroke {
    /// The angles at its key poses, rad.
    pub keys: KeyAngles,
    /// Interpolation between them.
    pub between: KeyInterpolation,
    /// Rotation of its plane about the arm from level, rad.
    pub plane_rad: f64,
    /// Delay behind the robot's phase, rad.
    pub lag: f64,
}

impl KeyStroke {
    /// Turns of the pseudo-targets at `phase` (rad, one stroke is 2 pi), with `sweep_rad` towards a goal on
    /// the left (3.5), which the whole arm takes.
    pub fn turns(&self, phase: f64, sweep_rad: f64) -> [Turn; GROUPS] {
        let mut turns = self
            .keys
            .rounded_at(self.between, phase - self.lag)
            .map(|angle| Turn::in_plane(angle, self.plane_rad));
        turns[0].sweep += sweep_rad;
        turns
    }

    /// Target ends of groups of these lengths (m), arm frame, m.
    pub fn ends_in_arm(&self, group_lengths_m: [f64; GROUPS], phase: f64, sweep_rad: f64) -> [DVec3; GROUPS] {
        places(group_lengths_m, self.turns(phase, sweep_rad))
    }
}

impl OfArm for KeyStroke {
    fn write(&self, arm: &ArmPlan, phase: f64, turn_rad: f64, target: &mut ArmTarget) {
        arm.write_turns(self.turns(phase, turn_rad), target);
    }
}
