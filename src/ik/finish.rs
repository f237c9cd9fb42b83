//! The finish: weighted, bounded, damped least squares with an active set on the limits.
//!
//! Each step minimises |J d - e|^2 + damping |W^-1/2 d|^2 with the stiffness as the weights W, so that
//! soft joints take more of it, as in CCD. A joint that a step would push past a limit goes onto the limit,
//! leaves the free set, and the others are solved again for what is left. Damping shrinks after a step that
//! came nearer and grows after one that did not (Levenberg and Marquardt).

use super::chain::ChainSolver;
use super::geometry::{Geometry, Vector};
use super::pose::SMALL_TURN_RAD;

/// Most steps in one solve.
const STEPS_MAX: u32 = 24;
/// Largest turn of one joint in one step, rad.
pub(super) const TURN_MAX_RAD: f64 = SMALL_TURN_RAD;
/// Damping at the start, as a share of the trace of J W J^T.
const DAMPING_START: f64 = 1e-6;
/// Damping past which no step comes nearer: the pose is the nearest.
const DAMPING_GIVE_UP: f64 = 1e3;

impl<G: Geometry> ChainSolver<G> {
    pub(super) fn finish(&mut self, target: G::Vector, pull: f64) {
        let tolerance_m = self.tolerance_m();
        let mut distance_m = self.distance_m(target);
        let mut damping = DAMPING_START;
        let mut pull = pull;
        for _ in 0..STEPS_MAX {
            if distance_m <= tolerance_m && pull <= 0.0 {
                return;
            }
            self.choose_step(target, pull, damping);
            self.take_step();
            let new_distance_m = self.distance_m(target);
            // The pull step may cost a little distance, which the next steps win back.
            if new_distance_m < distance_m || pull > 0.0 {
                let gain_m = distance_m - new_distance_m;
                distance_m = new_distance_m;
                damping = (damping * 0.1).max(1e-12);
                // Nothing left to win: out of reach, at the nearest pose.
                if pull <= 0.0 && gain_m < 1e-3 * tolerance_m {
                    return;
                }
            } else {
                self.take_step_back();
                damping *= 10.0;
                if damping > DAMPING_GIVE_UP {
                    return;
                }
            }
            pull = 0.0;
        }
    }

    /// Chooses the bounded step towards `target`, with a pull to the neutral pose where that does not move
    /// the tip.
    fn choose_step(&mut self, target: G::Vector, pull: f64, damping: f64) {
        self.differentiate();
        for joint in &mut self.joints {
            joint.pull_rad = pull * (joint.neutral_rad - joint.angle.rad);
            joint.turn_rad = 0.0;
            joint.is_free = true;
        }
        // Each pass fixes at least one joint on a limit, so there are at most count + 1.
        for _ in 0..=self.joints.len() {
            let mut wanted = target - self.tip;
            let mut normal = <G::Vector as Vector>::Normal::default();
            for joint in &self.joints {
                if joint.is_free {
                    joint.column.add_to(&mut normal, joint.stiffness);
                    // What the pull moves the tip by, the step must take back.
                    wanted = wanted - joint.column * joint.pull_rad;
                } else {
                    wanted = wanted - joint.column * joint.turn_rad;
                }
            }
            let multiplier = wanted.solved_by(&normal, damping);
            let mut largest_rad: f64 = 0.0;
            for joint in self.joints.iter_mut().filter(|joint| joint.is_free) {
                joint.turn_rad = joint.stiffness * joint.column.dot(multiplier) + joint.pull_rad;
                largest_rad = largest_rad.max(joint.turn_rad.abs());
            }
            if !largest_rad.is_finite() {
                for joint in self.joints.iter_mut().filter(|joint| joint.is_free) {
                    joint.turn_rad = 0.0;
                }
                return;
            }
            let scale = if largest_rad > TURN_MAX_RAD { TURN_MAX_RAD / largest_rad } else { 1.0 };
            let mut is_settled = true;
            for joint in self.joints.iter_mut().filter(|joint| joint.is_free) {
                let wanted = joint.angle.rad + scale * joint.turn_rad;
                let allowed = joint.held(wanted);
                joint.turn_rad = allowed - joint.angle.rad;
                if (allowed - wanted).abs() > 0.0 {
                    joint.is_free = false;
                    is_settled = false;
                }
            }
            if is_settled {
                return;
            }
        }
    }
}
