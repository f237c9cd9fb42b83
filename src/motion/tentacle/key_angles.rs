//! The turn of each pseudo-target over a stroke: four key poses and the interpolation between (Ishizuka 2008, 3.3).

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::model::GROUPS;
pub use crate::model::KeyInterpolation;

/// Key poses in one stroke: at 0, pi/2, pi and 3 pi/2.
pub const KEYS: usize = 4;

/// Distance from a key within which straight lines are rounded, in quarters of a stroke.
pub const ROUNDING_QUARTERS: f64 = 0.1;

/// Turns of each pseudo-target in its parent's frame at the key poses, rad; positive is up if the stroke is
/// upright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyAngles(pub [[f64; KEYS]; GROUPS]);

impl KeyAngles {
    /// Turns at `phase`, rad of the stroke, for any number of strokes from 0.
    pub fn at(&self, between: KeyInterpolation, phase: f64) -> [f64; GROUPS] {
        let quarters = phase.rem_euclid(TAU) / FRAC_PI_2;
        let share = quarters.fract();
        // A phase just below 0 becomes a whole turn after rounding.
        let quarter = (0..KEYS).rev().find(|key| quarters >= *key as f64).unwrap_or(0);
        self.0.map(|keys| {
            let key = |ahead: usize| keys[(quarter + ahead) % KEYS];
            let (before, here, next, after) = (key(KEYS - 1), key(0), key(1), key(2));
            match between {
                KeyInterpolation::Linear => here + share * (next - here),
                KeyInterpolation::Smooth => {
                    hermite(share, here, slope(before, next), next, slope(here, after))
                }
            }
        })
    }

    /// The same, with the corners of straight lines rounded: within [`ROUNDING_QUARTERS`] of a key, the mean
    /// over that much before and after, which is a parabola. The key is missed by a quarter of that times the
    /// change of slope per quarter: in walking by at most 8 degrees. This makes the speed of a turn
    /// continuous at any loop rate.
    pub fn rounded_at(&self, between: KeyInterpolation, phase: f64) -> [f64; GROUPS] {
        let mut turns = self.at(between, phase);
        if between == KeyInterpolation::Smooth {
            return turns;
        }
        let quarters = phase.rem_euclid(TAU) / FRAC_PI_2;
        let off = quarters - quarters.round();
        if off.abs() < ROUNDING_QUARTERS {
            let key = (0..KEYS).rev().find(|key| quarters.round() >= *key as f64).unwrap_or(0);
            let key = if quarters.round() >= KEYS as f64 { 0 } else { key };
            let left = ROUNDING_QUARTERS - off.abs();
            let share = left * left / (4.0 * ROUNDING_QUARTERS);
            for (turn, keys) in turns.iter_mut().zip(self.0) {
                *turn += share * (keys[(key + 1) % KEYS] - 2.0 * keys[key] + keys[(key + KEYS - 1) % KEYS]);
            }
        }
        turns
    }

    /// The same stroke, each turn times `gain`.
    pub fn times(self, gain: f64) -> KeyAngles {
        KeyAngles(self.0.map(|keys| keys.map(|key| gain * key)))
    }
}

/// Slope of the periodic cubic at a key, per quarter, from the keys before and after it. Continuity of the
/// acceleration requires m[-1] + 4 m[0] + m[1] = 3 (y[1] - y[-1]) at each; with four keys in the period,
/// opposite right-hand sides are opposite, hence opposite slopes, and this is the solution.
fn slope(before: f64, after: f64) -> f64 {
    0.75 * (after - before)
}

/// The cubic from `a` to `b` with slopes `at_a` and `at_b`, at the share `u` of the interval.
fn hermite(u: f64, a: f64, at_a: f64, b: f64, at_b: f64) -> f64 {
    let v = 1.0 - u;
    v * v * ((1.0 + 2.0 * u) * a + u * at_a) + u * u * ((1.0 + 2.0 * v) * b - v * at_b)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::motion::tentacle::strokes::swim::SWIM;
    use crate::motion::tentacle::strokes::walk::WALK;

    const BETWEEN: [KeyInterpolation; 2] = [KeyInterpolation::Linear, KeyInterpolation::Smooth];

    /// The spec's table, in degrees.
    const TABLE: [(KeyAngles, [[f64; 4]; 3]); 2] = [
        (WALK, [[0.0, 25.0, -50.0, -75.0], [0.0, -120.0, 80.0, 100.0], [0.0, 30.0, -30.0, -60.0]]),
        (SWIM, [[0.0, 10.0, -80.0, -5.0], [0.0, 15.0, -5.0, -45.0], [0.0, 15.0, 0.0, -60.0]]),
    ];

    #[test]
    fn key_poses_match_the_table() {
        for (keys, table) in TABLE {
            for between in BETWEEN {
                for key in 0..4 {
                    let at = keys.at(between, f64::from(key) * FRAC_PI_2);
                    for (angle, row) in at.iter().zip(table) {
                        assert!((angle.to_degrees() - row[key as usize]).abs() < 1e-9, "{at:?} at {key}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_linear_interpolation_matches_the_thesis() {
        // (3.8) and (3.9) as printed, and (3.15) with its third slope corrected.
        let alpha_1 = |t: f64| match t / PI {
            x if x < 0.5 => 5.0 / 18.0 * t,
            x if x < 1.0 => 5.0 / 36.0 * PI - 5.0 / 6.0 * (t - 0.5 * PI),
            x if x < 1.5 => -5.0 / 18.0 * PI - 5.0 / 18.0 * (t - PI),
            _ => -5.0 / 12.0 * PI + 5.0 / 6.0 * (t - 1.5 * PI),
        };
        let beta_1 = |t: f64| match t / PI {
            x if x < 0.5 => t / 9.0,
            x if x < 1.0 => PI / 18.0 - (t - 0.5 * PI),
            x if x < 1.5 => -4.0 / 9.0 * PI + 5.0 / 6.0 * (t - PI),
            _ => -PI / 36.0 + (t - 1.5 * PI) / 18.0,
        };
        for step in 0..1000 {
            let t = TAU * f64::from(step) / 1000.0;
            assert!((WALK.at(KeyInterpolation::Linear, t)[0] - alpha_1(t)).abs() < 1e-12);
            assert!((SWIM.at(KeyInterpolation::Linear, t)[0] - beta_1(t)).abs() < 1e-12);
        }
    }

    #[test]
    fn angles_are_continuous_and_smooth_ones_twice_differentiable() {
        let h = 1e-4;
        for (keys, _) in TABLE {
            for step in 0..4000 {
                let t = TAU * f64::from(step) / 4000.0 - 1.0;
                for between in BETWEEN {
                    let [a, b] = [t - 1e-9, t + 1e-9].map(|t| keys.at(between, t));
                    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-7), "{between:?} at {t}");
                }
                let at = |ahead: f64| keys.at(KeyInterpolation::Smooth, t + ahead * h);
                let acceleration = |ahead: f64, target: usize| {
                    (at(ahead + 1.0)[target] - 2.0 * at(ahead)[target] + at(ahead - 1.0)[target]) / (h * h)
                };
                for target in 0..GROUPS {
                    let leap = acceleration(2.0, target) - acceleration(-2.0, target);
                    // The third derivative of the steepest piece is below 30 rad per rad^3.
                    assert!(leap.abs() < 4.0 * h * 30.0 + 1e-5, "leaps by {leap} at {t}");
                }
            }
        }
    }

    #[test]
    fn rounded_corners_are_parabolas_that_touch_the_lines() {
        let step = 1e-4;
        for (keys, _) in TABLE {
            let speed = |phase: f64| -> [f64; GROUPS] {
                let [before, after] = [phase - step, phase + step]
                    .map(|phase| keys.rounded_at(KeyInterpolation::Linear, phase));
                std::array::from_fn(|group| (after[group] - before[group]) / (2.0 * step))
            };
            for index in 0..4000 {
                let phase = TAU * f64::from(index) / 4000.0;
                let [exact, rounded] = [
                    keys.at(KeyInterpolation::Linear, phase),
                    keys.rounded_at(KeyInterpolation::Linear, phase),
                ];
                let off = phase / FRAC_PI_2 - (phase / FRAC_PI_2).round();
                for (group, (exact, rounded)) in exact.iter().zip(rounded).enumerate() {
                    let miss_deg = (exact - rounded).abs().to_degrees();
                    let most_deg = if off.abs() < ROUNDING_QUARTERS { 8.0 + 1e-9 } else { 1e-9 };
                    assert!(miss_deg <= most_deg, "{miss_deg} degrees at {phase}");
                    // 320 degrees per quarter of change within a fifth of a quarter.
                    let gain = (speed(phase + step)[group] - speed(phase)[group]).abs() / step;
                    let most = 320.0_f64.to_radians() / 0.2 / (FRAC_PI_2 * FRAC_PI_2);
                    assert!(gain <= most * 1.01, "{gain} a radian squared at {phase}");
                }
            }
        }
    }
}
