//! The robot waits for joints that are on their way back, and for answers of their servos, but not for ever.

use super::{Fault, Finding};
use crate::signals::Permission;

/// What answers of servos may take in addition, s.
const ANSWERS_S: f64 = 0.5;

/// How long the robot has waited.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    /// The joint it waits for; none while it does not wait.
    joint: Option<usize>,
    /// Time since it last did not wait, s; time in which it was held for another reason left aside.
    waited_s: f64,
    /// The longest way of a joint in this time, s.
    allowed_s: f64,
}

impl Waiting {
    /// Notes a cycle of `dt_s`, which `joint` was waited for, if one was, and in which the robot was otherwise permitted
    /// `permission`. `way_s` says how long the longest way back takes, s.
    pub(super) fn note(
        &mut self,
        dt_s: f64,
        joint: Option<usize>,
        permission: Permission,
        way_s: impl FnOnce() -> f64,
    ) {
        self.joint = joint;
        if joint.is_none() {
            (self.waited_s, self.allowed_s) = (0.0, 0.0);
        } else if permission == Permission::Move {
            self.waited_s += dt_s;
            self.allowed_s = self.allowed_s.max(way_s() + ANSWERS_S);
        }
    }

    /// Whether the robot waits.
    pub(super) fn is_on(&self) -> bool {
        self.joint.is_some()
    }

    /// The joint that takes longer than its way does.
    pub(super) fn overdue(&self) -> Option<Finding> {
        let joint = self.joint.filter(|_| self.waited_s > self.allowed_s);
        joint.map(|joint| Finding { joint: Some(joint), fault: Fault::NotBack { waited_s: self.waited_s } })
    }
}
