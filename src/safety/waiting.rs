//! The robot waits for returning joints and for answers of their servos, but only for a limited time.

use super::{Fault, Finding};
use crate::signals::Permission;

/// Additional time allowed for the answers of servos, s.
const ANSWERS_S: f64 = 0.5;

/// The present wait of the robot.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    /// The joint it waits for; `None` while it does not wait.
    joint: Option<usize>,
    /// Time of the present wait, s, without time in which it was held for another reason.
    waited_s: f64,
    /// The longest return time of a joint during this wait, s.
    allowed_s: f64,
}

impl Waiting {
    /// Notes a cycle of `dt_s`. `joint` is the one waited for, if any; `permission` is what the robot was otherwise
    /// permitted; `way_s` gives the longest return time, s.
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

    /// True if the robot waits.
    pub(super) fn is_on(&self) -> bool {
        self.joint.is_some()
    }

    /// The joint that takes longer to return than it should.
    pub(super) fn overdue(&self) -> Option<Finding> {
        let joint = self.joint.filter(|_| self.waited_s > self.allowed_s);
        joint.map(|joint| Finding { joint: Some(joint), fault: Fault::NotBack { waited_s: self.waited_s } })
    }
}
