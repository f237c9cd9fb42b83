//! Detects a shaft that its motor may throw: a goal far from it at full torque, all at once.

/// A goal further than this from the shaft when torque comes on, or when the goal jumps, may throw the shaft,
/// degrees.
const FAR_DEG: f64 = 5.0;
/// A motor limited to less than this share of its stall torque throws nothing: it only pushes slowly.
const STRONG_SHARE: f64 = 0.3;
/// A shaft that moves this far towards such a goal within this time was thrown, degrees and s: three times
/// the slow rate.
const THROWN_DEG: f64 = 5.0;
const THROWN_S: f64 = 0.05;
/// Such a goal, and the position of the shaft before it, counts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Throw {
    since_s: f64,
    from: f64,
    goal: f64,
    cause: &'static str,
}

impl Throw {
    /// A possible throw: at `now_s` a goal reached a shaft at `from`, because of `cause`, at this share of
    /// the stall torque; a count is this many `degrees`. `None` if that throws nothing.
    pub(super) fn of(
        now_s: f64,
        (from, goal): (f64, f64),
        degrees: f64,
        torque_share: f64,
        cause: &'static str,
    ) -> Option<Throw> {
        let may_throw = (goal - from).abs() * degrees > FAR_DEG && torque_share >= STRONG_SHARE;
        may_throw.then_some(Throw { since_s: now_s, from, goal, cause })
    }

    /// A description of the throw, if the shaft, which is at `position` now, was thrown.
    pub(super) fn thrown(self, now_s: f64, position: f64, degrees: f64) -> Option<String> {
        let way = (position - self.from) * (self.goal - self.from).signum() * degrees;
        (way >= THROWN_DEG).then(|| {
            format!(
                "{} with the goal {:.1} degrees off the shaft, which went {way:.1} degrees within {:.0} ms",
                self.cause,
                (self.goal - self.from).abs() * degrees,
                (now_s - self.since_s) * 1e3
            )
        })
    }

    /// True if the present motion of the shaft has other causes.
    pub(super) fn is_over(self, now_s: f64) -> bool {
        now_s - self.since_s > THROWN_S
    }
}
