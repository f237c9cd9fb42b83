//! How far a leg reaches: its half-excursion E and neutral foot point, from lengths, ranges and heights.
//!
//! E is the largest half-width of a whole stride, stance on the ground and swing through the air, that the
//! leg follows within its ranges, at the neutral point that makes it largest. The swing's path through the
//! body frame depends on the duty factor (a short stance swings further out at its ends), so the strides
//! with the robot's smallest and largest duty factor must both pass.

use glam::DVec3;

use crate::ik::{Method, REACHED_M, Solution, Solver};
use crate::model::{HorseMotion, Joint, LEG_NAMES, Robot};
use crate::motion::curves::SwingCurve;

/// How the pose is pulled to neutral while following a stride, as a walk does.
const PULL: f64 = 0.1;
/// Steps a leg's length is scanned in.
const STEPS_A_LENGTH: f64 = 400.0;
/// Steps a stride is followed in.
const STEPS_A_STRIDE: u32 = 128;
/// Halvings of the search for E.
const HALVINGS: u32 = 10;
/// Places tried as neutral point, and how often the search narrows round the best.
const NEUTRALS: u32 = 8;
const NARROWINGS: u32 = 3;

/// What one leg reaches when the trunk stands at its height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// The middle of the reach on the ground, body frame, m.
    pub neutral_in_body: DVec3,
    /// How far fore and aft of it the foot can go, on the ground and anywhere up to the swing's height, m.
    pub half_excursion_m: f64,
}

/// Why a robot cannot stand as its file says.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReachError {
    /// No pose inside the ranges puts the foot on the ground.
    #[error("the {leg} leg reaches the ground at no point below or beside its root")]
    Unreachable {
        /// Name of the leg.
        leg: &'static str,
    },
    /// The foot can stand, but nowhere take a step with the swing's lift.
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
        /// By how much it misses, micrometres.
        miss_um: u64,
    },
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
    let chain = &robot.chains[horse.legs[leg]];
    let joints = robot.joints_of(chain);
    let middle: Vec<f64> = joints.iter().map(Joint::middle_rad).collect();
    let tip = robot.tip_in_body(chain, middle.iter().copied());
    let mut follower = Follower {
        solver: Solver::new(chain, joints),
        angles: middle,
        side_m: tip.y,
        ground_m: -horse.stand_height_m,
        length_m: chain.length_m(joints),
    };
    let start_m = follower.find_ground(tip.x).ok_or(ReachError::Unreachable { leg: LEG_NAMES[leg] })?;
    let start = follower.angles.clone();
    let fore_m = follower.edge(start_m, 1.0);
    follower.angles.copy_from_slice(&start);
    let aft_m = follower.edge(start_m, -1.0);

    let strides = strides_of(horse);
    let (mut low_m, mut high_m) = (aft_m, fore_m);
    let mut best = (0.0, 0.5 * (aft_m + fore_m));
    for _ in 0..NARROWINGS {
        for place in 0..=NEUTRALS {
            let neutral_m = low_m + (high_m - low_m) * f64::from(place) / f64::from(NEUTRALS);
            let limit_m = (neutral_m - aft_m).min(fore_m - neutral_m);
            if limit_m > best.0 {
                follower.go_to(start_m, &start, neutral_m);
                let excursion_m = follower.half_excursion(neutral_m, limit_m, &strides);
                if excursion_m > best.0 {
                    best = (excursion_m, neutral_m);
                }
            }
        }
        let width_m = (high_m - low_m) / f64::from(NEUTRALS);
        (low_m, high_m) = ((best.1 - width_m).max(aft_m), (best.1 + width_m).min(fore_m));
    }
    let (half_excursion_m, neutral_m) = best;
    if half_excursion_m <= 0.0 {
        return Err(ReachError::CannotSwing { leg: LEG_NAMES[leg] });
    }
    Ok(Reach { neutral_in_body: DVec3::new(neutral_m, tip.y, follower.ground_m), half_excursion_m })
}

/// A stride round the neutral point, in the body frame: forward as a share of E, height in m.
type Stride = Vec<(f64, f64)>;

/// The strides with the smallest and the largest duty factor of the robot's gaits, each from mid-stance
/// round to mid-stance.
fn strides_of(horse: &HorseMotion) -> [Stride; 2] {
    let swing = SwingCurve { time_s: 1.0, lift_m: horse.swing_lift_m, ramp_share: horse.swing_ramp_share };
    let factors = || horse.gaits.iter().map(|gait| gait.duty_factor);
    [factors().fold(f64::INFINITY, f64::min), factors().fold(0.0, f64::max)].map(|duty_factor| {
        // In units of the swing time and the trunk's way in it: period and half the stance's way.
        let period = 1.0 / (1.0 - duty_factor);
        let half_stance = 0.5 * duty_factor * period;
        let mut stride: Stride = (0..=STEPS_A_STRIDE)
            .map(|step| f64::from(step) / f64::from(STEPS_A_STRIDE) * period)
            .map(|since_middle| {
                let u = since_middle - half_stance;
                if u <= 0.0 {
                    (-since_middle, 0.0)
                } else if u >= 1.0 {
                    (period - since_middle, 0.0)
                } else {
                    (-half_stance + period * swing.way(u) - u, swing.height_m(u))
                }
            })
            .collect();
        let extreme = stride.iter().fold(0.0_f64, |extreme, (forward, _)| extreme.max(forward.abs()));
        for (forward, _) in &mut stride {
            *forward /= extreme;
        }
        stride
    })
}

/// A leg's pose, followed from place to place.
struct Follower {
    solver: Solver,
    angles: Vec<f64>,
    side_m: f64,
    ground_m: f64,
    length_m: f64,
}

impl Follower {
    fn solve(&mut self, x_m: f64, height_m: f64) -> Solution {
        let target = DVec3::new(x_m, self.side_m, self.ground_m + height_m);
        self.solver.solve(Method::CcdThenFinish, target, PULL, &mut self.angles)
    }

    /// Whether the pose goes on to this place; where it would have to leap, the reach ends.
    fn follows(&mut self, x_m: f64, height_m: f64) -> bool {
        let solution = self.solve(x_m, height_m);
        solution.residual_m <= REACHED_M && !solution.is_new_branch
    }

    /// The reachable place on the ground nearest to `x_m`; leaves the pose there.
    fn find_ground(&mut self, x_m: f64) -> Option<f64> {
        let middle = self.angles.clone();
        let mut offset_m = 0.0;
        while offset_m <= self.length_m {
            for place_m in [x_m + offset_m, x_m - offset_m] {
                self.angles.copy_from_slice(&middle);
                if self.solve(place_m, 0.0).residual_m <= REACHED_M {
                    return Some(place_m);
                }
            }
            offset_m += 5.0 * self.length_m / STEPS_A_LENGTH;
        }
        None
    }

    /// The last place on the ground reached without a break from `start_m` on, forward (`direction` 1) or
    /// back (-1).
    fn edge(&mut self, start_m: f64, direction: f64) -> f64 {
        let (mut place_m, mut step_m) = (start_m, direction * self.length_m / STEPS_A_LENGTH);
        let finest_m = 1e-3 * step_m.abs();
        let mut good = self.angles.clone();
        while step_m.abs() > finest_m {
            if self.follows(place_m + step_m, 0.0) {
                place_m += step_m;
                good.copy_from_slice(&self.angles);
            } else {
                step_m *= 0.5;
                self.angles.copy_from_slice(&good);
            }
        }
        place_m
    }

    /// Takes the pose from `start` at `start_m` along the ground to `neutral_m`.
    fn go_to(&mut self, start_m: f64, start: &[f64], neutral_m: f64) {
        self.angles.copy_from_slice(start);
        for step in 1..=STEPS_A_STRIDE {
            self.solve(start_m + (neutral_m - start_m) * f64::from(step) / f64::from(STEPS_A_STRIDE), 0.0);
        }
    }

    /// Largest E up to `limit_m` at which every stride round `neutral_m` is followed from the present pose.
    fn half_excursion(&mut self, neutral_m: f64, limit_m: f64, strides: &[Stride]) -> f64 {
        let start = self.angles.clone();
        let mut follows = |excursion_m: f64| {
            strides.iter().all(|stride| {
                self.angles.copy_from_slice(&start);
                stride
                    .iter()
                    .all(|(forward, height_m)| self.follows(neutral_m + excursion_m * forward, *height_m))
            })
        };
        if follows(limit_m) {
            return limit_m;
        }
        let (mut low_m, mut high_m) = (0.0, limit_m);
        for _ in 0..HALVINGS {
            let middle_m = 0.5 * (low_m + high_m);
            if follows(middle_m) { low_m = middle_m } else { high_m = middle_m }
        }
        low_m
    }
}

/// Joint angles of the sitting robot: feet on their neutral points, trunk at the sitting height; the
/// joints of chains that are not legs in the middle of their ranges.
///
/// # Errors
/// [`ReachError::CannotSit`] for the first leg that cannot.
pub fn sit_pose(robot: &Robot, horse: &HorseMotion, reaches: &[Reach; 4]) -> Result<Vec<f64>, ReachError> {
    let mut pose: Vec<f64> = robot.joints.iter().map(Joint::middle_rad).collect();
    for (leg, reach) in reaches.iter().enumerate() {
        let chain = &robot.chains[horse.legs[leg]];
        let mut solver = Solver::new(chain, robot.joints_of(chain));
        let target = reach.neutral_in_body.with_z(-horse.sit_height_m);
        let angles = &mut pose[chain.joints.clone()];
        let mut residual_m = f64::INFINITY;
        // A few solves more than it takes, so that the pull to the neutral posture has settled too.
        for _ in 0..100 {
            residual_m = solver.solve(Method::CcdThenFinish, target, PULL, angles).residual_m;
        }
        if residual_m > REACHED_M {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "for a message")]
            let miss_um = (residual_m * 1e6) as u64;
            return Err(ReachError::CannotSit { leg: LEG_NAMES[leg], miss_um });
        }
    }
    Ok(pose)
}
