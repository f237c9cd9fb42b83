//! Horses that are pushed over, in physics, by the whole program: whether the fall is told in time, which way it goes,
//! what it does to the robot, and what the robot does then; and an arm that is pulled.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::f64::consts::TAU;
use std::time::Duration;

use common::{Scenario, in_physics, servo, shipped};
use hippocamp::bus::{Buses, Ports, SimPorts};
use hippocamp::capability::TentacleCapability;
use hippocamp::cycle::Cycle;
use hippocamp::ik::Method;
use hippocamp::model::{Detector, ReflexMode, Robot};
use hippocamp::motion::{Activity, GaitChoice, Order, Stroke, StrokeCommand};
use hippocamp::reflex::FallOutcome;
use hippocamp::simulation;
use hippocamp::telemetry::Outcome;
use hippocamp::trial::{Scene, Summary, Trials};
use hw_sim::FaultScript;

/// Seeds of the poses' and thresholds' making are 11 to 13 and 101; this is none of them.
const HELD_OUT: u64 = 2;

/// As many as fit in half a minute of two cores; docs/falls.md has the whole table.
#[test]
fn falls_are_told_in_time_and_fallen_softer() {
    let trials = Trials::new(&in_physics("horse.toml")).unwrap();
    let tried = trials.try_all(48, HELD_OUT, |_| {}).unwrap();
    let summary = Summary::of(&tried);
    let told = format!("{summary}");
    assert!(summary.fell.count >= 10, "{told}");
    assert!(summary.predicted.value() >= 0.95, "{told}");
    assert!(summary.false_alarms.count <= 1, "{told}");
    assert!(summary.lead_s.unwrap().value >= 0.2, "{told}");
    assert!(summary.direction.value() >= 0.9, "{told}");
    assert!(summary.less_than_passive.impact_n.unwrap().value > 0.0, "{told}");
    assert!(summary.less_than_off.impact_n.unwrap().value > 0.0, "{told}");
    assert!(summary.less_than_passive.joint_load_nm.unwrap().value > 0.0, "{told}");
    assert!(summary.less_than_off.joint_load_nm.unwrap().value > 0.0, "{told}");
}

#[test]
fn the_same_trial_is_the_same_again() {
    let trials = Trials::new(&in_physics("horse.toml")).unwrap();
    let hardest = (0..48).map(|number| trials.scene(HELD_OUT, number));
    let scene = hardest.max_by(|a, b| a.impulse_ns.total_cmp(&b.impulse_ns)).unwrap();
    let [one, other] = [0, 1].map(|_| trials.observe(&scene, ReflexMode::Reflex, true).unwrap());
    assert_eq!(one, other);
    assert!(one.predicted_s.is_some(), "{scene:?}");
}

/// A standing horse pushed over towards each of eight sides: on a diagonal either neighbour is right.
#[test]
fn a_push_from_any_of_eight_sides_is_told_by_its_direction() {
    for file in ["horse.toml", "horse-dynamixel.toml"] {
        let trials = Trials::new(&in_physics(file)).unwrap();
        for side in 0..8 {
            let scene = Scene {
                number: side,
                gait: GaitChoice::Stand,
                speed_share: 0.0,
                friction: 0.8,
                push_at_s: 0.5,
                towards_rad: TAU / 8.0 * f64::from(u32::try_from(side).unwrap()),
                impulse_ns: 1.15 * trials.mass_kg(),
            };
            let fall = trials.observe(&scene, ReflexMode::Off, false).unwrap();
            let direction = fall.direction.unwrap_or_else(|| panic!("{file}, side {side}: no fall was told"));
            assert!(scene.is_towards(direction), "{file}, side {side}: {direction:?}");
        }
    }
}

fn push(direction_deg: f64, impulse_n_s: f64) -> String {
    format!(
        "[[fault]]\nkind = 'push'\nat_s = 6.0\nimpulse_n_s = {impulse_n_s}\ndirection_deg = {direction_deg}\n"
    )
}

#[test]
fn pushed_over_sideways_it_ends_limp_and_says_so() {
    let robot = in_physics("horse.toml");
    let faults = push(90.0, 2.4);
    let scenario = Scenario { faults: &faults, ..Scenario::from_sitting(&robot, "walk-steady", 60.0) };
    let report = scenario.run();
    assert_eq!(report.outcome, Outcome::Fallen, "{}", report.reason);
    assert!(report.reason.starts_with("fell to the left and stays limp"), "{}", report.reason);
    assert!(report.is_end_heard && report.duration_s < 12.0, "{} s", report.duration_s);
    let falls = report.falls.unwrap();
    assert_eq!((falls.falls, falls.got_up, falls.outcome), (1, 0, FallOutcome::LiesLimp));
    assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0));
}

/// A rule that takes a nudge for a fall: the horse lets itself down, lies on its underside, and knows a way up from there.
#[test]
fn let_down_on_its_legs_it_gets_up_and_walks_on() {
    let mut robot = in_physics("horse.toml");
    robot.reflex.as_mut().unwrap().detector =
        Detector::Lean { roll_rad: 0.14, pitch_rad: 0.14, ahead_s: 0.14 };
    let faults = push(0.0, 0.9);
    let order = |time_s: f64| if time_s > 18.0 { Order::Stop } else { Order::Go };
    let scenario =
        Scenario { faults: &faults, order: &order, ..Scenario::from_sitting(&robot, "walk-steady", 60.0) };
    let watched = scenario.watch();
    let mut activities: Vec<Activity> = watched.moments.iter().map(|moment| moment.activity).collect();
    activities.retain(|activity| ![Activity::Limp, Activity::Lying].contains(activity));
    activities.dedup();
    use Activity::{Done, Falling, Rising, Standing, Stopping, Walking};
    let expected = [Rising, Standing, Walking, Falling, Rising, Standing, Walking, Stopping, Done];
    assert_eq!(activities, expected, "{}", watched.report.reason);
    assert_eq!(watched.report.outcome, Outcome::Completed, "{}", watched.report.reason);
    let falls = watched.report.falls.unwrap();
    assert_eq!((falls.falls, falls.got_up, falls.outcome), (1, 1, FallOutcome::GotUp));
}

/// The arm holds still; a weight is hung on a joint near its root, and taken off again.
#[test]
fn a_pulled_arm_gives_way_and_returns() {
    let robot: Robot = shipped("tentacle.toml");
    let settings = robot.yielding.unwrap();
    let tentacle = robot.motion.tentacle().unwrap();
    let rest = StrokeCommand::of(Stroke::Rest);
    let plan = TentacleCapability::of(&robot, tentacle).plan(&robot, tentacle, rest);
    let world = simulation::world_from_pose(&robot, &plan.park_pose_rad, 1, &FaultScript::default()).unwrap();
    let mut buses = Buses::new(&robot, SimPorts::on_virtual_clock(world));
    buses.prepare(&robot).unwrap();
    let mut cycle = Cycle::new(&robot, plan, Method::CcdThenFinish, f64::INFINITY, buses);
    let period = Duration::from_secs_f64(robot.period_s());
    let mut deadline = cycle.buses_mut().ports_mut().now();
    let joint = 3;
    let pulled = *servo(&robot.joints[joint]);
    let place = robot.joints[..joint].iter().filter(|other| servo(other).bus == pulled.bus).count();
    // Four fifths of what it has at its stall: it would hold that, at more than the share that is borne.
    let weight_nm = 0.8 * pulled.model.stall_torque_nm;
    let mut positions = Vec::new();
    let mut yielded_s = None;
    for number in 0..2600 {
        let time_s = f64::from(number) * robot.period_s();
        let loads = cycle.buses_mut().ports_mut().world_mut();
        if number == 800 {
            loads.load(pulled.bus, place, weight_nm);
        } else if number == 1000 {
            loads.load(pulled.bus, place, 0.0);
        }
        cycle.buses_mut().ports_mut().wait_until(deadline);
        cycle.step(Order::Go);
        deadline = deadline + period;
        positions.push(cycle.state().joints[joint].position_rad);
        if cycle.yielding().is_yielding() {
            yielded_s.get_or_insert(time_s);
        }
    }
    let yielded_s = yielded_s.expect("it gave way");
    let began_s = 800.0 * robot.period_s();
    assert!(yielded_s >= began_s + settings.after_s - 1e-9 && yielded_s < began_s + 1.0, "{yielded_s} s");
    let away = (positions[999] - positions[799]).abs();
    assert!(away > 0.2, "it gave way by {away} rad");
    // In honey: a free joint under that weight would be at its no-load speed.
    let fastest =
        positions[799..].windows(2).map(|pair| (pair[1] - pair[0]).abs() * robot.rate_hz).fold(0.0, f64::max);
    assert!(fastest < pulled.model.no_load_speed_rad_s, "{fastest} rad/s");
    let left = (positions[2599] - positions[799]).abs();
    assert!(left < 0.035, "back where it was but for {left} rad");
    assert!(cycle.telemetry().joints_report().rate_violations == 0);
}
