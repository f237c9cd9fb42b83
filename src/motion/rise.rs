//! The watch over a robot that rises from the ground: its trunk must stay upright.
//!
//! Limp legs lie as they fell, also under the trunk; legs that fold and push from there may tip it over. With an
//! inertial measurement unit the robot notices that, lies down, and tries again: slower, with its legs folded first and
//! its trunk lower. After [`TRIES`] it stays down.

use crate::signals::State;

/// Number of times that the robot tries to rise.
const TRIES: u32 = 3;
/// A trunk that tilts further than this on the way tips over, rad; one that lay tilted may tilt [`MORE_RAD`] further.
const TIPPING_RAD: f64 = 0.45;
const MORE_RAD: f64 = 0.15;
/// A trunk that tilts further than this cannot be lifted on feet that stand below it, rad.
const UPRIGHT_RAD: f64 = 0.26;
/// A trunk that tilts further than this lies on its side or its back, rad: its legs cannot lift it.
const FALLEN_RAD: f64 = 1.0;
/// A trunk that turns more slowly than this lies still, rad/s.
const STILL_RAD_S: f64 = 0.1;

/// A robot that could not rise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FailedRise {
    /// Tilt of the trunk at which the last try ended, rad.
    pub tilt_rad: f64,
    /// Number of tries.
    pub tries: u32,
}

/// The tries of one rise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct RiseWatch {
    /// Tilt of the trunk as it lay, rad.
    lying_rad: f64,
    /// Tries that have ended.
    tries: u32,
    failed: Option<FailedRise>,
    /// True after a fall: the reflex that got the robot up watches over it, with tries of its own.
    is_off: bool,
}

impl RiseWatch {
    /// The reflex takes the watch over.
    pub(super) fn give_over(&mut self) {
        *self = RiseWatch { is_off: true, ..RiseWatch::default() };
    }

    /// Notes how the trunk lies.
    pub(super) fn lies(&mut self, state: &State) {
        self.lying_rad = tilt_rad(state).unwrap_or(0.0);
    }

    /// True if the trunk tips over while the legs fold, and this try ends.
    pub(super) fn tips_over(&mut self, state: &State) -> bool {
        self.ends(state, TIPPING_RAD.max(self.lying_rad + MORE_RAD))
    }

    /// True if the trunk is not upright, though the feet are to lift it, and this try ends.
    pub(super) fn is_tilted(&mut self, state: &State) -> bool {
        self.ends(state, UPRIGHT_RAD)
    }

    fn ends(&mut self, state: &State, limit_rad: f64) -> bool {
        let Some(tilt_rad) = tilt_rad(state).filter(|tilt_rad| !self.is_off && *tilt_rad > limit_rad) else {
            return false;
        };
        self.tries += 1;
        self.failed = (self.tries >= TRIES || tilt_rad > FALLEN_RAD)
            .then_some(FailedRise { tilt_rad, tries: self.tries });
        true
    }

    /// The robot stands; a later rise has all its tries again.
    pub(super) fn stands(&mut self) {
        *self = RiseWatch { is_off: self.is_off, ..RiseWatch::default() };
    }

    /// True once a try has ended: the next is slower and lower.
    pub(super) fn is_careful(&self) -> bool {
        self.tries > 0
    }

    /// The end of the last try.
    pub(super) fn failed(&self) -> Option<FailedRise> {
        self.failed
    }
}

/// True if the trunk lies still, or its motion is unknown.
pub(super) fn is_still(state: &State) -> bool {
    !state.body.is_known || state.body.rate_rad_s.length() < STILL_RAD_S
}

/// Tilt of the trunk, rad; `None` if it is unknown.
fn tilt_rad(state: &State) -> Option<f64> {
    state.body.is_known.then(|| state.body.tilt_rad())
}
