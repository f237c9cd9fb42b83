//! What a kind of robot on legs does on its feet: the part of [`super::legged`] that is its own.

use std::fmt;

use super::horse::Drive;
use super::{Activity, Order};
use crate::signals::{State, Targets};

/// A motion of a robot on its feet.
pub trait LeggedMotion: fmt::Debug + Send {
    /// The operator's command for this motion.
    type Command: Copy;

    /// The command to carry out `since_s` after the robot came to its feet; `None` to come to a stand and
    /// stop. If the order says no more than to go, it is the planned motion, for `move_for_s`.
    fn command(&self, order: Order, since_s: f64, move_for_s: f64) -> Option<Self::Command>;

    /// Advances by `dt_s` under `command`; without one, towards its stand.
    fn step(&mut self, dt_s: f64, state: &State, command: Option<Self::Command>);

    /// Resets to the stand in which the robot rises, as if it had not moved yet.
    fn reset_to_stand(&mut self);

    /// True once the robot stands as it stood up and will stay so.
    fn is_standing(&self) -> bool;

    /// Its present activity.
    fn activity(&self) -> Activity;

    /// Time for which the robot stands still after it has risen, s, before it counts as on its feet: a person
    /// who holds it sets it down in this time.
    fn set_down_s(&self) -> f64 {
        0.0
    }

    /// Joint angles of the sitting robot, rad.
    fn sit_pose_rad(&self) -> &[f64];

    /// The lowest pose on its feet: the body's height, m, and the joint angles, rad. `None` for a robot that is set on its
    /// feet by hand and does not rise from the ground.
    fn crouch(&self) -> Option<(f64, &[f64])> {
        None
    }

    /// Height of the body above the ground, sitting and standing, m.
    fn heights_m(&self) -> (f64, f64);

    /// Limits the speed from now on to this share of the top speed; no effect on a robot that does not walk.
    fn limit_speed(&mut self, _share: f64) {}

    /// Planned present speed of the trunk, m/s; 0 for a robot that does not walk.
    fn speed_m_s(&self) -> f64 {
        0.0
    }

    /// Present or next pose, index into [`crate::model::FigureMotion::poses`]; `None` for a robot without poses.
    fn pose(&self) -> Option<usize> {
        None
    }

    /// The walker, if the robot goes by gaits.
    fn drive(&self) -> Option<&Drive> {
        None
    }

    /// Writes the targets for a body whose posture begins `height_m` above the ground.
    fn write(&self, height_m: f64, targets: &mut Targets);
}
