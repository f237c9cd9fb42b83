//! Checks what safety lets through for any request.

use proptest::prelude::*;

use super::{Fault, JointCommand, Safety};
use crate::model::Robot;
use crate::signals::{JointState, JointTargets, Permission, Question, State};

const DT_S: f64 = 0.01;

fn robot() -> Robot {
    let file = crate::config::parse(include_str!("../../config/horse.toml"), "horse.toml").unwrap();
    file.robot
}

/// A robot that was just heard, cool and with a good supply, with its joints at `pose`.
fn heard(robot: &Robot, pose: &[f64]) -> State {
    let mut state = State::new(robot);
    for (joint, &position_rad) in state.joints.iter_mut().zip(pose) {
        *joint = JointState {
            is_known: true,
            position_rad,
            voltage_v: 12.0,
            temperature_c: 30.0,
            ..JointState::default()
        };
    }
    state
}

fn middle(robot: &Robot) -> Vec<f64> {
    robot.joints.iter().map(crate::model::Joint::middle_rad).collect()
}

fn asking(robot: &Robot, angles_rad: Vec<f64>) -> JointTargets {
    JointTargets { is_limp: false, angles_rad, ..JointTargets::new(robot) }
}

fn goal(command: JointCommand) -> (f64, f64) {
    match command {
        JointCommand::Goal { angle_rad, torque_share } => (angle_rad, torque_share),
        JointCommand::Limp | JointCommand::Keep => panic!("no goal"),
    }
}

#[test]
fn a_robot_that_never_answered_stays_limp() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut state = heard(&robot, &middle(&robot));
    state.joints[7].is_known = false;
    let command = safety.check(DT_S, DT_S, &asking(&robot, middle(&robot)), &mut state);
    assert!(command.joints().iter().all(|joint| *joint == JointCommand::Limp));
}

#[test]
fn torque_rises_from_nothing_at_the_measured_pose() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let pose: Vec<f64> = middle(&robot).iter().map(|angle| angle + 0.01).collect();
    let mut state = heard(&robot, &pose);
    let mut before = -1.0;
    for cycle in 0..300 {
        let command = safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
        for (joint, measured) in command.joints().iter().zip(&pose) {
            let (angle, share) = goal(*joint);
            assert!((angle - measured).abs() < 1e-12, "goals stay where the joints are");
            let expected = (f64::from(cycle) * DT_S / robot.safety.torque_ramp_s).min(1.0);
            assert!((share - expected * robot.safety.torque_share).abs() < 1e-9);
        }
        let share = goal(command.joints()[0]).1;
        assert!(share > before || share >= robot.safety.torque_share);
        before = share;
    }
}

#[test]
fn silence_first_coasts_then_holds_then_stops() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut state = heard(&robot, &middle(&robot));
    let (mut permissions, mut cycle) = (Vec::new(), 0_u32);
    while state.permission != Permission::Stop {
        state.joints[4].age_s = f64::from(cycle) * DT_S;
        safety.check(DT_S, DT_S, &asking(&robot, middle(&robot)), &mut state);
        permissions.push(state.permission);
        cycle += 1;
        assert!(cycle < 1000, "never stops");
    }
    let moved = permissions.iter().filter(|permission| **permission == Permission::Move).count();
    let held = permissions.iter().filter(|permission| **permission == Permission::Hold).count();
    let cycles = |s: f64| s / DT_S;
    assert!((moved as f64 - cycles(robot.safety.coast_s)).abs() <= 1.5, "{moved} cycles of coasting");
    assert!((held as f64 - cycles(robot.safety.hold_s)).abs() <= 1.5, "{held} cycles of holding");
    let finding = safety.cause().unwrap();
    assert_eq!(finding.joint, Some(4));
    assert!(matches!(finding.fault, Fault::Unheard { .. }));
    let words = finding.describe(&robot);
    for word in ["servo 5", "bus main", "left_fore.scapula", "check"] {
        assert!(words.contains(word), "{words}");
    }
    // A new reply does not undo a stop.
    state.joints[4].age_s = 0.0;
    safety.check(DT_S, DT_S, &asking(&robot, middle(&robot)), &mut state);
    assert_eq!(state.permission, Permission::Stop);
}

#[test]
fn a_hold_brings_moving_joints_to_rest_within_their_acceleration() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut pose = middle(&robot);
    let elbow = 6;
    let mut state = heard(&robot, &pose);
    let mut goals = vec![pose[elbow]];
    for cycle in 0..60 {
        if cycle < 30 {
            pose[elbow] += 2.0 * DT_S;
        } else {
            state.joints[0].age_s = 1.0;
        }
        for (joint, goal) in state.joints.iter_mut().zip(&pose) {
            joint.position_rad = *goal;
        }
        let command = safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
        goals.push(goal(command.joints()[elbow]).0);
    }
    for window in goals[4..].windows(3) {
        let change = (window[2] - 2.0 * window[1] + window[0]) / (DT_S * DT_S);
        assert!(change.abs() <= robot.safety.acceleration_rad_s2 * (1.0 + 1e-6), "{change} rad/s2");
    }
    let last = goals.len() - 1;
    assert!((goals[last] - goals[last - 1]).abs() < 1e-12, "at rest");
}

#[test]
fn joints_start_from_rest_after_a_stall_of_the_loop() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut pose = middle(&robot);
    let mut state = heard(&robot, &pose);
    for _ in 0..40 {
        pose[6] += 2.0 * DT_S;
        for (joint, goal) in state.joints.iter_mut().zip(&pose) {
            joint.position_rad = *goal;
        }
        safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
    }
    let before = state.goal_rad[6];
    pose[6] += 2.0 * DT_S;
    safety.check(DT_S, 0.2, &asking(&robot, pose.clone()), &mut state);
    let speed = (state.goal_rad[6] - before) / DT_S;
    assert!(speed <= robot.safety.acceleration_rad_s2 * DT_S * (1.0 + 1e-9), "{speed} rad/s at once");
    // A loop that stood still longer than a hold may last does not continue by itself.
    safety.check(DT_S, robot.safety.hold_s + 2.0 * DT_S, &asking(&robot, pose), &mut state);
    assert_eq!(state.permission, Permission::Stop);
}

/// Swings one joint's goal by `swing_rad` to both sides, once a second, while the joint is at `angle`, a function
/// of time and goal; returns the time of the first hold, if one comes within 10 s.
fn first_hold(swing_rad: f64, angle: impl Fn(f64, f64) -> f64) -> Option<(f64, Fault)> {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let middle = middle(&robot);
    let hock = 3;
    let mut state = heard(&robot, &middle);
    (0..1000).map(|cycle| f64::from(cycle) * DT_S).find_map(|s| {
        let mut pose = middle.clone();
        pose[hock] += swing_rad * (std::f64::consts::TAU * s).sin();
        state.joints[hock].position_rad = angle(s, pose[hock]);
        safety.check(DT_S, DT_S, &asking(&robot, pose), &mut state);
        (state.permission == Permission::Hold).then(|| (s, safety.cause().unwrap().fault))
    })
}

#[test]
fn a_jammed_joint_is_found_though_its_goal_returns_to_it() {
    let robot = robot();
    let stands = middle(&robot)[3];
    let swing_rad = 0.5 * robot.safety.tracking_error_rad;
    let (at_s, fault) = first_hold(swing_rad, |_, _| stands).unwrap();
    assert!(at_s < 2.0, "found after {at_s} s");
    assert!(matches!(fault, Fault::Stalled { .. }), "{fault:?}");
    // A joint that turns half as far as it should is weak, not jammed.
    assert_eq!(first_hold(swing_rad, |_, goal| 0.5 * (goal + stands)), None);
    // A joint that is a little off a still goal carries a load.
    let offset_rad = 0.9 * robot.safety.tracking_error_rad;
    assert_eq!(first_hold(0.0, |s, goal| goal + offset_rad * s.min(1.0)), None);
}

#[test]
fn a_joint_pushed_ahead_of_its_goal_does_not_count_as_jammed_when_the_goal_reaches_it() {
    let robot = robot();
    let settings = &robot.safety;
    // A foot on the ground is pushed ahead like this before torque has risen in full.
    let ahead_rad = 0.5 * settings.tracking_error_rad;
    let mut stall = super::stall::Stall::default();
    let joint = JointState { position_rad: ahead_rad, ..JointState::default() };
    for goal_rad in (0..1000).map(|cycle| ahead_rad * (f64::from(cycle) / 300.0).min(1.1)) {
        assert_eq!(stall.judge(DT_S, &joint, goal_rad, 0.0, settings), None, "goal at {goal_rad}");
    }
    // If the goal goes past the joint and the joint does not follow, the joint is jammed.
    let mut goals = (0..1000).map(|cycle| ahead_rad * (1.1 + f64::from(cycle) / 300.0));
    let fault = goals.find_map(|goal_rad| stall.judge(DT_S, &joint, goal_rad, 0.0, settings));
    assert!(matches!(fault, Some(Fault::Stalled { .. })), "{fault:?}");
}

/// The goal of a dog's knee passes from 3.5 degrees on one side of the joint to 3.5 on the other, and back.
#[test]
fn a_joint_that_friction_and_load_hold_near_its_goal_does_not_count_as_jammed() {
    let robot = robot();
    let stands = middle(&robot)[3];
    // The joint follows its goal to one side, slips back and stays there.
    let held = |s: f64, goal: f64| if s < 0.25 { goal } else { stands };
    assert_eq!(first_hold(3.5_f64.to_radians(), held), None);
    // At 8 degrees its servo pushes with two thirds of its torque.
    assert!(first_hold(8.0_f64.to_radians(), held).is_some());
}

#[test]
fn a_servo_that_is_never_heard_ends_the_start() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut state = heard(&robot, &middle(&robot));
    state.joints[7].is_known = false;
    let limp = JointTargets { is_limp: true, ..asking(&robot, middle(&robot)) };
    for cycle in 0..300 {
        state.joints[7].age_s = f64::from(cycle) * DT_S;
        safety.check(DT_S, DT_S, &limp, &mut state);
        let patience_s = robot.safety.coast_s + robot.safety.hold_s;
        let expected = if state.joints[7].age_s > patience_s { Permission::Stop } else { Permission::Move };
        assert_eq!(state.permission, expected, "after {} s", state.joints[7].age_s);
    }
    assert!(safety.cause().unwrap().describe(&robot).starts_with("servo 8 on bus main"));
}

#[test]
fn heat_and_voltage_are_named_rather_than_their_alarm_bits() {
    let robot = robot();
    for (temperature_c, voltage_v, words) in [(75.0, 12.0, "75 C"), (30.0, 8.0, "8.0 V")] {
        let mut safety = Safety::new(&robot);
        let mut state = heard(&robot, &middle(&robot));
        let joint = &mut state.joints[2];
        (joint.temperature_c, joint.voltage_v, joint.alarms) = (temperature_c, voltage_v, 0x05);
        while state.permission == Permission::Move {
            safety.check(DT_S, DT_S, &asking(&robot, middle(&robot)), &mut state);
        }
        let message = safety.cause().unwrap().describe(&robot);
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn a_servo_that_comes_back_limp_starts_from_its_measured_position() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let pose = middle(&robot);
    let elbow = 6;
    let mut state = heard(&robot, &pose);
    let ramp_cycles = 102;
    for _ in 0..ramp_cycles {
        safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
    }
    // The plug comes out, the elbow sinks half a radian further, and the plug goes back in.
    state.joints[elbow].age_s = robot.safety.coast_s + 0.05;
    safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
    assert_eq!(state.permission, Permission::Hold);
    let hangs = pose[elbow] + 0.5;
    state.joints[elbow] = JointState { age_s: 0.0, position_rad: hangs, ..state.joints[elbow] };
    for answers in 0..2 {
        let command = safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
        assert_eq!(command.question(), Some((elbow, Question::Torque)), "after {answers} answers");
        assert_eq!(command.joints()[elbow], JointCommand::Keep);
        (state.joints[elbow].age_s, state.joints[elbow].has_torque) = (DT_S, Some(false));
        if answers == 0 {
            safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
            (state.joints[elbow].age_s, state.joints[elbow].has_torque) = (0.0, None);
        }
    }
    let mut before = hangs;
    for cycle in 0..300 {
        let command = safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
        let (angle, torque) = goal(command.joints()[elbow]);
        assert!((before - angle).abs() <= robot.safety.slow_rate_rad_s * DT_S * (1.0 + 1e-9), "at {angle}");
        let expected = (f64::from(cycle) * DT_S / robot.safety.torque_ramp_s).min(1.0);
        assert!((torque - expected).abs() < 1e-9, "its torque rises from nothing again");
        let (_, others) = goal(command.joints()[0]);
        assert!(others > 0.99, "the others keep theirs");
        before = angle;
        (state.joints[elbow].age_s, state.joints[elbow].has_torque) = (0.0, None);
        state.joints[elbow].position_rad = angle;
    }
    assert!((before - pose[elbow]).abs() < 1e-9, "and it is back");
    assert_eq!(state.permission, Permission::Move);
}

/// Silences the elbow (joint 6) of a robot in its middle pose for a while, in which its goal moves by
/// `way_rad`, and lets it answer again: it has kept its torque and the goal it heard first. Returns its next goals.
fn goals_after_a_silence(way_rad: f64, asks_for: impl Fn(&Robot) -> f64) -> (Robot, Vec<f64>, Permission) {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let elbow = 6;
    let mut pose = middle(&robot);
    let held = pose[elbow];
    let mut state = heard(&robot, &pose);
    for _ in 0..150 {
        safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
    }
    for cycle in 1..30 {
        state.joints[elbow].age_s = f64::from(cycle) * DT_S;
        state.joints[elbow].is_damaged = true;
        pose[elbow] = held + way_rad * f64::from(cycle) / 10.0;
        safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
    }
    pose[elbow] = asks_for(&robot);
    state.joints[elbow] = JointState { age_s: 0.0, is_damaged: false, ..state.joints[elbow] };
    let mut goals = Vec::new();
    for _ in 0..2000 {
        let command = safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
        let question = command.question().map(|(_, question)| question);
        if let JointCommand::Goal { angle_rad, .. } = command.joints()[elbow] {
            goals.push(angle_rad);
            state.joints[elbow].position_rad = angle_rad;
        }
        let joint = &mut state.joints[elbow];
        joint.has_torque = (question == Some(Question::Torque)).then_some(true);
        joint.held_goal_rad = (question == Some(Question::Goal)).then_some(held);
        joint.age_s = if question.is_some() { DT_S } else { 0.0 };
    }
    (robot, goals, state.permission)
}

#[test]
fn a_servo_that_was_silent_continues_from_its_held_goal_at_the_slow_rate() {
    let (robot, goals, permission) = goals_after_a_silence(0.05, |robot| middle(robot)[6] + 0.4);
    let mut before = middle(&robot)[6];
    for goal in &goals {
        assert!(
            (goal - before).abs() <= robot.safety.slow_rate_rad_s * DT_S * (1.0 + 1e-9),
            "leaps to {goal}"
        );
        before = *goal;
        if (goal - middle(&robot)[6] - 0.4).abs() < 1e-9 {
            break;
        }
    }
    assert!((before - middle(&robot)[6] - 0.4).abs() < 1e-9, "it arrives");
    assert_eq!(permission, Permission::Move);
}

/// A late reply spoils the goals that cross the line at that time, for all servos of its bus.
#[test]
fn while_a_servo_owes_an_answer_no_goal_of_its_bus_is_more_than_a_step_from_the_last_that_all_heard() {
    let text = include_str!("../../config/horse-dynamixel.toml");
    let mut robot = crate::config::parse(text, "horse-dynamixel.toml").unwrap().robot;
    robot.safety.acceleration_rad_s2 = 1e6;
    let (neighbour, elsewhere, late) = (4, 0, 7);
    let dt_s = robot.period_s();
    let mut pose: Vec<f64> = robot.joints.iter().map(|joint| joint.goal_range_rad().0).collect();
    let mut safety = Safety::new(&robot);
    let mut state = heard(&robot, &pose);
    for _ in 0..5 {
        safety.check(dt_s, dt_s, &asking(&robot, pose.clone()), &mut state);
    }
    pose[neighbour] += 1.0;
    pose[elsewhere] += 1.0;
    let missed = 5;
    let mut goals = Vec::new();
    for cycle in 0..=missed + 1 {
        state.joints[late].age_s = if cycle == missed { dt_s } else { 0.0 };
        let command = safety.check(dt_s, dt_s, &asking(&robot, pose.clone()), &mut state);
        goals.push([neighbour, elsewhere].map(|joint| goal(command.joints()[joint]).0));
        for (joint, goal_rad) in state.joints.iter_mut().zip(&state.goal_rad) {
            joint.position_rad = *goal_rad;
        }
    }
    let steps = |of: usize, from: usize| {
        let rate_rad_s =
            robot.safety.rate_share * robot.joints[[neighbour, elsewhere][of]].no_load_speed_rad_s();
        (goals[missed + 1][of] - goals[from][of]) / (rate_rad_s * dt_s)
    };
    assert!((steps(0, missed - 1) - 1.0).abs() < 1e-6, "{}", steps(0, missed - 1));
    assert!((steps(1, missed - 1) - 2.0).abs() < 1e-6, "another bus goes on: {}", steps(1, missed - 1));
}

/// Dynamixels stop by themselves after 200 ms without an exchange, and hold the position they have then.
#[test]
fn a_servo_that_its_watchdog_may_have_stopped_is_asked_and_continues_from_there() {
    let text = include_str!("../../config/horse-dynamixel.toml");
    let robot = crate::config::parse(text, "horse-dynamixel.toml").unwrap().robot;
    let mut safety = Safety::new(&robot);
    let (pose, dt_s) = (middle(&robot), robot.period_s());
    let mut state = heard(&robot, &pose);
    for _ in 0..600 {
        safety.check(dt_s, dt_s, &asking(&robot, pose.clone()), &mut state);
    }
    let stopped = pose[6] - 0.04;
    let (mut gap_s, mut asked, mut first) = (0.325, Vec::new(), None);
    for _ in 0..40 {
        let command = safety.check(dt_s, gap_s, &asking(&robot, pose.clone()), &mut state);
        gap_s = dt_s;
        if let JointCommand::Goal { angle_rad, .. } = command.joints()[6] {
            first = first.or(Some(angle_rad));
        }
        let question = command.question().map(|(_, question)| question);
        asked.extend(question);
        for (index, joint) in state.joints.iter_mut().enumerate() {
            let held_rad = if index == 6 { stopped } else { pose[index] };
            joint.position_rad = held_rad;
            joint.has_torque = (question == Some(Question::Torque)).then_some(true);
            joint.held_goal_rad = (question == Some(Question::Goal)).then_some(held_rad);
            joint.age_s = if question.is_some() { dt_s } else { 0.0 };
        }
    }
    assert_eq!(asked, [Question::Torque, Question::Torque, Question::Goal]);
    let step_rad = robot.safety.slow_rate_rad_s * dt_s;
    assert!((first.unwrap() - stopped).abs() <= step_rad * (1.0 + 1e-9), "{first:?} after {stopped}");
}

#[test]
fn a_robot_does_not_wait_for_ever_for_a_joint_whose_target_is_out_of_range() {
    let (robot, goals, permission) = goals_after_a_silence(0.05, |robot| robot.joints[6].range_rad.1 + 0.5);
    assert_eq!(permission, Permission::Move, "as near as it gets is there");
    let (low, high) = robot.joints[6].goal_range_rad();
    assert!(goals.iter().all(|goal| (low..=high).contains(goal)));
}

#[test]
fn a_joint_that_lost_its_torque_starts_inside_its_range() {
    for (beyond_rad, starts) in [(0.05, true), (0.6, false)] {
        let robot = robot();
        let mut safety = Safety::new(&robot);
        let (elbow, pose) = (6, middle(&robot));
        let mut state = heard(&robot, &pose);
        safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
        state.joints[elbow].age_s = 1.0;
        safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
        let high = robot.joints[elbow].goal_range_rad().1;
        state.joints[elbow].age_s = 0.0;
        state.joints[elbow].position_rad = robot.joints[elbow].range_rad.1 + beyond_rad;
        for _ in 0..3 {
            state.joints[elbow].has_torque = Some(false);
            let command = safety.check(DT_S, DT_S, &asking(&robot, pose.clone()), &mut state);
            if let JointCommand::Goal { angle_rad, torque_share } = command.joints()[elbow] {
                let step_rad = robot.safety.slow_rate_rad_s * DT_S;
                let is_at_border = (0.0..=step_rad * (1.0 + 1e-9)).contains(&(high - angle_rad));
                assert!(starts && is_at_border && torque_share <= 0.0, "{angle_rad} below {high}");
                break;
            }
        }
        let is_stopped = state.permission == Permission::Stop;
        assert_eq!(is_stopped, !starts);
        if is_stopped {
            let words = safety.cause().unwrap().describe(&robot);
            assert!(words.contains("left_fore.elbow") && words.contains("beyond its range"), "{words}");
        }
    }
}

#[test]
fn a_link_that_keeps_failing_stops_the_robot() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut state = heard(&robot, &middle(&robot));
    let mut cycle = 0_u32;
    while state.permission != Permission::Stop {
        // Silent for 180 ms of every 200 ms.
        let in_period = f64::from(cycle % 20) * DT_S;
        state.joints[2].age_s = if in_period < 0.18 { in_period } else { 0.0 };
        safety.check(DT_S, DT_S, &asking(&robot, middle(&robot)), &mut state);
        cycle += 1;
        assert!(cycle < 3000, "flaps for ever");
    }
}

#[test]
fn a_joint_outside_the_counts_of_its_servo_gets_no_torque() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut pose = middle(&robot);
    // Half a turn and a little more from the middle count.
    pose[6] += std::f64::consts::PI + 0.1;
    let mut state = heard(&robot, &pose);
    let command = safety.check(DT_S, DT_S, &asking(&robot, middle(&robot)), &mut state);
    assert_eq!(command.joints()[6], JointCommand::Limp);
    assert_eq!(state.permission, Permission::Stop);
    let words = safety.cause().unwrap().describe(&robot);
    assert!(words.contains("left_fore.elbow") && words.contains("turn the limp joint by hand"), "{words}");
}

#[test]
fn a_bus_without_any_reply_is_named_as_such() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut state = heard(&robot, &middle(&robot));
    safety.check(DT_S, DT_S, &asking(&robot, middle(&robot)), &mut state);
    for joint in &mut state.joints {
        joint.age_s = 1.0;
    }
    safety.check(DT_S, DT_S, &asking(&robot, middle(&robot)), &mut state);
    let words = safety.cause().unwrap().describe(&robot);
    assert!(
        words.starts_with("bus main: none of its servos answers") && words.contains("adapter"),
        "{words}"
    );
}

#[test]
fn a_target_that_is_not_finite_holds_the_robot() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut state = heard(&robot, &middle(&robot));
    let lost = JointTargets { not_finite: Some(3), ..asking(&robot, middle(&robot)) };
    safety.check(DT_S, DT_S, &lost, &mut state);
    assert_eq!(state.permission, Permission::Hold);
    assert_eq!(safety.cause().map(|finding| finding.fault), Some(Fault::NotFinite));
}

/// Any value that a defect upstream could request.
fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -7.0..7.0_f64,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(f64::NEG_INFINITY),
        1 => Just(1e300),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn goals_stay_within_range_and_rate_for_any_target(
        from_middle in proptest::collection::vec(-3.0..3.0_f64, 16),
        asked in proptest::collection::vec(proptest::collection::vec(anything(), 16), 1..120),
    ) {
        let robot = robot();
        let mut safety = Safety::new(&robot);
        let start: Vec<f64> = middle(&robot).iter().zip(from_middle).map(|(middle, offset)| middle + offset).collect();
        let mut state = heard(&robot, &start);
        let mut before = start.clone();
        for angles in asked {
            let command = safety.check(DT_S, DT_S, &asking(&robot, angles), &mut state);
            for (index, joint) in robot.joints.iter().enumerate() {
                let (angle, torque_share) = goal(command.joints()[index]);
                prop_assert!(angle.is_finite());
                let outside = |angle: f64| (joint.range_rad.0 - angle).max(angle - joint.range_rad.1).max(0.0);
                // The goal is inside the joint's range, or no further outside than before.
                prop_assert!(outside(angle) <= outside(before[index]) + 1e-9);
                let rate = robot.safety.rate_share * joint.no_load_speed_rad_s();
                // A goal without torque moves nothing: a joint found a little outside starts at the border of its
                // range.
                prop_assert!(torque_share <= 0.0 || (angle - before[index]).abs() <= rate * DT_S * (1.0 + 1e-9));
                before[index] = angle;
            }
            for (joint, goal) in state.joints.iter_mut().zip(&before) {
                joint.position_rad = *goal;
            }
        }
    }
}

#[test]
fn only_the_chosen_joint_has_torque_and_the_others_may_be_moved_by_hand() {
    let robot = robot();
    let mut safety = Safety::new(&robot);
    let mut pose = middle(&robot);
    let mut state = heard(&robot, &pose);
    let wanted = asking(&robot, pose.clone());
    let wanted = JointTargets { only: Some(4), ..wanted };
    for _ in 0..300 {
        // Another joint is moved by 60 degrees a second, far from its angle at the start.
        pose[7] += 60f64.to_radians() * DT_S;
        state.joints[7].position_rad = pose[7];
        let command = safety.check(DT_S, DT_S, &wanted, &mut state);
        for (index, joint) in command.joints().iter().enumerate() {
            assert_eq!(matches!(joint, JointCommand::Goal { .. }), index == 4, "joint {index}");
        }
        assert_eq!(state.permission, Permission::Move);
    }
    assert!((state.goal_rad[7] - pose[7]).abs() < 1e-12);
    // The other joints are still watched.
    state.joints[7].age_s = 1.0;
    safety.check(DT_S, DT_S, &wanted, &mut state);
    assert_eq!(state.permission, Permission::Hold);
}
