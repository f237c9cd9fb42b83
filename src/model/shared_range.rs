//! Hinges in one place that share the range of a ball joint: the joint rotation their angles make, and angles
//! that keep it in range.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use glam::{DQuat, DVec3};

use super::ball_joint::SwingTwist;
use super::{BallJoint, Joint, Robot, hinges_in_place};

/// Most hinges of one joint.
const HINGES_MAX: usize = 3;
/// A pose this far outside, in swing or twist (rad), counts as inside: it is rounding.
const ROUNDING: f64 = 1e-9;
/// Halvings to find how much of a way is inside.
const HALVINGS: u32 = 24;

/// Coordinate axis of its own frame about which an arm's hinge turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Along the link: a twist.
    X,
    /// To the left.
    Y,
    /// Up.
    Z,
}

impl Axis {
    /// The axis of `joint`, and 1, or -1 if it turns about it backwards.
    pub fn of(joint: &Joint) -> (Axis, f64) {
        let (axis, along) = match joint.axis.abs().max_position() {
            0 => (Axis::X, joint.axis.x),
            1 => (Axis::Y, joint.axis.y),
            _ => (Axis::Z, joint.axis.z),
        };
        (axis, along.signum())
    }

    /// The rotation about this axis by `angle`, rad.
    pub fn turn(self, angle: f64) -> DQuat {
        match self {
            Axis::X => DQuat::from_rotation_x(angle),
            Axis::Y => DQuat::from_rotation_y(angle),
            Axis::Z => DQuat::from_rotation_z(angle),
        }
    }

    /// The rotation about this axis that brings x closest to `way`, in the hinge's frame, rad; 0 for a twist.
    pub fn aim(self, way: DVec3) -> f64 {
        match self {
            Axis::X => 0.0,
            Axis::Y => (-way.z).atan2(way.x),
            Axis::Z => way.y.atan2(way.x),
        }
    }
}

/// The range that the hinges of one joint share.
#[derive(Debug, Clone)]
pub struct SharedRange {
    hinges: [(Axis, f64); HINGES_MAX],
    /// The hinges' own ranges, rad.
    ranges_rad: [(f64, f64); HINGES_MAX],
    count: usize,
    range: BallJoint,
}

impl SharedRange {
    /// The `range` that these hinges share; there are at most three.
    pub fn new(hinges: &[Joint], range: BallJoint) -> SharedRange {
        let mut all = [(Axis::X, 1.0); HINGES_MAX];
        let mut ranges_rad = [(0.0, 0.0); HINGES_MAX];
        for ((axis, range_rad), joint) in all.iter_mut().zip(&mut ranges_rad).zip(hinges) {
            (*axis, *range_rad) = (Axis::of(joint), joint.range_rad);
        }
        SharedRange { hinges: all, ranges_rad, count: hinges.len().min(HINGES_MAX), range }
    }

    /// All shared ranges of `robot`, with the joints that share them.
    pub fn of_robot(robot: &Robot) -> Vec<(Range<usize>, SharedRange)> {
        let of_chain = |chain: &super::Chain| {
            let first = chain.joints.start;
            let of_chain = SharedRange::of_chain(robot.joints_of(chain)).into_iter();
            of_chain
                .map(|(hinges, shared)| (first + hinges.start..first + hinges.end, shared))
                .collect::<Vec<_>>()
        };
        robot.chains.iter().flat_map(of_chain).collect()
    }

    /// The shared ranges of a chain with these `joints`, counted from its root.
    pub fn of_chain(joints: &[Joint]) -> Vec<(Range<usize>, SharedRange)> {
        let shared = |(last, joint): (usize, &Joint)| {
            let hinges = hinges_in_place(joints, last);
            let shared = SharedRange::new(&joints[hinges.clone()], joint.ball.clone()?);
            Some((hinges, shared))
        };
        joints.iter().enumerate().filter_map(shared).collect()
    }

    fn axes(&self) -> &[(Axis, f64)] {
        &self.hinges[..self.count]
    }

    /// Swing and twist of the joint at these hinge angles (rad).
    fn parts(&self, angles: &[f64]) -> SwingTwist {
        let turn = self
            .axes()
            .iter()
            .zip(angles)
            .fold(DQuat::IDENTITY, |turn, ((axis, sense), angle)| turn * axis.turn(sense * angle));
        SwingTwist::of(turn)
    }

    /// False for two hinges: their twist follows from their swing.
    fn can_twist(&self) -> bool {
        self.axes().iter().any(|(axis, _)| *axis == Axis::X)
    }

    /// The rotation nearest to `asked` that is in the range. The twist of two hinges follows from their swing.
    fn nearest(&self, asked: SwingTwist) -> SwingTwist {
        let mut held = self.range.nearest(asked);
        if !self.can_twist() {
            held.twist_rad = asked.twist_rad;
        }
        held
    }

    /// How far outside the range the hinges are at these `angles` (rad): in swing or in twist (rad),
    /// whichever is larger.
    pub fn outside_by(&self, angles: &[f64]) -> f64 {
        let asked = self.parts(angles);
        let held = self.nearest(asked);
        held.swing.distance(asked.swing).max((held.twist_rad - asked.twist_rad).abs())
    }

    /// True if the hinges are inside the range at these `angles` (rad).
    pub fn holds(&self, angles: &[f64]) -> bool {
        self.outside_by(angles) <= ROUNDING
    }

    /// Moves `angles` (rad) that are outside to the nearest border; returns true if they were outside.
    pub fn bring_in(&self, angles: &mut [f64]) -> bool {
        let asked = self.parts(angles);
        let held = self.nearest(asked);
        if held == asked {
            return false;
        }
        self.write(held, angles);
        true
    }

    /// Limits the `angles` (rad) by a soft stop that begins `margin_rad` before the border
    /// ([`BallJoint::softened`]).
    pub fn soften(&self, angles: &mut [f64], margin_rad: f64) {
        let asked = self.parts(angles);
        let mut soft = self.range.softened(asked, margin_rad);
        if !self.can_twist() {
            soft.twist_rad = asked.twist_rad;
        }
        if soft != asked {
            self.write(soft, angles);
        }
    }

    /// Writes the hinge angles (rad) that make `turn`. Of the two solutions it takes the one within the
    /// hinges' own ranges, or less outside; if both are equal, the one nearer to the previous angles.
    fn write(&self, turn: SwingTwist, angles: &mut [f64]) {
        let ways = [false, true].map(|is_over| self.angles_of(turn, is_over));
        let most = |parts: &mut dyn Iterator<Item = f64>| parts.fold(0.0_f64, f64::max);
        let off = |way: &[f64; HINGES_MAX]| {
            let outside = way.iter().zip(&self.ranges_rad).map(|(to, (low, high))| (low - to).max(to - high));
            let turned = way.iter().zip(&*angles).map(|(to, from)| (to - from + PI).rem_euclid(TAU) - PI);
            (most(&mut outside.take(self.count)), most(&mut turned.map(f64::abs)))
        };
        let [straight, over] = [off(&ways[0]), off(&ways[1])];
        let is_over = over.0 < straight.0 || over.0 <= straight.0 && over.1 < straight.1;
        let nearer = usize::from(is_over);
        angles.copy_from_slice(&ways[nearer][..angles.len()]);
    }

    /// The hinge angles (rad) that make `turn`; if `is_over`, the first of the two swing hinges is turned
    /// half round, and the second goes over the top.
    fn angles_of(&self, turn: SwingTwist, is_over: bool) -> [f64; HINGES_MAX] {
        let mut angles = [0.0; HINGES_MAX];
        let mut left = turn.turn();
        let last = self.axes().iter().rposition(|(axis, _)| *axis != Axis::X);
        for (index, ((axis, sense), angle)) in self.axes().iter().zip(&mut angles).enumerate() {
            let way = left * DVec3::X;
            let sign = if is_over && Some(index) != last { -1.0 } else { 1.0 };
            let aim = match axis {
                // Once the link has its direction, the rest is twist.
                Axis::X => SwingTwist::of(left).twist_rad,
                Axis::Y | Axis::Z => axis.aim(way * sign),
            };
            *angle = sense * aim;
            left = axis.turn(-aim) * left;
        }
        angles
    }

    /// Share of the way from `before` to `after` (rad) that the hinges may move, 0 to 1, the same for all. If
    /// they are outside already, they may move: they are on their way in.
    pub fn share_inside(&self, before: &[f64], after: &[f64]) -> f64 {
        if self.holds(after) || !self.holds(before) {
            return 1.0;
        }
        let mut angles = [0.0; HINGES_MAX];
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            for ((angle, before), after) in angles.iter_mut().zip(before).zip(after) {
                *angle = before + middle * (after - before);
            }
            if self.holds(&angles[..self.count]) { low = middle } else { high = middle }
        }
        low
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::model::ball_joint::Corner;

    fn hinge(axis: DVec3) -> Joint {
        Joint {
            name: String::new(),
            axis,
            link_m: DVec3::ZERO,
            range_rad: (-1.5, 1.5),
            stiffness: 1.0,
            mass_kg: 0.0,
            center_m: DVec3::ZERO,
            ball: None,
            servo: None,
        }
    }

    /// A hip's pitch goes past a right angle. The same rotation has a second solution, half a turn off in
    /// pitch and yaw and over the top in roll, where no hip can be.
    #[test]
    fn hinges_stay_on_their_side_while_they_are_brought_in() {
        let corner = |lift: f64, sweep: f64| Corner {
            // About -y and z.
            swing: DVec2::new(-lift, sweep).normalize() * (0.5 * lift.hypot(sweep)).sin(),
            twist_rad: (-0.7, 0.7),
        };
        let corners = vec![corner(-0.4, -0.4), corner(-0.4, 0.4), corner(2.2, 0.4), corner(2.2, -0.4)];
        let range = BallJoint::new(corners).unwrap();
        let mut hinges: Vec<Joint> = [DVec3::NEG_Y, DVec3::Z, DVec3::X].into_iter().map(hinge).collect();
        hinges[0].range_rad = (-0.5, 2.2);
        let shared = SharedRange::new(&hinges, range);
        // Nearer to the solution over the top, which no hip can reach.
        let mut angles = [184.0_f64, -46.0, 86.0].map(f64::to_radians);
        shared.bring_in(&mut angles);
        assert!(
            (-0.5..2.2).contains(&angles[0]) && angles[1].abs() < 1.5 && angles[2].abs() < 1.5,
            "{angles:?}"
        );
        for pitch in [0.3, 1.5, 1.7, 1.9, 2.1] {
            for (roll, yaw) in [(0.6, 0.2), (-0.7, -0.5), (0.1, 1.0)] {
                let asked = [pitch, roll, yaw];
                let mut angles = asked;
                shared.bring_in(&mut angles);
                assert!(shared.holds(&angles), "{angles:?}");
                let moved = asked.iter().zip(angles).map(|(from, to)| (from - to).abs());
                assert!(moved.fold(0.0, f64::max) < 1.0, "{asked:?} to {angles:?}");
            }
        }
    }

    #[test]
    fn a_step_that_begins_inside_is_shortened_to_end_inside() {
        let corner = |y: f64, z: f64| Corner { swing: DVec2::new(y, z), twist_rad: (-0.3, 0.2) };
        // Not convex: the straight way between two points inside may lead outside.
        let corners = vec![
            corner(-0.4, -0.4),
            corner(0.4, -0.4),
            corner(0.4, 0.4),
            corner(0.0, -0.1),
            corner(-0.4, 0.4),
        ];
        let range = BallJoint::new(corners).unwrap();
        let mut source = Pcg64Mcg::seed_from_u64(8);
        let mut draw = move || (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        for axes in [vec![DVec3::NEG_Y, DVec3::Z], vec![DVec3::NEG_Y, DVec3::Z, DVec3::X]] {
            let hinges: Vec<Joint> = axes.into_iter().map(hinge).collect();
            let shared = SharedRange::new(&hinges, range.clone());
            let mut shortened = 0;
            for _ in 0..2000 {
                let mut before: Vec<f64> = hinges.iter().map(|_| 2.0 * draw()).collect();
                shared.bring_in(&mut before);
                assert!(shared.holds(&before), "{before:?} is brought in");
                let after: Vec<f64> = before.iter().map(|angle| angle + 0.3 * draw()).collect();
                let share = shared.share_inside(&before, &after);
                let gone: Vec<f64> = before.iter().zip(&after).map(|(a, b)| a + share * (b - a)).collect();
                assert!(shared.holds(&gone), "{share} of the way to {after:?}");
                shortened += u32::from(share < 1.0);
            }
            assert!((100..1900).contains(&shortened), "{shortened} of 2000 ways led outside");
        }
    }
}
