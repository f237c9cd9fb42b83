//! Inverse kinematics of the shipped horses' legs against a dense search: the nearest pose, from any start, for
//! targets in and out of reach, and no jumps during a stride.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::{PI, TAU};
use std::path::Path;

use glam::DVec3;
use hippocamp::config;
use hippocamp::ik::{Method, Solver};
use hippocamp::kinds::horse::HorseCapability;
use hippocamp::model::{Chain, Robot};
use hippocamp::motion::horse::{Velocity, Walk};
use hippocamp::motion::{Command, posture_pull};
use hippocamp::signals::Targets;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

fn robot(file: &str) -> Robot {
    config::load(&Path::new("config").join(file)).unwrap().robot
}

/// A leg in its plane: x forward, z up; four bones that hang down at angle zero (Takizawa 2005, 3.2).
struct Leg {
    root: [f64; 2],
    lengths_m: [f64; 4],
    ranges_rad: [(f64, f64); 4],
}

/// From a place by `length_m` along the bone at the cumulative angle `phi`.
fn along(from: [f64; 2], length_m: f64, phi: f64) -> [f64; 2] {
    [from[0] - length_m * phi.sin(), from[1] - length_m * phi.cos()]
}

/// The cumulative angle of a bone from `from` to `to`.
fn angle_of(from: [f64; 2], to: [f64; 2]) -> f64 {
    (from[0] - to[0]).atan2(from[1] - to[1])
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// `angle` plus the whole turns that bring it into `range`.
fn in_range(angle: f64, range: (f64, f64)) -> Option<f64> {
    [-2.0, -1.0, 0.0, 1.0, 2.0]
        .map(|turns| angle + turns * TAU)
        .into_iter()
        .find(|angle| (range.0..=range.1).contains(angle))
}

impl Leg {
    fn of(robot: &Robot, chain: &Chain) -> Leg {
        let joints = robot.joints_of(chain);
        Leg {
            root: [chain.root_m.x, chain.root_m.z],
            lengths_m: std::array::from_fn(|index| -joints[index].link_m.z),
            ranges_rad: std::array::from_fn(|index| joints[index].goal_range_rad()),
        }
    }

    fn tip(&self, angles: &[f64]) -> [f64; 2] {
        let mut phi = 0.0;
        angles.iter().zip(self.lengths_m).fold(self.root, |place, (angle, length_m)| {
            phi += angle;
            along(place, length_m, phi)
        })
    }

    /// Least distance from the tip to `target` with the first two joints at these angles: the last two bones
    /// by plane geometry. At the least distance, each of the two stands on a limit, or points (alone or with
    /// what is behind it) at the target, or the tip is on the target.
    fn nearest_with(&self, first: f64, second: f64, target: [f64; 2]) -> f64 {
        let phi = first + second;
        let knee = along(along(self.root, self.lengths_m[0], first), self.lengths_m[1], phi);
        let [_, _, upper, lower] = self.lengths_m;
        let [_, _, third_range, fourth_range] = self.ranges_rad;
        let tip =
            |third: f64, fourth: f64| along(along(knee, upper, phi + third), lower, phi + third + fourth);

        let away = distance(knee, target);
        let bend =
            ((away * away - upper * upper - lower * lower) / (2.0 * upper * lower)).clamp(-1.0, 1.0).acos();
        let bent = [0.0, PI, bend, -bend].into_iter().filter_map(|angle| in_range(angle, fourth_range));
        let last_fixed = [fourth_range.0, fourth_range.1].into_iter().chain(bent).flat_map(|fourth| {
            let pointing = angle_of(knee, target)
                - angle_of([0.0, 0.0], along(along([0.0, 0.0], upper, 0.0), lower, fourth));
            let thirds = [Some(third_range.0), Some(third_range.1), in_range(pointing - phi, third_range)];
            thirds.into_iter().flatten().map(move |third| (third, fourth))
        });
        let third_fixed = [third_range.0, third_range.1].into_iter().filter_map(|third| {
            let ankle = along(knee, upper, phi + third);
            in_range(angle_of(ankle, target) - phi - third, fourth_range).map(|fourth| (third, fourth))
        });
        last_fixed
            .chain(third_fixed)
            .map(|(third, fourth)| distance(tip(third, fourth), target))
            .fold(f64::INFINITY, f64::min)
    }

    /// Least distance from the tip to `target` of all poses: a grid over the first two joints, and from its
    /// best points on, step by step with shrinking steps.
    fn nearest(&self, target: [f64; 2]) -> f64 {
        const STEPS: i32 = 16;
        let widths =
            [0, 1].map(|joint| (self.ranges_rad[joint].1 - self.ranges_rad[joint].0) / f64::from(STEPS));
        let mut grid: Vec<(f64, [f64; 2])> = (0..=STEPS)
            .flat_map(|i| (0..=STEPS).map(move |j| [i, j]))
            .map(|at| {
                let pose =
                    [0, 1].map(|joint| self.ranges_rad[joint].0 + widths[joint] * f64::from(at[joint]));
                (self.nearest_with(pose[0], pose[1], target), pose)
            })
            .collect();
        grid.sort_by(|a, b| a.0.total_cmp(&b.0));
        grid[..5]
            .iter()
            .map(|&(least, pose)| self.polish(least, pose, widths, target))
            .fold(f64::INFINITY, f64::min)
    }

    fn polish(&self, mut least: f64, mut pose: [f64; 2], mut steps: [f64; 2], target: [f64; 2]) -> f64 {
        let ways = [
            [1.0, 0.0],
            [-1.0, 0.0],
            [0.0, 1.0],
            [0.0, -1.0],
            [1.0, 1.0],
            [-1.0, -1.0],
            [1.0, -1.0],
            [-1.0, 1.0],
        ];
        while steps[0] + steps[1] > 1e-6 {
            let better = ways.iter().find_map(|way| {
                let next = [0, 1].map(|joint| {
                    let (low, high) = self.ranges_rad[joint];
                    (pose[joint] + way[joint] * steps[joint]).clamp(low, high)
                });
                let distance = self.nearest_with(next[0], next[1], target);
                (distance < least - 1e-12).then_some((distance, next))
            });
            match better {
                Some(found) => (least, pose) = found,
                None => steps = steps.map(|step| 0.5 * step),
            }
        }
        least
    }
}

/// Each range's share of the way from its low to its high end; a share outside 0 to 1 is a limit.
fn pose_of(leg: &Leg, shares: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|joint| {
        let (low, high) = leg.ranges_rad[joint];
        (low + shares[joint] * (high - low)).clamp(low, high)
    })
}

#[test]
fn from_any_start_the_pose_is_the_nearest_a_dense_search_finds() {
    let shares = || proptest::array::uniform4(-0.5..1.5);
    for file in ["thoroughbred.toml", "horse.toml"] {
        let robot = robot(file);
        for chain in &robot.chains[..2] {
            let leg = Leg::of(&robot, chain);
            let solver = Solver::new(chain, robot.joints_of(chain));
            let length_m: f64 = leg.lengths_m.iter().sum();
            let beside =
                |place: [f64; 2], share: [f64; 2]| [0, 1].map(|axis| place[axis] + share[axis] * length_m);
            // In reach; round its edge; anywhere.
            let reached = shares().prop_map(|shares| leg.tip(&pose_of(&leg, shares)));
            let near = (shares(), proptest::array::uniform2(-0.02..0.02))
                .prop_map(|(shares, share)| beside(leg.tip(&pose_of(&leg, shares)), share));
            let any = proptest::array::uniform2(-1.3..1.3).prop_map(|share| beside(leg.root, share));

            let config = Config { cases: 1500, failure_persistence: None, ..Config::default() };
            let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
            let cases = (prop_oneof![reached, near, any], shares());
            let outcome = TestRunner::new_with_rng(config, rng).run(&cases, |(target, start)| {
                let mut solver = solver.clone();
                let target_in_body = DVec3::new(target[0], chain.root_m.y, target[1]);
                let mut angles = pose_of(&leg, start);
                let solution = solver.solve(Method::CcdThenFinish, target_in_body, 0.1, &mut angles);

                for (angle, (low, high)) in angles.iter().zip(leg.ranges_rad) {
                    prop_assert!((low..=high).contains(angle), "{angle} rad");
                }
                let miss_m = distance(leg.tip(&angles), target);
                prop_assert!((miss_m - solution.residual_m).abs() < 1e-9, "{solution:?}, truly {miss_m} m");
                let nearest_m = if miss_m <= 1e-4 { 0.0 } else { leg.nearest(target) };
                prop_assert!(
                    miss_m <= nearest_m + 1e-4,
                    "{target:?} m: {miss_m} m, the search has {nearest_m} m"
                );
                Ok(())
            });
            outcome.unwrap_or_else(|failed| panic!("{file}, {}: {failed}", chain.name));
        }
    }
}

#[test]
fn no_joint_jumps_in_a_stride_of_any_gait() {
    for file in ["thoroughbred.toml", "horse.toml"] {
        let robot = robot(file);
        let horse = robot.motion.horse().unwrap().clone();
        let capability = HorseCapability::of(&robot, &horse).unwrap();
        let plan = capability.plan(&horse, Command::default());
        for (index, gait) in horse.gaits.iter().enumerate() {
            let speed_m_s = capability.top_speeds[index].by_reach_m_s;
            let mut walk = Walk::cruising(&plan, index, Velocity { speed_m_s, yaw_rate_rad_s: 0.0 });
            let mut targets = Targets::new(&robot);
            // In this time the fastest foot goes some 15 mm of a leg of two metres.
            let dt_s = 5e-4;
            let period_s = gait.period_s(horse.swing_time_s);
            let mut legs: Vec<_> = horse
                .legs
                .iter()
                .map(|&leg| {
                    let chain = &robot.chains[leg];
                    let solver = Solver::new(chain, robot.joints_of(chain));
                    (leg, solver, plan.sit_pose_rad[chain.joints.clone()].to_vec())
                })
                .collect();
            let mut s = 0.0;
            // One stride to settle, then two to look at.
            while s < 3.0 * period_s {
                walk.advance(s);
                walk.write_level(&plan, s, &mut targets);
                for (leg, solver, angles) in &mut legs {
                    let before = angles.clone();
                    let target = targets.tip_in_body(*leg).unwrap();
                    let solution = solver.solve(Method::CcdThenFinish, target, posture_pull(dt_s), angles);
                    if s < period_s {
                        continue;
                    }
                    let at = format!("{file}, {}, leg {leg} at {s} s", gait.name);
                    assert!(solution.residual_m <= 1e-4 && !solution.is_new_branch, "{at}: {solution:?}");
                    let step =
                        angles.iter().zip(&before).fold(0.0_f64, |step, (a, b)| step.max((a - b).abs()));
                    assert!(step <= 0.1, "{at}: {step} rad");
                }
                s += dt_s;
            }
        }
    }
}
