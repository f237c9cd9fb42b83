//! A soft stop before the hard one: slows goals down near the end of a range, as against a spring.
//!
//! Input: joint angles from inverse kinematics or a pose. Output: the same angles, changed only near the ends
//! of their ranges. If this keeps a foot from its target, its residual shows it.

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
    /// The stops of a chain with these `joints`, which begin `margin_rad` before each end.
    pub(super) fn new(joints: &[Joint], margin_rad: f64) -> SoftStops {
        SoftStops {
            margin_rad,
            ranges_rad: joints.iter().map(Joint::goal_range_rad).collect(),
            balls: SharedRange::of_chain(joints),
        }
    }

    /// Limits `angles`, rad, by the stops.
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
