//! Inverse kinematics of one chain: a tip target in, joint angles and what is left over out; of an octopus arm, more
//! than a tip ([`ArmSolver`]).
//!
//! Cyclic coordinate descent as the horse thesis has it (Takizawa 2005, 3.2): from the tip to the root,
//! each joint turns by its stiffness times the angle that would point the tip at the target, and is held
//! in its range as it turns. Started from the previous angles. On its own ([`Method::Ccd`]) it leaves
//! millimetres, and only on the branch it is on. By default ([`Method::CcdThenFinish`])
//! 1. sweeps bring the tip near the target, if it is not;
//! 2. a bounded least-squares finish takes it there: two steps on a path, which follow the pose before;
//! 3. what that does not reach, Newton steps take to the nearest pose downhill;
//! 4. if that misses by more than [`REACHED_M`], a search looks for a nearer pose all over the ranges.
//!
//! So the pose is the nearest of all; while the one that is followed reaches, it is followed without a leap.
//! Works on any chain of hinges, planar or not. Never allocates after construction, keeps nothing from one
//! solve to the next, never hides what it could not reach.

mod arm;
mod ccd;
mod chain;
mod finish;
mod geometry;
mod limbs;
mod nearest;
mod pose;
mod search;
mod soft_stop;
mod sole;
#[cfg(test)]
mod tests;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::model::{Chain, Joint};
pub use arm::{ArmSolution, ArmSolver, Clearance, HandOver, Mode, SectionSolver};
use chain::ChainSolver;
use geometry::{Geometry, Plane, Space};
pub use limbs::Limbs;
pub use sole::{SoleSolver, SoleTarget};

/// A target counts as reached when the tip comes this close, m; no pose is left for another that is nearer by
/// less.
pub const REACHED_M: f64 = 5e-5;

/// How a target is solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The thesis' method alone, this many sweeps at most.
    Ccd {
        /// Most sweeps over the chain.
        sweeps: u32,
    },
    /// Sweeps of the thesis' method until the tip is near, then the least-squares finish; the nearest pose on any
    /// branch.
    CcdThenFinish,
}

/// What a solve left.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solution {
    /// Distance from the tip to the target, m.
    pub residual_m: f64,
    /// How many joints stand on a limit of their range.
    pub saturated: u32,
    /// True where the pose does not follow from the one before but was found elsewhere: joints leap.
    pub is_new_branch: bool,
}

/// Solver of one chain, with room for its intermediate results.
#[derive(Debug, Clone)]
pub struct Solver(Kind);

#[derive(Debug, Clone)]
enum Kind {
    Plane(ChainSolver<Plane>),
    Space(ChainSolver<Space>),
}

impl Solver {
    /// A solver for `chain`, whose `joints` are held to the range goals are held to.
    pub fn new(chain: &Chain, joints: &[Joint]) -> Solver {
        Solver(match Plane::of(chain, joints) {
            Some(plane) => Kind::Plane(ChainSolver::new(plane, chain, joints)),
            None => Kind::Space(ChainSolver::new(Space::of(chain), chain, joints)),
        })
    }

    /// Turns `angles` (rad, root first, one a joint; the previous solution as they come in) so that the
    /// tip comes as near as it can to `target_in_body` (m).
    ///
    /// `pull` (0 to 1) is the share of the way to the middle of the ranges that joints go where this does
    /// not move the tip; it keeps a chain with joints to spare from drifting.
    /// A target or angle that is not finite changes nothing and leaves an infinite residual.
    pub fn solve(
        &mut self,
        method: Method,
        target_in_body: DVec3,
        pull: f64,
        angles: &mut [f64],
    ) -> Solution {
        match &mut self.0 {
            Kind::Plane(solver) => solve(solver, method, target_in_body, pull, angles),
            Kind::Space(solver) => solve(solver, method, target_in_body, pull, angles),
        }
    }
}

fn solve<G: Geometry>(
    solver: &mut ChainSolver<G>,
    method: Method,
    target_in_body: DVec3,
    pull: f64,
    angles: &mut [f64],
) -> Solution {
    debug_assert_eq!(angles.len(), solver.joints.len());
    if !target_in_body.is_finite() || angles.iter().any(|angle| !angle.is_finite()) {
        return Solution { residual_m: f64::INFINITY, ..Solution::default() };
    }
    let (target, aside_m) = solver.geometry.project(target_in_body);
    let solution = solver.solve(method, target, pull, angles);
    Solution { residual_m: solution.residual_m.hypot(aside_m), ..solution }
}
