//! The stride clock: the lift-off times of each leg, through every change of gait.
//!
//! All legs share one clock. Its phase counts strides and advances by `1 / T` per second; leg i lifts when
//! the phase has passed its phase offset psi_i since the last whole number. A change of gait moves the period
//! and the four phase offsets along a quintic smooth step over a number of strides. All legs keep the same
//! swing time, so that only the length of a leg's stance changes.

use crate::model::Gait;
use crate::motion::curves::{SMOOTH_STEP_SLOPE_MAX, smooth_step, smooth_step_integral};

/// Period and phase offsets at one end of a change.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Timing {
    period_s: f64,
    phase_offsets: [f64; 4],
}

/// Lift-off times of each leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrideClock {
    from: Timing,
    to: Timing,
    /// Phase and time at the start of the change.
    change_phase: f64,
    change_s: f64,
    /// Length of the change, strides; 0 if there is none.
    strides: f64,
}

/// Newton steps and halvings that suffice to find a lift-off to rounding.
const STEPS: u32 = 60;

impl StrideClock {
    /// Strides of `gait` with the left hind leg first, at `start_s`.
    pub fn starting(gait: &Gait, swing_time_s: f64, start_s: f64) -> StrideClock {
        let timing = Timing { period_s: gait.period_s(swing_time_s), phase_offsets: gait.phase_offsets };
        StrideClock { from: timing, to: timing, change_phase: 0.0, change_s: start_s, strides: 0.0 }
    }

    /// The clock with a change to `gait` from `start_s` on, over `strides`. A change that is under way must
    /// be over by then; one that begins later is dropped.
    pub fn change_to(&self, gait: &Gait, swing_time_s: f64, start_s: f64, strides: f64) -> StrideClock {
        let from = if start_s < self.change_end_s() { self.from } else { self.to };
        let shifts = shortest_shifts(&from.phase_offsets, &gait.phase_offsets);
        StrideClock {
            from,
            to: Timing {
                period_s: gait.period_s(swing_time_s),
                phase_offsets: std::array::from_fn(|leg| from.phase_offsets[leg] + shifts[leg]),
            },
            change_phase: self.phase(start_s),
            change_s: start_s,
            strides,
        }
    }

    /// The clock with its present strides for good: a change that has not begun at `s` is dropped.
    pub fn without_later_change(&self, s: f64) -> StrideClock {
        if s >= self.change_s { *self } else { StrideClock { to: self.from, strides: 0.0, ..*self } }
    }

    /// Length of the change, strides.
    pub fn change_strides(&self) -> f64 {
        self.strides
    }

    /// Start of the change, s.
    pub fn change_start_s(&self) -> f64 {
        self.change_s
    }

    /// End of the change, s.
    pub fn change_end_s(&self) -> f64 {
        self.time_in_change_s(1.0)
    }

    /// Time of the share `u` of the change, s: the integral of the period over the phase.
    fn time_in_change_s(&self, u: f64) -> f64 {
        let more = self.to.period_s - self.from.period_s;
        self.change_s + self.strides * (self.from.period_s * u + more * smooth_step_integral(u))
    }

    /// Strides since the clock started, at time `s`.
    pub fn phase(&self, s: f64) -> f64 {
        let end_s = self.change_end_s();
        if s <= self.change_s {
            self.change_phase + (s - self.change_s) / self.from.period_s
        } else if s >= end_s {
            self.change_phase + self.strides + (s - end_s) / self.to.period_s
        } else {
            let u = solve(
                |u| self.time_in_change_s(u) - s,
                |u| {
                    let more = self.to.period_s - self.from.period_s;
                    self.strides * (self.from.period_s + more * smooth_step(u))
                },
            );
            self.change_phase + self.strides * u
        }
    }

    /// Strides since the left hind leg's lift-off at time `s`, by its phase offset before and after the change.
    pub(super) fn phases_since_left_hind(&self, s: f64) -> [f64; 2] {
        let phase = self.phase(s);
        [phase - self.from.phase_offsets[0], phase - self.to.phase_offsets[0]]
    }

    /// The longest period from `s` on, s.
    pub fn longest_period_s(&self, s: f64) -> f64 {
        if s >= self.change_end_s() { self.to.period_s } else { self.from.period_s.max(self.to.period_s) }
    }

    /// The period once every change is over, s.
    pub fn settled_period_s(&self) -> f64 {
        self.to.period_s
    }

    /// Completed share of the change at time `s`, smooth.
    pub fn share_changed(&self, s: f64) -> f64 {
        if self.strides <= 0.0 {
            return 1.0;
        }
        smooth_step((self.phase(s) - self.change_phase) / self.strides)
    }

    /// Time of lift-off number `count` of `leg`, s.
    pub fn lift_off_s(&self, leg: usize, count: i64) -> f64 {
        #[allow(clippy::cast_precision_loss, reason = "strides are counted exactly for ages")]
        let count = count as f64;
        let before = count + self.from.phase_offsets[leg] - self.change_phase;
        let after = count + self.to.phase_offsets[leg] - self.change_phase - self.strides;
        if before <= 0.0 {
            self.change_s + before * self.from.period_s
        } else if after >= 0.0 {
            self.change_end_s() + after * self.to.period_s
        } else {
            let shift = self.to.phase_offsets[leg] - self.from.phase_offsets[leg];
            let u = solve(
                |u| self.strides * u - shift * smooth_step(u) - before,
                |u| self.strides - shift * 30.0 * (u * (1.0 - u)).powi(2),
            );
            self.time_in_change_s(u)
        }
    }

    /// Number of the first lift-off of `leg` at or after time `s`.
    pub fn next_lift_off(&self, leg: usize, s: f64) -> i64 {
        #[allow(clippy::cast_possible_truncation, reason = "strides since the start fit")]
        let mut count = (self.phase(s) - self.from.phase_offsets[leg]).floor() as i64 - 1;
        while self.lift_off_s(leg, count) < s {
            count += 1;
        }
        count
    }
}

/// Change of each phase offset from `from` to `to`, strides. Whole strides are added so that the legs shift
/// as little as possible relative to each other, and the middle of the changes is 0.
pub(super) fn shortest_shifts(from: &[f64; 4], to: &[f64; 4]) -> [f64; 4] {
    let change: [f64; 4] = std::array::from_fn(|leg| to[leg] - from[leg]);
    let spread = |shifts: &[f64; 4]| {
        let (low, high) = ends(shifts);
        high - low
    };
    let mut best = [0.0, 0.0, 0.0, f64::INFINITY];
    for first in 0..4 {
        // Bring each other leg's change into the stride that begins at this leg's.
        let shifts = std::array::from_fn(|leg| {
            let beyond = (change[leg] - change[first]).rem_euclid(1.0);
            // A whole stride, within rounding, is no change.
            change[first] + if beyond > 1.0 - 1e-9 { beyond - 1.0 } else { beyond }
        });
        if spread(&shifts) < spread(&best) - 1e-9 {
            best = shifts;
        }
    }
    let (low, high) = ends(&best);
    best.map(|shift| shift - 0.5 * (low + high))
}

/// Largest change of a phase offset from `from` to `to`, strides.
pub(super) fn largest_shift(from: &Gait, to: &Gait) -> f64 {
    ends(&shortest_shifts(&from.phase_offsets, &to.phase_offsets)).1
}

/// Upper bound on the time between a leg's lift-offs in a change between the periods over `strides`, s.
pub(super) fn longest_interval_s(longest_period_s: f64, largest_shift: f64, strides: f64) -> f64 {
    longest_period_s / (1.0 - SMOOTH_STEP_SLOPE_MAX * largest_shift / strides).max(0.1)
}

fn ends(shifts: &[f64; 4]) -> (f64, f64) {
    shifts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &s| (low.min(s), high.max(s)))
}

/// The zero of the rising `f` between 0 and 1: Newton's method, with a halving if it would leave the bracket.
fn solve(f: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high, mut u) = (0.0, 1.0, 0.5);
    for _ in 0..STEPS {
        let value = f(u);
        if value > 0.0 {
            high = u
        } else {
            low = u
        }
        let newton = u - value / slope(u);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - u).abs() < 1e-16 {
            break;
        }
        u = next;
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;

    const SWING_S: f64 = 0.3;

    fn gait(name: &str) -> Gait {
        Gait::built_in().into_iter().find(|gait| gait.name == name).unwrap()
    }

    /// The table of reference changes of phase offsets, in the order left hind, left fore, right hind, right fore.
    #[test]
    fn phase_offsets_change_the_shortest_way() {
        let expected = [
            ("walk", "trot", [-0.15, 0.15, -0.15, 0.15]),
            ("walk", "canter", [0.15, 0.15, -0.15, -0.15]),
            ("walk", "gallop", [0.075, 0.225, -0.225, -0.075]),
            ("trot", "canter", [0.3, 0.0, 0.0, -0.3]),
            ("trot", "gallop", [0.225, 0.075, -0.075, -0.225]),
            ("canter", "gallop", [-0.075, 0.075, -0.075, 0.075]),
        ];
        for (from, to, shifts) in expected {
            let (from, to) = (gait(from), gait(to));
            for (a, b, sign) in [(&from, &to, 1.0), (&to, &from, -1.0)] {
                let found = shortest_shifts(&a.phase_offsets, &b.phase_offsets);
                // Two spreads can be equal; then the mirror image of the change is also right.
                let same = (0..4).all(|leg| (found[leg] - sign * shifts[leg]).abs() < 1e-9);
                assert!(same, "{} to {}: {found:?}", a.name, b.name);
            }
        }
    }

    #[test]
    fn steady_lift_offs_match_the_gait() {
        let trot = gait("trot");
        let clock = StrideClock::starting(&trot, SWING_S, 2.0);
        for leg in 0..4 {
            for count in 0..5 {
                let expected = 2.0 + 0.6 * (f64::from(count) + trot.phase_offsets[leg]);
                assert!((clock.lift_off_s(leg, count.into()) - expected).abs() < 1e-12);
            }
        }
        assert!((clock.phase(3.5) - 2.5).abs() < 1e-12);
        assert_eq!(clock.next_lift_off(0, 2.0), 0);
        assert_eq!(clock.next_lift_off(0, 2.1), 1);
    }

    #[test]
    fn a_change_ends_in_the_other_gait_and_every_lift_off_matches_the_phase() {
        for from in Gait::built_in() {
            for to in Gait::built_in() {
                let clock = StrideClock::starting(&from, SWING_S, 0.0).change_to(&to, SWING_S, 1.23, 1.5);
                let end_s = clock.change_end_s();
                assert!(end_s > 1.23);
                for step in 0..400 {
                    let s = f64::from(step) * 0.01;
                    assert!(clock.phase(s + 0.01) > clock.phase(s));
                }
                let mut lifts = [[0.0; 3]; 4];
                for (leg, lifts) in lifts.iter_mut().enumerate() {
                    let first = clock.next_lift_off(leg, end_s);
                    for (place, lift) in lifts.iter_mut().enumerate() {
                        *lift = clock.lift_off_s(leg, first + i64::try_from(place).unwrap());
                    }
                    // Intervals between lift-offs always leave room for a swing and a stance.
                    let mut count = clock.next_lift_off(leg, 0.0);
                    let mut before = clock.lift_off_s(leg, count);
                    while before < end_s {
                        count += 1;
                        let now = clock.lift_off_s(leg, count);
                        assert!(now - before > SWING_S, "{} to {} leg {leg}", from.name, to.name);
                        before = now;
                    }
                }
                let period_s = to.period_s(SWING_S);
                for leg in 0..4 {
                    assert!((lifts[leg][1] - lifts[leg][0] - period_s).abs() < 1e-9);
                    let phase_offset =
                        ((lifts[leg][0] - lifts[0][0]) / period_s - to.phase_offsets[leg]).rem_euclid(1.0);
                    assert!(
                        !(1e-9..=1.0 - 1e-9).contains(&phase_offset),
                        "{} to {}: {phase_offset}",
                        from.name,
                        to.name
                    );
                }
            }
        }
    }
}
