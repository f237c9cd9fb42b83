//! What `check` says by formulas, against the simulated body.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{Scenario, capability, horse_of};
use hippocamp::config;
use hippocamp::kinds::horse::load::{self, MOVING_SHARE};
use hippocamp::model::Robot;
use hippocamp::motion::Command;
use hippocamp::telemetry::Outcome;

/// A dog of three joints a leg whose trunk has this mass.
fn dog(trunk_kg: f64) -> Robot {
    let text = include_str!("robots/twelve-joint-dog.toml");
    let loaded = text.replace("mass_kg = 2\n", &format!("mass_kg = {trunk_kg}\n"));
    config::parse(&loaded, "dog").unwrap().robot
}

/// The largest load of its joints, as a share of stall torque, by statics.
fn most(robot: &Robot) -> f64 {
    let plan = capability(robot).plan(&horse_of(robot), Command::default());
    load::of_joints(robot, &plan).iter().map(load::LegLoad::most).fold(0.0, f64::max)
}

/// On either side of the limit by a fifth of it.
#[test]
fn a_robot_walks_up_to_the_load_that_check_permits_and_not_beyond() {
    let light = dog(2.0);
    assert!((0.8 * MOVING_SHARE..MOVING_SHARE).contains(&most(&light)), "{}", most(&light));
    let report = Scenario::new(&light, "walk", 3.0).run();
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert!(!report.body.unwrap().fell);

    let heavy = dog(3.0);
    assert!((MOVING_SHARE..1.25 * MOVING_SHARE).contains(&most(&heavy)), "{}", most(&heavy));
    let report = Scenario::new(&heavy, "walk", 3.0).run();
    assert_eq!(report.outcome, Outcome::StoppedBySafety, "{}", report.reason);
    assert!(report.reason.contains("load"), "{}", report.reason);
}

/// A trunk of 8 kg: the message of the run names the load, not a horn.
#[test]
fn a_joint_that_pushes_against_too_much_weight_is_not_blamed_on_its_horn() {
    let report = Scenario::new(&dog(8.0), "walk", 3.0).run();
    assert_eq!(report.outcome, Outcome::StoppedBySafety);
    assert!(report.reason.contains("the weight on it is too great"), "{}", report.reason);
    assert!(!report.reason.contains("horn"), "{}", report.reason);
}
