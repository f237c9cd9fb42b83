//! The stage of inverse kinematics: from targets of every chain to joint angles. A pose passes straight through.

use std::ops::Range;

use super::soft_stop::SoftStops;
use super::{
    ArmSolution, ArmSolver, Clearance, HandOver, Method, Mode, SectionSolver, SoleSolver, SoleTarget, Solver,
};
use crate::model::{ArmGeometry, Bending, Chain, Robot};
use crate::signals::{ArmAim, ArmTarget, JointTargets, Targets, Wanted};

/// One solver per chain, and the angles from which they start.
#[derive(Debug, Clone)]
pub struct Limbs {
    method: Method,
    limbs: Vec<Limb>,
    /// Clearance of arms.
    clearance: Option<Clearance>,
    /// The last output angles, rad.
    out_rad: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Limb {
    joints: Range<usize>,
    tip: Solver,
    /// The solver, if the chain is an arm.
    arm: Option<Arm>,
    /// For a figure: the solver for its sole, and the soft stops before the ends of its ranges.
    sole: Option<(SoleSolver, SoftStops)>,
}

/// An arm's solver, which follows its own last solution, and the transition from one motion to the next.
#[derive(Debug, Clone)]
struct Arm {
    solver: ArmSolverKind,
    solved_rad: Vec<f64>,
    hand_over: HandOver,
}

/// The solver of the arm's kind.
#[derive(Debug, Clone)]
enum ArmSolverKind {
    Hinges(ArmSolver),
    Tendons(SectionSolver),
}

impl Limbs {
    /// Number of corrections so far that moved arms apart that came too near to each other.
    pub fn corrections(&self) -> u64 {
        self.clearance.as_ref().map_or(0, Clearance::corrections)
    }

    /// Solvers for every chain of `robot`.
    pub fn new(robot: &Robot, method: Method) -> Limbs {
        let tentacle = robot.motion.tentacle();
        let bending = tentacle.map_or(Bending::default(), |tentacle| tentacle.bending);
        let clearance = tentacle.map(|tentacle| Clearance::new(robot, tentacle));
        let limb = |chain: &Chain| Limb {
            joints: chain.joints.clone(),
            tip: Solver::new(chain, robot.joints_of(chain)),
            arm: Arm::of(robot, chain, bending),
            sole: robot.motion.figure().map(|figure| {
                let joints = robot.joints_of(chain);
                (SoleSolver::new(chain, joints), SoftStops::new(joints, figure.soft_stop_rad))
            }),
        };
        let out_rad = vec![0.0; robot.joints.len()];
        Limbs { method, limbs: robot.chains.iter().map(limb).collect(), clearance, out_rad }
    }

    /// Writes the last output again: with targets that stand still no joint moves, not even towards the end
    /// of a change of motion.
    pub fn hold(&self, targets: &Targets, joints: &mut JointTargets) {
        joints.torque_shares.fill(targets.torque_share);
        joints.angles_rad.copy_from_slice(&self.out_rad);
    }

    /// Writes the joint angles for `targets`. The solution starts from the angles in `joints`.
    pub fn solve(&mut self, targets: &Targets, joints: &mut JointTargets) {
        let wanted = targets.wanted();
        joints.is_limp = matches!(wanted, Wanted::Limp);
        joints.only = match wanted {
            Wanted::Joint { joint, .. } => Some(joint),
            _ => None,
        };
        joints.torque_shares.fill(targets.torque_share);
        joints.may_restart = targets.may_restart;
        joints.not_finite = None;
        joints.residual_m.fill(0.0);
        joints.group_residual_m.fill(0.0);
        joints.saturated.fill(0);
        match wanted {
            Wanted::Limp => {}
            Wanted::Pose(pose_rad) | Wanted::Joint { pose_rad, .. } => {
                joints.angles_rad.copy_from_slice(pose_rad);
                joints.not_finite = pose_rad.iter().position(|angle| !angle.is_finite());
            }
            Wanted::Tips { tips_in_body, .. } => {
                for (index, limb) in self.limbs.iter_mut().enumerate() {
                    let angles = &mut joints.angles_rad[limb.joints.clone()];
                    let solution =
                        limb.tip.solve(self.method, tips_in_body[index], targets.posture_pull, angles);
                    joints.residual_m[index] = solution.residual_m;
                    joints.saturated[index] = solution.saturated;
                    if !solution.residual_m.is_finite() {
                        joints.not_finite = joints.not_finite.or(Some(limb.joints.start));
                    }
                }
            }
            Wanted::Soles { tips_in_body, sole_orientations, feet, pose_rad } => {
                let target = |chain: usize| {
                    let has_foot = feet.iter().any(|foot| foot.chain == chain);
                    has_foot
                        .then(|| SoleTarget { place: tips_in_body[chain], turn: sole_orientations[chain] })
                };
                self.solve_soles(target, pose_rad, joints);
            }
            Wanted::Arms(arms) => self.solve_arms(arms, joints),
        }
        if !matches!(wanted, Wanted::Arms(_)) {
            for limb in &mut self.limbs {
                if let Some(arm) = &mut limb.arm {
                    arm.hand_over.pass(&joints.angles_rad[limb.joints.clone()]);
                }
            }
        }
        if let Some(clearance) = &mut self.clearance {
            match wanted {
                _ if joints.not_finite.is_some() => clearance.pass(),
                Wanted::Arms(_) => clearance.keep(Mode::Strokes, &mut joints.angles_rad),
                Wanted::Pose(_) => clearance.keep(Mode::Pose, &mut joints.angles_rad),
                _ => clearance.pass(),
            }
        }
        self.out_rad.copy_from_slice(&joints.angles_rad);
    }

    /// Solves the chains that have a target for their sole; the others take their angles from `pose_rad`.
    fn solve_soles(
        &mut self,
        target: impl Fn(usize) -> Option<SoleTarget>,
        pose_rad: &[f64],
        joints: &mut JointTargets,
    ) {
        for (index, limb) in self.limbs.iter_mut().enumerate() {
            let Some((solver, stops)) = &mut limb.sole else { continue };
            let angles = &mut joints.angles_rad[limb.joints.clone()];
            if let Some(target) = target(index) {
                let solution = solver.solve(target, angles);
                joints.saturated[index] = solution.saturated;
                joints.residual_m[index] = solution.residual_m;
                if !solution.residual_m.is_finite() {
                    joints.not_finite = joints.not_finite.or(Some(limb.joints.start));
                    continue;
                }
                stops.soften(angles);
                joints.residual_m[index] = solver.residual_m(target, angles);
            } else {
                angles.copy_from_slice(&pose_rad[limb.joints.clone()]);
                let not_finite = angles.iter().position(|angle| !angle.is_finite());
                joints.not_finite = joints.not_finite.or(not_finite.map(|place| limb.joints.start + place));
                stops.soften(angles);
            }
        }
    }

    fn solve_arms(&mut self, targets: &[ArmTarget], joints: &mut JointTargets) {
        // The search for a motion's first pose takes longer than all else: only one arm does it per cycle.
        let mut may_begin = true;
        for (index, limb) in self.limbs.iter_mut().enumerate() {
            let Some(arm) = &mut limb.arm else { continue };
            let target = &targets[index];
            let angles = &mut joints.angles_rad[limb.joints.clone()];
            let solution = arm.solve(target, &mut may_begin, angles);
            joints.residual_m[index] = solution.tip_residual_m;
            if target.aim == ArmAim::Ends {
                joints.group_residual_m[index] = solution.residual_m;
            }
            joints.saturated[index] = solution.saturated;
            if !solution.residual_m.is_finite() {
                joints.not_finite = joints.not_finite.or(Some(limb.joints.start));
            }
        }
    }
}

impl Arm {
    fn of(robot: &Robot, chain: &Chain, bending: Bending) -> Option<Arm> {
        let joints = robot.joints_of(chain);
        let solver = match &chain.tendons {
            Some(drive) => ArmSolverKind::Tendons(SectionSolver::new(drive, chain)),
            None => {
                let geometry = ArmGeometry::of(chain, joints).ok()?;
                ArmSolverKind::Hinges(ArmSolver::new(&geometry, chain, joints, bending, robot.period_s()))
            }
        };
        Some(Arm {
            solver,
            solved_rad: vec![0.0; joints.len()],
            hand_over: HandOver::new(joints, &robot.safety, robot.period_s()),
        })
    }

    /// Writes the angles to send for `target`; on entry `angles` are those sent in the last cycle. A new motion
    /// waits until it `may_begin`, and then no other may begin in this cycle; an arm that waits has no residual.
    fn solve(&mut self, target: &ArmTarget, may_begin: &mut bool, angles: &mut [f64]) -> ArmSolution {
        let is_new = self.hand_over.is_new(target.change);
        if is_new && !*may_begin {
            self.hand_over.wait(angles);
            return ArmSolution::default();
        }
        if is_new {
            *may_begin = false;
            self.solved_rad.copy_from_slice(angles);
        }
        let solution = match &mut self.solver {
            ArmSolverKind::Hinges(solver) => solver.solve(target, is_new, &mut self.solved_rad),
            ArmSolverKind::Tendons(solver) => solver.solve(target, is_new, &mut self.solved_rad),
        };
        if solution.residual_m.is_finite() {
            angles.copy_from_slice(&self.solved_rad);
            self.hand_over.fade(target.change, angles);
        }
        solution
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config;
    use crate::model::tendon::SectionBend;

    #[test]
    fn of_arms_that_start_together_one_searches_its_pose_per_cycle() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/octopus.toml");
        let robot = config::load(&path).unwrap().robot;
        let mut limbs = Limbs::new(&robot, Method::CcdThenFinish);
        let (mut targets, mut joints) = (Targets::new(&robot), JointTargets::new(&robot));
        targets.set_pose();
        limbs.solve(&targets, &mut joints);
        let bends = [SectionBend { lift: 0.5, sweep: 0.2 }; 3];
        for (chain, arm) in robot.chains.iter().zip(targets.set_arms().0) {
            arm.aim = ArmAim::Ends;
            let drive = chain.tendons.as_ref().unwrap();
            drive.walk(chain.root_m, chain.root_rotation, &bends, |joint| {
                arm.ends_in_body[joint.section] = joint.end;
            });
        }
        let mut moved = Vec::new();
        for _ in 0..10 {
            limbs.solve(&targets, &mut joints);
            let moves = |chain: &&Chain| {
                joints.angles_rad[chain.joints.clone()]
                    .iter()
                    .zip(&vec![0.0; chain.joints.len()])
                    .any(|(angle, before)| (angle - before).abs() > 0.0)
            };
            moved.push(robot.chains.iter().filter(moves).count());
        }
        assert_eq!(moved, [1, 2, 3, 4, 5, 6, 7, 8, 8, 8]);
    }
}
