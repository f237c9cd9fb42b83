//! The range of motion of a ball joint: how far it may swing, and how far it may twist there.
//!
//! A rotation is a swing, which takes the link's rest direction X to where it points, after a twist about X.
//! The swing is a vector in the plane normal to X: it lies along the swing's axis and is sin(gamma / 2) long,
//! gamma being the angle. The permitted rotations lie over a polygon of that plane, between two surfaces of
//! twist: triangular prisms with slanted ends (paper on falling figures, 3.1). Input: a rotation in the
//! joint's rest frame. Output: the nearest that is permitted, first in swing, then in twist.

use glam::{DQuat, DVec2};
use thiserror::Error;

/// A rotation in two parts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SwingTwist {
    /// Axis of the swing, y and z in the rest frame, times the sine of half its angle; length at most 1.
    pub swing: DVec2,
    /// Rotation about the link itself before the swing, right-handed, -pi to pi, rad.
    pub twist_rad: f64,
}

/// A corner of the range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// The swing, as in [`SwingTwist`].
    pub swing: DVec2,
    /// Lowest and highest twist there, rad; between corners they change linearly.
    pub twist_rad: (f64, f64),
}

/// Reasons why a range is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum BallJointError {
    /// No area.
    #[error("a range needs at least 3 corners that are not in one line, not {0}")]
    NoArea(usize),
    /// A corner that is not a valid swing.
    #[error("corner {0}: a swing is at most 1 long, the sine of half its angle")]
    TooLong(usize),
    /// Twist limits in the wrong order, or beyond half a turn.
    #[error("corner {0}: the lowest twist first, then the highest, from -180 to 180 degrees")]
    Twist(usize),
    /// A border that crosses itself.
    #[error("the sides that begin at corners {0} and {1} cross")]
    Crossing(usize, usize),
}

/// The range of a ball joint. Its corners go round it counter-clockwise, as seen from the tip of X.
#[derive(Debug, Clone, PartialEq)]
pub struct BallJoint {
    corners: Vec<Corner>,
    /// Prisms: indices of three corners, counter-clockwise.
    triangles: Vec<[usize; 3]>,
}

impl SwingTwist {
    /// The swing of one rotation by `lift` up and `sweep` to the left (rad; for an arm's joint, whose x is the
    /// link's direction, y left and z up): about one axis, by the root of the sum of their squares, at most pi.
    pub fn swing_to(lift: f64, sweep: f64) -> DVec2 {
        let angle = lift.hypot(sweep);
        if angle > 0.0 { DVec2::new(-lift, sweep) * ((0.5 * angle).sin() / angle) } else { DVec2::ZERO }
    }

    /// The parts of `turn`, a unit quaternion. If the link points straight back, swing and twist cannot be
    /// told apart: the twist is 0 there.
    pub fn of(turn: DQuat) -> SwingTwist {
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let length = turn.w.hypot(turn.x);
        if length < f64::MIN_POSITIVE {
            return SwingTwist { swing: DVec2::new(turn.y, turn.z), twist_rad: 0.0 };
        }
        let (cosine, sine) = (turn.w / length, turn.x / length);
        SwingTwist {
            swing: DVec2::new(turn.y * cosine - turn.z * sine, turn.z * cosine + turn.y * sine),
            twist_rad: 2.0 * turn.x.atan2(turn.w),
        }
    }

    /// The rotation that the two parts make.
    pub fn turn(self) -> DQuat {
        let DVec2 { x: y, y: z } = self.swing;
        DQuat::from_xyzw(0.0, y, z, (1.0 - y * y - z * z).max(0.0).sqrt())
            * DQuat::from_rotation_x(self.twist_rad)
    }
}

impl BallJoint {
    /// The range with these corners, in either direction round it.
    pub fn new(mut corners: Vec<Corner>) -> Result<BallJoint, BallJointError> {
        for (index, corner) in corners.iter().enumerate() {
            let is_swing = corner.swing.length() <= 1.0;
            let (low, high) = corner.twist_rad;
            let is_twist = -std::f64::consts::PI <= low && low <= high && high <= std::f64::consts::PI;
            if !is_swing {
                return Err(BallJointError::TooLong(index));
            }
            if !is_twist {
                return Err(BallJointError::Twist(index));
            }
        }
        let count = corners.len();
        let doubled_area: f64 =
            (0..count).map(|i| corners[i].swing.perp_dot(corners[(i + 1) % count].swing)).sum();
        if count < 3 || doubled_area.abs() < 1e-9 {
            return Err(BallJointError::NoArea(count));
        }
        if let Some((a, b)) = crossing(&corners) {
            return Err(BallJointError::Crossing(a, b));
        }
        if doubled_area < 0.0 {
            corners.reverse();
        }
        let triangles = triangulate(&corners);
        Ok(BallJoint { corners, triangles })
    }

    /// Its corners, counter-clockwise.
    pub fn corners(&self) -> &[Corner] {
        &self.corners
    }

    /// True if the joint may swing to `swing`.
    pub fn has_swing(&self, swing: DVec2) -> bool {
        self.triangles.iter().any(|triangle| self.shares(*triangle, swing).iter().all(|share| *share >= 0.0))
    }

    /// The permitted swing nearest to `swing`.
    pub fn nearest_swing(&self, swing: DVec2) -> DVec2 {
        if self.has_swing(swing) {
            return swing;
        }
        let mut nearest = (f64::INFINITY, swing);
        for (index, corner) in self.corners.iter().enumerate() {
            let next = self.corners[(index + 1) % self.corners.len()].swing;
            let side = next - corner.swing;
            let along = ((swing - corner.swing).dot(side) / side.length_squared()).clamp(0.0, 1.0);
            let place = corner.swing + along * side;
            let square = place.distance_squared(swing);
            if square < nearest.0 {
                nearest = (square, place);
            }
        }
        nearest.1
    }

    /// Lowest and highest twist at a permitted `swing`, rad.
    pub fn twist_range_rad(&self, swing: DVec2) -> (f64, f64) {
        // On a border, rounding may put it just outside: take the prism that it is least outside of.
        let mut best = (f64::NEG_INFINITY, [0; 3], [0.0; 3]);
        for &triangle in &self.triangles {
            let shares = self.shares(triangle, swing);
            let least = shares.iter().fold(f64::INFINITY, |least, share| least.min(*share));
            if least > best.0 {
                best = (least, triangle, shares);
            }
        }
        let (_, triangle, shares) = best;
        let mean = |limit: fn(&Corner) -> f64| -> f64 {
            triangle.iter().zip(shares).map(|(corner, share)| share * limit(&self.corners[*corner])).sum()
        };
        (mean(|corner| corner.twist_rad.0), mean(|corner| corner.twist_rad.1))
    }

    /// The permitted rotation nearest to `turn`: nearest in swing, then in twist.
    pub fn nearest(&self, turn: SwingTwist) -> SwingTwist {
        let swing = self.nearest_swing(turn.swing);
        let (low, high) = self.twist_range_rad(swing);
        SwingTwist { swing, twist_rad: turn.twist_rad.clamp(low, high.max(low)) }
    }

    /// `turn` after a soft stop: unchanged further than `margin_rad` from the border on the way there from
    /// rest, slowed down beyond that, and never on the border ([`soft_stop`]).
    pub fn softened(&self, turn: SwingTwist, margin_rad: f64) -> SwingTwist {
        let length = turn.swing.length();
        let border = self.border_on_the_way_to(turn.swing);
        let swing = if border < f64::INFINITY && length > 0.0 {
            turn.swing * (soft_stop(length, border, (0.5 * margin_rad).sin()) / length)
        } else {
            turn.swing
        };
        let (low, high) = self.twist_range_rad(swing);
        SwingTwist { swing, twist_rad: soft_range(turn.twist_rad, (low, high), margin_rad) }
    }

    /// Distance from rest to the first crossing of the border in the direction of `swing`; infinite if there
    /// is none.
    fn border_on_the_way_to(&self, swing: DVec2) -> f64 {
        let Some(way) = swing.try_normalize() else { return f64::INFINITY };
        let mut nearest = f64::INFINITY;
        for (index, corner) in self.corners.iter().enumerate() {
            let side = self.corners[(index + 1) % self.corners.len()].swing - corner.swing;
            let across = way.perp_dot(side);
            let (distance, share) =
                (corner.swing.perp_dot(side) / across, corner.swing.perp_dot(way) / across);
            if distance > 0.0 && (0.0..=1.0).contains(&share) {
                nearest = nearest.min(distance);
            }
        }
        nearest
    }

    /// Weights of the three corners at a point in a triangle's plane; all positive inside.
    fn shares(&self, [a, b, c]: [usize; 3], swing: DVec2) -> [f64; 3] {
        let [a, b, c] = [a, b, c].map(|corner| self.corners[corner].swing);
        let scale = 1.0 / (b - a).perp_dot(c - a);
        let at_b = (swing - a).perp_dot(c - a) * scale;
        let at_c = (b - a).perp_dot(swing - a) * scale;
        [1.0 - at_b - at_c, at_b, at_c]
    }
}

/// How far a joint moves when asked to go `way` towards a stop at `end`, both 0 or more: all the way up to
/// `margin` before the stop; beyond that less and less, as if against a stiffening spring, and never quite to
/// the stop. The speed is continuous where this begins.
pub fn soft_stop(way: f64, end: f64, margin: f64) -> f64 {
    let margin = margin.min(0.5 * end);
    let past = way - (end - margin);
    if past > 0.0 && margin > 0.0 { end - margin + margin * past / (past + margin) } else { way.min(end) }
}

/// The `angle` between two such stops.
pub fn soft_range(angle: f64, (low, high): (f64, f64), margin: f64) -> f64 {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let from_middle = angle - middle;
    middle + soft_stop(from_middle.abs(), half, margin).copysign(from_middle)
}

/// The first two sides that cross or touch, other than neighbours at their common corner.
fn crossing(corners: &[Corner]) -> Option<(usize, usize)> {
    let count = corners.len();
    let side = |index: usize| (corners[index].swing, corners[(index + 1) % count].swing);
    let is_left = |(a, b): (DVec2, DVec2), point: DVec2| (b - a).perp_dot(point - a) > 0.0;
    for first in 0..count {
        for second in first + 2..count {
            if (second + 1) % count == first {
                continue;
            }
            let (p, q) = (side(first), side(second));
            if is_left(p, q.0) != is_left(p, q.1) && is_left(q, p.0) != is_left(q, p.1) {
                return Some((first, second));
            }
        }
    }
    None
}

/// Triangulates a counter-clockwise polygon by cutting off one ear after the other.
fn triangulate(corners: &[Corner]) -> Vec<[usize; 3]> {
    let area = |[a, b, c]: [usize; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| corners[corner].swing);
        (b - a).perp_dot(c - a)
    };
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut triangles = Vec::new();
    while left.len() > 2 {
        let count = left.len();
        let at = |index: usize| left[index % count];
        let is_ear = |index: usize| {
            let ear = [at(index), at(index + 1), at(index + 2)];
            let holds = |corner: &usize| {
                let [a, b, c] = ear;
                [[a, b, *corner], [b, c, *corner], [c, a, *corner]].into_iter().all(|side| area(side) >= 0.0)
            };
            area(ear) > 0.0 && !left.iter().any(|corner| !ear.contains(corner) && holds(corner))
        };
        // A polygon that does not cross itself always has an ear; corners in line with their neighbours have
        // no area.
        let ear = (0..count).find(|index| is_ear(*index)).unwrap_or(0);
        let triangle = [at(ear), at(ear + 1), at(ear + 2)];
        if area(triangle) > 0.0 {
            triangles.push(triangle);
        }
        left.remove((ear + 1) % count);
    }
    triangles
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;

    /// A shoulder whose range is not convex and not centred on the rest direction.
    fn shoulder() -> BallJoint {
        let corner =
            |y: f64, z: f64, low: f64, high: f64| Corner { swing: DVec2::new(y, z), twist_rad: (low, high) };
        BallJoint::new(vec![
            corner(-0.6, -0.2, -1.0, 0.5),
            corner(0.1, -0.5, -0.3, 0.9),
            corner(0.7, -0.1, -1.2, 1.2),
            corner(0.3, 0.1, -0.1, 0.2),
            corner(0.5, 0.6, -0.5, 0.5),
            corner(-0.3, 0.4, 0.1, 1.5),
        ])
        .unwrap()
    }

    /// Random rotations, uniformly distributed.
    fn turns(count: usize) -> impl Iterator<Item = DQuat> {
        let mut source = Pcg64Mcg::seed_from_u64(3);
        let mut share = move || (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        (0..count).map(move |_| {
            let (u, a, b) = (share(), TAU * share(), TAU * share());
            let (p, q) = ((1.0 - u).sqrt(), u.sqrt());
            DQuat::from_xyzw(p * a.sin(), p * a.cos(), q * b.sin(), q * b.cos())
        })
    }

    /// True if a point is inside the polygon: sums the angles between its corners as seen from the point.
    fn winds_round(corners: &[Corner], point: DVec2) -> bool {
        let angle = |i: usize| {
            let (a, b) = (corners[i].swing - point, corners[(i + 1) % corners.len()].swing - point);
            a.perp_dot(b).atan2(a.dot(b))
        };
        (0..corners.len()).map(angle).sum::<f64>().abs() > PI
    }

    #[test]
    fn a_hundred_thousand_rotations_stay_inside_or_move_to_the_nearest_point_of_the_border() {
        let range = shoulder();
        let corners = range.corners();
        // Steps of less than a thousandth while the longest side is shorter than 1.
        let (steps, step) = (1000, 1e-3);
        let border: Vec<DVec2> = (0..corners.len())
            .flat_map(|i| {
                let (a, b) = (corners[i].swing, corners[(i + 1) % corners.len()].swing);
                (0..=steps).map(move |s| a.lerp(b, f64::from(s) / f64::from(steps)))
            })
            .collect();
        let (mut inside, mut searched) = (0, 0);
        for (index, turn) in turns(100_000).enumerate() {
            let parts = SwingTwist::of(turn);
            let nearest = range.nearest(parts);
            let (low, high) = range.twist_range_rad(nearest.swing);
            assert!((low..=high).contains(&nearest.twist_rad));
            if winds_round(corners, parts.swing) {
                inside += 1;
                assert_eq!(nearest.swing, parts.swing);
                if (low..=high).contains(&parts.twist_rad) {
                    assert_eq!(nearest, parts);
                }
            } else if index % 10 == 0 {
                searched += 1;
                let square = |place: &DVec2| place.distance_squared(parts.swing);
                let least = border.iter().map(square).fold(f64::INFINITY, f64::min).sqrt();
                let found = nearest.swing.distance(parts.swing);
                assert!(found <= least + 1e-9 && found >= least - step, "{found}, by search {least}");
            }
            // The result is in range, and does not change if projected again.
            assert!(range.nearest(nearest).swing.distance(nearest.swing) < 1e-12);
        }
        assert!(inside > 10_000 && searched > 5000, "{inside} inside, {searched} searched");
    }

    #[test]
    fn swing_and_twist_compose_to_the_rotation_they_came_from() {
        for turn in turns(100_000) {
            let parts = SwingTwist::of(turn);
            if 2.0 * parts.swing.length().min(1.0).asin() > PI - 1e-3 {
                continue;
            }
            let again = parts.turn();
            let again = if again.dot(turn) < 0.0 { -again } else { again };
            assert!((again - turn).length() < 1e-9, "{turn} became {again}");
            let parts_again = SwingTwist::of(again);
            assert!(parts_again.swing.distance(parts.swing) < 1e-9);
            assert!((parts_again.twist_rad - parts.twist_rad).sin().abs() < 1e-9);
            // The swing alone points the link in the same direction as the whole rotation.
            let pointed = SwingTwist { twist_rad: 0.0, ..parts }.turn() * glam::DVec3::X;
            assert!(pointed.distance(turn * glam::DVec3::X) < 1e-9);
        }
    }

    #[test]
    fn a_soft_stop_slows_smoothly_and_never_passes_the_border() {
        let range = shoulder();
        let margin = 10_f64.to_radians();
        for turn in turns(10_000) {
            let asked = SwingTwist::of(turn);
            let soft = range.softened(asked, margin);
            assert!(range.nearest(soft).swing.distance(soft.swing) < 1e-12, "{asked:?} became {soft:?}");
            // The same direction from rest, and no further than asked.
            assert!(soft.swing.perp_dot(asked.swing).abs() < 1e-12);
            assert!(soft.swing.length() <= asked.swing.length() + 1e-15);
        }
        // A joint that swings out at a constant speed: its speed falls steadily to zero.
        let way = DVec2::new(0.2, 0.25);
        let at = |share: f64| {
            range.softened(SwingTwist { swing: way * share, twist_rad: 0.2 }, margin).swing.length()
        };
        let (step, mut before) = (1e-3, way.length());
        for place in 0..3000 {
            let share = f64::from(place) * step;
            let speed = (at(share + step) - at(share)) / step;
            assert!(speed >= 0.0 && speed <= before + 1e-9, "at {share}");
            assert!(before - speed < 0.02, "the speed leaps at {share}");
            before = speed;
        }
        assert!(before < 0.1 * way.length());
    }

    #[test]
    fn twist_limits_are_linear_between_those_of_the_corners() {
        let range = shoulder();
        for corner in range.corners() {
            let (low, high) = range.twist_range_rad(corner.swing);
            assert!((low - corner.twist_rad.0).abs() < 1e-12 && (high - corner.twist_rad.1).abs() < 1e-12);
        }
        let (a, b) = (range.corners()[1], range.corners()[2]);
        let (low, high) = range.twist_range_rad(a.swing.lerp(b.swing, 0.25));
        assert!((low - (0.75 * a.twist_rad.0 + 0.25 * b.twist_rad.0)).abs() < 1e-12);
        assert!((high - (0.75 * a.twist_rad.1 + 0.25 * b.twist_rad.1)).abs() < 1e-12);
    }

    #[test]
    fn prisms_fill_the_polygon() {
        let range = shoulder();
        let area = |corners: &[DVec2]| -> f64 {
            (0..corners.len()).map(|i| corners[i].perp_dot(corners[(i + 1) % corners.len()])).sum::<f64>()
                / 2.0
        };
        let whole = area(&range.corners().iter().map(|corner| corner.swing).collect::<Vec<_>>());
        let prisms: f64 = range.triangles.iter().map(|ids| area(&ids.map(|i| range.corners[i].swing))).sum();
        assert!((whole - prisms).abs() < 1e-12, "{whole}, prisms {prisms}");
        assert_eq!(range.triangles.len(), 4);
    }

    #[test]
    fn an_impossible_range_is_refused_with_its_reason() {
        let corner = |y, z| Corner { swing: DVec2::new(y, z), twist_rad: (-0.1, 0.1) };
        let square = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
        assert!(BallJoint::new(square.to_vec()).is_ok());
        assert_eq!(BallJoint::new(square[..2].to_vec()), Err(BallJointError::NoArea(2)));
        let bow = vec![square[0], square[2], square[1], square[3]];
        assert!(matches!(BallJoint::new(bow), Err(BallJointError::Crossing(..) | BallJointError::NoArea(_))));
        let mut long = square;
        long[1].swing.x = 1.2;
        assert_eq!(BallJoint::new(long.to_vec()), Err(BallJointError::TooLong(1)));
        let mut twisted = square;
        twisted[2].twist_rad = (0.2, f64::NAN);
        assert_eq!(BallJoint::new(twisted.to_vec()), Err(BallJointError::Twist(2)));
    }
}
