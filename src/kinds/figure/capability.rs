//! Positions of a figure's trunk and joints in each of its poses, and the torques its joints hold there.

use glam::DVec3;

use crate::ik::{Limbs, Method, REACHED_M};
use crate::kinds::loads::Load;
use crate::model::{FigureMotion, FigurePose, Joint, Robot};
use crate::motion::figure::{FigurePlan, TrunkPosture};
use crate::signals::{JointTargets, Targets};

/// Most solutions until the centre of mass is over the feet.
const ROUNDS: u32 = 200;
/// The centre of mass counts as over the feet within this distance, m.
const OVER_FEET_M: f64 = 1e-6;

/// Capability of a figure.
#[derive(Debug, Clone)]
pub struct FigureCapability {
    plan: FigurePlan,
    /// Centre of mass in each pose: forward of the middle of the soles, to its left, above the ground, m.
    pub centers_m: Vec<DVec3>,
    /// Torque of each joint in each pose if the weight is split equally, half of it at the middle of each
    /// sole, N m.
    pub split_nm: Vec<Vec<f64>>,
    /// Load of each joint in the heaviest of its poses, in the robot's order.
    pub loads: Vec<Load>,
}

/// The reason why a figure cannot take a pose.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the {leg} sole is {miss_mm:.1} mm from its target")]
pub struct PoseError {
    /// Number of the pose; `None` for sitting.
    pub pose: Option<usize>,
    /// The leg.
    pub leg: &'static str,
    /// Distance from the target, mm; a missing rotation counts too.
    pub miss_mm: f64,
}

impl PoseError {
    /// The key of the robot file at fault, and what was expected there.
    pub(in crate::kinds) fn fault(&self) -> (String, String) {
        match self.pose {
            None => ("motion.sit_height_mm".to_owned(), format!("a height the legs can fold to: {self}")),
            Some(pose) => (
                format!("motion.pose[{pose}]"),
                format!(
                    "a pose both legs reach the ground from, a little before the ends of their ranges: {self}"
                ),
            ),
        }
    }
}

impl FigureCapability {
    /// Computes the poses of `robot`.
    ///
    /// # Errors
    /// [`PoseError`] for the first pose it cannot take with its soles on the ground.
    pub fn of(robot: &Robot, figure: &FigureMotion) -> Result<FigureCapability, PoseError> {
        let sole = |leg: usize| DVec3::Y * robot.chains[leg].root_m.y;
        let mut solver = PoseSolver {
            robot,
            figure,
            soles: figure.legs.map(sole),
            limbs: Limbs::new(robot, Method::CcdThenFinish),
            targets: Targets::new(robot),
            joints: JointTargets::new(robot),
        };
        let mut plan = FigurePlan {
            settings: figure.clone(),
            soles: solver.soles,
            sit_forward_m: 0.0,
            forward_m: Vec::new(),
            sit_pose_rad: Vec::new(),
            pose_rad: Vec::new(),
            pose: 0,
        };
        let (mut centers_m, mut loads): (Vec<DVec3>, Vec<Load>) = (Vec::new(), Vec::new());
        for (place, pose) in figure.poses.iter().enumerate() {
            let (forward_m, center_m) =
                solver.solve(pose).map_err(|error| PoseError { pose: Some(place), ..error })?;
            plan.forward_m.push(forward_m);
            plan.pose_rad.push(solver.joints.angles_rad.clone());
            centers_m.push(center_m);
        }
        if let Some(stand) = figure.poses.first() {
            let sitting = FigurePose { height_m: figure.sit_height_m, ..stand.clone() };
            plan.sit_forward_m = solver.solve(&sitting)?.0;
            plan.sit_pose_rad.clone_from(&solver.joints.angles_rad);
        }
        let split_of = |(place, angles): (usize, &Vec<f64>)| {
            let stance = plan.stance(place);
            (0..robot.joints.len())
                .map(|joint| hold_nm(robot, figure, stance, angles, joint))
                .collect::<Vec<f64>>()
        };
        let split_nm: Vec<Vec<f64>> = plan.pose_rad.iter().enumerate().map(split_of).collect();
        for (joint, of) in robot.joints.iter().enumerate() {
            let torque_nm = split_nm.iter().map(|pose| pose[joint].abs()).fold(0.0, f64::max);
            let share_of_stall = of.servo.map(|servo| torque_nm / servo.model.stall_torque_nm);
            loads.push(Load { joint, torque_nm, share_of_stall });
        }
        Ok(FigureCapability { plan, centers_m, split_nm, loads })
    }

    /// A plan to take pose number `pose` if the order says no more than to go.
    pub fn plan(&self, pose: usize) -> FigurePlan {
        FigurePlan { pose, ..self.plan.clone() }
    }
}

struct PoseSolver<'r> {
    robot: &'r Robot,
    figure: &'r FigureMotion,
    soles: [DVec3; 2],
    limbs: Limbs,
    targets: Targets,
    joints: JointTargets,
}

impl PoseSolver<'_> {
    /// Leaves the joints in `pose`; returns how far forward of its soles the trunk then is, m, and the centre
    /// of mass.
    fn solve(&mut self, pose: &FigurePose) -> Result<(f64, DVec3), PoseError> {
        for (angle, joint) in self.joints.angles_rad.iter_mut().zip(&self.robot.joints) {
            *angle = Joint::middle_rad(joint);
        }
        self.targets.set_soles().pose_rad.copy_from_slice(&pose.angles_rad);
        let mut stance = TrunkPosture {
            rise_m: pose.height_m - self.figure.stand_height_m,
            pitch_rad: pose.pitch_rad,
            roll_rad: pose.roll_rad,
            sway_m: pose.sway_m,
            forward_m: 0.0,
        };
        let mut center = DVec3::ZERO;
        for _ in 0..ROUNDS {
            stance.write(self.figure.legs, self.soles, self.figure.stand_height_m, &mut self.targets);
            self.limbs.solve(&self.targets, &mut self.joints);
            let in_body = self.robot.center_of_mass_in_body(&self.joints.angles_rad);
            center = self.targets.trunk_in_world + self.targets.trunk_orientation * in_body;
            if center.x.abs() < OVER_FEET_M && self.misses().all(|(_, miss_m)| miss_m < OVER_FEET_M) {
                break;
            }
            stance.forward_m -= center.x;
        }
        let worst = self.misses().fold(("", 0.0), |worst, miss| if miss.1 > worst.1 { miss } else { worst });
        if worst.1 > REACHED_M {
            return Err(PoseError { pose: None, leg: worst.0, miss_mm: worst.1 * 1e3 });
        }
        Ok((stance.forward_m, center))
    }

    fn misses(&self) -> impl Iterator<Item = (&'static str, f64)> {
        ["left", "right"].into_iter().zip(self.figure.legs.map(|leg| self.joints.residual_m[leg]))
    }
}

/// Torque that holds joint number `joint` at `angles`, N m, with the weight shared by the soles as when the
/// centre of mass is over their middle. For a leg it is the moment of its half of the weight at its sole,
/// less that of the parts between; for other limbs the moment of the parts that hang on the joint. `stance`
/// gives the trunk's posture.
fn hold_nm(robot: &Robot, figure: &FigureMotion, stance: TrunkPosture, angles: &[f64], joint: usize) -> f64 {
    const GRAVITY_M_S2: f64 = 9.806_65;
    let Some(place) = robot.chains.iter().position(|chain| chain.joints.contains(&joint)) else { return 0.0 };
    let chain = &robot.chains[place];
    let up = stance.trunk_orientation().inverse() * DVec3::Z;
    let (mut position, mut rotation) = (chain.root_m, chain.root_rotation);
    let (mut pivot, mut axis, mut moment) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for index in chain.joints.clone() {
        let of = &robot.joints[index];
        if index == joint {
            (pivot, axis) = (position, rotation * of.axis);
        }
        rotation *= glam::DQuat::from_axis_angle(of.axis, angles.get(index).copied().unwrap_or_default());
        if index >= joint {
            moment += (position + rotation * of.center_m - pivot).cross(-up * of.mass_kg * GRAVITY_M_S2);
        }
        position += rotation * of.link_m;
    }
    if figure.legs.contains(&place) {
        let weight_n = robot.mass_kg() * GRAVITY_M_S2;
        moment += (position - pivot).cross(up * 0.5 * weight_n);
    }
    -moment.dot(axis)
}
