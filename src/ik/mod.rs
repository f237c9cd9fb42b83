//! Inverse kinematics of one chain: a tip target in, joint angles and what is left over out.
//!
//! Cyclic coordinate descent as the horse thesis has it (Takizawa 2005, 3.2): from the tip to the root,
//! each joint turns by its stiffness times the angle that would point the tip at the target, and is held
//! in its range as it turns. Started from the previous angles. On its own ([`Method::Ccd`]) it leaves
//! millimetres; by default a bounded least-squares finish ([`Method::CcdThenFinish`]) takes it to
//! the nearest pose. Works on any chain of hinges, planar or not. Never allocates after construction,
//! never hides what it could not reach.

mod ccd;
mod finish;
mod limbs;
#[cfg(test)]
mod tests;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::model::{Chain, Joint};
pub use limbs::Limbs;

/// How a target is solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The thesis' method alone, this many sweeps at most.
    Ccd {
        /// Most sweeps over the chain.
        sweeps: u32,
    },
    /// Sweeps of the thesis' method until the tip is near, then the least-squares finish.
    CcdThenFinish,
}

/// What a solve left.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solution {
    /// Distance from the tip to the target, m.
    pub residual_m: f64,
    /// How many joints stand on a limit of their range.
    pub saturated: u32,
}

/// One hinge as the solver sees it.
#[derive(Debug, Clone)]
struct Hinge {
    axis: DVec3,
    link_m: DVec3,
    range_rad: (f64, f64),
    stiffness: f64,
    neutral_rad: f64,
}

/// Solver of one chain, with room for its intermediate results.
#[derive(Debug, Clone)]
pub struct Solver {
    root_m: DVec3,
    root_rotation: DQuat,
    hinges: Vec<Hinge>,
    length_m: f64,
    /// Place of each joint and of the tip, body frame, m; one more than hinges.
    places: Vec<DVec3>,
    /// Turning axis of each joint in the body frame.
    axes: Vec<DVec3>,
    /// How the tip moves with each joint, body frame, m/rad: the columns of the Jacobian.
    columns: Vec<DVec3>,
    /// Steps and trial angles of the finish.
    step: Vec<f64>,
    trial: Vec<f64>,
    is_free: Vec<bool>,
}

/// Before the finish, sweeps go on until the tip is this near, m per metre of chain: one sweep while
/// following a path; from afar as many as it takes to let the stiffness shape the pose.
const NEAR_SHARE: f64 = 0.02;
/// Most of those sweeps; a target out of reach takes them all.
const SWEEPS_MAX: u32 = 10;
/// A solve stops when the tip is this close, m per metre of chain.
const TOLERANCE_SHARE: f64 = 1e-7;

impl Solver {
    /// A solver for `chain`, whose `joints` are held to the range goals are held to.
    pub fn new(chain: &Chain, joints: &[Joint]) -> Solver {
        let hinges: Vec<Hinge> = joints
            .iter()
            .map(|joint| Hinge {
                axis: joint.axis,
                link_m: joint.link_m,
                range_rad: joint.goal_range_rad(),
                stiffness: joint.stiffness,
                neutral_rad: joint.middle_rad(),
            })
            .collect();
        let count = hinges.len();
        Solver {
            root_m: chain.root_m,
            root_rotation: chain.root_rotation,
            hinges,
            length_m: chain.length_m(joints),
            places: vec![DVec3::ZERO; count + 1],
            axes: vec![DVec3::Y; count],
            columns: vec![DVec3::ZERO; count],
            step: vec![0.0; count],
            trial: vec![0.0; count],
            is_free: vec![true; count],
        }
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
        debug_assert_eq!(angles.len(), self.hinges.len());
        if !target_in_body.is_finite() || angles.iter().any(|angle| !angle.is_finite()) {
            return Solution { residual_m: f64::INFINITY, saturated: 0 };
        }
        for (angle, hinge) in angles.iter_mut().zip(&self.hinges) {
            *angle = angle.clamp(hinge.range_rad.0, hinge.range_rad.1);
        }
        let tolerance_m = TOLERANCE_SHARE * self.length_m;
        match method {
            Method::Ccd { sweeps } => {
                self.place(angles);
                for _ in 0..sweeps {
                    if self.tip().distance(target_in_body) <= tolerance_m {
                        break;
                    }
                    self.sweep(target_in_body, angles);
                }
            }
            Method::CcdThenFinish => {
                self.place(angles);
                for _ in 0..SWEEPS_MAX {
                    self.sweep(target_in_body, angles);
                    if self.tip().distance(target_in_body) <= NEAR_SHARE * self.length_m {
                        break;
                    }
                }
                self.finish(target_in_body, pull, tolerance_m, angles);
            }
        }
        let saturated =
            angles.iter().zip(&self.hinges).filter(|(angle, hinge)| hinge.is_at_limit(**angle)).count();
        Solution {
            residual_m: self.tip().distance(target_in_body),
            saturated: u32::try_from(saturated).unwrap_or(u32::MAX),
        }
    }

    /// Forward kinematics into `places` and `axes`.
    fn place(&mut self, angles: &[f64]) {
        let (mut position, mut rotation) = (self.root_m, self.root_rotation);
        for (index, (hinge, &angle)) in self.hinges.iter().zip(angles).enumerate() {
            self.places[index] = position;
            self.axes[index] = rotation * hinge.axis;
            rotation *= DQuat::from_axis_angle(hinge.axis, angle);
            position += rotation * hinge.link_m;
        }
        self.places[self.hinges.len()] = position;
    }

    fn tip(&self) -> DVec3 {
        self.places[self.hinges.len()]
    }
}

impl Hinge {
    fn is_at_limit(&self, angle: f64) -> bool {
        angle <= self.range_rad.0 || angle >= self.range_rad.1
    }
}
