//! Walking: each arm in its own role (Ishizuka 2008, 3.3.1).

use std::f64::consts::{PI, TAU};

use super::{Needs, Shown, StrokeKind};
use crate::model::GROUPS;
use crate::motion::tentacle::key_angles::{KeyAngles, KeyInterpolation};
use crate::motion::tentacle::key_stroke::{KeyStroke, Part};
use crate::motion::tentacle::rhythm::Rhythm;
use crate::motion::tentacle::variation::Variation;

/// The stroke.
pub const KIND: StrokeKind = StrokeKind {
    name: "walk",
    meaning: "lift, reach, press and push (Ishizuka 2008, 3.3.1); the fourth arm of each side pushes, the others \
              explore and support",
    key: Some('2'),
    needs: Needs::Nothing,
    is_rhythmic: true,
    shown: Some(Shown { strokes: 3.0, hold_s: 0.0 }),
    make: |rig| {
        Box::new(Rhythm::new("walk", rig, |arm, between| of_arm(arm.part, between, arm.variation.clone())))
    },
};

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

/// Walking (3.8 to 3.10): lift, reach, press and push.
pub const WALK: KeyAngles = KeyAngles([
    [0.0, 5.0 / 36.0 * PI, -5.0 / 18.0 * PI, -5.0 / 12.0 * PI],
    [0.0, -2.0 / 3.0 * PI, 4.0 / 9.0 * PI, 5.0 / 9.0 * PI],
    [0.0, PI / 6.0, -PI / 6.0, -PI / 3.0],
]);

/// The walk of an arm with this role, its key angles varied.
pub fn of_arm(part: Part, between: KeyInterpolation, mut variation: Variation) -> KeyStroke {
    let role = usize::from(part.role.clamp(1, 4)) - 1;
    let gains = WALK_GAINS[role];
    let mut keys = WALK;
    for (keys, gain) in keys.0.iter_mut().zip(gains) {
        keys.iter_mut().for_each(|key| *key *= gain);
    }
    let side_lag = if part.is_right { RIGHT_LAG } else { 0.0 };
    KeyStroke {
        keys: variation.varied(keys),
        between,
        plane_rad: part.walk_plane_rad,
        lag: TAU * (WALK_LAGS[role] + side_lag),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn walk(role: u8, is_right: bool, walk_plane_rad: f64) -> KeyStroke {
        of_arm(Part { role, is_right, walk_plane_rad }, KeyInterpolation::Smooth, Variation::new(1, 0, 0.0))
    }

    #[test]
    fn a_fourth_arm_walks_by_the_thesis_key_angles_in_its_plane() {
        let walk = self::walk(4, false, FRAC_PI_2);
        for (key, quarter) in [0.0, 0.25, 0.5, 0.75].into_iter().enumerate() {
            let turns = walk.turns(TAU * quarter, 0.0);
            for (turn, keys) in turns.iter().zip(WALK.0) {
                assert!((turn.lift - keys[key]).abs() < 1e-12 && turn.sweep.abs() < 1e-12);
            }
        }
        let level = self::walk(4, false, 0.0).turns(1.0, 0.2);
        assert!(level.iter().all(|turn| turn.lift.abs() < 1e-12));
        assert!((level[0].sweep - self::walk(4, false, 0.0).turns(1.0, 0.0)[0].sweep - 0.2).abs() < 1e-12);
    }

    #[test]
    fn the_rear_pushes_and_sides_alternate() {
        let [front, rear] = [1, 4].map(|role| walk(role, false, FRAC_PI_2));
        let root_swing = |stroke: KeyStroke| {
            let lifts = (0..100).map(|step| stroke.turns(TAU * f64::from(step) / 100.0, 0.0)[0].lift);
            lifts.clone().fold(f64::MIN, f64::max) - lifts.fold(f64::MAX, f64::min)
        };
        assert!(root_swing(rear) > 1.4 * root_swing(front));
        let right = walk(4, true, FRAC_PI_2);
        let (a, b) = (rear.turns(1.0, 0.0), right.turns(1.0 + TAU / 2.0, 0.0));
        assert!(a.iter().zip(b).all(|(a, b)| (a.lift - b.lift).abs() < 1e-9));
    }
}
