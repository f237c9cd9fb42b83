//! A soft stop before the hard one: goals near the end of a range are slowed down, as against a spring.
//!
//! Comes in: joint angles as inverse kinematics or a pose has them. Goes out: the same, unchanged but near the ends of
//! their ranges. What that takes from a foot's way shows in its residual.

use std::ops::Range;

use super::ball::{self, Axis};
use crate::model::ball_joint::{SwingTwist, soft_range};
use crate::model::{BallJoint, Joint, hinges_in_place};

/// The soft stops of one chain.
#[derive(Debug, Clone)]
pub(super) struct SoftStops {
    margin_rad: f64,
    ranges_rad: Vec<(f64, f64)>,
    balls: Vec<Ball>,
}

#[derive(Debug, Clone)]
struct Ball {
    hinges: Range<usize>,
    axes: Vec<(Axis, f64)>,
    range: BallJoint,
}

impl SoftStops {
    /// Of a chain with these `joints`: so far before each end.
    pub(super) fn new(joints: &[Joint], margin_rad: f64) -> SoftStops {
        let ball = |(last, joint): (usize, &Joint)| {
            let hinges = hinges_in_place(joints, last);
            let axes = joints[hinges.clone()].iter().map(Axis::of).collect();
            Some(Ball { hinges, axes, range: joint.ball.clone()? })
        };
        SoftStops {
            margin_rad,
            ranges_rad: joints.iter().map(Joint::goal_range_rad).collect(),
            balls: joints.iter().enumerate().filter_map(ball).collect(),
        }
    }

    /// Brings `angles`, rad, to where the stops let them be.
    pub(super) fn soften(&self, angles: &mut [f64]) {
        for Ball { hinges, axes, range } in &self.balls {
            let Some(angles) = angles.get_mut(hinges.clone()) else { continue };
            let axes = axes.iter().copied();
            let asked = SwingTwist::of(ball::turn(axes.clone(), angles));
            let mut soft = range.softened(asked, self.margin_rad);
            if angles.len() < 3 {
                // Two hinges have the twist that comes with their swing.
                soft.twist_rad = asked.twist_rad;
            }
            if soft != asked {
                ball::write_angles(axes, soft, angles);
            }
        }
        for (angle, range) in angles.iter_mut().zip(&self.ranges_rad) {
            *angle = soft_range(*angle, *range, self.margin_rad);
        }
    }
}
