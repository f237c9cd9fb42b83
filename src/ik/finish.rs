//! The finish: weighted, bounded, damped least squares with an active set on the limits.
//!
//! Each step minimises |J d - e|^2 + damping |W^-1/2 d|^2 with the stiffness as the weights W, so that
//! soft joints take more of it, as in CCD. A joint that a step would push past a limit goes onto the limit,
//! leaves the free set, and the others are solved again for what is left. Damping shrinks after a step that
//! came nearer and grows after one that did not (Levenberg and Marquardt), so a target out of reach ends in
//! the nearest pose instead of an oscillation.

use super::chain::{ChainSolver, TOLERANCE_SHARE};
use super::geometry::{Geometry, Vector};
use super::pose::{SMALL_TURN_RAD, small_turn};

/// Most steps in one solve.
const STEPS_MAX: u32 = 24;
/// Largest turn of one joint in one step, rad.
pub(super) const TURN_MAX_RAD: f64 = SMALL_TURN_RAD;
/// Damping at the start, as a share of the trace of J W J^T.
const DAMPING_START: f64 = 1e-6;
/// Damping past which no step comes nearer: the pose is the nearest.
const DAMPING_GIVE_UP: f64 = 1e3;

/// One joint in a step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Step<V> {
    /// How the tip moves with the joint, m/rad: its column of the Jacobian.
    pub(super) column: V,
    pub(super) turn_rad: f64,
    /// The part of the turn that goes to the neutral posture.
    pull_rad: f64,
    pub(super) is_free: bool,
}

impl<G: Geometry> ChainSolver<G> {
    pub(super) fn finish(&mut self, target: G::Vector, pull: f64) {
        let tolerance_m = TOLERANCE_SHARE * self.length_m;
        let mut distance_m = self.pose.distance_m(target);
        let mut damping = DAMPING_START;
        let mut pull = pull;
        for _ in 0..STEPS_MAX {
            if distance_m <= tolerance_m && pull <= 0.0 {
                return;
            }
            self.bounded_step(target, pull, damping);
            self.try_step();
            let new_distance_m = self.trial.distance_m(target);
            // The pull step may cost a little distance, which the next steps win back.
            if new_distance_m < distance_m || pull > 0.0 {
                let gain_m = distance_m - new_distance_m;
                std::mem::swap(&mut self.pose, &mut self.trial);
                distance_m = new_distance_m;
                damping = (damping * 0.1).max(1e-12);
                // Nothing left to win: out of reach, at the nearest pose.
                if pull <= 0.0 && gain_m < 1e-3 * tolerance_m {
                    return;
                }
            } else {
                damping *= 10.0;
                if damping > DAMPING_GIVE_UP {
                    return;
                }
            }
            pull = 0.0;
        }
    }

    /// Writes into `trial` the pose a step leads to.
    pub(super) fn try_step(&mut self) {
        let joints = self.trial.joints.iter_mut().zip(&self.pose.joints);
        for ((trial, joint), (step, hinge)) in joints.zip(self.steps.iter().zip(&self.hinges)) {
            let (low, high) = hinge.range_rad;
            let (sine, cosine) = small_turn(step.turn_rad);
            *trial = *joint;
            trial.turn((joint.angle_rad + step.turn_rad).clamp(low, high), sine, cosine);
        }
        self.trial.place(&self.geometry, &self.hinges);
    }

    /// Writes into `steps` the bounded step from `pose` towards `target`, with a pull to the neutral pose
    /// where that does not move the tip.
    fn bounded_step(&mut self, target: G::Vector, pull: f64, damping: f64) {
        let tip = self.pose.tip;
        for ((step, joint), hinge) in self.steps.iter_mut().zip(&self.pose.joints).zip(&self.hinges) {
            step.column = G::motion(joint.axis, tip - joint.place);
            step.pull_rad = pull * (hinge.neutral_rad - joint.angle_rad);
            step.turn_rad = 0.0;
            step.is_free = true;
        }
        // Each pass fixes at least one joint on a limit, so there are at most count + 1.
        for _ in 0..=self.hinges.len() {
            let mut wanted = target - tip;
            let mut normal = <G::Vector as Vector>::Normal::default();
            for (step, hinge) in self.steps.iter().zip(&self.hinges) {
                if step.is_free {
                    step.column.add_to(&mut normal, hinge.stiffness);
                    // What the pull moves the tip by, the step must take back.
                    wanted = wanted - step.column * step.pull_rad;
                } else {
                    wanted = wanted - step.column * step.turn_rad;
                }
            }
            let multiplier = wanted.solved_by(&normal, damping);
            let mut largest: f64 = 0.0;
            for (step, hinge) in self.steps.iter_mut().zip(&self.hinges) {
                if step.is_free {
                    step.turn_rad = hinge.stiffness * step.column.dot(multiplier) + step.pull_rad;
                    largest = largest.max(step.turn_rad.abs());
                }
            }
            if !largest.is_finite() {
                for step in self.steps.iter_mut().filter(|step| step.is_free) {
                    step.turn_rad = 0.0;
                }
                return;
            }
            let scale = if largest > TURN_MAX_RAD { TURN_MAX_RAD / largest } else { 1.0 };
            let mut is_settled = true;
            for ((step, joint), hinge) in self.steps.iter_mut().zip(&self.pose.joints).zip(&self.hinges) {
                if !step.is_free {
                    continue;
                }
                let (low, high) = hinge.range_rad;
                let wanted = joint.angle_rad + scale * step.turn_rad;
                let allowed = wanted.clamp(low, high);
                step.turn_rad = allowed - joint.angle_rad;
                if (allowed - wanted).abs() > 0.0 {
                    step.is_free = false;
                    is_settled = false;
                }
            }
            if is_settled {
                return;
            }
        }
    }
}
