//! Ranges of ball joints: every goal keeps them, in every phase of a run.
#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test may panic; counts and times are small"
)]

mod common;

use common::arm::{chance, plan, strokes};
use common::{config_file, servo};
use hippocamp::bus::Slot;
use hippocamp::config;
use hippocamp::cycle::Controller;
use hippocamp::ik::Method;
use hippocamp::model::{Robot, SharedRange};
use hippocamp::motion::{Activity, Order, StrokeCommand};
use hippocamp::signals::{Feedback, ImuReading, ServoGoal};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;

/// Not convex: the joint bends less up and left together than in either direction alone.
const CORNERS: [[i32; 2]; 6] = [[60, 0], [25, 25], [0, 60], [-45, 40], [-60, -20], [20, -60]];

/// The arm of config/tentacle.toml whose joints have these corners, with some of its text replaced.
fn arm(changes: &[(&str, &str)]) -> String {
    let mut text = std::fs::read_to_string(config_file("tentacle.toml")).unwrap();
    let corners =
        CORNERS.map(|[lift, sweep]| format!("[[arm.ball]]\nlift_deg = {lift}\nsweep_deg = {sweep}\n\n"));
    text = text.replace("[motion]\nkind", &format!("{}[motion]\nkind", corners.concat()));
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

/// Servos that are always at their goals.
struct Servos {
    positions: Vec<i32>,
}

impl Servos {
    fn exchange(&mut self, goals: &[ServoGoal]) -> Vec<Slot> {
        let heard = |(goal, position): (&ServoGoal, &mut i32)| {
            if let ServoGoal::Move { position: to, .. } = goal {
                *position = *to;
            }
            let (position, voltage_decivolt, temperature_c) = (*position, 50, 30);
            Slot::Fresh(Feedback { position, voltage_decivolt, temperature_c, ..Feedback::default() })
        };
        goals.iter().zip(&mut self.positions).map(heard).collect()
    }
}

/// Runs random strokes from the present positions of the servos, then stops; in every cycle each joint that was
/// inside its range stays inside. Returns the number of joints that began outside.
fn run(robot: &Robot, mut servos: Servos, seed: u64, stop: Order) -> usize {
    let ranges = SharedRange::of_robot(robot);
    assert_eq!(ranges.len(), 12);
    let plan = plan(robot, StrokeCommand::default());
    let mut controller = Controller::new(robot, plan, Method::CcdThenFinish, f64::MAX);
    let mut source = Pcg64Mcg::seed_from_u64(seed);
    let strokes = strokes(robot);
    let (mut order, mut until) = (Order::Perform(StrokeCommand::default()), 0.0);
    let (mut is_inside, mut began_outside) = (vec![false; 12], 0);
    let mut activity = Activity::Limp;
    for cycle in 0..(120.0 * robot.rate_hz) as u64 {
        let time_s = cycle as f64 * robot.period_s();
        if time_s > 100.0 {
            order = stop;
        } else if activity != Activity::Rising && time_s > until {
            let pick = (chance(&mut source) * strokes.len() as f64) as usize % strokes.len();
            let (tempo, turn_rad) = (1.5 * chance(&mut source), chance(&mut source) - 0.5);
            order = Order::Perform(StrokeCommand { stroke: strokes[pick], tempo, turn_rad });
            until = time_s + 0.3 + 3.0 * chance(&mut source);
        }
        let goals = controller.decide(robot.period_s(), order).servos().to_vec();
        let slots = servos.exchange(&goals);
        controller.learn(robot.period_s(), &slots, &ImuReading::default());
        let record = controller.record(&slots);
        activity = record.facts.activity;
        if cycle < 2 {
            // No reply is believed yet: two must agree.
            continue;
        }
        for ((joints, range), is_inside) in ranges.iter().zip(&mut is_inside) {
            let outside = range.outside_by(&record.state.goal_rad[joints.clone()]);
            // The controller does not determine how a limp arm moves. A count is 1.5 mrad.
            assert!(!*is_inside || outside < 1e-6, "{time_s} s, {activity:?}: {outside} outside");
            *is_inside |= outside < 1e-6;
        }
        if cycle == 2 {
            began_outside = is_inside.iter().filter(|is_inside| !**is_inside).count();
        }
    }
    assert_eq!(activity, Activity::Done);
    assert!(is_inside.iter().all(|is_inside| *is_inside), "every joint came in");
    began_outside
}

#[test]
fn no_goal_leaves_the_range_from_start_to_limp() {
    let robot = config::parse(&arm(&[]), "arm.toml").unwrap().robot;
    let at = |lift: f64, sweep: f64| {
        let angle = |joint: usize| if joint.is_multiple_of(2) { lift } else { sweep };
        let counts = robot.joints.iter().enumerate().map(|(index, joint)| {
            servo(joint).count_of(if index < 12 { angle(index) } else { 0.0 }).round() as i32
        });
        Servos { positions: counts.collect() }
    };
    for (seed, stop) in [(1, Order::Stop), (2, Order::StopAtOnce)] {
        assert_eq!(run(&robot, at(0.0, 0.0), seed, stop), 0);
        // Pushed by hand to angles that each hinge may have, but not both together.
        assert_eq!(run(&robot, at(0.7, 0.7), seed, stop), 6);
    }
}

#[test]
fn an_arm_that_is_parked_out_of_its_range_is_refused() {
    let park = |deg: &str| arm(&[("radius_mm = 18\n", &format!("radius_mm = 18\npark_lift_deg = {deg}\n"))]);
    config::parse(&park("10"), "arm.toml").unwrap();
    for (deg, said) in [("65", "arm.ball"), ("75", "[-70, 70]")] {
        let faults = config::parse(&park(deg), "arm.toml").unwrap_err().faults;
        let fault = faults.iter().find(|fault| fault.key == "arm[0].park_lift_deg");
        assert!(fault.is_some_and(|fault| fault.to_string().contains(said)), "{faults:?}");
    }
}
