//! The IK stage: tip targets of every chain to joint angles. A pose passes straight through.

use super::{Method, Solver};
use crate::model::Robot;
use crate::signals::{Aim, JointTargets, Targets};

/// One solver a chain, and the angles they start from.
#[derive(Debug, Clone)]
pub struct Limbs {
    method: Method,
    chains: Vec<(std::ops::Range<usize>, Solver)>,
}

impl Limbs {
    /// Solvers for every chain of `robot`.
    pub fn new(robot: &Robot, method: Method) -> Limbs {
        let chains = robot
            .chains
            .iter()
            .map(|chain| (chain.joints.clone(), Solver::new(chain, robot.joints_of(chain))))
            .collect();
        Limbs { method, chains }
    }

    /// Writes the joint angles for `targets`. The angles `joints` comes in with are where the solve starts.
    pub fn solve(&mut self, targets: &Targets, joints: &mut JointTargets) {
        joints.is_limp = targets.aim == Aim::Limp;
        joints.only = match targets.aim {
            Aim::Joint(joint) => Some(joint),
            Aim::Limp | Aim::Pose | Aim::Tips => None,
        };
        match targets.aim {
            Aim::Limp => joints.residual_m.fill(0.0),
            Aim::Pose | Aim::Joint(_) => {
                joints.angles_rad.copy_from_slice(&targets.pose_rad);
                joints.residual_m.fill(0.0);
            }
            Aim::Tips => {
                for (index, (range, solver)) in self.chains.iter_mut().enumerate() {
                    let angles = &mut joints.angles_rad[range.clone()];
                    let tip = targets.tips_in_body[index];
                    joints.residual_m[index] =
                        solver.solve(self.method, tip, targets.posture_pull, angles).residual_m;
                }
            }
        }
    }
}
