//! One sweep of cyclic coordinate descent with stiffness and ranges (Takizawa 2005, 3.2).

use glam::{DQuat, DVec3};

use super::Solver;

/// A lever shorter than this, m, has no direction to turn.
const LEVER_MIN_M: f64 = 1e-9;

impl Solver {
    /// From the last joint to the first, turns each by its stiffness times the angle that points the tip
    /// at the target. Joints nearer the root see the reduced turn. Expects `places` and `axes` to hold for
    /// `angles`, and leaves them so.
    pub(super) fn sweep(&mut self, target: DVec3, angles: &mut [f64]) {
        let count = self.hinges.len();
        for index in (0..count).rev() {
            let (pivot, axis) = (self.places[index], self.axes[index]);
            let to_tip = (self.places[count] - pivot).reject_from_normalized(axis);
            let to_target = (target - pivot).reject_from_normalized(axis);
            if to_tip.length_squared() < LEVER_MIN_M * LEVER_MIN_M
                || to_target.length_squared() < LEVER_MIN_M * LEVER_MIN_M
            {
                continue;
            }
            let found = axis.dot(to_tip.cross(to_target)).atan2(to_tip.dot(to_target));
            let hinge = &self.hinges[index];
            let wanted = angles[index] + hinge.stiffness * found;
            let allowed = wanted.clamp(hinge.range_rad.0, hinge.range_rad.1);
            let turn = DQuat::from_axis_angle(axis, allowed - angles[index]);
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
