//! Horses in physics rise from lying limp, walk, and sit down. Takes about 14 s of one core.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{ROBOTS, SharedPorts, horse_of, in_physics, plan};
use hippocamp::ik::Method;
use hippocamp::model::{Physics, Robot};
use hippocamp::motion::Order;
use hippocamp::plan::RunPlan;
use hippocamp::run::run;
use hippocamp::simulation;
use hippocamp::telemetry::{BodyReport, Outcome, Report};
use hw_sim::FaultScript;
use hw_sim::body::BodyState;

/// Furthest a trunk that lies on folded legs is tilted, rad.
const LYING_TILT_RAD: f64 = 0.5;

fn tilt_rad(body: &BodyState) -> f64 {
    let (roll, pitch, _) = body.roll_pitch_yaw();
    roll.abs().max(pitch.abs())
}

/// A walk of `robot` from lying limp; the ports at its end.
fn walk(robot: &Robot, gait: &str, for_s: f64, seed: u64) -> (Report, SharedPorts) {
    let ports = SharedPorts::new(simulation::world(robot, seed, &FaultScript::default()).unwrap());
    let motion = plan(robot, gait, 0.9).into();
    let plan = RunPlan { motion, method: Method::CcdThenFinish, move_for_s: for_s, driver: None };
    let report = run(robot, plan, ports.clone(), |_| Order::Go).unwrap();
    (report, ports)
}

#[test]
fn a_limp_horse_lies_still_on_its_folded_legs() {
    for file in ROBOTS {
        let robot = in_physics(file);
        for seed in 1..=8 {
            let mut world = simulation::world(&robot, seed, &FaultScript::default()).unwrap();
            let before = world.body().unwrap().clone();
            assert!(tilt_rad(&before) < LYING_TILT_RAD, "{file} {seed}: {before:?}");
            assert!(before.height_m < horse_of(&robot).sit_height_m, "{file} {seed}: {before:?}");
            world.advance_to(1_000_000_000);
            let after = world.body().unwrap();
            let moved_m = (0..3).map(|axis| (after.position_m[axis] - before.position_m[axis]).abs());
            assert!(moved_m.fold(0.0, f64::max) < 2e-3, "{file} {seed}: {before:?} {after:?}");
        }
    }
}

#[test]
fn the_horse_rises_walks_and_sits_down() {
    for (file, seed) in ROBOTS.into_iter().zip([1, 2]) {
        let robot = in_physics(file);
        let (report, ports) = walk(&robot, "walk-steady", 8.0, seed);
        assert_eq!(report.outcome, Outcome::Completed, "{file}: {}", report.reason);
        let BodyReport { fell, distance_m, mean_speed_m_s, roll_max_deg, pitch_max_deg, height_error_max_m } =
            report.body.unwrap();
        let asked_m_s = report.speed_m_s.unwrap();
        assert!(!fell && roll_max_deg < 4.0 && pitch_max_deg < 4.0, "{file}: {:?}", report.body);
        assert!(
            (mean_speed_m_s / asked_m_s - 1.0).abs() < 0.15,
            "{file}: {mean_speed_m_s} of {asked_m_s} m/s"
        );
        assert!(distance_m > 0.9 * 8.0 * mean_speed_m_s, "{file}: {:?}", report.body);
        assert!(height_error_max_m.unwrap() < 6e-3, "{file}: {:?}", report.body);
        // Then its torque goes off, and it lies down on its legs.
        let mut world = ports;
        hippocamp::bus::Ports::wait_until(&mut world, hippocamp::units::Time(60_000_000_000));
        let ports = world.borrow();
        let body = ports.world().body().unwrap();
        assert!(body.height_m < horse_of(&robot).sit_height_m && tilt_rad(body) < LYING_TILT_RAD, "{body:?}");
        let is_limp = |bus, place| !ports.world().shaft_at(bus, place).unwrap().torque_on;
        assert!((0..robot.buses.len()).all(|bus| (0..4).all(|place| is_limp(bus, place))), "{file}");
    }
}

#[test]
fn simulation_steps_of_one_and_two_milliseconds_agree() {
    let distance_m = |step_ms| {
        let robot = in_physics("horse.toml");
        let physics = Physics { step_ms, ..robot.physics.clone().unwrap() };
        walk(&Robot { physics: Some(physics), ..robot }, "trot", 4.0, 1).0.body.unwrap().distance_m
    };
    let (fine, coarse) = (distance_m(1), distance_m(2));
    assert!((coarse / fine - 1.0).abs() < 0.05, "{fine} m, {coarse} m");
}
