//! A change from one pose to another, joint by joint, at the slow rate.

use super::curves::SMOOTH_STEP_SLOPE_MAX;
use crate::signals::Targets;

/// Shortest duration of a change of pose, s.
const SHORTEST_S: f64 = 0.5;

/// Time for every joint to move from one pose to another, no faster than `rate_rad_s`, s.
pub(super) fn duration_s(from_rad: &[f64], to_rad: &[f64], rate_rad_s: f64) -> f64 {
    let turns = from_rad.iter().zip(to_rad).map(|(from, to)| (to - from).abs());
    (SMOOTH_STEP_SLOPE_MAX * turns.fold(0.0, f64::max) / rate_rad_s).max(SHORTEST_S)
}

/// Writes the pose `share` of the way from one pose to the other.
pub(super) fn write(from_rad: &[f64], to_rad: &[f64], share: f64, targets: &mut Targets) {
    for ((angle, from), to) in targets.set_pose().iter_mut().zip(from_rad).zip(to_rad) {
        *angle = from + share * (to - from);
    }
}
