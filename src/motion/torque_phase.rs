//! The two ends of every motion: from limp to torque in place, and from torque to limp.

use super::Activity;
use super::curves::smooth_step;
use crate::signals::State;

/// One of the two ends. `from` fields are motion time, s.
///
/// ```text
/// Limp -> TorqueUp -> (the motion's own phases) -> LetGo -> Done
///   |                                                        ^
///   +--------------------------------------------------------+   ordered to end before there was torque
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TorquePhase {
    /// Waits until every servo has been heard.
    Limp,
    /// The torque rises at a rate that safety limits, with every joint where it is.
    TorqueUp { from: f64 },
    /// The torque falls to zero from this share of what is permitted, with every joint where it is.
    LetGo { from: f64, share: f64 },
    /// Limp, permanently.
    Done,
}

impl TorquePhase {
    /// The phase at time `now_s`; `None` once the torque has risen for `ramp_s` and the motion's own phases
    /// begin. Writes the pose at which the torque comes on into `pose_rad`.
    pub(super) fn next(
        self,
        now_s: f64,
        ramp_s: f64,
        must_end: bool,
        state: &State,
        pose_rad: &mut [f64],
    ) -> Option<TorquePhase> {
        Some(match self {
            TorquePhase::Limp if must_end => TorquePhase::Done,
            // A limp joint may be moved by hand: torque comes on only where the joint was measured just now.
            TorquePhase::Limp if state.is_fresh() => {
                pose_rad.copy_from_slice(&state.start_rad);
                TorquePhase::TorqueUp { from: now_s }
            }
            TorquePhase::Limp => TorquePhase::Limp,
            TorquePhase::TorqueUp { from } if now_s >= from + ramp_s => return None,
            TorquePhase::LetGo { from, .. } if now_s >= from + ramp_s => TorquePhase::Done,
            unchanged => unchanged,
        })
    }

    /// Starts to let go, at time `now_s`, of a robot that holds its last goals with `share` of its torque.
    /// Writes them into `pose_rad`.
    pub(super) fn let_go(now_s: f64, share: f64, state: &State, pose_rad: &mut [f64]) -> TorquePhase {
        pose_rad.copy_from_slice(&state.goal_rad);
        TorquePhase::LetGo { from: now_s, share }
    }

    /// Share of the permitted torque to request at time `now_s`.
    pub(super) fn torque_share(self, now_s: f64, ramp_s: f64) -> f64 {
        match self {
            TorquePhase::LetGo { from, share } => share * (1.0 - smooth_step((now_s - from) / ramp_s)),
            TorquePhase::Limp | TorquePhase::TorqueUp { .. } | TorquePhase::Done => 1.0,
        }
    }

    /// True if no joint should have torque.
    pub(super) fn is_limp(self) -> bool {
        matches!(self, TorquePhase::Limp | TorquePhase::Done)
    }

    /// Activity of a robot whose activity between its ends is `moving`.
    pub(super) fn activity(self, moving: Activity) -> Activity {
        match self {
            TorquePhase::Limp => Activity::Limp,
            TorquePhase::TorqueUp { .. } => moving,
            TorquePhase::LetGo { .. } => Activity::Stopping,
            TorquePhase::Done => Activity::Done,
        }
    }
}
