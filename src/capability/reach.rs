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
use crate::motion::horse::{Lean, ReachTable};

/// How the pose is pulled to neutral while following a stride, as a walk does.
const PULL: f64 = 0.1;
/// Steps a leg's length is scanned in.
const STEPS_A_LENGTH: f64 = 400.0;
/// Steps a stride is followed in.
const STEPS_A_STRIDE: u32 = 128;
/// Halvings of the search for E.
const HALVINGS: u32 = 10;
/// Steps from one posture to another, and halvings of the search for E in it.
const STEPS_A_POSTURE: u32 = 24;
const POSTURE_HALVINGS: u32 = 6;
/// Heights and pitches a leg's reach is worked out at, and the steepest pitch and roll, rad.
const HEIGHTS: u32 = 6;
const PITCHES: u32 = 5;
const PITCH_MAX_RAD: f64 = 0.2;
const ROLL_MAX_RAD: f64 = 0.15;
/// The highest posture, and the furthest sway that is tried, shares of the standing height.
const HIGHEST: f64 = 1.05;
const SWAY_MAX: f64 = 0.15;
/// Share of E that a sway must leave.
const SWAYING_SHARE: f64 = 0.75;
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
        lean: level(horse),
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
                let excursion_m = follower.half_excursion(neutral_m, limit_m, &strides, HALVINGS);
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
    Ok(Reach { neutral_in_body: DVec3::new(neutral_m, tip.y, -horse.stand_height_m), half_excursion_m })
}

/// A stride round the neutral point, in the body frame: forward as a share of E, height in m.
type Stride = Vec<(f64, f64)>;

/// The strides with the smallest and the largest duty factor of the robot's gaits, each from mid-stance
/// round to mid-stance; where the trunk bobs, at its lowest and its highest.
fn strides_of(horse: &HorseMotion) -> Vec<Stride> {
    let factors = || horse.gaits.iter().map(|gait| gait.duty_factor);
    let half_bob_m = 0.5 * horse.gaits.iter().map(|gait| gait.bob.rise_m).fold(0.0, f64::max);
    let heights_m: &[f64] = if half_bob_m > 0.0 { &[-half_bob_m, half_bob_m] } else { &[0.0] };
    [factors().fold(f64::INFINITY, f64::min), factors().fold(0.0, f64::max)]
        .into_iter()
        .flat_map(|duty_factor| heights_m.iter().map(move |height_m| stride(horse, duty_factor, *height_m)))
        .collect()
}

/// The stride of a gait with `duty_factor`, its heights raised by `raised_m`.
fn stride(horse: &HorseMotion, duty_factor: f64, raised_m: f64) -> Stride {
    let swing = SwingCurve { time_s: 1.0, lift_m: horse.swing_lift_m, ramp_share: horse.swing_ramp_share };
    // In units of the swing time and the trunk's way in it: period and half the stance's way.
    let period = 1.0 / (1.0 - duty_factor);
    let half_stance = 0.5 * duty_factor * period;
    let mut stride: Stride = (0..=STEPS_A_STRIDE)
        .map(|step| f64::from(step) / f64::from(STEPS_A_STRIDE) * period)
        .map(|since_middle| {
            let u = since_middle - half_stance;
            if u <= 0.0 {
                (-since_middle, raised_m)
            } else if u >= 1.0 {
                (period - since_middle, raised_m)
            } else {
                (-half_stance + period * swing.way(u) - u, raised_m + swing.height_m(u))
            }
        })
        .collect();
    let extreme = stride.iter().fold(0.0_f64, |extreme, (forward, _)| extreme.max(forward.abs()));
    for (forward, _) in &mut stride {
        *forward /= extreme;
    }
    stride
}

/// A trunk that stands level.
fn level(horse: &HorseMotion) -> Lean {
    Lean { height_m: horse.stand_height_m, pitch_rad: 0.0, roll_rad: 0.0 }
}

/// How far the feet reach in other postures than standing level, round the same neutral points, from `reaches`.
pub fn table(robot: &Robot, horse: &HorseMotion, reaches: &[Reach; 4]) -> ReachTable {
    let level_m = reaches.iter().map(|reach| reach.half_excursion_m).fold(f64::INFINITY, f64::min);
    let between = |low: f64, high: f64, count: u32| -> Vec<f64> {
        (0..count).map(|index| low + (high - low) * f64::from(index) / f64::from(count - 1)).collect()
    };
    let heights_m = between(horse.sit_height_m, HIGHEST * horse.stand_height_m, HEIGHTS);
    let pitches_rad = between(-PITCH_MAX_RAD, PITCH_MAX_RAD, PITCHES);
    let strides = strides_of(horse);
    let mut legs: [Vec<f64>; 4] = Default::default();
    let mut sway_max_m = SWAY_MAX * horse.stand_height_m;
    for (leg, (column, reach)) in legs.iter_mut().zip(reaches).enumerate() {
        let mut follower = Follower::at_neutral(robot, horse, leg, reach);
        for height_m in &heights_m {
            for pitch_rad in &pitches_rad {
                let lean = Lean { height_m: *height_m, pitch_rad: *pitch_rad, roll_rad: 0.0 };
                column.push(follower.half_excursion_at(lean, reach, level_m, &strides));
            }
        }
        sway_max_m = sway_max_m.min(follower.sway_max_m(reach, level_m, &strides, sway_max_m));
    }
    ReachTable {
        level_m,
        stand_height_m: horse.stand_height_m,
        half_excursions_m: (0..legs[0].len()).map(|place| legs.each_ref().map(|leg| leg[place])).collect(),
        heights_m,
        pitches_rad,
        sides_m: reaches.map(|reach| reach.neutral_in_body.y),
        roll_max_rad: ROLL_MAX_RAD,
        sway_max_m,
    }
}

/// A leg's pose, followed from place to place.
struct Follower {
    solver: Solver,
    angles: Vec<f64>,
    side_m: f64,
    lean: Lean,
    length_m: f64,
}

impl Follower {
    /// Leg `leg` with its foot on its neutral point, the trunk standing level.
    fn at_neutral(robot: &Robot, horse: &HorseMotion, leg: usize, reach: &Reach) -> Follower {
        let chain = &robot.chains[horse.legs[leg]];
        let joints = robot.joints_of(chain);
        let mut follower = Follower {
            solver: Solver::new(chain, joints),
            angles: joints.iter().map(Joint::middle_rad).collect(),
            side_m: reach.neutral_in_body.y,
            lean: level(horse),
            length_m: chain.length_m(joints),
        };
        for _ in 0..STEPS_A_STRIDE {
            follower.solve(reach.neutral_in_body.x, 0.0);
        }
        follower
    }

    /// Largest E up to `limit_m` with the trunk as `lean` has it, from its present posture; goes back to that.
    fn half_excursion_at(&mut self, lean: Lean, reach: &Reach, limit_m: f64, strides: &[Stride]) -> f64 {
        let (from, angles) = (self.lean, self.angles.clone());
        for step in 1..=STEPS_A_POSTURE {
            let share = f64::from(step) / f64::from(STEPS_A_POSTURE);
            self.lean = Lean {
                height_m: from.height_m + (lean.height_m - from.height_m) * share,
                pitch_rad: from.pitch_rad + (lean.pitch_rad - from.pitch_rad) * share,
                roll_rad: from.roll_rad + (lean.roll_rad - from.roll_rad) * share,
            };
            self.solve(reach.neutral_in_body.x, 0.0);
        }
        let found_m = self.half_excursion(reach.neutral_in_body.x, limit_m, strides, POSTURE_HALVINGS);
        (self.lean, self.angles) = (from, angles);
        found_m
    }

    /// How far up to `limit_m` the trunk can sway over this foot either way and leave it enough of E; 0 without
    /// a joint that turns sideways.
    fn sway_max_m(&mut self, reach: &Reach, level_m: f64, strides: &[Stride], limit_m: f64) -> f64 {
        let (side_m, angles) = (self.side_m, self.angles.clone());
        let mut sways = |sway_m: f64| {
            let is_enough = [-1.0, 1.0].into_iter().all(|direction| {
                self.side_m = side_m + direction * sway_m;
                self.angles.copy_from_slice(&angles);
                for _ in 0..STEPS_A_POSTURE {
                    self.solve(reach.neutral_in_body.x, 0.0);
                }
                self.half_excursion(reach.neutral_in_body.x, SWAYING_SHARE * level_m, strides, 0) > 0.0
            });
            self.side_m = side_m;
            self.angles.copy_from_slice(&angles);
            is_enough
        };
        if !sways(limit_m / f64::from(1 << POSTURE_HALVINGS)) {
            return 0.0;
        }
        let (mut good_m, mut bad_m) = (0.0, limit_m);
        for _ in 0..POSTURE_HALVINGS {
            let middle_m = 0.5 * (good_m + bad_m);
            if sways(middle_m) { good_m = middle_m } else { bad_m = middle_m }
        }
        good_m
    }

    fn solve(&mut self, x_m: f64, height_m: f64) -> Solution {
        let target = self.lean.tip_in_body(x_m, height_m, self.side_m);
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
    fn half_excursion(&mut self, neutral_m: f64, limit_m: f64, strides: &[Stride], halvings: u32) -> f64 {
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
        for _ in 0..halvings {
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
