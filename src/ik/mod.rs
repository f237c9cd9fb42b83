//! Inverse kinematics of one chain. Input: a tip target. Output: joint angles and the remaining error. An
//! octopus arm takes more than a tip ([`ArmSolver`]).
//!
//! Cyclic coordinate descent follows the horse thesis (Takizawa 2005, 3.2): from the tip to the root, each
//! joint turns by its stiffness times the angle that would point the tip at the target, and stays within its
//! range as it turns. It starts from the previous angles. On its own ([`Method::Ccd`]) it leaves errors of
//! millimetres, and it finds only poses on its present branch. By default ([`Method::CcdThenFinish`])
//! 1. sweeps bring the tip near the target, if it is not near;
//! 2. a bounded least-squares finish takes it there: two steps on a path, which follow the last pose;
//! 3. if that does not reach, Newton steps go downhill to the nearest pose;
//! 4. if that misses by more than [`REACHED_M`], a search looks for a nearer pose over the whole ranges.
//!
//! So the pose is the nearest of all; while the followed pose reaches the target, the solver follows it
//! without a jump. Works on any chain of hinges, planar or not. Never allocates after construction, keeps no
//! state between solutions, and never hides an error that remains.

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

/// A target counts as reached when the tip comes this close, m; the solver changes to another pose only if it
/// is nearer by at least this.
pub const REACHED_M: f64 = 5e-5;

/// The method of solution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The thesis' method alone, with at most this many sweeps.
    Ccd {
        /// Most sweeps over the chain.
        sweeps: u32,
    },
    /// Sweeps of the thesis' method until the tip is near, then the least-squares finish; finds the nearest
    /// pose on any branch.
    CcdThenFinish,
}

/// Result of a solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solution {
    /// Distance from the tip to the target, m.
    pub residual_m: f64,
    /// Number of joints at a limit of their range.
    pub saturated: u32,
    /// True if the pose does not follow from the last one but was found elsewhere: the joints jump.
    pub is_new_branch: bool,
}

/// Solver for one chain, with storage for its intermediate results.
#[derive(Debug, Clone)]
pub struct Solver(Kind);

#[derive(Debug, Clone)]
enum Kind {
    Plane(ChainSolver<Plane>),
    Space(ChainSolver<Space>),
}

impl Solver {
    /// A solver for `chain`; its `joints` stay within the range for goals.
    pub fn new(chain: &Chain, joints: &[Joint]) -> Solver {
        Solver(match Plane::of(chain, joints) {
            Some(plane) => Kind::Plane(ChainSolver::new(plane, chain, joints)),
            None => Kind::Space(ChainSolver::new(Space::of(chain), chain, joints)),
        })
    }

    /// Turns `angles` (rad, root first, one per joint; on entry the previous solution) so that the tip comes
    /// as near as possible to `target_in_body` (m).
    ///
    /// `pull` (0 to 1) is the share of the way to the middle of their ranges that joints move if this does
    /// not move the tip; it keeps a chain with redundant joints from drifting.
    /// A target or angle that is not finite changes nothing and returns an infinite residual.
    pub fn solve(
        &mut self,
        method: Method,
        target_in_body: DVec3,
        pull: f64,
        angles: &mut [f64],
    ) -> Solution {
        match &mut self.0 {
            Kind::Plane(chain) => solve(chain, target_in_body, angles, |chain, target, angles| {
                chain.solve(method, target, pull, angles)
            }),
            Kind::Space(chain) => solve(chain, target_in_body, angles, |chain, target, angles| {
                chain.solve(method, target, pull, angles)
            }),
        }
    }

    /// As [`Solver::solve`] with [`Method::CcdThenFinish`], but does not look for a pose elsewhere if the present
    /// branch of poses does not reach `target_in_body`: much faster where the answer may be no.
    pub fn follow(&mut self, target_in_body: DVec3, pull: f64, angles: &mut [f64]) -> Solution {
        match &mut self.0 {
            Kind::Plane(chain) => solve(chain, target_in_body, angles, |chain, target, angles| {
                chain.follow(target, pull, angles)
            }),
            Kind::Space(chain) => solve(chain, target_in_body, angles, |chain, target, angles| {
                chain.follow(target, pull, angles)
            }),
        }
    }
}

fn solve<G: Geometry>(
    chain: &mut ChainSolver<G>,
    target_in_body: DVec3,
    angles: &mut [f64],
    solve: impl FnOnce(&mut ChainSolver<G>, G::Vector, &mut [f64]) -> Solution,
) -> Solution {
    debug_assert_eq!(angles.len(), chain.joints.len());
    if !target_in_body.is_finite() || angles.iter().any(|angle| !angle.is_finite()) {
        return Solution { residual_m: f64::INFINITY, ..Solution::default() };
    }
    let (target, aside_m) = chain.geometry.project(target_in_body);
    let solution = solve(chain, target, angles);
    Solution { residual_m: solution.residual_m.hypot(aside_m), ..solution }
}
