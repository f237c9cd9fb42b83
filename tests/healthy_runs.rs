//! A healthy run: in physics and without, safety changes no goal, and the robot goes as asked.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::path::Path;

use common::{Scenario, in_physics, is_full, shipped};
use hippocamp::config;
use hippocamp::model::Robot;
use hippocamp::telemetry::Verdict;

fn assert_healthy(robot: &Robot, gait: &str, seed: u64) {
    let mut scenario = Scenario::new(robot, gait, if is_full() { 20.0 } else { 5.0 });
    scenario.seed = seed;
    let report = scenario.run();
    let what = format!("{} {gait}, seed {seed}: {:?}", robot.name, report.findings);
    assert_eq!(report.safety_interventions, 0, "{what}");
    assert_eq!(report.held_cycles, 0, "{what}");
    assert_eq!(report.verdict, Verdict::Good, "{what}");
}

#[test]
fn safety_changes_no_goal_of_a_horse_in_physics() {
    let seeds = if is_full() { 1..=10 } else { 1..=1 };
    for seed in seeds {
        for gait in ["walk", "walk-steady", "trot"] {
            assert_healthy(&in_physics("horse.toml"), gait, seed);
        }
        for gait in ["walk", "trot"] {
            assert_healthy(&in_physics("horse-dynamixel.toml"), gait, seed);
        }
    }
}

#[test]
fn safety_changes_no_goal_of_a_horse_on_free_joints() {
    for file in ["horse.toml", "horse-dynamixel.toml"] {
        for gait in ["walk", "trot"] {
            assert_healthy(&shipped(file), gait, 1);
        }
    }
}

/// Twelve XL330 servos with abduction joints: interventions used to make it roll over in a trot.
#[test]
fn a_small_dog_trots_without_help_of_safety() {
    let robot = config::load(Path::new("tests/robots/small-dog.toml")).unwrap().robot;
    (1..=3).for_each(|seed| assert_healthy(&robot, "trot", seed));
}
