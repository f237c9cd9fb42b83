//! The finish: weighted, bounded, damped least squares with an active set on the limits.
//!
//! Each step minimises |J d - e|^2 + damping |W^-1/2 d|^2 with the stiffness as the weights W, so that soft
//! joints take more of it, as in CCD. A joint that a step would push past a limit is set to the limit and
//! leaves the free set, and the others are solved again for the rest. Damping shrinks after a step that came
//! nearer and grows after one that did not (Levenberg and Marquardt).

use super::chain::ChainSolver;
use super::geometry::{Geometry, Vector};
use super::pose::{PosedJoint, SMALL_TURN_RAD};

/// Most steps in one solution. A path needs two; a target that these do not reach is mostly out of reach.
const STEPS_MAX: u32 = 8;
/// Largest turn of one joint in one step, rad.
pub(super) const TURN_MAX_RAD: f64 = SMALL_TURN_RAD;
/// Damping at the start, as a share of the trace of J W J^T.
const DAMPING_START: f64 = 1e-6;
/// Damping below which steps no longer change.
const DAMPING_MIN: f64 = 1e-12;
/// Largest error that the pull to the neutral posture may cause, m per metre of chain; the next steps remove it.
const PULL_COST_SHARE: f64 = 0.01;

impl<G: Geometry> ChainSolver<G> {
    /// Moves the tip to `target`, if the joints are free to follow it. `pull` is the share of the way to the
    /// neutral posture that they move if that does not move the tip.
    pub(super) fn finish(&mut self, target: G::Vector, mut pull: f64) {
        let mut distance_m = self.distance_m(target);
        let mut damping = DAMPING_START;
        for _ in 0..STEPS_MAX {
            if distance_m <= self.tolerance_m() && pull <= 0.0 {
                return;
            }
            self.choose_step(target, pull, damping);
            self.take_step();
            let new_distance_m = self.distance_m(target);
            let cost_max_m = if pull > 0.0 { PULL_COST_SHARE * self.length_m } else { 0.0 };
            if new_distance_m < distance_m + cost_max_m {
                distance_m = new_distance_m;
                damping = (damping * 0.1).max(DAMPING_MIN);
            } else {
                self.take_step_back();
                damping *= 10.0;
            }
            pull = 0.0;
        }
    }

    /// Chooses the bounded step towards `target`, with a pull to the neutral pose if that does not move the tip.
    fn choose_step(&mut self, target: G::Vector, pull: f64, damping: f64) {
        let miss = target - self.tip;
        let mut sums = Sums::new(miss);
        for joint in &mut self.joints {
            joint.column = G::motion(joint.axis, self.tip - joint.place);
            joint.pull_rad = pull * (joint.neutral_rad - joint.angle.rad);
            joint.is_free = true;
            sums.add(joint);
        }
        // Each pass holds at least one more joint at a limit.
        while !self.turn_free_joints(sums.multiplier(damping)) {
            sums = Sums::new(miss);
            for joint in &self.joints {
                sums.add(joint);
            }
        }
    }

    /// Turns the free joints by `multiplier`, all by the same share of it if one would turn too far; false if
    /// one met a limit, which then holds it.
    #[inline]
    fn turn_free_joints(&mut self, multiplier: G::Vector) -> bool {
        let mut largest_rad: f64 = 0.0;
        let mut is_settled = true;
        for joint in self.joints.iter_mut().filter(|joint| joint.is_free) {
            joint.turn_rad = joint.stiffness * joint.column.dot(multiplier) + joint.pull_rad;
            largest_rad = largest_rad.max(joint.turn_rad.abs());
            is_settled &= joint.holds(joint.angle.rad + joint.turn_rad);
        }
        if is_settled && largest_rad <= TURN_MAX_RAD {
            return true;
        }
        let share = (TURN_MAX_RAD / largest_rad).min(1.0);
        is_settled = true;
        for joint in self.joints.iter_mut().filter(|joint| joint.is_free) {
            let wanted = joint.angle.rad + share * joint.turn_rad;
            joint.is_free = joint.holds(wanted);
            joint.turn_rad = joint.held(wanted) - joint.angle.rad;
            is_settled &= joint.is_free;
        }
        is_settled
    }
}

/// The sums from which a step is solved.
struct Sums<V: Vector> {
    /// J W J^T of the free joints.
    normal: V::Normal,
    /// Remaining way of the tip after the pull and the held joints have turned.
    wanted: V,
}

impl<V: Vector> Sums<V> {
    fn new(miss: V) -> Self {
        Sums { normal: V::Normal::default(), wanted: miss }
    }

    #[inline]
    fn add<G: Geometry<Vector = V>>(&mut self, joint: &PosedJoint<G>) {
        if joint.is_free {
            joint.column.add_to(&mut self.normal, joint.stiffness);
            self.wanted = self.wanted - joint.column * joint.pull_rad;
        } else {
            self.wanted = self.wanted - joint.column * joint.turn_rad;
        }
    }

    /// The multiplier of the step: each free joint turns by its stiffness times its column times this.
    #[inline]
    fn multiplier(&self, damping: f64) -> V {
        let multiplier = self.wanted.solved_by(&self.normal, damping);
        // If no free joint moves the tip, there is none.
        if multiplier.dot(multiplier).is_finite() { multiplier } else { V::default() }
    }
}
