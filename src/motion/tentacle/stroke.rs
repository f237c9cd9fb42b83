//! Strokes of one arm: how its pseudo-targets turn in walking, swimming and idle swaying (Ishizuka 2008, 3.3).

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DQuat, DVec3};

use super::key_angles::{KeyAngles, KeyInterpolation, SWIM, WALK};
use super::pseudo_targets::{Turn, places};
use super::variation::Variation;
use crate::model::GROUPS;

/// Arms on one side of an octopus.
pub const ROLES: usize = 4;

/// Size of the walking turns of each group, by role, root group first. The fourth arm pushes, and the first
/// three explore and support (2.2): they step more lightly at the root and feel about with the tip.
const WALK_GAINS: [[f64; GROUPS]; ROLES] =
    [[0.6, 0.8, 1.2], [0.7, 0.9, 1.1], [0.85, 1.0, 1.0], [1.0, 1.0, 1.0]];

/// Delay of each role's stroke behind the fourth arm's, as a share of the stroke: a wave from rear to front.
const WALK_LAGS: [f64; ROLES] = [0.75, 0.5, 0.25, 0.0];

/// Delay of the right side's steps behind the left side's.
const RIGHT_LAG: f64 = 0.5;

/// Lift in the middle of idle swaying, rad, for all joints together.
const SWAY_LIFT_RAD: f64 = 0.6;
/// Amplitude of lift and sweep about that, for all joints together, rad.
const SWAY_RAD: f64 = 0.9;
/// Phase by which the waves of a sway are ahead at the root of those at the tip, rad.
const SWAY_WAVE_RAD: f64 = 4.0;
/// A joint's bend at the root as a share of that at the tip.
const SWAY_ROOT_SHARE: f64 = 0.4;

/// Rates of a sway's lift and sweep, per stroke: the pattern never repeats.
const SWAY_RATES: [f64; 2] = [1.0, 0.618_033_988_749_895];

/// Role of an arm among its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Position on its side, 1 (front) to 4 (rear).
    pub role: u8,
    /// True on the right.
    pub is_right: bool,
    /// Rotation of the plane of walking strokes about the arm from level, rad: 0 is left-right, pi/2 up-down.
    pub walk_plane_rad: f64,
}

/// A stroke of key angles in a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyStroke {
    keys: KeyAngles,
    between: KeyInterpolation,
    plane_rad: f64,
    /// Delay behind the robot's phase, rad.
    lag: f64,
}

/// Idle swaying: waves of bend that run down the arm and never repeat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sway {
    /// Initial phase of lift and sweep, rad.
    begins: [f64; 2],
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
    /// Strokes of an arm with this `part`, varied by `variation`.
    pub fn new(part: Part, between: KeyInterpolation, mut variation: Variation) -> Strokes {
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
            sway: Sway { begins: [(); 2].map(|()| variation.uniform(0.0, TAU)) },
        }
    }
}

impl KeyStroke {
    /// Turns of the pseudo-targets at `phase` (rad, one stroke is 2 pi), with `sweep_rad` towards a goal on
    /// the left (3.5), which the whole arm takes.
    pub fn turns(&self, phase: f64, sweep_rad: f64) -> [Turn; GROUPS] {
        let mut turns = self
            .keys
            .rounded_at(self.between, phase - self.lag)
            .map(|angle| Turn::in_plane(angle, self.plane_rad));
        turns[0].sweep += sweep_rad;
        turns
    }

    /// Target ends of groups of these lengths (m), arm frame, m.
    pub fn ends_in_arm(&self, group_lengths_m: [f64; GROUPS], phase: f64, sweep_rad: f64) -> [DVec3; GROUPS] {
        places(group_lengths_m, self.turns(phase, sweep_rad))
    }
}

impl Sway {
    /// Writes the ends of links of these lengths (m) at `phase`, rad from the start on, arm frame, m.
    pub fn write(&self, phase: f64, links_m: impl Iterator<Item = f64>, places: &mut [DVec3]) {
        let (mut place, mut rotation) = (DVec3::ZERO, DQuat::IDENTITY);
        let count = places.len() as f64;
        for (index, (link_m, end)) in links_m.zip(places).enumerate() {
            let along = index as f64 / count;
            let share = (SWAY_ROOT_SHARE + (1.0 - SWAY_ROOT_SHARE) * along) / count;
            let wave =
                |way: usize| (SWAY_RATES[way] * phase - SWAY_WAVE_RAD * along + self.begins[way]).sin();
            let turn = Turn {
                lift: share * (SWAY_LIFT_RAD + SWAY_RAD * wave(0)),
                sweep: share * SWAY_RAD * wave(1),
                twist: 0.0,
            };
            rotation *= turn.rotation();
            place += rotation * DVec3::X * link_m;
            *end = place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strokes(role: u8, is_right: bool, walk_plane_rad: f64) -> Strokes {
        Strokes::new(
            Part { role, is_right, walk_plane_rad },
            KeyInterpolation::Smooth,
            Variation::new(1, 0, 0.0),
        )
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
    fn swaying_is_gentle_and_does_not_repeat() {
        let sway = strokes(1, false, 0.0).sway;
        let links_m = [0.034; 12];
        let mut places = [DVec3::ZERO; 12];
        let mut at = |phase: f64| {
            sway.write(phase, links_m.into_iter(), &mut places);
            places
        };
        let begin = at(0.0);
        for step in 1..2000 {
            let phase = 0.05 * f64::from(step);
            let (now, next) = (at(phase), at(phase + 0.05));
            let lengths = now.windows(2).map(|pair| pair[0].distance(pair[1]));
            assert!(lengths.into_iter().all(|length| (length - 0.034).abs() < 1e-12));
            // No joint bends by more than a tenth of a turn, and the tip moves by less than half the arm per
            // radian.
            assert!(
                now.windows(3).all(|three| (three[1] - three[0]).angle_between(three[2] - three[1]) < 0.3)
            );
            assert!(now[11].distance(next[11]) < 0.5 * 12.0 * 0.034 * 0.05);
            assert!(phase < 1.0 || now[11].distance(begin[11]) > 1e-5, "at {phase}");
        }
    }
}
