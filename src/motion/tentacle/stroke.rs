//! Strokes of one arm: how its pseudo-targets turn in walking, swimming and idle swaying (Ishizuka 2008, 3.3).

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::key_angles::{Between, KeyAngles, SWIM, WALK};
use super::pseudo_targets::{Turn, places};
use super::variation::Variation;
use crate::model::GROUPS;

/// Arms on one side of an octopus.
pub const ROLES: usize = 4;

/// How large the walking turns of each group are, by role, root group first. The fourth arm pushes and the first three
/// explore and support (2.2): they step more lightly at the root and feel about with the tip.
const WALK_GAINS: [[f64; GROUPS]; ROLES] =
    [[0.6, 0.8, 1.2], [0.7, 0.9, 1.1], [0.85, 1.0, 1.0], [1.0, 1.0, 1.0]];

/// How far behind the fourth arm's stroke each role's is, as a share of the stroke: a wave from rear to front.
const WALK_LAGS: [f64; ROLES] = [0.75, 0.5, 0.25, 0.0];

/// How much later the right side steps than the left.
const RIGHT_LAG: f64 = 0.5;

/// Largest turn of a group in idle swaying, root group first, rad.
const SWAY_RAD: [f64; GROUPS] = [0.18, 0.3, 0.42];

/// Strokes a sway's lift and sweep take, so that it comes back to nothing it did before.
const SWAY_RATES: [f64; 2] = [1.0, 0.618_033_988_749_895];

/// What an arm has to do with its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Place on its side, 1 (front) to 4 (rear).
    pub role: u8,
    /// True on the right.
    pub is_right: bool,
    /// Turn of the plane of walking strokes about the arm from level, rad: 0 is left-right, pi/2 up-down.
    pub walk_plane_rad: f64,
}

/// A stroke of key angles in a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyStroke {
    keys: KeyAngles,
    between: Between,
    plane_rad: f64,
    /// How far behind the rig's phase it is, rad.
    lag: f64,
}

/// Idle swaying: slow, and never twice the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sway {
    /// Where each group's lift and sweep begin, rad.
    begins: [[f64; 2]; GROUPS],
}

/// All strokes of one arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strokes {
    /// Walking.
    pub walk: KeyStroke,
    /// Swimming.
    pub swim: KeyStroke,
    /// Idle swaying.
    pub sway: Sway,
}

impl Strokes {
    /// Of an arm that has this `part`, varied by `variation`.
    pub fn new(part: Part, between: Between, mut variation: Variation) -> Strokes {
        let role = usize::from(part.role.clamp(1, 4)) - 1;
        let gains = WALK_GAINS[role];
        let mut walk = WALK;
        for (keys, gain) in walk.0.iter_mut().zip(gains) {
            keys.iter_mut().for_each(|key| *key *= gain);
        }
        let side_lag = if part.is_right { RIGHT_LAG } else { 0.0 };
        Strokes {
            walk: KeyStroke {
                keys: variation.varied(walk),
                between,
                plane_rad: part.walk_plane_rad,
                lag: TAU * (WALK_LAGS[role] + side_lag),
            },
            // All arms alike, upright (3.3.2).
            swim: KeyStroke { keys: variation.varied(SWIM), between, plane_rad: FRAC_PI_2, lag: 0.0 },
            sway: Sway { begins: [[(); 2]; GROUPS].map(|pair| pair.map(|()| variation.uniform(0.0, TAU))) },
        }
    }
}

impl KeyStroke {
    /// Turns of the pseudo-targets at `phase` (rad, one stroke is 2 pi) with `sweep_rad` towards a goal on the left
    /// (3.5), which the whole arm takes.
    pub fn turns(&self, phase: f64, sweep_rad: f64) -> [Turn; GROUPS] {
        let mut turns =
            self.keys.at(self.between, phase - self.lag).map(|angle| Turn::in_plane(angle, self.plane_rad));
        turns[0].sweep += sweep_rad;
        turns
    }

    /// Where the ends of groups of these lengths (m) are to be, arm frame, m.
    pub fn ends_in_arm(&self, group_lengths_m: [f64; GROUPS], phase: f64, sweep_rad: f64) -> [DVec3; GROUPS] {
        places(group_lengths_m, self.turns(phase, sweep_rad), self.between)
    }
}

impl Sway {
    /// Turns of the pseudo-targets at `phase`, rad, from the start on.
    pub fn turns(&self, phase: f64) -> [Turn; GROUPS] {
        std::array::from_fn(|group| {
            let [lift, sweep] = [0, 1].map(|way: usize| {
                // Groups nearer the tip follow those nearer the root.
                let behind = 0.9 * group as f64;
                SWAY_RAD[group] * (SWAY_RATES[way] * phase - behind + self.begins[0][way]).sin()
            });
            Turn { lift, sweep, twist: 0.0 }
        })
    }

    /// Where the ends of groups of these lengths (m) are to be, arm frame, m.
    pub fn ends_in_arm(&self, group_lengths_m: [f64; GROUPS], phase: f64) -> [DVec3; GROUPS] {
        places(group_lengths_m, self.turns(phase), Between::Smooth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTHS_M: [f64; GROUPS] = [1.97, 1.89, 1.81];

    fn strokes(role: u8, is_right: bool, walk_plane_rad: f64) -> Strokes {
        Strokes::new(Part { role, is_right, walk_plane_rad }, Between::Smooth, Variation::new(1, 0, 0.0))
    }

    #[test]
    fn a_fourth_arm_walks_by_the_thesis_key_angles_in_its_plane() {
        let walk = strokes(4, false, FRAC_PI_2).walk;
        for (key, quarter) in [0.0, 0.25, 0.5, 0.75].into_iter().enumerate() {
            let turns = walk.turns(TAU * quarter, 0.0);
            for (turn, keys) in turns.iter().zip(WALK.0) {
                assert!((turn.lift - keys[key]).abs() < 1e-12 && turn.sweep.abs() < 1e-12);
            }
        }
        let level = strokes(4, false, 0.0).walk.turns(1.0, 0.2);
        assert!(level.iter().all(|turn| turn.lift.abs() < 1e-12));
        assert!((level[0].sweep - strokes(4, false, 0.0).walk.turns(1.0, 0.0)[0].sweep - 0.2).abs() < 1e-12);
    }

    #[test]
    fn the_rear_pushes_and_sides_alternate() {
        let [front, rear] = [1, 4].map(|role| strokes(role, false, FRAC_PI_2).walk);
        let root_swing = |stroke: KeyStroke| {
            let lifts = (0..100).map(|step| stroke.turns(TAU * f64::from(step) / 100.0, 0.0)[0].lift);
            lifts.clone().fold(f64::MIN, f64::max) - lifts.fold(f64::MAX, f64::min)
        };
        assert!(root_swing(rear) > 1.4 * root_swing(front));
        let right = strokes(4, true, FRAC_PI_2).walk;
        let (a, b) = (rear.turns(1.0, 0.0), right.turns(1.0 + TAU / 2.0, 0.0));
        assert!(a.iter().zip(b).all(|(a, b)| (a.lift - b.lift).abs() < 1e-9));
    }

    #[test]
    fn swaying_stays_small_and_does_not_repeat() {
        let sway = strokes(1, false, 0.0).sway;
        let begin = sway.ends_in_arm(LENGTHS_M, 0.0);
        for step in 1..2000 {
            let phase = 0.05 * f64::from(step);
            let turns = sway.turns(phase);
            assert!(turns.iter().zip(SWAY_RAD).all(|(turn, most)| turn.angle() <= most * 2.0_f64.sqrt()));
            let ends = sway.ends_in_arm(LENGTHS_M, phase);
            assert!(phase < 1.0 || ends[2].distance(begin[2]) > 1e-3, "at {phase}");
        }
    }
}
