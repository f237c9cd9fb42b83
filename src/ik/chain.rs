//! The solver for one chain, in a plane or in three dimensions.

use super::geometry::Geometry;
use super::pose::PosedJoint;
use super::search::Search;
use super::{Method, REACHED_M, Solution};
use crate::model::{Chain, Joint};

/// A chain, its pose, and storage for intermediate results.
#[derive(Debug, Clone)]
pub(super) struct ChainSolver<G: Geometry> {
    pub(super) geometry: G,
    pub(super) length_m: f64,
    pub(super) joints: Vec<PosedJoint<G>>,
    pub(super) tip: G::Vector,
    /// Second derivatives of half the squared distance, m^2/rad^2, row by row.
    pub(super) hessian: Vec<f64>,
    pub(super) search: Search<G::Vector>,
}

/// If the tip is not this near, m per metre of chain, a solution begins with sweeps, in which the stiffness shapes
/// the pose. On a path the tip is near, and the finish, which weights the joints in the same way, suffices.
const NEAR_SHARE: f64 = 0.1;
/// Most of those sweeps; a target out of reach uses them all.
const SWEEPS_MAX: u32 = 10;
/// The solver stops when the tip is this close, m per metre of chain.
const TOLERANCE_SHARE: f64 = 1e-7;

impl<G: Geometry> ChainSolver<G> {
    pub(super) fn new(geometry: G, chain: &Chain, joints: &[Joint]) -> ChainSolver<G> {
        let posed: Vec<_> = geometry
            .hinges(joints)
            .into_iter()
            .zip(joints)
            .map(|(hinge, joint)| {
                PosedJoint::new(hinge, joint.goal_range_rad(), joint.stiffness, joint.middle_rad())
            })
            .collect();
        let mut solver = ChainSolver {
            geometry,
            length_m: chain.length_m(joints),
            hessian: vec![0.0; posed.len() * posed.len()],
            joints: posed,
            tip: G::Vector::default(),
            search: Search::default(),
        };
        solver.prepare_search();
        solver
    }

    pub(super) fn solve(
        &mut self,
        method: Method,
        target: G::Vector,
        pull: f64,
        angles: &mut [f64],
    ) -> Solution {
        self.set_pose(angles);
        let mut is_new_branch = false;
        match method {
            Method::Ccd { sweeps } => self.sweep_until(target, sweeps, self.tolerance_m()),
            Method::CcdThenFinish => {
                self.approach(target, pull);
                if self.distance_m(target) > REACHED_M {
                    is_new_branch = self.search(target, angles);
                }
            }
        }
        self.solution(target, is_new_branch, angles)
    }

    /// As [`Method::CcdThenFinish`], but on the present branch alone.
    pub(super) fn follow(&mut self, target: G::Vector, pull: f64, angles: &mut [f64]) -> Solution {
        self.set_pose(angles);
        self.approach(target, pull);
        self.solution(target, false, angles)
    }

    /// Moves the pose to the nearest one of its branch.
    fn approach(&mut self, target: G::Vector, pull: f64) {
        self.sweep_until(target, SWEEPS_MAX, NEAR_SHARE * self.length_m);
        self.finish(target, pull);
        if self.distance_m(target) > self.tolerance_m() {
            self.descend(target);
        }
    }

    /// Copies the pose to `angles`.
    fn solution(&self, target: G::Vector, is_new_branch: bool, angles: &mut [f64]) -> Solution {
        let mut saturated = 0;
        for (angle, joint) in angles.iter_mut().zip(&self.joints) {
            *angle = joint.angle.rad;
            saturated += u32::from(joint.is_at_limit());
        }
        Solution { residual_m: self.distance_m(target), saturated, is_new_branch }
    }

    /// The tip is on the target when it is this close, m.
    pub(super) fn tolerance_m(&self) -> f64 {
        TOLERANCE_SHARE * self.length_m
    }

    fn sweep_until(&mut self, target: G::Vector, sweeps_max: u32, near_m: f64) {
        for _ in 0..sweeps_max {
            if self.distance_m(target) <= near_m {
                return;
            }
            self.sweep(target);
        }
    }
}
