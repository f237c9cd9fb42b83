//! Tips of arms: along paths, after points that move, and where they point.
#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test may panic; counts and times are small"
)]

mod common;

use common::arm::Arm;
use common::{config_file, shipped};
use glam::{DQuat, DVec3};
use hippocamp::config;
use hippocamp::model::{Motion, Pole, Robot, TipPath};
use hippocamp::motion::{Place, Stroke, StrokeCommand};
use hippocamp::signals::{Targets, Wanted};

/// Position of the tip of the only arm by its goals.
fn tip(robot: &Robot, arm: &Arm<'_>) -> DVec3 {
    robot.tip_in_body(&robot.chains[0], arm.goals[0].iter().copied())
}

#[test]
fn a_tip_follows_its_path_at_one_speed_through_all_points() {
    let robot = shipped("tentacle.toml");
    let dt_s = robot.period_s();
    let waypoints =
        [[200.0, 100.0, 200.0], [230.0, 0.0, 250.0], [200.0, -100.0, 200.0], [120.0, -150.0, 250.0]]
            .map(|mm| DVec3::from_array(mm) / 1000.0);
    let path = TipPath::new(&waypoints, 0.06).unwrap();
    let command = StrokeCommand::of(Stroke { name: "path", place: Place::Path(path) });
    let mut arm = Arm::awake(&robot);
    let mut tips = Vec::new();
    for _ in 0..(20.0 * robot.rate_hz) as usize {
        arm.perform(command, dt_s);
        tips.push(tip(&robot, &arm));
    }
    assert_eq!(arm.interventions, 0, "goals held back by safety");
    // It comes to rest on the first, and continues from there.
    let first = tips.iter().rposition(|tip| tip.distance(waypoints[0]) < 1e-5).unwrap();
    let tips = &tips[first..];
    for waypoint in waypoints {
        let near_m = tips.iter().map(|tip| tip.distance(waypoint)).fold(f64::INFINITY, f64::min);
        assert!(near_m < 1e-3, "{waypoint} is missed by {near_m} m");
    }
    assert!(tips.last().unwrap().distance(waypoints[3]) < 1e-4, "it stays at the end");
    let speeds: Vec<DVec3> = tips.windows(2).map(|pair| (pair[1] - pair[0]) / dt_s).collect();
    let steady = speeds.iter().filter(|speed| (speed.length() - 0.06).abs() < 0.03 * 0.06).count();
    let moving = speeds.iter().filter(|speed| speed.length() > 1e-3).count();
    println!("{steady} of {moving} cycles at the path's speed");
    assert!(steady as f64 > 0.55 * moving as f64, "{steady} of {moving} cycles at the path's speed");
    for (index, pair) in speeds.windows(2).enumerate() {
        let change = (pair[1] - pair[0]).length();
        assert!(pair[1].length() < 1.03 * 0.06 && change < 0.05 * 0.06, "{change} m/s in cycle {index}");
    }
}

#[test]
fn a_moving_point_is_followed_and_a_jump_starts_a_new_motion() {
    let robot = shipped("tentacle.toml");
    let dt_s = robot.period_s();
    let reach = |point_in_body: DVec3, direction: Option<DVec3>| {
        StrokeCommand::of(Stroke { name: "reach", place: Place::Point { in_body: point_in_body, direction } })
    };
    let point = |time_s: f64| {
        let (sine, cosine) = (1.2 * time_s).sin_cos();
        DVec3::new(0.16, 0.06 * sine, 0.2 + 0.05 * cosine)
    };
    let aside = |time_s: f64| DVec3::new(1.0, 0.5 * (0.7 * time_s).sin(), -0.3);
    for is_directed in [false, true] {
        let mut arm = Arm::awake(&robot);
        let mut change = None;
        for cycle in 0..2000 {
            let time_s = f64::from(cycle) * dt_s;
            let direction = is_directed.then(|| aside(time_s));
            arm.perform(reach(point(time_s), direction), dt_s);
            let now = change_of(arm.controller.record(&[]).targets);
            assert_eq!(*change.get_or_insert(now), now, "one motion, {time_s} s");
            if cycle == 300 {
                arm.interventions = 0;
            }
            if cycle > 300 {
                let off_m = tip(&robot, &arm).distance(point(time_s));
                assert!(off_m < 2e-3, "{off_m} m behind after {time_s} s");
                let places = robot.places_in_body(&robot.chains[0], arm.goals[0].iter().copied());
                let ahead = places[24] - places[22];
                let off_rad = ahead.angle_between(aside(time_s));
                assert!(!is_directed || off_rad < 0.05, "points {off_rad} rad aside after {time_s} s");
            }
        }
        assert_eq!(arm.interventions, 0, "goals held back by safety");
        arm.perform(reach(DVec3::new(-0.1, 0.1, 0.25), None), dt_s);
        assert_ne!(change, Some(change_of(arm.controller.record(&[]).targets)));
        arm.perform(reach(DVec3::new(-0.1, 0.1, 0.25), None), 5.0);
        assert!(tip(&robot, &arm).distance(DVec3::new(-0.1, 0.1, 0.25)) < 1e-3);
    }
}

/// The count of changes of the first arm's action.
fn change_of(targets: &Targets) -> u32 {
    match targets.wanted() {
        Wanted::Arms(arms) => arms[0].change,
        other => panic!("{other:?}"),
    }
}

/// The shipped arm, each joint with a third hinge that twists.
fn with_twists() -> Robot {
    let mut text = std::fs::read_to_string(config_file("tentacle.toml")).unwrap();
    for (from, to) in [
        ("joints = 12\n", "joints = 12\nhinges = 3\ntwist_range_deg = [-30, 30]\n"),
        ("first_id = 13\n", "first_id = 19\n"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    config::parse(&text, "arm.toml").unwrap_or_else(|error| panic!("{error}")).robot
}

#[test]
fn twist_hinges_help_to_point_a_tip() {
    let (two, three) = (shipped("tentacle.toml"), with_twists());
    assert_eq!(three.joints.len(), 36);
    // To the side and back; down beside the arm; over and back to the base.
    for (mm, direction) in [
        ([120.0, 120.0, 180.0], [-1.0, 0.3, 0.2]),
        ([-60.0, 150.0, 150.0], [0.2, -0.5, -1.0]),
        ([150.0, -80.0, 120.0], [-0.7, -0.7, -0.3]),
    ] {
        let (point_in_body, direction) = (DVec3::from_array(mm) / 1000.0, DVec3::from_array(direction));
        let reach = StrokeCommand::of(Stroke {
            name: "reach",
            place: Place::Point { in_body: point_in_body, direction: Some(direction) },
        });
        let bent = |robot: &Robot, hinges: usize| {
            let mut arm = Arm::awake(robot);
            arm.perform(reach, 8.0);
            let goals = &arm.goals[0];
            let places = robot.places_in_body(&robot.chains[0], goals.iter().copied());
            let last = places.len() - 1;
            let off_rad = (places[last] - places[last - hinges]).angle_between(direction);
            let off_m = places[last].distance(point_in_body);
            assert!(off_m < 1e-3 && off_rad < 0.02, "{hinges} hinges: {off_m} m and {off_rad} rad off");
            let square = |kind: usize| -> f64 {
                goals.iter().skip(kind).step_by(hinges).map(|angle| angle * angle).sum()
            };
            (
                square(0) + square(1),
                goals.iter().skip(2).step_by(hinges).fold(0.0_f64, |most, angle| most.max(angle.abs())),
            )
        };
        let ((with_two, _), (with_three, twist)) = (bent(&two, 2), bent(&three, 3));
        println!(
            "{mm:?}: squared bends {with_two} with two hinges, {with_three} with three, twists up to {twist} rad"
        );
        assert!(twist > 0.005, "no joint twists: {twist} rad at most");
        assert!(with_three < with_two, "{with_three} rad^2, {with_two} with two hinges");
    }
}

#[test]
fn twists_turn_the_suckers_to_a_pole_beside_them() {
    let mut robot = with_twists();
    let Motion::Tentacle(tentacle) = &mut robot.motion else { panic!("no arm") };
    tentacle.grip_share = 0.0;
    // The suckers of the arm that stands face forward; the pole is to its left.
    let pole = Pole { point_in_body: DVec3::new(0.0, 0.13, 0.12), axis: DVec3::X, radius_m: 0.085 };
    let mut arm = Arm::awake(&robot);
    let command = StrokeCommand::of(Stroke { name: "wind", place: Place::Pole(pole) });
    let before = |robot: &Robot, goals: &[f64]| off_suckers_rad(robot, goals, pole);
    let begin_rad = before(&robot, &arm.goals[0]);
    arm.perform(command, 16.0);
    assert_eq!(arm.interventions, 0, "goals held back by safety");
    let offs_rad = before(&robot, &arm.goals[0]);
    println!("suckers off the pole by {begin_rad:?} rad, wound by {offs_rad:?} rad");
    assert!(begin_rad[8] > 1.4 && offs_rad[4..].iter().all(|off| *off < 0.1), "{offs_rad:?}");
}

/// The angle that the lower side of each link is off from facing the pole, rad, by separate forward kinematics.
fn off_suckers_rad(robot: &Robot, goals: &[f64], pole: Pole) -> Vec<f64> {
    let chain = &robot.chains[0];
    let (mut place, mut rotation) = (chain.root_m, chain.root_rotation);
    let mut offs_rad = Vec::new();
    for (joint, angle) in robot.joints.iter().zip(goals) {
        rotation *= DQuat::from_axis_angle(joint.axis, *angle);
        if joint.link_m.length() > 0.0 {
            let to_point = pole.point_in_body - place;
            let way = to_point - pole.axis * to_point.dot(pole.axis);
            let across = way - rotation * DVec3::X * way.dot(rotation * DVec3::X);
            offs_rad.push((rotation * DVec3::NEG_Z).angle_between(across));
        }
        place += rotation * joint.link_m;
    }
    offs_rad
}
