//! The nearest pose of a neighbourhood if the target may be out of reach: projected Newton steps.
//!
//! Least squares assumes that the remaining distance is small. Out of reach it is not, and the curvature of
//! the tip's path matters: with it a few steps end in the nearest pose, where least squares takes dozens.
//! Each step minimises half the squared distance to second order, on the joints that no limit holds back
//! (Bertsekas 1982), damped as in the finish.

use super::chain::ChainSolver;
use super::finish::TURN_MAX_RAD;
use super::geometry::{Geometry, Vector};

/// Most steps from one start.
const STEPS_MAX: u32 = 32;
/// Damping at the start, as a share of the mean of the squared lengths of the Jacobian's columns.
const DAMPING_START: f64 = 1e-3;
/// Damping beyond which no step comes nearer: the pose is the nearest.
const DAMPING_GIVE_UP: f64 = 1e6;
/// A step that gains less than this is the last, m per metre of chain.
const GAIN_SHARE: f64 = 1e-9;

impl<G: Geometry> ChainSolver<G> {
    /// Moves the pose downhill to the nearest one.
    pub(super) fn descend(&mut self, target: G::Vector) {
        let mut distance_m = self.distance_m(target);
        let mut damping = DAMPING_START;
        for _ in 0..STEPS_MAX {
            if distance_m <= self.tolerance_m() {
                return;
            }
            self.differentiate();
            while !self.choose_newton_step(target, damping) {
                damping *= 10.0;
                if damping > DAMPING_GIVE_UP {
                    return;
                }
            }
            self.take_step();
            let new_distance_m = self.distance_m(target);
            if new_distance_m < distance_m {
                let gain_m = distance_m - new_distance_m;
                distance_m = new_distance_m;
                if gain_m < GAIN_SHARE * self.length_m {
                    return;
                }
                damping *= 0.1;
            } else {
                self.take_step_back();
                damping *= 10.0;
                if damping > DAMPING_GIVE_UP {
                    return;
                }
            }
        }
    }

    /// Chooses the step towards `target`; false if there is no downhill step with this damping.
    fn choose_newton_step(&mut self, target: G::Vector, damping: f64) -> bool {
        let count = self.joints.len();
        let miss = target - self.tip;
        let mut square = 0.0;
        for joint in &mut self.joints {
            square += joint.column.dot(joint.column);
            let downhill = joint.column.dot(miss);
            let limit_rad = if downhill > 0.0 { joint.range_rad.1 } else { joint.range_rad.0 };
            joint.is_free = downhill * (limit_rad - joint.angle.rad) > 0.0;
            joint.turn_rad = if joint.is_free { downhill } else { 0.0 };
        }
        // The Hessian's lower half, root first; for joints held back, a row of the identity.
        let damping = damping * square / count as f64 + f64::MIN_POSITIVE;
        for (row, joint) in self.joints.iter().enumerate() {
            let entries = &mut self.hessian[row * count..=row * count + row];
            for (entry, before) in entries.iter_mut().zip(&self.joints) {
                *entry = if joint.is_free && before.is_free {
                    joint.column.dot(before.column) - miss.dot(G::motion(before.axis, joint.column))
                } else {
                    0.0
                };
            }
            entries[row] += if joint.is_free { damping } else { 1.0 };
        }
        if !self.solve_hessian() {
            return false;
        }
        let largest_rad =
            self.joints.iter().fold(0.0_f64, |largest, joint| largest.max(joint.turn_rad.abs()));
        let scale = if largest_rad > TURN_MAX_RAD { TURN_MAX_RAD / largest_rad } else { 1.0 };
        for joint in &mut self.joints {
            joint.turn_rad = joint.held(joint.angle.rad + scale * joint.turn_rad) - joint.angle.rad;
        }
        true
    }

    /// Solves for the turns in place, by Cholesky decomposition; false if the Hessian is not positive.
    fn solve_hessian(&mut self) -> bool {
        let count = self.joints.len();
        for row in 0..count {
            for column in 0..=row {
                let mut sum = self.hessian[row * count + column];
                for before in 0..column {
                    sum -= self.hessian[row * count + before] * self.hessian[column * count + before];
                }
                if column < row {
                    self.hessian[row * count + column] = sum * self.hessian[column * count + column];
                } else if sum > 0.0 {
                    // The diagonal holds the reciprocal.
                    self.hessian[row * count + row] = 1.0 / sum.sqrt();
                } else {
                    return false;
                }
            }
        }
        for row in 0..count {
            let mut sum = self.joints[row].turn_rad;
            for before in 0..row {
                sum -= self.hessian[row * count + before] * self.joints[before].turn_rad;
            }
            self.joints[row].turn_rad = sum * self.hessian[row * count + row];
        }
        for row in (0..count).rev() {
            let mut sum = self.joints[row].turn_rad;
            for after in row + 1..count {
                sum -= self.hessian[after * count + row] * self.joints[after].turn_rad;
            }
            self.joints[row].turn_rad = sum * self.hessian[row * count + row];
        }
        true
    }
}
