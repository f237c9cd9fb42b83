//! Pseudo-targets: the targets Q_1, Q_2 and Q_3 of the ends of an arm's groups (Ishizuka 2008, 3.1.3).

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use crate::model::GROUPS;

/// Turn of a pseudo-target in its parent's frame, rad. The thesis calls the three heading, pitch and bank.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Turn {
    /// Up, out of the x-y plane.
    pub lift: f64,
    /// To the left, about the parent's z.
    pub sweep: f64,
    /// About its own x, right-handed.
    pub twist: f64,
}

/// Width of the rounding of |F|, rad. An arm that leaves the straight bends as the square root of its shortening:
/// with the kink of |F| at 0 it would have to jump. The rounding changes the spacing by less than 1.8 %.
const ROUNDING_RAD: f64 = 0.4;

impl Turn {
    /// A turn by `angle` in the plane at `plane_rad` about x from level: at 0 it is all sweep, at pi/2 all lift.
    pub fn in_plane(angle: f64, plane_rad: f64) -> Turn {
        Turn { lift: angle * plane_rad.sin(), sweep: angle * plane_rad.cos(), twist: 0.0 }
    }

    /// Rotation from this pseudo-target's frame to its parent's. Lift and sweep together are one rotation
    /// about one axis across x, so that turns in one plane add up; the twist comes before it.
    pub fn rotation(self) -> DQuat {
        DQuat::from_scaled_axis(DVec3::new(0.0, -self.lift, self.sweep)) * DQuat::from_rotation_x(self.twist)
    }

    /// The angle F between its x and its parent's, rad.
    pub fn angle(self) -> f64 {
        self.lift.hypot(self.sweep)
    }
}

impl std::ops::Add for Turn {
    type Output = Turn;

    fn add(self, other: Turn) -> Turn {
        Turn {
            lift: self.lift + other.lift,
            sweep: self.sweep + other.sweep,
            twist: self.twist + other.twist,
        }
    }
}

/// The spacing of a pseudo-target from its parent, as the share 1 - |F| / (2 pi) of its group's length. The
/// thesis prints e = -|F| / (2 pi) (3.11) and calls e times the length the change of the spacing (3.12 to
/// 3.14). Ours is rounded at 0.
pub fn spacing_share(angle: f64) -> f64 {
    1.0 - angle * (angle / ROUNDING_RAD).tanh() / TAU
}

/// Q_1, Q_2 and Q_3 in the arm's frame, m: each lies off the one before along its own x, and rotates all that
/// follow.
pub fn places(group_lengths_m: [f64; GROUPS], turns: [Turn; GROUPS]) -> [DVec3; GROUPS] {
    let (mut place, mut rotation) = (DVec3::ZERO, DQuat::IDENTITY);
    std::array::from_fn(|group| {
        rotation *= turns[group].rotation();
        let spacing_m = group_lengths_m[group] * spacing_share(turns[group].angle());
        place += rotation * DVec3::X * spacing_m;
        place
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;

    const LENGTHS_M: [f64; GROUPS] = [1.97, 1.89, 1.81];

    #[test]
    fn a_straight_arm_ends_on_its_pseudo_targets() {
        let places = places(LENGTHS_M, [Turn::default(); GROUPS]);
        for (place, x) in places.iter().zip([1.97, 3.86, 5.67]) {
            assert!(place.distance(DVec3::X * x) < 1e-12, "{places:?}");
        }
    }

    #[test]
    fn lift_goes_up_and_sweep_left_and_spacing_shrinks_with_the_turn() {
        let up = Turn { lift: FRAC_PI_2, ..Turn::default() };
        let left = Turn { sweep: FRAC_PI_4, ..Turn::default() };
        let [first, second, third] = places(LENGTHS_M, [up, left, Turn::default()]);
        // Apart from the rounding, the first spacing is shorter by a quarter, the second by an eighth.
        assert!(first.distance(DVec3::Z * 1.97 * 0.75) < 1e-3);
        // The second turns in the first one's frame, whose x is up and whose y is still left.
        let ahead = (DVec3::Z + DVec3::Y).normalize();
        assert!(second.distance(first + ahead * 1.89 * 0.875) < 0.01);
        assert!(third.distance(second + ahead * 1.81) < 1e-12);
    }

    #[test]
    fn twist_turns_the_planes_of_later_hinges() {
        let twisted = Turn { twist: FRAC_PI_2, ..Turn::default() };
        let up = Turn { lift: 0.3, ..Turn::default() };
        let [_, second, _] = places(LENGTHS_M, [twisted, up, Turn::default()]);
        assert!(
            second.z.abs() < 1e-12 && second.y < -0.1,
            "right-handed about x, up becomes right: {second}"
        );
    }

    #[test]
    fn turns_in_one_plane_add_up() {
        for plane_rad in [0.0, 0.4, FRAC_PI_2, -2.0] {
            let turns = [0.4, -2.1, 0.5].map(|angle| Turn::in_plane(angle, plane_rad));
            let upright = [0.4, -2.1, 0.5].map(|angle| Turn::in_plane(angle, FRAC_PI_2));
            let rolled = DQuat::from_rotation_x(plane_rad - FRAC_PI_2);
            let pairs = places(LENGTHS_M, turns).into_iter().zip(places(LENGTHS_M, upright));
            for (place, in_upright) in pairs {
                assert!(place.distance(rolled * in_upright) < 1e-12 && in_upright.y.abs() < 1e-12);
            }
        }
    }

    #[test]
    fn rounding_differs_by_less_than_a_fiftieth() {
        for step in -3000..=3000 {
            let angle = f64::from(step) * 1e-3;
            let printed = 1.0 - angle.abs() / TAU;
            assert!((0.0..0.018).contains(&(spacing_share(angle) - printed)), "at {angle}");
        }
        assert!((spacing_share(0.0) - 1.0).abs() < 1e-15);
    }
}
