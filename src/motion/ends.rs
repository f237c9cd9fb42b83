//! The two ends of every motion: from limp to torque in place, and from torque to limp.

use super::Activity;
use super::curves::smooth_step;
use crate::signals::State;

/// One of the two ends. `from` fields are motion time, s.
///
/// ```text
/// Limp -> Heard -> TorqueUp -> (the motion's own phases) -> LetGo -> Done
///   |                                                                 ^
///   +-----------------------------------------------------------------+   ordered to end before there was torque
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Ends {
    /// Waits until every servo has been heard.
    Limp,
    /// Every servo has been heard: in this cycle safety says where goals start.
    Heard,
    /// The torque rises at a rate that safety limits, with every joint where it is.
    TorqueUp { from: f64 },
    /// The torque falls to zero from this share of what is permitted, with every joint where it is.
    LetGo { from: f64, share: f64 },
    /// Limp, permanently.
    Done,
}

impl Ends {
    /// The phase at time `now_s`; `None` once the torque has risen for `ramp_s` and the motion's own phases
    /// begin. Writes the pose at which the torque comes on into `pose_rad`.
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
            // A limp joint may be moved by hand: torque comes on only where the joint was measured just now.
            Ends::Heard if state.is_fresh() => {
                // The start of the goals: each joint's position, or its border if it hangs a little outside.
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

    /// Starts to let go, at time `now_s`, of a robot that holds its last goals with `share` of its torque.
    /// Writes them into `pose_rad`.
    pub(super) fn let_go(now_s: f64, share: f64, state: &State, pose_rad: &mut [f64]) -> Ends {
        pose_rad.copy_from_slice(&state.goal_rad);
        Ends::LetGo { from: now_s, share }
    }

    /// Share of the permitted torque to request at time `now_s`.
    pub(super) fn torque_share(self, now_s: f64, ramp_s: f64) -> f64 {
        match self {
            Ends::LetGo { from, share } => share * (1.0 - smooth_step((now_s - from) / ramp_s)),
            Ends::Limp | Ends::Heard | Ends::TorqueUp { .. } | Ends::Done => 1.0,
        }
    }

    /// True if no joint should have torque.
    pub(super) fn is_limp(self) -> bool {
        matches!(self, Ends::Limp | Ends::Heard | Ends::Done)
    }

    /// Activity of a robot whose activity between its ends is `moving`.
    pub(super) fn activity(self, moving: Activity) -> Activity {
        match self {
            Ends::Limp | Ends::Heard => Activity::Limp,
            Ends::TorqueUp { .. } => moving,
            Ends::LetGo { .. } => Activity::Stopping,
            Ends::Done => Activity::Done,
        }
    }
}
