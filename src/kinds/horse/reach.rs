//! How far a leg reaches: its half-excursion E and neutral foot point, from lengths, ranges and heights.
//!
//! The fore-and-aft reach of a foot within the joints' ranges is found at every height of a stride, because
//! legs reach less far, or have gaps, higher up. E is the half-width of the largest steady strides inside
//! that reach, about the neutral point that makes it largest.

use std::ops::Range;

use glam::DVec3;

use super::follower::Follower;
use crate::ik::{Method, REACHED_M, Solver};
use crate::model::{HorseMotion, Joint, LEG_NAMES, Robot};
use crate::motion::curves::SwingCurve;
use crate::motion::horse::{LegReach, Reachable, StridePoint};

/// Pull of the pose towards neutral, as in a walk.
pub(super) const PULL: f64 = 0.1;
/// Number of steps in which a swing is checked.
const STEPS_A_STRIDE: u32 = 128;
/// Steps of the standing height in which the lowest pose is searched for.
const CROUCH_STEPS: f64 = 50.0;
/// Solutions in which a pose settles: the sitting pose from the middle of the ranges, and the next lower pose.
const SITTING: u32 = 100;
const CROUCHING: u32 = 10;
/// Number of candidates for the neutral point.
const NEUTRALS: u32 = 400;

/// Reach of one leg when the trunk stands at its height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// The middle of the reach on the ground, body frame, m.
    pub neutral_in_body: DVec3,
    /// How far fore and aft of that point the foot can go, on the ground and anywhere up to the swing's height, m.
    pub half_excursion_m: f64,
}

/// Reasons why a robot cannot stand as its file says.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReachError {
    /// No pose within the ranges puts the foot on the ground.
    #[error("the {leg} leg reaches the ground at no point below or beside its root")]
    Unreachable {
        /// Name of the leg.
        leg: &'static str,
    },
    /// The foot can stand, but cannot step anywhere with the swing's lift.
    #[error("the {leg} leg stands, but at no point can it lift its foot so high and set it down again")]
    CannotSwing {
        /// Name of the leg.
        leg: &'static str,
    },
    /// The neutral foot point cannot be reached from the sitting height.
    #[error("the {leg} leg cannot sit: its foot misses the neutral point by {miss_um} um")]
    CannotSit {
        /// Name of the leg.
        leg: &'static str,
        /// Distance by which it misses, micrometres.
        miss_um: u64,
    },
}

impl ReachError {
    /// The key of the robot file at fault, and what was expected there.
    pub(in crate::kinds) fn fault(&self) -> (String, String) {
        let (key, expected) = match self {
            ReachError::Unreachable { .. } => {
                ("motion.stand_height_mm", "a height the legs reach the ground from")
            }
            ReachError::CannotSwing { .. } => ("motion.swing_lift_mm", "a lift the legs can do"),
            ReachError::CannotSit { .. } => ("motion.sit_height_mm", "a height the legs can fold to"),
        };
        (key.to_owned(), format!("{expected}: {self}"))
    }
}

/// Reach of each leg of `horse`.
///
/// # Errors
/// [`ReachError::Unreachable`] or [`ReachError::CannotSwing`] for the first leg that cannot stand or step.
pub fn of_legs(robot: &Robot, horse: &HorseMotion) -> Result<[Reach; 4], ReachError> {
    let mut reaches = [Reach { neutral_in_body: DVec3::ZERO, half_excursion_m: 0.0 }; 4];
    for (leg, reach) in reaches.iter_mut().enumerate() {
        *reach = of_leg(robot, horse, leg)?;
    }
    Ok(reaches)
}

fn of_leg(robot: &Robot, horse: &HorseMotion, leg: usize) -> Result<Reach, ReachError> {
    let name = LEG_NAMES[leg];
    let mut follower = Follower::new(robot, horse, leg);
    let start_m = follower.find_ground().ok_or(ReachError::Unreachable { leg: name })?;
    let (aft_m, fore_m) = follower.ends_on_ground(start_m);
    let middle_m = 0.5 * (aft_m + fore_m);
    follower.go_along(start_m, middle_m);
    let ends =
        follower.ends_by_height(middle_m, f64::INFINITY).ok_or(ReachError::CannotSwing { leg: name })?;
    let strides = strides_of(horse);
    let around = |neutral_m: f64| {
        let leg = LegReach {
            aft_m: ends.map(|(aft_m, _)| (neutral_m - aft_m).max(0.0)),
            fore_m: ends.map(|(_, fore_m)| (fore_m - neutral_m).max(0.0)),
        };
        reachable([leg; 4], follower.heights_m(), horse, &strides, f64::INFINITY).half_excursion_m
    };
    let place = |step: u32| aft_m + (fore_m - aft_m) * f64::from(step) / f64::from(NEUTRALS);
    let best = (1..NEUTRALS).map(|step| (around(place(step)), place(step)));
    let (half_excursion_m, neutral_m) =
        best.fold((0.0, middle_m), |best, found| if found.0 > best.0 { found } else { best });
    if half_excursion_m <= 0.0 {
        return Err(ReachError::CannotSwing { leg: name });
    }
    let neutral_in_body = DVec3::new(neutral_m, follower.side_m(), -horse.stand_height_m);
    Ok(Reach { neutral_in_body, half_excursion_m })
}

/// Reach of feet whose legs have the reach `legs`, with the E of steady `strides` up to `limit_m`.
pub(super) fn reachable(
    legs: [LegReach; 4],
    levels_m: (f64, f64),
    horse: &HorseMotion,
    strides: &[StridePoint],
    limit_m: f64,
) -> Reachable {
    let half_oscillation_m =
        0.5 * horse.gaits.iter().map(|gait| gait.vertical_oscillation.rise_m).fold(0.0, f64::max);
    Reachable { half_excursion_m: 0.0, legs, levels_m, half_oscillation_m }
        .with_half_excursion_of(strides, limit_m, 0.0)
}

/// Paths of the strides with the smallest and the largest duty factor of the robot's gaits. The swing's path
/// depends on the duty factor: after a short stance a foot swings further out at both ends.
pub(super) fn strides_of(horse: &HorseMotion) -> Vec<StridePoint> {
    let factors = || horse.gaits.iter().map(|gait| gait.duty_factor);
    [factors().fold(f64::INFINITY, f64::min), factors().fold(0.0, f64::max)]
        .into_iter()
        .flat_map(|duty_factor| stride(horse, duty_factor))
        .collect()
}

/// The swing of a stride with `duty_factor`; the stance lies between its ends.
fn stride(horse: &HorseMotion, duty_factor: f64) -> Vec<StridePoint> {
    let swing = SwingCurve { time_s: 1.0, lift_m: horse.swing_lift_m, ramp_share: horse.swing_ramp_share };
    // In units of the swing time and the trunk's travel in it: the period, and half the travel in stance.
    let period = 1.0 / (1.0 - duty_factor);
    let half_stance = 0.5 * duty_factor * period;
    let mut stride: Vec<StridePoint> = (0..=STEPS_A_STRIDE)
        .map(|step| f64::from(step) / f64::from(STEPS_A_STRIDE))
        .map(|u| StridePoint { forward: -half_stance + period * swing.way(u) - u, up_m: swing.height_m(u) })
        .collect();
    let furthest = stride.iter().map(|point| point.forward.abs()).fold(0.0, f64::max);
    for point in &mut stride {
        point.forward /= furthest;
    }
    stride
}

/// The legs of a horse, each with its foot on its neutral point.
pub(super) struct Legs([(Range<usize>, Solver, DVec3); 4]);

impl Legs {
    /// Legs of `horse` with these neutral points.
    pub(super) fn new(robot: &Robot, horse: &HorseMotion, neutral_in_body: [DVec3; 4]) -> Legs {
        Legs(std::array::from_fn(|leg| {
            let chain = &robot.chains[horse.legs[leg]];
            (chain.joints.clone(), Solver::new(chain, robot.joints_of(chain)), neutral_in_body[leg])
        }))
    }

    /// Puts each foot `height_m` below the trunk by `solve`, which turns the angles of one leg and returns what remains
    /// to its target, m. Returns that of each leg.
    pub(super) fn put(
        &mut self,
        height_m: f64,
        pose_rad: &mut [f64],
        mut solve: impl FnMut(&mut Solver, DVec3, &mut [f64]) -> f64,
    ) -> [f64; 4] {
        self.0.each_mut().map(|(joints, solver, neutral)| {
            solve(solver, neutral.with_z(-height_m), &mut pose_rad[joints.clone()])
        })
    }
}

/// Joint angles of the sitting robot: feet on their neutral points, trunk at the sitting height; the joints
/// of chains that are not legs are in the middle of their ranges.
///
/// # Errors
/// [`ReachError::CannotSit`] for the first leg that cannot.
pub fn sit_pose(robot: &Robot, horse: &HorseMotion, reaches: &[Reach; 4]) -> Result<Vec<f64>, ReachError> {
    let mut pose: Vec<f64> = robot.joints.iter().map(Joint::middle_rad).collect();
    let mut legs = Legs::new(robot, horse, reaches.map(|reach| reach.neutral_in_body));
    let left_m = legs.put(horse.sit_height_m, &mut pose, |leg, target, angles| {
        settled(SITTING, || leg.solve(Method::CcdThenFinish, target, PULL, angles).residual_m)
    });
    match left_m.iter().position(|left_m| *left_m > REACHED_M) {
        None => Ok(pose),
        Some(leg) => {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "for a message")]
            let miss_um = (left_m[leg] * 1e6) as u64;
            Err(ReachError::CannotSit { leg: LEG_NAMES[leg], miss_um })
        }
    }
}

/// The lowest pose with all feet on their neutral points, below the pose `sit_pose_rad`: height of the trunk, m, and joint
/// angles, rad.
pub fn crouch(
    robot: &Robot,
    horse: &HorseMotion,
    reaches: &[Reach; 4],
    sit_pose_rad: &[f64],
) -> (f64, Vec<f64>) {
    let mut lowest = (horse.sit_height_m, sit_pose_rad.to_vec());
    let mut pose = sit_pose_rad.to_vec();
    let step_m = horse.stand_height_m / CROUCH_STEPS;
    let mut legs = Legs::new(robot, horse, reaches.map(|reach| reach.neutral_in_body));
    while lowest.0 > step_m {
        let height_m = lowest.0 - step_m;
        let left_m = legs.put(height_m, &mut pose, |leg, target, angles| {
            settled(CROUCHING, || leg.follow(target, PULL, angles).residual_m)
        });
        if left_m.iter().any(|left_m| *left_m > REACHED_M) {
            break;
        }
        lowest = (height_m, pose.clone());
    }
    lowest
}

/// What remains after `times` solutions, m: a few more than necessary, so that the pull to the neutral posture settles too.
fn settled(times: u32, mut solve: impl FnMut() -> f64) -> f64 {
    (0..times).fold(f64::INFINITY, |_, _| solve())
}
