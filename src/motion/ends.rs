//! The two ends of every motion: from limp to torque where the robot is, and from torque to limp.

use super::Activity;
use super::curves::smooth_step;
use crate::signals::State;

/// One of the two ends. `from` fields are motion time, s.
///
/// ```text
/// Limp -> Heard -> TorqueUp -> (the motion's own phases) -> LetGo -> Done
///   |                                                                 ^
///   +-----------------------------------------------------------------+   told to end before there was torque
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Ends {
    /// Waits until every servo is heard.
    Limp,
    /// Every servo was heard: in this cycle safety says where goals start.
    Heard,
    /// The torque rises, at a rate safety keeps, where every joint is.
    TorqueUp { from: f64 },
    /// The torque falls to nothing from this share of what is permitted, where every joint is.
    LetGo { from: f64, share: f64 },
    /// Limp for good.
    Done,
}

impl Ends {
    /// The end it is at time `now_s`; none once the torque has risen for `ramp_s` and the motion's own phases
    /// begin. Writes the pose in which the torque comes on into `pose_rad`.
    pub(super) fn next(
        self,
        now_s: f64,
        ramp_s: f64,
        must_end: bool,
        state: &State,
        pose_rad: &mut [f64],
    ) -> Option<Ends> {
        Some(match self {
            Ends::Limp | Ends::Heard if must_end => Ends::Done,
            // A limp joint may be moved by hand: torque comes on only where it was heard to be just now.
            Ends::Heard if state.is_fresh() => {
                // Where goals start: where each joint is, or at its border where it hangs a little outside.
                pose_rad.copy_from_slice(&state.goal_rad);
                Ends::TorqueUp { from: now_s }
            }
            Ends::Limp | Ends::Heard => {
                if state.is_fresh() {
                    Ends::Heard
                } else {
                    Ends::Limp
                }
            }
            Ends::TorqueUp { from } if now_s >= from + ramp_s => return None,
            Ends::LetGo { from, .. } if now_s >= from + ramp_s => Ends::Done,
            unchanged => unchanged,
        })
    }

    /// Lets go, from time `now_s` on, of a robot that holds its last goals with `share` of its torque. Writes
    /// them into `pose_rad`.
    pub(super) fn let_go(now_s: f64, share: f64, state: &State, pose_rad: &mut [f64]) -> Ends {
        pose_rad.copy_from_slice(&state.goal_rad);
        Ends::LetGo { from: now_s, share }
    }

    /// Share of the permitted torque to ask for at time `now_s`.
    pub(super) fn torque_share(self, now_s: f64, ramp_s: f64) -> f64 {
        match self {
            Ends::LetGo { from, share } => share * (1.0 - smooth_step((now_s - from) / ramp_s)),
            Ends::Limp | Ends::Heard | Ends::TorqueUp { .. } | Ends::Done => 1.0,
        }
    }

    /// Whether no joint is to have torque.
    pub(super) fn is_limp(self) -> bool {
        matches!(self, Ends::Limp | Ends::Heard | Ends::Done)
    }

    /// What a robot is doing that does `moving` between its ends.
    pub(super) fn activity(self, moving: Activity) -> Activity {
        match self {
            Ends::Limp | Ends::Heard => Activity::Limp,
            Ends::TorqueUp { .. } => moving,
            Ends::LetGo { .. } => Activity::Stopping,
            Ends::Done => Activity::Done,
        }
    }
}
