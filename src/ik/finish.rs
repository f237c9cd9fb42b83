//! The finish: weighted, bounded, damped least squares with an active set on the limits.
//!
//! Each step minimises |J d - e|^2 + damping |W^-1/2 d|^2 with the stiffness as the weights W, so that
//! soft joints take more of it, as in CCD. A joint that a step would push past a limit goes onto the limit,
//! leaves the free set, and the others are solved again for what is left. Damping shrinks after a step that
//! came nearer and grows after one that did not (Levenberg and Marquardt), so a target out of reach ends in
//! the nearest pose instead of an oscillation.

use glam::{DMat3, DVec3};

use super::Solver;

/// Most steps in one solve.
const STEPS_MAX: u32 = 24;
/// Largest turn of one joint in one step, rad.
const TURN_MAX_RAD: f64 = 0.25;
/// Damping at the start, as a share of the trace of J W J^T.
const DAMPING_START: f64 = 1e-6;
/// Damping past which no step comes nearer: the pose is the nearest.
const DAMPING_GIVE_UP: f64 = 1e3;

impl Solver {
    pub(super) fn finish(&mut self, target: DVec3, pull: f64, tolerance_m: f64, angles: &mut [f64]) {
        let mut distance_m = self.tip().distance(target);
        let mut damping = DAMPING_START;
        let mut pull = pull;
        for _ in 0..STEPS_MAX {
            if distance_m <= tolerance_m && pull <= 0.0 {
                return;
            }
            self.bounded_step(target, pull, damping, angles);
            for (index, hinge) in self.hinges.iter().enumerate() {
                let (low, high) = hinge.range_rad;
                self.trial[index] = (angles[index] + self.step[index]).clamp(low, high);
            }
            let trial = std::mem::take(&mut self.trial);
            self.place(&trial);
            self.trial = trial;
            let new_distance_m = self.tip().distance(target);
            // The pull step may cost a little distance, which the next steps win back.
            if new_distance_m < distance_m || pull > 0.0 {
                let gain_m = distance_m - new_distance_m;
                angles.copy_from_slice(&self.trial);
                distance_m = new_distance_m;
                damping = (damping * 0.1).max(1e-12);
                // Nothing left to win: out of reach, at the nearest pose.
                if pull <= 0.0 && gain_m < 1e-3 * tolerance_m {
                    return;
                }
            } else {
                self.place(angles);
                damping *= 10.0;
                if damping > DAMPING_GIVE_UP {
                    return;
                }
            }
            pull = 0.0;
        }
    }

    /// Writes into `step` the bounded step from `angles` towards `target`, with a pull to the neutral pose
    /// where that does not move the tip.
    fn bounded_step(&mut self, target: DVec3, pull: f64, damping: f64, angles: &[f64]) {
        let count = self.hinges.len();
        self.is_free.fill(true);
        self.step.fill(0.0);
        let tip = self.tip();
        for index in 0..count {
            self.columns[index] = self.axes[index].cross(tip - self.places[index]);
        }
        // Each pass fixes at least one joint on a limit, so there are at most count + 1.
        for _ in 0..=count {
            let mut wanted = target - tip;
            let mut normal = DMat3::ZERO;
            for index in 0..count {
                let column = self.columns[index];
                if self.is_free[index] {
                    let weight = self.hinges[index].stiffness;
                    normal += outer(column, column * weight);
                    // What the pull moves the tip by, the step must take back.
                    wanted -= column * self.pull_of(index, pull, angles);
                } else {
                    wanted -= column * self.step[index];
                }
            }
            let trace = normal.x_axis.x + normal.y_axis.y + normal.z_axis.z;
            let damped = normal + DMat3::from_diagonal(DVec3::splat(damping * trace + f64::MIN_POSITIVE));
            let multiplier = damped.inverse() * wanted;
            if !multiplier.is_finite() {
                return;
            }
            let mut largest: f64 = 0.0;
            for index in (0..count).filter(|&index| self.is_free[index]) {
                let turn = self.hinges[index].stiffness * self.columns[index].dot(multiplier)
                    + self.pull_of(index, pull, angles);
                self.step[index] = turn;
                largest = largest.max(turn.abs());
            }
            let scale = if largest > TURN_MAX_RAD { TURN_MAX_RAD / largest } else { 1.0 };
            let mut is_settled = true;
            for (index, &angle) in angles.iter().enumerate() {
                if !self.is_free[index] {
                    continue;
                }
                let (low, high) = self.hinges[index].range_rad;
                let wanted = angle + scale * self.step[index];
                let allowed = wanted.clamp(low, high);
                self.step[index] = allowed - angle;
                if (allowed - wanted).abs() > 0.0 {
                    self.is_free[index] = false;
                    is_settled = false;
                }
            }
            if is_settled {
                return;
            }
        }
    }

    fn pull_of(&self, index: usize, pull: f64, angles: &[f64]) -> f64 {
        pull * (self.hinges[index].neutral_rad - angles[index])
    }
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
