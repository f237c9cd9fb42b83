//! One sweep of cyclic coordinate descent with stiffness and ranges (Takizawa 2005, 3.2).

use glam::{DMat3, DVec3};

use super::Solver;

/// A joint whose levers to tip and target are both shorter than this, m, has no direction to turn.
const LEVER_MIN_M: f64 = 1e-9;

impl Solver {
    /// From the last joint to the first, turns each by its stiffness times the angle that points the tip
    /// at the target. Joints nearer the root see the reduced turn. Expects `places` and `axes` to hold for
    /// `angles`, and leaves them so.
    pub(super) fn sweep(&mut self, target: DVec3, angles: &mut [f64]) {
        let count = self.hinges.len();
        for index in (0..count).rev() {
            let (pivot, axis) = (self.places[index], self.axes[index]);
            // Both levers as seen along the axis: sine and cosine of the angle between them, times their lengths.
            let (to_tip, to_target) = (self.places[count] - pivot, target - pivot);
            let sine = axis.dot(to_tip.cross(to_target));
            let cosine = to_tip.dot(to_target) - axis.dot(to_tip) * axis.dot(to_target);
            if sine.abs() + cosine.abs() < LEVER_MIN_M * LEVER_MIN_M {
                continue;
            }
            let found = sine.atan2(cosine);
            let hinge = &self.hinges[index];
            let wanted = angles[index] + hinge.stiffness * found;
            let allowed = wanted.clamp(hinge.range_rad.0, hinge.range_rad.1);
            let turn = DMat3::from_axis_angle(axis, allowed - angles[index]);
            angles[index] = allowed;
            for later in index + 1..=count {
                self.places[later] = pivot + turn * (self.places[later] - pivot);
            }
            for later in index + 1..count {
                self.axes[later] = turn * self.axes[later];
            }
        }
    }
}
