//! A soft stop before the hard one: goals near the end of a range are slowed down, as against a spring.
//!
//! Comes in: joint angles as inverse kinematics or a pose has them. Goes out: the same, unchanged but near the ends of
//! their ranges. What that takes from a foot's way shows in its residual.

use std::ops::Range;

use crate::model::ball_joint::soft_range;
use crate::model::{Joint, SharedRange};

/// The soft stops of one chain.
#[derive(Debug, Clone)]
pub(super) struct SoftStops {
    margin_rad: f64,
    ranges_rad: Vec<(f64, f64)>,
    balls: Vec<(Range<usize>, SharedRange)>,
}

impl SoftStops {
    /// Of a chain with these `joints`: so far before each end.
    pub(super) fn new(joints: &[Joint], margin_rad: f64) -> SoftStops {
        SoftStops {
            margin_rad,
            ranges_rad: joints.iter().map(Joint::goal_range_rad).collect(),
            balls: SharedRange::of_chain(joints),
        }
    }

    /// Brings `angles`, rad, to where the stops let them be.
    pub(super) fn soften(&self, angles: &mut [f64]) {
        for (hinges, range) in &self.balls {
            if let Some(angles) = angles.get_mut(hinges.clone()) {
                range.soften(angles, self.margin_rad);
            }
        }
        for (angle, range) in angles.iter_mut().zip(&self.ranges_rad) {
            *angle = soft_range(*angle, *range, self.margin_rad);
        }
    }
}
