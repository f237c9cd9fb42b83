//! Runs that do not end by the plan: the operator stops them, the start fails, or the program panics.
//!
//! With `HIPPOCAMP_FULL` set, the operator stops at more times, and at each time in both ways; otherwise the ways
//! alternate.

mod common;

use common::{ROBOTS, Scenario, Watched, is_full, servo, shipped};
use hippocamp::model::{Robot, StopAction};
use hippocamp::motion::{Activity, Order};
use hippocamp::telemetry::Outcome;

fn all_limp(watched: &Watched) -> bool {
    watched.end().iter().all(|servo| !servo.torque_on)
}

/// A walk that the operator ends with `order` at `at_s`, s since power-up.
fn stopped_at(robot: &Robot, order: Order, at_s: f64) -> Watched {
    let wish = |time_s: f64| if time_s < at_s { Order::Go } else { order };
    Scenario { order: &wish, ..Scenario::from_sitting(robot, "trot", 60.0) }.watch()
}

#[test]
fn the_operator_can_stop_the_robot_at_any_time() {
    for file in ROBOTS {
        let robot = shipped(file);
        let step = match (file, is_full()) {
            ("horse.toml", true) => 3,
            ("horse.toml", false) => 6,
            (_, true) => 13,
            (_, false) => 29,
        };
        for (number, tenths) in (1_u32..70).step_by(step).enumerate() {
            // Motion begins two cycles after the first replies: two must agree.
            let at_s = f64::from(tenths) * 0.1 + 2.0 * robot.period_s();
            let orders = [Order::Stop, Order::StopAtOnce];
            for order in
                if is_full() { &orders[..] } else { &orders[number % 2..=number % 2] }.iter().copied()
            {
                let watched = stopped_at(&robot, order, at_s);
                let (report, what) = (&watched.report, format!("{file}, {order:?} at {at_s} s"));
                assert_eq!(report.outcome, Outcome::Completed, "{what}: {}", report.reason);
                assert_eq!(report.reason, "stopped by the operator", "{what}");
                watched.assert_goals_kept_limits(&robot);
                assert!(all_limp(&watched), "{what}: not limp");
                // Slowing down, the last steps, and sitting down.
                let took_s = watched.moments.last().map_or(0.0, |last| last.time_s) - at_s;
                assert!(took_s < 10.0, "{what}: took {took_s} s");
                if order == Order::Stop {
                    let feet = report.feet.unwrap();
                    assert!(feet.stance_slip_planned_max_m <= 1e-6, "{what}: {feet:?}");
                    assert_eq!(report.safety_interventions, 0, "{what}");
                }
            }
        }
    }
}

#[test]
fn the_stop_action_hold_keeps_standing_when_the_operator_stops() {
    let mut robot = shipped("horse.toml");
    robot.stop_action = StopAction::Hold;
    for (order, at_s) in [(Order::Stop, 6.0), (Order::StopAtOnce, 6.0), (Order::Stop, 2.0)] {
        let watched = stopped_at(&robot, order, at_s);
        assert_eq!(watched.report.outcome, Outcome::Completed, "{}", watched.report.reason);
        watched.assert_goals_kept_limits(&robot);
        assert!(watched.end().iter().all(|servo| servo.torque_on), "{order:?} at {at_s} s let go");
    }
}

#[test]
fn a_walk_that_ends_in_hold_stands_still() {
    let mut robot = shipped("horse.toml");
    robot.stop_action = StopAction::Hold;
    let watched = Scenario::from_sitting(&robot, "trot", 2.0).watch();
    assert_eq!(watched.report.outcome, Outcome::Completed, "{}", watched.report.reason);
    assert_eq!(watched.report.safety_interventions, 0);
    let last = watched.moments.len() - 1;
    for servo in 0..robot.joints.len() {
        let goals: Vec<i32> =
            watched.moments[last - 20..].iter().map(|moment| moment.servos[servo].goal).collect();
        let spread = goals.iter().max().unwrap() - goals.iter().min().unwrap();
        // Redundant joints still settle, by a quarter of a degree.
        assert!(spread <= 3, "{}: {goals:?}", robot.joints[servo].name);
    }
}

#[test]
fn the_torque_falls_before_it_is_off() {
    for file in ROBOTS {
        let robot = shipped(file);
        let watched = Scenario::from_sitting(&robot, "trot", 1.0).watch();
        let off = watched.moments.iter().rposition(|moment| moment.servos[0].torque_on).unwrap();
        for (servo, truth) in watched.moments[off].servos.iter().enumerate() {
            let full = f64::from(robot.joints[servo].servo.unwrap().model.torque_limit_full);
            assert!(f64::from(truth.torque_limit) < 0.05 * full, "{file}: {truth:?} just before it was off");
        }
    }
}

/// When the servos have been found and the first cycle begins, s since power-up.
fn first_cycle_s(robot: &Robot) -> f64 {
    let watched = Scenario::from_sitting(robot, "walk", 0.0).watch_until(Activity::Rising);
    watched.moments.first().map_or(0.0, |moment| moment.time_s)
}

#[test]
fn a_servo_lost_before_its_first_reply_ends_the_run_limp() {
    let robot = shipped("horse.toml");
    let faults =
        format!("[[fault]]\nkind = 'silent'\nat_s = {}\nbus = 'main'\nid = 6", first_cycle_s(&robot));
    let watched = Scenario { faults: &faults, ..Scenario::from_sitting(&robot, "walk", 5.0) }.watch();
    assert_eq!(watched.report.outcome, Outcome::StoppedBySafety);
    assert!(watched.report.reason.contains("servo 6 on bus main"), "{}", watched.report.reason);
    assert!(watched.first(|moment| moment.servos.iter().any(|servo| servo.torque_on)).is_none());
}

#[test]
fn torque_comes_on_only_when_every_servo_was_just_heard() {
    let robot = shipped("horse.toml");
    // Servo 2 is heard once and lost; servo 9 is lost at first, and both come back one after the other.
    let (first_s, cycle_s) = (first_cycle_s(&robot), robot.period_s());
    let faults = format!(
        "[[fault]]\nkind = 'silent'\nat_s = {first_s}\nfor_s = 0.5\nbus = 'main'\nid = 9\n\
         [[fault]]\nkind = 'silent'\nat_s = {}\nfor_s = 1.0\nbus = 'main'\nid = 2",
        first_s + cycle_s
    );
    let watched = Scenario { faults: &faults, ..Scenario::from_sitting(&robot, "walk", 1.0) }.watch();
    assert_eq!(watched.report.outcome, Outcome::Completed, "{}", watched.report.reason);
    let wakes = watched.first(|moment| moment.servos.iter().any(|servo| servo.torque_on));
    let wakes_s = wakes.map_or(0.0, |moment| moment.time_s);
    assert!(wakes_s > first_s + cycle_s + 1.0, "torque at {wakes_s} s");
}

#[test]
fn a_servo_missing_at_the_start_is_named_and_nothing_gets_torque() {
    for (file, bus, id) in [("horse.toml", "main", 12), ("horse-dynamixel.toml", "right_hind", 12)] {
        let robot = shipped(file);
        let faults = format!("[[fault]]\nkind = 'silent'\nat_s = 0\nbus = '{bus}'\nid = {id}");
        let scenario = Scenario { faults: &faults, ..Scenario::from_sitting(&robot, "walk", 1.0) };
        let (error, ports) = scenario.fail_to_start();
        for words in ["servo 12", "right_hind.hock", bus, "check its power and cable"] {
            assert!(error.contains(words), "no '{words}' in: {error}");
        }
        for joint in &robot.joints {
            let servo = servo(joint);
            let shaft = ports.borrow().world().shaft(servo.bus, servo.id.0);
            assert!(shaft.is_some_and(|shaft| !shaft.torque_on), "{file}: {} has torque", joint.name);
        }
    }
}

#[test]
fn a_panic_in_the_loop_takes_the_torque_off() {
    for file in ROBOTS {
        let robot = shipped(file);
        let defect = |time_s: f64| {
            assert!(time_s < 6.0, "a defect, for this test's sake");
            Order::Go
        };
        let watched = Scenario { order: &defect, ..Scenario::from_sitting(&robot, "walk", 10.0) }.watch();
        assert_eq!(watched.report.outcome, Outcome::Failed);
        assert!(watched.report.reason.contains("defect of the program"), "{}", watched.report.reason);
        assert!(all_limp(&watched), "{file}");
    }
}
