//! Detects a joint that does not turn although its goal does.
//!
//! The distance from the goal alone does not reveal a jam: a walk brings the goal back past a jammed joint twice a
//! stride. A still joint does not prove one: a loaded joint stands a few degrees off a still goal. Nor does a joint
//! that is still while its goal turns: a joint that was pushed ahead of its goal waits for it. And near its goal a
//! healthy joint stands still under its load: its servo turns the error into torque, and the friction of its gears and
//! the weight on it hold against that. Only an error with which the servo pushes harder than these proves a jam.

use super::Fault;
use crate::model::{SafetySettings, ServoModel};
use crate::signals::JointState;

/// A joint that turned by less than this counts as still: two degrees, above play and noise.
const STILL_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Turn of the goal that a joint must follow, as a share of the allowed tracking error.
const GOAL_TURN_SHARE: f64 = 1.0 / 3.0;

/// Share of a servo's stall torque with which it does not yet turn a healthy joint: an eighth for the friction of its gears
/// at rest, and a fifth for the weight on it.
const EXPLAINED_SHARE: f64 = 0.33;

/// The largest error, rad, that friction and load explain on a joint with this servo.
pub(super) fn explained_rad(servo: &ServoModel) -> f64 {
    EXPLAINED_SHARE / servo.position_gain_share_rad
}

/// Watches one joint.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stall {
    /// Angles of the joint and its goal when the joint last turned, rad; `None` before the first look.
    since: Option<(f64, f64)>,
    /// Total time that the goal was far from there, s.
    lasted_s: f64,
}

impl Stall {
    /// Looks at the joint `dt_s` after the last look, when its goal is `goal_rad`. Friction and load explain an error
    /// of `explained_rad`.
    pub(super) fn judge(
        &mut self,
        dt_s: f64,
        joint: &JointState,
        goal_rad: f64,
        explained_rad: f64,
        settings: &SafetySettings,
    ) -> Option<Fault> {
        let position_rad = joint.position_rad;
        let (turned_from_rad, goal_then_rad) = *self.since.get_or_insert((position_rad, goal_rad));
        if (position_rad - turned_from_rad).abs() > STILL_RAD {
            *self = Stall { since: Some((position_rad, goal_rad)), lasted_s: 0.0 };
            return None;
        }
        let goal_turn_rad = (goal_rad - goal_then_rad).abs();
        let off_rad = (goal_rad - position_rad).abs();
        if goal_turn_rad > GOAL_TURN_SHARE * settings.tracking_error_rad
            && off_rad > STILL_RAD.max(explained_rad)
        {
            self.lasted_s += dt_s;
        }
        (self.lasted_s > settings.fault_delay_s)
            .then_some(Fault::Stalled { goal_turn_rad, load_share: joint.load_share })
    }
}
