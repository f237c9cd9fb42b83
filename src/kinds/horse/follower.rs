//! A leg whose pose follows its foot from point to point, to find the limits of its reach.

use crate::ik::{Method, REACHED_M, Solution, Solver};
use crate::model::{HorseMotion, Joint, Robot};
use crate::motion::horse::{LEVELS, LegReach, TrunkPose};

/// Pull of the pose towards neutral while following, as in a walk.
const PULL: f64 = 0.1;
/// Number of steps in which a leg's length is scanned.
const STEPS_A_LENGTH: f64 = 100.0;
/// Halvings of a step at the limit of the reach, to a ten-thousandth or an eight-hundredth of the leg's length.
const FINE_HALVINGS: i32 = 7;
const COARSE_HALVINGS: i32 = 3;
/// Number of steps from one posture or height to another.
const STEPS_A_MOVE: u32 = 16;

/// A leg's pose.
pub(super) struct Follower {
    solver: Solver,
    angles: Vec<f64>,
    /// Forward position of the tip in the middle of the ranges, m.
    middle_m: f64,
    side_m: f64,
    trunk: TrunkPose,
    length_m: f64,
    /// Halvings of a step at the limit of the reach.
    halvings: i32,
    /// Lowest and highest position of a foot relative to the ground from which the trunk's mean height
    /// is measured, m.
    heights_m: (f64, f64),
}

impl Follower {
    /// Leg `leg` of `robot` in the middle of its ranges, with the trunk level.
    pub(super) fn new(robot: &Robot, horse: &HorseMotion, leg: usize) -> Follower {
        let chain = &robot.chains[horse.legs[leg]];
        let joints = robot.joints_of(chain);
        let angles: Vec<f64> = joints.iter().map(Joint::middle_rad).collect();
        let tip = robot.tip_in_body(chain, angles.iter().copied());
        let half_oscillation_m =
            0.5 * horse.gaits.iter().map(|gait| gait.vertical_oscillation.rise_m).fold(0.0, f64::max);
        Follower {
            solver: Solver::new(chain, joints),
            middle_m: tip.x,
            side_m: tip.y,
            angles,
            trunk: TrunkPose { height_m: horse.stand_height_m, pitch_rad: 0.0, roll_rad: 0.0 },
            length_m: chain.length_m(joints),
            halvings: FINE_HALVINGS,
            heights_m: (-half_oscillation_m, horse.swing_lift_m + half_oscillation_m),
        }
    }

    /// The same with its foot on the ground at `forward_m`, and a coarser search for the limits of the reach:
    /// each limit costs a search for poses that do not exist.
    pub(super) fn standing_at(robot: &Robot, horse: &HorseMotion, leg: usize, forward_m: f64) -> Follower {
        let mut follower = Follower { halvings: COARSE_HALVINGS, ..Follower::new(robot, horse, leg) };
        for _ in 0..4 * STEPS_A_MOVE {
            follower.solve(forward_m, 0.0);
        }
        follower
    }

    /// The same leg in the same pose, with the fine search.
    pub(super) fn finely(&self) -> Follower {
        Follower {
            halvings: FINE_HALVINGS,
            solver: self.solver.clone(),
            angles: self.angles.clone(),
            ..*self
        }
    }

    /// Position of the leg's plane to the left of the trunk's middle, m.
    pub(super) fn side_m(&self) -> f64 {
        self.side_m
    }

    fn solve(&mut self, forward_m: f64, up_m: f64) -> Solution {
        let target = self.trunk.tip_in_body(forward_m, up_m, self.side_m);
        self.solver.solve(Method::CcdThenFinish, target, PULL, &mut self.angles)
    }

    /// True if the pose can follow to this point; the reach ends where the pose would have to jump.
    fn follows(&mut self, forward_m: f64, up_m: f64) -> bool {
        let target = self.trunk.tip_in_body(forward_m, up_m, self.side_m);
        self.solver.follow(target, PULL, &mut self.angles).residual_m <= REACHED_M
    }

    /// The reachable point on the ground nearest below the tip of the present pose; leaves the pose there.
    pub(super) fn find_ground(&mut self) -> Option<f64> {
        let middle = self.angles.clone();
        let mut offset_m = 0.0;
        while offset_m <= self.length_m {
            for place_m in [self.middle_m + offset_m, self.middle_m - offset_m] {
                self.angles.copy_from_slice(&middle);
                if self.solve(place_m, 0.0).residual_m <= REACHED_M {
                    return Some(place_m);
                }
            }
            offset_m += self.length_m / STEPS_A_LENGTH;
        }
        None
    }

    /// The last points aft and fore reached on the ground without a gap from `start_m`, where the pose is.
    pub(super) fn ends_on_ground(&mut self, start_m: f64) -> (f64, f64) {
        self.ends(start_m, 0.0, f64::INFINITY)
    }

    /// Moves the pose along the ground.
    pub(super) fn go_along(&mut self, from_m: f64, to_m: f64) {
        for step in 1..=4 * STEPS_A_MOVE {
            self.solve(from_m + (to_m - from_m) * f64::from(step) / f64::from(4 * STEPS_A_MOVE), 0.0);
        }
    }

    /// The last points aft and fore reached at each height of a stride, at most `limit_m` from `start_m`;
    /// `None` if some height is not reached over `start_m` at all. Leaves the pose on the ground there.
    pub(super) fn ends_by_height(&mut self, start_m: f64, limit_m: f64) -> Option<[(f64, f64); LEVELS]> {
        let (low_m, high_m) = self.heights_m;
        for _ in 0..STEPS_A_MOVE {
            self.solve(start_m, low_m);
        }
        let mut ends = [(start_m, start_m); LEVELS];
        let (mut up_m, mut is_reached) = (low_m, true);
        for (level, ends) in ends.iter_mut().enumerate() {
            #[allow(clippy::cast_precision_loss, reason = "small numbers")]
            let next_m = low_m + (high_m - low_m) * level as f64 / (LEVELS - 1) as f64;
            is_reached &= self.go(start_m, up_m, next_m);
            up_m = next_m;
            if !is_reached {
                break;
            }
            *ends = self.ends(start_m, up_m, limit_m);
        }
        self.go(start_m, up_m, 0.0);
        is_reached.then_some(ends)
    }

    /// Lowest and highest position of a foot in a stride, above the ground from which the trunk's mean height
    /// is measured, m.
    pub(super) fn heights_m(&self) -> (f64, f64) {
        self.heights_m
    }

    /// Moves from one height to another; true if every point on the way was reached.
    fn go(&mut self, forward_m: f64, from_m: f64, to_m: f64) -> bool {
        (1..=STEPS_A_MOVE).fold(true, |all, step| {
            let up_m = from_m + (to_m - from_m) * f64::from(step) / f64::from(STEPS_A_MOVE);
            self.follows(forward_m, up_m) && all
        })
    }

    fn ends(&mut self, start_m: f64, up_m: f64, limit_m: f64) -> (f64, f64) {
        let start = self.angles.clone();
        let fore_m = self.end(start_m, up_m, 1.0, limit_m);
        self.angles.copy_from_slice(&start);
        let aft_m = self.end(start_m, up_m, -1.0, limit_m);
        self.angles.copy_from_slice(&start);
        (aft_m, fore_m)
    }

    fn end(&mut self, start_m: f64, up_m: f64, direction: f64, limit_m: f64) -> f64 {
        let (mut place_m, mut step_m) = (start_m, direction * self.length_m / STEPS_A_LENGTH);
        let finest_m = step_m.abs() * 0.5_f64.powi(self.halvings);
        let mut good = self.angles.clone();
        while step_m.abs() > finest_m {
            let next_m = place_m + step_m;
            if (next_m - start_m).abs() >= limit_m {
                return start_m + direction * limit_m;
            }
            if self.follows(next_m, up_m) {
                place_m = next_m;
                good.copy_from_slice(&self.angles);
            } else {
                step_m *= 0.5;
                self.angles.copy_from_slice(&good);
            }
        }
        place_m
    }

    /// How far, up to `limit_m`, the foot can go from `neutral_m` at each height of a stride, with the trunk
    /// at `trunk`; the pose starts from the present posture and returns to it.
    pub(super) fn reach_at(&mut self, trunk: TrunkPose, neutral_m: f64, limit_m: f64) -> LegReach {
        let (from, angles) = (self.trunk, self.angles.clone());
        for step in 1..=STEPS_A_MOVE {
            let share = f64::from(step) / f64::from(STEPS_A_MOVE);
            self.trunk = TrunkPose {
                height_m: from.height_m + (trunk.height_m - from.height_m) * share,
                pitch_rad: from.pitch_rad + (trunk.pitch_rad - from.pitch_rad) * share,
                roll_rad: from.roll_rad + (trunk.roll_rad - from.roll_rad) * share,
            };
            self.solve(neutral_m, 0.0);
        }
        let ends = self.ends_by_height(neutral_m, limit_m).unwrap_or([(neutral_m, neutral_m); LEVELS]);
        (self.trunk, self.angles) = (from, angles);
        LegReach {
            aft_m: ends.map(|(aft_m, _)| (neutral_m - aft_m).max(0.0)),
            fore_m: ends.map(|(_, fore_m)| (fore_m - neutral_m).max(0.0)),
        }
    }

    /// The same in the present posture, with the trunk `sway_m` to the left of the foot.
    pub(super) fn reach_swaying(&mut self, sway_m: f64, neutral_m: f64, limit_m: f64) -> LegReach {
        self.side_m -= sway_m;
        let found = self.reach_at(self.trunk, neutral_m, limit_m);
        self.side_m += sway_m;
        found
    }
}
