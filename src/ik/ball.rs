//! Hinges in one place as the ball joint they make: their angles to its turn, and back.

use glam::{DQuat, DVec3};

use crate::model::Joint;
use crate::model::ball_joint::SwingTwist;

/// Coordinate axis of its own frame that a hinge turns about. The hinges of a ball joint have no others, which makes a
/// turn half the arithmetic of one about any axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// The axis `joint` turns about, and 1, or -1 where it turns about it backwards.
    pub(super) fn of(joint: &Joint) -> (Axis, f64) {
        let (axis, along) = match joint.axis.abs().max_position() {
            0 => (Axis::X, joint.axis.x),
            1 => (Axis::Y, joint.axis.y),
            _ => (Axis::Z, joint.axis.z),
        };
        (axis, along.signum())
    }

    fn turn(self, angle: f64) -> DQuat {
        match self {
            Axis::X => DQuat::from_rotation_x(angle),
            Axis::Y => DQuat::from_rotation_y(angle),
            Axis::Z => DQuat::from_rotation_z(angle),
        }
    }

    /// The turn about it that brings x as near to `way`, in the hinge's frame, as it can; none by a twist.
    pub(super) fn aim(self, way: DVec3) -> f64 {
        match self {
            Axis::X => 0.0,
            Axis::Y => (-way.z).atan2(way.x),
            Axis::Z => way.y.atan2(way.x),
        }
    }
}

/// The turn that hinges (axis and sense of each, the first one first) make at `angles`, rad.
pub(super) fn turn(hinges: impl Iterator<Item = (Axis, f64)>, angles: &[f64]) -> DQuat {
    hinges.zip(angles).fold(DQuat::IDENTITY, |turn, ((axis, sense), angle)| turn * axis.turn(sense * angle))
}

/// Writes the angles at which hinges make `turn`, rad; as near as they can, where there are only two.
pub(super) fn write_angles(
    hinges: impl DoubleEndedIterator<Item = (Axis, f64)> + ExactSizeIterator + Clone,
    turn: SwingTwist,
    angles: &mut [f64],
) {
    let mut left = turn.turn();
    let last = hinges.clone().rposition(|(axis, _)| axis != Axis::X);
    for (index, ((axis, sense), angle)) in hinges.zip(angles).enumerate() {
        let way = left * DVec3::X;
        let sign = if way.x < 0.0 && Some(index) != last { -1.0 } else { 1.0 };
        let aim = match axis {
            // Once the link points where it is to, what is left is twist.
            Axis::X => SwingTwist::of(left).twist_rad,
            Axis::Y | Axis::Z => axis.aim(way * sign),
        };
        *angle = sense * aim;
        left = axis.turn(-aim) * left;
    }
}
