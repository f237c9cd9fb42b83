//! The pose of an arm: each hinge's angle with its sine and cosine, its position and its axis.

use glam::{DMat3, DVec3};

use super::super::pose::{Angle, SMALL_TURN_RAD, small_turn};
use super::smooth::rest_bend;
use crate::model::{ArmGeometry, Axis, Chain, Joint, SharedRange};

/// A hinge and its present state in the solution.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hinge {
    // Fixed. An arm's hinges turn about coordinate axes, which takes half the arithmetic of a rotation about
    // any axis.
    pub(super) axis: Axis,
    /// 1, or -1 if it turns about the axis backwards.
    pub(super) sense: f64,
    /// Length of the link it carries, m; 0 if another hinge follows in the same place.
    pub(super) link_m: f64,
    pub(super) range_rad: (f64, f64),
    /// The thesis' ratio a_i.
    pub(super) stiffness: f64,
    /// Its angle in the resting arm, rad.
    pub(super) rest_rad: f64,
    // The pose.
    pub(super) angle: Angle,
    pub(super) place: DVec3,
    pub(super) direction: DVec3,
    // The step.
    pub(super) turn_rad: f64,
    /// The part of the turn towards the resting angle.
    pub(super) pull_rad: f64,
    /// False if a limit holds it.
    pub(super) is_free: bool,
}

/// A joint: hinges in one place, from the first to before the end, and the range they share.
#[derive(Debug, Clone)]
pub(super) struct Ball {
    pub(super) first: usize,
    pub(super) end: usize,
    pub(super) range: Option<SharedRange>,
}

/// An arm's fixed geometry and its pose.
#[derive(Debug, Clone)]
pub(super) struct Pose {
    root_m: DVec3,
    root_rotation: DMat3,
    pub(super) hinges: Vec<Hinge>,
    pub(super) balls: Vec<Ball>,
    pub(super) tip: DVec3,
    /// The hinge whose sine and cosine are recomputed next.
    next: usize,
}

impl Hinge {
    fn new(joint: &Joint, ball: usize) -> Hinge {
        let (axis, sense) = Axis::of(joint);
        let (low, high) = joint.goal_range_rad();
        let rest_rad = match axis {
            Axis::X => 0.0,
            Axis::Y => rest_bend(ball).0,
            Axis::Z => rest_bend(ball).1,
        };
        Hinge {
            axis,
            sense,
            link_m: joint.link_m.x,
            range_rad: (low, high),
            stiffness: joint.stiffness,
            rest_rad: rest_rad.clamp(low, high),
            angle: Angle::ZERO,
            place: DVec3::ZERO,
            direction: DVec3::ZERO,
            turn_rad: 0.0,
            pull_rad: 0.0,
            is_free: true,
        }
    }

    /// The angle `rad` limited to the range.
    #[inline]
    pub(super) fn held(&self, rad: f64) -> f64 {
        rad.clamp(self.range_rad.0, self.range_rad.1)
    }

    /// True if the angle `rad` is in the range.
    #[inline]
    pub(super) fn holds(&self, rad: f64) -> bool {
        self.range_rad.0 <= rad && rad <= self.range_rad.1
    }

    /// True if it is at a limit of its range.
    pub(super) fn is_at_limit(&self) -> bool {
        self.angle.rad <= self.range_rad.0 || self.angle.rad >= self.range_rad.1
    }

    /// Places it at `place` on a link with this orientation; returns end and orientation of its own link.
    #[inline]
    pub(super) fn put(
        &mut self,
        place: DVec3,
        DMat3 { x_axis: x, y_axis: y, z_axis: z }: DMat3,
    ) -> (DVec3, DMat3) {
        let (sine, cosine) = (self.sense * self.angle.sine, self.angle.cosine);
        let (axis, turned) = match self.axis {
            Axis::X => (x, DMat3::from_cols(x, y * cosine + z * sine, z * cosine - y * sine)),
            Axis::Y => (y, DMat3::from_cols(x * cosine - z * sine, y, z * cosine + x * sine)),
            Axis::Z => (z, DMat3::from_cols(x * cosine + y * sine, y * cosine - x * sine, z)),
        };
        self.place = place;
        self.direction = axis * self.sense;
        (place + turned.x_axis * self.link_m, turned)
    }
}

impl Pose {
    /// The straight arm.
    pub(super) fn new(arm: &ArmGeometry, chain: &Chain, joints: &[Joint]) -> Pose {
        let mut hinges = Vec::with_capacity(joints.len());
        let mut balls = Vec::with_capacity(arm.joints.len());
        for (ball, joint) in arm.joints.iter().enumerate() {
            let range =
                joint.range.clone().map(|range| SharedRange::new(&joints[joint.hinges.clone()], range));
            balls.push(Ball { first: joint.hinges.start, end: joint.hinges.end, range });
            hinges.extend(joints[joint.hinges.clone()].iter().map(|joint| Hinge::new(joint, ball)));
        }
        let root_rotation = DMat3::from_quat(chain.root_rotation);
        let mut pose =
            Pose { root_m: chain.root_m, root_rotation, hinges, balls, tip: chain.root_m, next: 0 };
        pose.place();
        pose
    }

    /// Position of the first joint, and orientation of its base.
    pub(super) fn root(&self) -> (DVec3, DMat3) {
        (self.root_m, self.root_rotation)
    }

    /// Length of the link after joint `ball`, m.
    pub(super) fn link_m(&self, ball: usize) -> f64 {
        self.hinges[self.balls[ball].end - 1].link_m
    }

    /// The end of link number `links`, counted from the root.
    #[inline]
    pub(super) fn end(&self, links: usize) -> DVec3 {
        self.balls.get(links).map_or(self.tip, |ball| self.hinges[ball.first].place)
    }

    /// Sets the angles, limited to the ranges.
    pub(super) fn set(&mut self, angles: &[f64]) {
        for (hinge, angle) in self.hinges.iter_mut().zip(angles) {
            hinge.angle = Angle::of(hinge.held(*angle));
        }
        let from = self.root();
        self.tip = (0..self.balls.len()).fold(from, |from, ball| self.hold_ball(ball, from)).0;
    }

    /// True if these are its angles.
    #[inline]
    pub(super) fn is_at(&self, angles: &[f64]) -> bool {
        self.hinges.iter().zip(angles).all(|(hinge, angle)| hinge.angle.rad.to_bits() == angle.to_bits())
    }

    /// Recomputes the sine and cosine of the next hinge.
    #[inline]
    pub(super) fn renew_next(&mut self) {
        self.next = (self.next + 1) % self.hinges.len();
        let hinge = &mut self.hinges[self.next];
        hinge.angle = Angle::of(hinge.angle.rad);
    }

    /// Sets the resting arm.
    pub(super) fn rest(&mut self) {
        for hinge in &mut self.hinges {
            hinge.angle = Angle::of(hinge.rest_rad);
        }
        self.place();
    }

    /// Writes the angles, rad.
    pub(super) fn copy_to(&self, angles: &mut [f64]) {
        for (angle, hinge) in angles.iter_mut().zip(&self.hinges) {
            *angle = hinge.angle.rad;
        }
    }

    /// Computes positions and axes from sines and cosines.
    #[inline]
    pub(super) fn place(&mut self) {
        let (mut place, mut rotation) = (self.root_m, self.root_rotation);
        for hinge in &mut self.hinges {
            (place, rotation) = hinge.put(place, rotation);
        }
        self.tip = place;
    }

    /// Turns each hinge by its turn in this step.
    #[inline]
    pub(super) fn take_step(&mut self) {
        let (mut place, mut rotation) = (self.root_m, self.root_rotation);
        for hinge in &mut self.hinges {
            let turn_rad = hinge.turn_rad;
            let (sine, cosine) =
                if turn_rad.abs() <= SMALL_TURN_RAD { small_turn(turn_rad) } else { turn_rad.sin_cos() };
            hinge.angle.turn_to(hinge.held(hinge.angle.rad + turn_rad), sine, cosine);
            (place, rotation) = hinge.put(place, rotation);
        }
        self.tip = place;
    }

    /// Limits joint `ball`, which starts at `from`, to the range its hinges share; returns the end of its link.
    #[inline]
    pub(super) fn hold_ball(&mut self, ball: usize, from: (DVec3, DMat3)) -> (DVec3, DMat3) {
        let Ball { first, end, .. } = self.balls[ball];
        if let Some(range) = &self.balls[ball].range {
            let mut angles = [0.0; 3];
            let angles = &mut angles[..end - first];
            for (angle, hinge) in angles.iter_mut().zip(&self.hinges[first..end]) {
                *angle = hinge.angle.rad;
            }
            if range.bring_in(angles) {
                for (hinge, angle) in self.hinges[first..end].iter_mut().zip(angles) {
                    hinge.angle = Angle::of(hinge.held(*angle));
                }
            }
        }
        let hinges = self.hinges[first..end].iter_mut();
        hinges.fold(from, |(place, rotation), hinge| hinge.put(place, rotation))
    }
}
