//! The solver of one chain, in a plane or in space.

use super::finish::Step;
use super::geometry::Geometry;
use super::pose::Pose;
use super::search::Search;
use super::{Method, REACHED_M, Solution};
use crate::model::{Chain, Joint};

/// One hinge as the solver sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hinge<G: Geometry> {
    pub(super) shape: G::Hinge,
    pub(super) range_rad: (f64, f64),
    pub(super) stiffness: f64,
    pub(super) neutral_rad: f64,
}

/// What is fixed of a chain, and room for its solver's intermediate results.
#[derive(Debug, Clone)]
pub(super) struct ChainSolver<G: Geometry> {
    pub(super) geometry: G,
    pub(super) hinges: Vec<Hinge<G>>,
    pub(super) length_m: f64,
    /// Where the solve is, and where the finish tries to go next.
    pub(super) pose: Pose<G>,
    pub(super) trial: Pose<G>,
    pub(super) steps: Vec<Step<G::Vector>>,
    /// Second derivatives of half the squared distance, m^2/rad^2, row by row.
    pub(super) hessian: Vec<f64>,
    pub(super) search: Search<G>,
}

/// The tip is this near, m per metre of chain, or the solve begins with sweeps, which let the stiffness shape
/// the pose. On a path it is near, and the finish, which weighs the joints alike, follows by itself.
const NEAR_SHARE: f64 = 0.1;
/// Most of those sweeps; a target out of reach takes them all.
const SWEEPS_MAX: u32 = 10;
/// A solve stops when the tip is this close, m per metre of chain.
pub(super) const TOLERANCE_SHARE: f64 = 1e-7;

impl<G: Geometry> ChainSolver<G> {
    pub(super) fn new(geometry: G, chain: &Chain, joints: &[Joint]) -> ChainSolver<G> {
        let hinges: Vec<Hinge<G>> = geometry
            .hinges(joints)
            .into_iter()
            .zip(joints)
            .map(|(shape, joint)| Hinge {
                shape,
                range_rad: joint.goal_range_rad(),
                stiffness: joint.stiffness,
                neutral_rad: joint.middle_rad(),
            })
            .collect();
        let pose = Pose::new(hinges.len());
        let search = Search::new(&geometry, &hinges);
        ChainSolver {
            geometry,
            length_m: chain.length_m(joints),
            trial: pose.clone(),
            steps: vec![Step::default(); hinges.len()],
            hessian: vec![0.0; hinges.len() * hinges.len()],
            hinges,
            pose,
            search,
        }
    }

    pub(super) fn solve(
        &mut self,
        method: Method,
        target: G::Vector,
        pull: f64,
        angles: &mut [f64],
    ) -> Solution {
        for (angle, hinge) in angles.iter_mut().zip(&self.hinges) {
            *angle = angle.clamp(hinge.range_rad.0, hinge.range_rad.1);
        }
        self.pose.set(&self.geometry, &self.hinges, angles);
        let mut is_new_branch = false;
        match method {
            Method::Ccd { sweeps } => self.sweep_until(target, sweeps, TOLERANCE_SHARE * self.length_m),
            Method::CcdThenFinish => {
                self.sweep_until(target, SWEEPS_MAX, NEAR_SHARE * self.length_m);
                self.finish(target, pull);
                if self.pose.distance_m(target) > TOLERANCE_SHARE * self.length_m {
                    self.descend(target);
                }
                if self.pose.distance_m(target) > REACHED_M {
                    is_new_branch = self.search(target, angles);
                }
            }
        }
        let mut saturated = 0;
        for ((angle, joint), hinge) in angles.iter_mut().zip(&self.pose.joints).zip(&self.hinges) {
            *angle = joint.angle_rad;
            saturated += u32::from(*angle <= hinge.range_rad.0 || *angle >= hinge.range_rad.1);
        }
        Solution { residual_m: self.pose.distance_m(target), saturated, is_new_branch }
    }

    fn sweep_until(&mut self, target: G::Vector, sweeps_max: u32, near_m: f64) {
        for _ in 0..sweeps_max {
            if self.pose.distance_m(target) <= near_m {
                return;
            }
            self.sweep(target);
        }
    }
}
