//! Horses that are pushed over in physics, with the whole program: whether the fall is predicted in time, its
//! direction, its impact on the robot, and what the robot does afterwards.
//!
//! With `HIPPOCAMP_FULL` set, three times as many pushes, each from all sides.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::f64::consts::TAU;

use common::{Scenario, in_physics, is_full};
use hippocamp::model::ReflexMode;
use hippocamp::motion::GaitChoice;
use hippocamp::reflex::FallOutcome;
use hippocamp::telemetry::Outcome;
use hippocamp::trial::{Scene, Summary, Trials, Tried};

/// A seed that was not used to tune poses and thresholds: those were 11 to 13 and 101.
const HELD_OUT: u64 = 2;

/// A sixth as many as there are in docs/falls.md, or a third of these.
#[test]
fn falls_are_predicted_in_time_and_land_softer() {
    let trials = Trials::new(&in_physics("horse.toml")).unwrap();
    let runs = if is_full() { 48 } else { 16 };
    let tried = trials.try_all(runs, HELD_OUT, |_| {}).unwrap();
    let summary = Summary::of(&tried);
    let told = format!("{summary}");
    assert!(u64::from(summary.fell.count) * 5 >= runs, "{told}");
    assert!(summary.predicted.value() >= 0.95, "{told}");
    assert!(summary.false_alarms.count <= 1, "{told}");
    assert!(summary.lead_s.unwrap().value >= 0.2, "{told}");
    assert!(summary.direction.value() >= 0.9, "{told}");
    assert!(summary.less_than_passive.impact_n.unwrap().value > 0.0, "{told}");
    assert!(summary.less_than_off.impact_n.unwrap().value > 0.0, "{told}");
    assert!(summary.less_than_passive.joint_load_nm.unwrap().value > 0.0, "{told}");
}

/// One push for each side and strength, or a fifth of these, with each strength to different sides. docs/figure.md
/// has ten of each.
#[test]
fn a_figure_keeps_its_feet_or_falls_softer_than_a_limp_one() {
    let trials = Trials::new(&in_physics("figure.toml")).unwrap();
    let tried = if is_full() {
        trials.try_all(24, HELD_OUT, |_| {}).unwrap()
    } else {
        let every_fifth = (0..24).step_by(5).map(|number| trials.scene(HELD_OUT, number));
        every_fifth.map(|scene| trials.try_scene(scene).unwrap()).collect()
    };
    let of_strength =
        |strength: u64| tried.iter().filter(move |tried| tried.scene.number / 8 % 3 == strength);
    assert!(of_strength(0).all(|tried| tried.off.fallen_s.is_none()), "at 0.08 N s for each kg");
    assert!(of_strength(2).all(|tried| tried.off.fallen_s.is_some()), "at 0.8 N s for each kg");
    assert!((0..3).all(|strength| of_strength(strength).count() > 0));
    let (mut softer, mut heads_softer, mut heads, mut falls) = (0, 0, 0, 0);
    for Tried { scene, off, reflex, passive } in tried.iter().filter(|tried| tried.off.fallen_s.is_some()) {
        let (reflex, passive) = (reflex.as_ref().unwrap(), passive.as_ref().unwrap());
        assert!(off.predicted_s < off.fallen_s, "{scene:?}");
        assert!(scene.is_towards(off.direction.unwrap()), "{scene:?}: {:?}", off.direction);
        assert!(off.told_at_deg.unwrap() < 30.0, "{scene:?}: {:?} degrees", off.told_at_deg);
        falls += 1;
        softer += i32::from(reflex.impact_n < passive.impact_n);
        if passive.head_impact_n > 0.0 {
            heads += 1;
            heads_softer += i32::from(reflex.head_impact_n < passive.head_impact_n);
        }
    }
    assert!(f64::from(softer) >= 0.8 * f64::from(falls), "trunk: {softer} of {falls}");
    assert!(f64::from(heads_softer) >= 0.8 * f64::from(heads), "head: {heads_softer} of {heads}");
}

#[test]
fn the_same_trial_gives_the_same_result() {
    let trials = Trials::new(&in_physics("horse.toml")).unwrap();
    let hardest = (0..48).map(|number| trials.scene(HELD_OUT, number));
    let scene = hardest.max_by(|a, b| a.impulse_ns.total_cmp(&b.impulse_ns)).unwrap();
    let [one, other] = [0, 1].map(|_| trials.observe(&scene, ReflexMode::Reflex, true).unwrap());
    assert_eq!(one, other);
    assert!(one.predicted_s.is_some(), "{scene:?}");
}

/// A standing horse pushed over towards each of eight sides: on a diagonal either neighbour is right.
#[test]
fn a_push_from_any_of_eight_sides_is_recognised_by_its_direction() {
    for (file, step) in [("horse.toml", 1), ("horse-dynamixel.toml", if is_full() { 1 } else { 3 })] {
        let trials = Trials::new(&in_physics(file)).unwrap();
        for side in (0..8).step_by(step) {
            let scene = Scene {
                number: side,
                gait: GaitChoice::Stand,
                speed_share: 0.0,
                friction: 0.8,
                push_at_s: 0.5,
                towards_rad: TAU / 8.0 * f64::from(u32::try_from(side).unwrap()),
                impulse_ns: 1.15 * trials.mass_kg(),
                world_seed: side,
            };
            let fall = trials.observe(&scene, ReflexMode::Off, false).unwrap();
            let direction = fall.direction.unwrap_or_else(|| panic!("{file}, side {side}: no fall was told"));
            assert!(scene.is_towards(direction), "{file}, side {side}: {direction:?}");
        }
    }
}

fn push(direction_deg: f64, impulse_n_s: f64, at_s: f64) -> String {
    format!(
        "[[fault]]\nkind = 'push'\nat_s = {at_s}\nimpulse_n_s = {impulse_n_s}\ndirection_deg = {direction_deg}\n"
    )
}

#[test]
fn a_horse_pushed_over_sideways_ends_limp_and_reports_it() {
    let robot = in_physics("horse.toml");
    let faults = push(90.0, 2.4, 6.0);
    let scenario = Scenario { faults: &faults, ..Scenario::from_sitting(&robot, "walk-steady", 60.0) };
    let report = scenario.run();
    assert_eq!(report.outcome, Outcome::Fallen, "{}", report.reason);
    assert!(report.reason.starts_with("fell to the left and stays limp"), "{}", report.reason);
    assert!(report.is_end_heard && report.duration_s < 12.0, "{} s", report.duration_s);
    let falls = report.falls.unwrap();
    assert_eq!((falls.falls, falls.got_up, falls.outcome), (1, 0, FallOutcome::LiesLimp));
    assert_eq!(report.joints.rate_violations, 0);
    assert!(report.body.unwrap().fell);
}

/// A robot on its underside rises by its ordinary start phases, and continues with its order.
#[test]
fn a_horse_pushed_onto_its_underside_gets_up_and_walks_on() {
    let robot = in_physics("horse.toml");
    let pushes = [(180.0, 2.4), (180.0, 2.6), (195.0, 2.6)];
    for (direction_deg, impulse_n_s) in pushes.into_iter().take(if is_full() { 3 } else { 1 }) {
        let faults = push(direction_deg, impulse_n_s, 12.0);
        let scenario = Scenario { faults: &faults, ..Scenario::new(&robot, "walk-steady", 25.0) };
        let report = scenario.run();
        let falls = report.falls.unwrap();
        assert_eq!((falls.falls, falls.got_up, falls.outcome), (1, 1, FallOutcome::GotUp), "{falls:?}");
        assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
        assert!(report.duration_s > 40.0, "{} s", report.duration_s);
        assert_eq!(report.joints.rate_violations, 0);
    }
}
