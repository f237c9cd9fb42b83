//! Poses that follow given places: each link is pointed at the end it is to have, from the root on.

use glam::{DMat3, DVec3};

use super::super::pose::Angle;
use super::pose::Pose;
use crate::model::Axis;

impl Pose {
    /// Points each link at its place in turn, as far as the ranges let it; what one misses the next makes good.
    pub(super) fn follow(&mut self, places: &[DVec3]) {
        let mut from = self.root();
        for (ball, place) in places.iter().enumerate() {
            let way = *place - from.0;
            // A link that points back can be brought there two ways round.
            let [straight, flipped] = [false, true].map(|is_flipped| self.point(ball, from, way, is_flipped));
            self.point(ball, from, way, flipped < straight - 1e-9);
            from = self.hold_ball(ball, from);
        }
        self.tip = from.0;
    }

    /// Turns the hinges of joint `ball`, which is placed as `from` says, so that its link points along `way`; returns
    /// the angle it misses by.
    fn point(&mut self, ball: usize, from: (DVec3, DMat3), way: DVec3, is_flipped: bool) -> f64 {
        let hinges = &mut self.hinges[self.balls[ball].first..self.balls[ball].end];
        let last = hinges.iter().rposition(|hinge| hinge.axis != Axis::X);
        let (mut place, mut rotation) = from;
        for (index, hinge) in hinges.iter_mut().enumerate() {
            // Each but the last that turns the link brings the way into the plane in which the next turns it.
            let sign = if is_flipped && Some(index) != last { -1.0 } else { 1.0 };
            let aim = hinge.axis.aim(rotation.transpose() * way * sign);
            hinge.angle = Angle::of(hinge.held(hinge.sense * aim));
            (place, rotation) = hinge.put(place, rotation);
        }
        rotation.x_axis.angle_between(way)
    }
}
