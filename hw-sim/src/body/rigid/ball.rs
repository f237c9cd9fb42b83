//! Ball joints: hinges in one place that share a stop, at the border of a region of swings or at the end of
//! their twist.
//!
//! The rotation of the link is a twist about its rest direction, X, followed by a swing. The swing is a
//! vector across X: along the swing's axis, as long as the sine of half its angle (a paper on falling human
//! figures, 3.1). Past the border a spring and a damper push back but never pull: they give back no energy
//! that they take.

use rapier3d_f64::prelude::*;

use super::super::BallStop;

/// Small change of a hinge's angle, either way, that shows how swing and twist depend on it, rad.
const PROBE_RAD: f64 = 1e-6;

/// A ball joint in the rigid body.
#[derive(Debug)]
pub(super) struct BallJointStop {
    /// Its hinges, as indices into the body's list, the first one first.
    pub(super) hinges: Vec<usize>,
    axes: Vec<Vector>,
    /// From X to the link's rest direction.
    rest: Rotation,
    /// Corners of the region, going round it, and the twists allowed at each.
    corners: Vec<([f64; 2], (f64, f64))>,
}

/// How far past its border a joint is, in swing (its two coordinates) and twist; 0 inside.
type Beyond = [f64; 3];

impl BallJointStop {
    pub(super) fn new(stop: &BallStop, hinges: Vec<usize>, axes: Vec<Vector>, link: Vector) -> BallJointStop {
        BallJointStop {
            hinges,
            axes,
            rest: Rotation::from_rotation_arc(Vector::X, link.normalize()),
            corners: stop.corners.clone(),
        }
    }

    /// Torque of the stop on each hinge, N m, at these angles and speeds; `stop` is its stiffness and damping.
    pub(super) fn torques(&self, angles: [f64; 3], speeds: [f64; 3], stop: (f64, f64)) -> [f64; 3] {
        let beyond = self.beyond(angles);
        let mut torques = [0.0; 3];
        let swing = beyond[0].hypot(beyond[1]);
        let ways = [(swing, [beyond[0], beyond[1], 0.0]), (beyond[2].abs(), [0.0, 0.0, beyond[2]])];
        for (depth, way) in ways.into_iter().filter(|(depth, _)| *depth > 0.0) {
            let outward = way.map(|part| part / depth);
            // How the depth grows with each hinge.
            let mut slopes = [0.0; 3];
            for (hinge, slope) in slopes.iter_mut().enumerate().take(self.axes.len()) {
                let at = |turn: f64| {
                    let mut angles = angles;
                    angles[hinge] += turn;
                    let moved = self.parts(angles);
                    moved.iter().zip(outward).map(|(part, way)| part * way).sum::<f64>()
                };
                *slope = (at(PROBE_RAD) - at(-PROBE_RAD)) / (2.0 * PROBE_RAD);
            }
            let rate: f64 = slopes.iter().zip(speeds).map(|(slope, speed)| slope * speed).sum();
            // A swing vector is as long as half its angle; a twist is its angle.
            let scale = if way[2].abs() > 0.0 { 1.0 } else { 4.0 };
            let push = (scale * (stop.0 * depth + stop.1 * rate)).max(0.0);
            for (torque, slope) in torques.iter_mut().zip(slopes) {
                *torque -= push * slope;
            }
        }
        torques
    }

    /// Swing and twist at these angles.
    fn parts(&self, angles: [f64; 3]) -> [f64; 3] {
        let turn =
            self.axes.iter().zip(angles).fold(Rotation::IDENTITY, |turn, (axis, angle)| {
                turn * Rotation::from_axis_angle(*axis, angle)
            });
        let turn = self.rest.inverse() * turn * self.rest;
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let length = turn.w.hypot(turn.x).max(f64::MIN_POSITIVE);
        let (cosine, sine) = (turn.w / length, turn.x / length);
        [turn.y * cosine - turn.z * sine, turn.z * cosine + turn.y * sine, 2.0 * turn.x.atan2(turn.w)]
    }

    fn beyond(&self, angles: [f64; 3]) -> Beyond {
        let [y, z, twist] = self.parts(angles);
        // The nearest point of the border sets the limits of the twist.
        let (_, (place, (low, high))) = self.nearest_of_border([y, z]);
        let out = if self.holds([y, z]) { [0.0, 0.0] } else { [y - place[0], z - place[1]] };
        // With two hinges the twist follows from the swing.
        let past = if self.axes.len() < 3 { 0.0 } else { (twist - high).max(0.0) + (twist - low).min(0.0) };
        [out[0], out[1], past]
    }

    /// True if the region holds this swing: counts the sides that a ray from it crosses.
    fn holds(&self, [y, z]: [f64; 2]) -> bool {
        let mut is_inside = false;
        for (index, (a, _)) in self.corners.iter().enumerate() {
            let b = self.corners[(index + 1) % self.corners.len()].0;
            if (a[1] > z) != (b[1] > z) && y < a[0] + (z - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
                is_inside = !is_inside;
            }
        }
        is_inside
    }

    /// The point of the border nearest to a swing: its distance, the point, and the twists allowed there.
    fn nearest_of_border(&self, [y, z]: [f64; 2]) -> (f64, ([f64; 2], (f64, f64))) {
        let mut nearest = (f64::INFINITY, ([0.0; 2], (0.0, 0.0)));
        for (index, (a, twist_a)) in self.corners.iter().enumerate() {
            let (b, twist_b) = self.corners[(index + 1) % self.corners.len()];
            let side = [b[0] - a[0], b[1] - a[1]];
            let square = side[0] * side[0] + side[1] * side[1];
            let share = (((y - a[0]) * side[0] + (z - a[1]) * side[1]) / square).clamp(0.0, 1.0);
            let place = [a[0] + share * side[0], a[1] + share * side[1]];
            let distance = (y - place[0]).hypot(z - place[1]);
            if distance < nearest.0 {
                let between = |a: f64, b: f64| a + share * (b - a);
                nearest = (distance, (place, (between(twist_a.0, twist_b.0), between(twist_a.1, twist_b.1))));
            }
        }
        nearest
    }
}
