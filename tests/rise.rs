//! A robot rises from the ground on its simulated body: with its trunk upright, or not at all.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::path::Path;

use common::Scenario;
use hippocamp::config;
use hippocamp::model::Robot;
use hippocamp::telemetry::{Outcome, Report};

/// A dog of two joints a leg, with an IMU, whose limp legs lie as they fell: a different way with each seed.
fn dog() -> Robot {
    config::load(Path::new("tests/robots/eight-joint-dog.toml")).unwrap().robot
}

fn trot(robot: &Robot, seed: u64) -> Report {
    Scenario { seed, ..Scenario::new(robot, "trot", 0.5) }.run()
}

/// With seed 4 the trunk lies over a leg, tilted 28 degrees; with seed 9 it hangs level on straight legs. Legs that went
/// to the sitting pose joint by joint, all at once, rolled the dog onto its back.
#[test]
fn legs_that_lie_under_the_trunk_fold_before_they_lift_it() {
    let robot = dog();
    for seed in [4, 9] {
        let report = trot(&robot, seed);
        assert_eq!(report.outcome, Outcome::Completed, "seed {seed}: {}", report.reason);
        let body = report.body.unwrap();
        assert!(!body.fell && body.roll_max_deg < 20.0 && body.pitch_max_deg < 20.0, "seed {seed}: {body:?}");
    }
}

/// With seed 6 a leg is caught under the trunk.
#[test]
fn a_robot_that_cannot_rise_level_lies_down_limp_and_says_so() {
    let report = trot(&dog(), 6);
    assert_eq!(report.outcome, Outcome::Fallen, "{}", report.reason);
    assert!(report.reason.starts_with("it could not rise, and lies"), "{}", report.reason);
    assert!(report.reason.contains("in 3 tries"), "{}", report.reason);
    // It never walked.
    assert!(report.reached.is_none_or(|reached| reached.distance_m.abs() < 0.01), "{:?}", report.reached);
}
