//! Poses that follow given positions: from the root on, each link is pointed at its target end.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use super::super::pose::Angle;
use super::pose::Pose;
use crate::model::Axis;

/// Angles this close to straight up are turned to one side, rad.
const BEHIND_RAD: f64 = 0.1;

impl Pose {
    /// Points each link at its target in turn, as far as the ranges permit; each link corrects the error of
    /// the one before. Joints that can twist turn their lower side towards the line `faced`, if there is one
    /// (a point on it, its direction).
    pub(super) fn follow(&mut self, places: &[DVec3], faced: Option<[DVec3; 2]>) {
        let mut from = self.root();
        for (ball, place) in places.iter().enumerate() {
            let way = *place - from.0;
            // Two solutions bring a link that points back to its target.
            let [straight, flipped] = [false, true].map(|is_flipped| self.point(ball, from, way, is_flipped));
            self.point(ball, from, way, flipped < straight - 1e-9);
            if let Some([point, direction]) = faced {
                let off = point - from.0;
                self.face(ball, from, off - direction * off.dot(direction) / direction.length_squared());
            }
            from = self.hold_ball(ball, from);
        }
        self.tip = from.0;
    }

    /// Turns the hinges of joint `ball`, which starts at `from`, so that its link points along `way`; returns
    /// the remaining angle.
    fn point(&mut self, ball: usize, from: (DVec3, DMat3), way: DVec3, is_flipped: bool) -> f64 {
        let hinges = &mut self.hinges[self.balls[ball].first..self.balls[ball].end];
        let last = hinges.iter().rposition(|hinge| hinge.axis != Axis::X);
        let (mut place, mut rotation) = from;
        for (index, hinge) in hinges.iter_mut().enumerate() {
            // Each hinge that turns the link, except the last, brings the way into the plane in which the
            // next turns it.
            let sign = if is_flipped && Some(index) != last { -1.0 } else { 1.0 };
            let aim = hinge.axis.aim(rotation.transpose() * way * sign);
            hinge.angle = Angle::of(hinge.held(hinge.sense * aim));
            (place, rotation) = hinge.put(place, rotation);
        }
        rotation.x_axis.angle_between(way)
    }

    /// Turns the twist of joint `ball`, if it has one, so that the lower side of its link faces `way`.
    fn face(&mut self, ball: usize, from: (DVec3, DMat3), way: DVec3) {
        let hinges = &mut self.hinges[self.balls[ball].first..self.balls[ball].end];
        let (mut place, mut rotation) = from;
        for hinge in hinges {
            if hinge.axis == Axis::X {
                let seen = rotation.transpose() * way;
                let angle = seen.y.atan2(-seen.z);
                // Straight up is equally far to either side: rounding must not choose.
                let angle = if angle < BEHIND_RAD - PI { angle + TAU } else { angle };
                hinge.angle = Angle::of(hinge.held(hinge.sense * angle));
            }
            (place, rotation) = hinge.put(place, rotation);
        }
    }
}
