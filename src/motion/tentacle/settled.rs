//! Detects from their goals whether arms have come to rest at their targets.

use crate::signals::State;

/// Goals that move more slowly than this, rad/s, count as still.
const STILL_RAD_S: f64 = 1e-4;
/// Time for which they must be still, s.
const STILL_FOR_S: f64 = 0.1;

/// Watches all goals.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    last_rad: Vec<f64>,
    still_s: f64,
}

impl Settled {
    pub(super) fn new(joints: usize) -> Settled {
        Settled { last_rad: vec![0.0; joints], still_s: 0.0 }
    }

    /// Checks the goals of the last cycle, `dt_s` after the last call. Joints out of service may hang freely.
    pub(super) fn look(&mut self, dt_s: f64, state: &State) {
        let goals = self.last_rad.iter().zip(&state.goal_rad).zip(&state.is_out);
        let ways = goals.filter(|(_, is_out)| !**is_out).map(|((last, now), _)| (now - last).abs());
        let is_moving = ways.fold(0.0, f64::max) > STILL_RAD_S * dt_s;
        self.still_s = if is_moving { 0.0 } else { self.still_s + dt_s };
        self.last_rad.copy_from_slice(&state.goal_rad);
    }

    /// Restarts the watch for a new motion.
    pub(super) fn begin(&mut self) {
        self.still_s = 0.0;
    }

    pub(super) fn is(&self) -> bool {
        self.still_s >= STILL_FOR_S
    }
}
