//! One sweep of cyclic coordinate descent with stiffness and ranges (Takizawa 2005, 3.2).

use super::chain::ChainSolver;
use super::geometry::Geometry;
use super::pose::{SMALL_TURN_RAD, small_turn};

/// A joint whose levers to tip and target are both shorter than this, m, has no useful direction.
const LEVER_MIN_M: f64 = 1e-9;

impl<G: Geometry> ChainSolver<G> {
    /// From the last joint to the first, turns each by its stiffness times the angle that points the tip
    /// at the target. Joints nearer the root see the reduced turn.
    pub(super) fn sweep(&mut self, target: G::Vector) {
        // This sweep does not use the part between a turned joint and the tip again.
        let mut tip = self.tip;
        for joint in self.joints.iter_mut().rev() {
            let to_tip = tip - joint.place;
            let (sine, cosine) = G::angle_between(joint.axis, to_tip, target - joint.place);
            if sine.abs() + cosine.abs() < LEVER_MIN_M * LEVER_MIN_M {
                continue;
            }
            let wanted = joint.held(joint.angle.rad + joint.stiffness * sine.atan2(cosine));
            let turn_rad = wanted - joint.angle.rad;
            let (sine, cosine) =
                if turn_rad.abs() <= SMALL_TURN_RAD { small_turn(turn_rad) } else { turn_rad.sin_cos() };
            tip = joint.place + G::turn_lever(joint.axis, to_tip, sine, cosine);
            joint.angle.turn_to(wanted, sine, cosine);
        }
        self.place();
    }
}
