//! Falls presented to the reflex as a sequence of states.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;

use super::*;
use crate::config;
use crate::model::Detector;
use crate::signals::{Aim, BodyEstimate, Wanted};

const DT_S: f64 = 0.01;
const WAY_UP: GetUp = GetUp { lying: Lying::Upright, keys: Vec::new() };

/// The horse, with one key pose for each direction: every joint in the middle of its range after 0.2 s.
fn horse(mode: ReflexMode) -> Robot {
    let mut robot = config::parse(include_str!("../../config/horse.toml"), "horse.toml").unwrap().robot;
    let angles_rad: Vec<f64> = robot.joints.iter().map(crate::model::Joint::middle_rad).collect();
    let keys = || vec![KeyPose { at_s: 0.2, angles_rad: angles_rad.clone(), torque_share: 0.6 }];
    robot.reflex = Some(ReflexSettings {
        mode,
        detector: Detector::Lean { roll_rad: 0.6, pitch_rad: 0.5, ahead_s: 0.14 },
        falls: [keys(), keys(), keys(), keys(), Vec::new()],
        passive_torque_share: 0.1,
        rest_rate_rad_s: 0.3,
        rest_s: 0.5,
        get_ups: vec![WAY_UP],
        get_ups_max: 2,
    });
    robot
}

/// The joint angles that `targets` want, rad.
///
/// # Panics
/// If they want no pose.
fn pose_of(targets: &Targets) -> &[f64] {
    match targets.wanted() {
        Wanted::Pose(pose_rad) => pose_rad,
        other => panic!("{other:?}"),
    }
}

/// A robot that stands at the upper ends of its ranges, and the state it is given.
struct Scene<'r> {
    reflex: Reflex<'r>,
    state: State,
    targets: Targets,
    activity: Activity,
    order: Order,
}

impl<'r> Scene<'r> {
    fn new(robot: &'r Robot) -> Scene<'r> {
        let mut state = State::new(robot);
        for ((joint, goal), of) in state.joints.iter_mut().zip(&mut state.goal_rad).zip(&robot.joints) {
            joint.is_known = true;
            joint.position_rad = of.range_rad.1 - 0.02;
            *goal = of.range_rad.1;
        }
        state.body.is_known = true;
        Scene {
            reflex: Reflex::new(robot),
            state,
            targets: Targets::new(robot),
            activity: Activity::Walking,
            order: Order::Go,
        }
    }

    /// The same, ordered to carry its trunk nose down by `pitch_rad`.
    fn leaning(robot: &'r Robot, pitch_rad: f64) -> Scene<'r> {
        let mut scene = Scene::new(robot);
        scene.targets.set_soles();
        scene.targets.trunk_orientation = glam::DQuat::from_rotation_y(pitch_rad);
        scene
    }

    /// Sets roll, pitch and rates of the trunk for this time; returns the kinds of motion it went through,
    /// each once.
    fn see(&mut self, roll_pitch: (f64, f64), rate: [f64; 3], for_s: f64) -> Vec<&'static str> {
        (self.state.body.roll_rad, self.state.body.pitch_rad) = roll_pitch;
        self.state.body.rate_rad_s = DVec3::from_array(rate);
        self.go_on(for_s)
    }

    fn go_on(&mut self, for_s: f64) -> Vec<&'static str> {
        let mut kinds = Vec::new();
        let mut time_s = 0.0;
        while time_s < for_s - 1e-9 {
            self.step();
            if kinds.last() != Some(&self.reflex.kind()) {
                kinds.push(self.reflex.kind());
            }
            time_s += DT_S;
        }
        kinds
    }

    /// One cycle; whatever the estimate says, a pose has finite angles.
    fn step(&mut self) -> Control {
        let control = self.reflex.step(DT_S, self.order, self.activity, &self.state, &mut self.targets);
        if let Wanted::Pose(pose_rad) = self.targets.wanted() {
            assert!(pose_rad.iter().all(|angle| angle.is_finite()));
        }
        control
    }

    /// Moves the joints to their goals.
    fn follow(&mut self) {
        for (joint, goal) in self.state.joints.iter_mut().zip(pose_of(&self.targets)) {
            joint.position_rad = *goal;
        }
        self.state.goal_rad.copy_from_slice(pose_of(&self.targets));
    }
}

#[test]
fn a_push_that_the_robot_withstands_passes() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = Scene::new(&robot);
    assert_eq!(scene.see((0.0, 0.0), [0.5, 0.3, 0.1], 1.0), ["steady"], "walking sways");
    // 0.2 + 0.14 x 1.5 = 0.41 of 0.6 rad.
    assert_eq!(scene.see((0.2, 0.0), [1.5, 0.0, 0.0], 0.3), ["pushed", "recovering"]);
    assert_eq!(scene.see((0.05, 0.0), [0.0; 3], 0.4), ["recovering", "steady"]);
    assert_eq!(scene.reflex.report().unwrap().falls, 0);
    assert_eq!(scene.targets.aim(), Aim::Limp, "never touched");
}

#[test]
fn a_fall_to_the_side_is_braced_damped_and_ends_limp() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = Scene::new(&robot);
    scene.see((0.0, 0.0), [0.0; 3], 0.1);
    assert_eq!(scene.see((0.3, 0.0), [2.5, 0.0, 0.0], DT_S), ["falling"], "0.65 of 0.6 rad");
    // No jump: the first goals are the last ones.
    let jump = |targets: &Targets, state: &State| {
        pose_of(targets).iter().zip(&state.goal_rad).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(jump(&scene.targets, &scene.state) < 1e-9);
    assert!((scene.targets.torque_share - 0.6).abs() < 1e-9 && scene.targets.aim() == Aim::Pose);
    // Half-way in time is half-way to the key pose, as far as the stationary joints permit.
    assert_eq!(scene.see((0.5, 0.0), [3.0, 0.0, 0.0], 0.1), ["falling"]);
    for (joint, (goal, state)) in
        robot.joints.iter().zip(pose_of(&scene.targets).iter().zip(&scene.state.joints))
    {
        let half = 0.5 * (joint.range_rad.1 + joint.middle_rad());
        let near = 0.85 * robot.safety.tracking_error_rad;
        let expected = half.max(state.position_rad - near);
        assert!((goal - expected).abs() < 1e-9, "{}: {goal} {expected}", joint.name);
    }
    assert_eq!(scene.see((0.9, 0.0), [3.0, 0.0, 0.0], 0.3), ["falling", "settling"]);
    assert!((scene.targets.torque_share - 0.1).abs() < 1e-9);
    let follows = |scene: &Scene<'_>| {
        pose_of(&scene.targets)
            .iter()
            .zip(&scene.state.joints)
            .all(|(a, b)| (a - b.position_rad).abs() < 1e-12)
    };
    assert!(follows(&scene), "goals follow the joints");
    scene.state.joints[3].position_rad -= 0.4;
    scene.state.joints[3].speed_rad_s = -2.0;
    scene.see((1.5, 0.0), [0.0; 3], 1.0);
    assert!(follows(&scene) && scene.reflex.kind() == "settling", "a leg still moves");
    scene.state.joints[3].speed_rad_s = 0.0;
    assert_eq!(scene.go_on(3.0), ["settling", "lying", "letting go", "limp"]);
    assert_eq!(scene.targets.aim(), Aim::Limp);
    assert_eq!(scene.reflex.activity(), Some(Activity::Done));
    let report = scene.reflex.report().unwrap();
    assert_eq!(
        (report.falls, report.direction, report.lying, report.outcome),
        (1, Some(FallDirection::Right), Some(Lying::Right), FallOutcome::LiesLimp)
    );
    assert_eq!(report.to_string(), "fell to the right and stays limp, on its right side");
    assert_eq!(scene.see((0.0, 0.0), [0.0; 3], 5.0), ["limp"], "stays");
}

/// Falls from upright until it lies at this roll and pitch.
fn fall_to<'r>(robot: &'r Robot, roll_pitch: (f64, f64)) -> Scene<'r> {
    let mut scene = Scene::new(robot);
    scene.see((0.0, 0.0), [0.0; 3], 0.1);
    scene.see((0.0, 0.5), [0.0, 3.0, 0.0], 0.3);
    scene.see(roll_pitch, [0.0; 3], 0.6);
    scene
}

#[test]
fn the_robot_gets_up_where_the_file_has_key_poses_and_only_as_often_as_allowed() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = fall_to(&robot, (0.1, 0.1));
    for time in 1..=2 {
        assert_eq!(scene.reflex.kind(), "getting up");
        let mut last_share = scene.targets.torque_share;
        let mut control = Control::Reflex;
        while control == Control::Reflex {
            scene.follow();
            control = scene.step();
            assert!(scene.targets.torque_share - last_share < 0.01, "the torque rises over a second");
            last_share = scene.targets.torque_share;
        }
        assert_eq!((control, scene.reflex.kind()), (Control::Returned, "steady"));
        let report = scene.reflex.report().unwrap();
        assert_eq!((report.falls, report.got_up, report.outcome), (time, time, FallOutcome::GotUp));
        // It rises, and is not judged in that time; then it stands, and falls again.
        scene.activity = Activity::Rising;
        assert_eq!(scene.see((0.0, 0.7), [0.0; 3], 1.0), ["steady"]);
        scene.activity = Activity::Standing;
        scene.see((0.0, 0.5), [0.0, 3.0, 0.0], 0.3);
        scene.see((0.1, 0.1), [0.0; 3], 0.6);
    }
    assert_eq!(scene.go_on(2.0), ["letting go", "limp"]);
}

/// From its front, by two poses: each is reached at its time, on the way from where the robot lay, without a jump.
#[test]
fn getting_up_uses_the_key_poses_of_the_side_it_lies_on() {
    let mut robot = horse(ReflexMode::Reflex);
    let pose = |share: f64| -> Vec<f64> {
        let of =
            |joint: &crate::model::Joint| joint.range_rad.0 + share * (joint.range_rad.1 - joint.range_rad.0);
        robot.joints.iter().map(of).collect()
    };
    let (first, second) = (pose(0.3), pose(0.6));
    let key = |at_s: f64, angles_rad: &[f64], torque_share: f64| KeyPose {
        at_s,
        angles_rad: angles_rad.to_vec(),
        torque_share,
    };
    let keys = vec![key(0.5, &first, 0.7), key(1.2, &second, 1.0)];
    let settings = robot.reflex.as_mut().unwrap();
    settings.get_ups = vec![WAY_UP, GetUp { lying: Lying::Front, keys }];
    let ramp_s = robot.safety.torque_ramp_s;
    let mut scene = fall_to(&robot, (0.0, 1.5));
    assert_eq!(scene.reflex.kind(), "getting up");
    let (mut time_s, mut before) = (0.0, pose_of(&scene.targets).to_vec());
    let most_rad = robot.joints.iter().map(|joint| joint.range_rad.1 - joint.range_rad.0).fold(0.0, f64::max);
    let (mut was_first, mut control) = (false, Control::Reflex);
    let near = |pose: &[f64], to: &[f64]| pose.iter().zip(to).all(|(a, b)| (a - b).abs() < 0.02 * most_rad);
    while control == Control::Reflex {
        if time_s > ramp_s + 1.0 {
            // The robot is up by then.
            scene.state.body.pitch_rad = 0.0;
        }
        scene.follow();
        control = scene.step();
        time_s += DT_S;
        let moved =
            pose_of(&scene.targets).iter().zip(&before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved <= most_rad * DT_S / 0.5 + 1e-9, "{moved} rad in a cycle, {time_s} s on the way");
        was_first |= near(pose_of(&scene.targets), &first) && (scene.targets.torque_share - 0.7).abs() < 1e-9;
        before.copy_from_slice(pose_of(&scene.targets));
        assert!(time_s < ramp_s + 2.0, "it never gets up");
    }
    assert_eq!(control, Control::Returned);
    assert!(was_first && near(&before, &second), "{before:?}");
    // The motion began a tenth of a second before the first check.
    assert!((time_s + 0.1 - ramp_s - 1.2).abs() < 0.05, "{time_s} s");
}

#[test]
fn a_robot_that_rolls_over_while_getting_up_has_not_got_up() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = fall_to(&robot, (0.1, 0.1));
    assert_eq!(scene.reflex.kind(), "getting up");
    assert_eq!(
        scene.see((3.0, 0.0), [0.0; 3], 9.0),
        ["getting up", "settling", "lying", "letting go", "limp"]
    );
    let report = scene.reflex.report().unwrap();
    assert_eq!((report.got_up, report.lying, report.outcome), (0, Some(Lying::Over), FallOutcome::LiesLimp));
}

#[test]
fn a_robot_without_attitude_does_not_get_up() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = fall_to(&robot, (0.1, 0.1));
    assert_eq!(scene.reflex.kind(), "getting up");
    scene.state.body.is_known = false;
    assert_eq!(scene.go_on(9.0), ["getting up", "settling", "lying", "letting go", "limp"]);
    assert_eq!(scene.reflex.report().unwrap().got_up, 0);
}

#[test]
fn a_robot_ordered_to_stop_does_not_get_up() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = fall_to(&robot, (0.0, 0.0));
    scene.go_on(0.5);
    assert_eq!(scene.reflex.kind(), "getting up");
    scene.order = Order::Stop;
    assert_eq!(scene.go_on(1.5), ["letting go", "limp"]);
    let mut scene = fall_to(&robot, (0.0, 0.3));
    scene.state.permission = Permission::Stop;
    assert_eq!(scene.go_on(3.0), ["getting up", "letting go", "limp"][1..]);
}

#[test]
fn passive_mode_drops_limp_and_off_mode_only_records_the_fall() {
    let robot = horse(ReflexMode::Passive);
    let mut scene = Scene::new(&robot);
    scene.see((0.0, 0.0), [0.0; 3], 0.1);
    scene.see((0.5, 0.0), [3.0, 0.0, 0.0], 2.0 * DT_S);
    assert_eq!((scene.reflex.kind(), scene.targets.aim()), ("settling", Aim::Limp));
    assert_eq!(scene.see((1.5, 0.0), [0.0; 3], 3.0), ["settling", "lying", "letting go", "limp"]);

    let robot = horse(ReflexMode::Off);
    let mut scene = Scene::new(&robot);
    scene.see((0.0, 0.0), [0.0; 3], 0.1);
    for _ in 0..50 {
        scene.see((0.5, 0.0), [3.0, 0.0, 0.0], DT_S);
        assert_eq!(scene.step(), Control::Operator);
    }
    let report = scene.reflex.report().unwrap();
    assert_eq!((report.falls, report.outcome), (1, FallOutcome::Falling), "one fall, not one a cycle");
    scene.see((0.0, 0.0), [0.0; 3], 1.0);
    assert_eq!(scene.reflex.report().unwrap().outcome, FallOutcome::KeptItsFeet);
    scene.see((0.5, 0.0), [3.0, 0.0, 0.0], 0.5);
    assert_eq!(scene.reflex.report().unwrap().falls, 2);
}

/// A body pushed towards each of eight sides turns about the level axis across: (p, q) = size (-y, x).
#[test]
fn the_direction_is_that_of_the_push_on_eight_sides() {
    use FallDirection::{Backward, Forward, Left, Right, Twisting};
    let sides = [
        (vec![Forward], 0.0),
        (vec![Forward, Left], 45.0),
        (vec![Left], 90.0),
        (vec![Left, Backward], 135.0),
        (vec![Backward], 180.0),
        (vec![Backward, Right], 225.0),
        (vec![Right], 270.0),
        (vec![Right, Forward], 315.0),
    ];
    for (directions, towards_deg) in sides {
        // With noise, and with the lean it has by then.
        for off_deg in [-20.0, -3.0, 3.0, 20.0_f64] {
            let towards = f64::to_radians(towards_deg + off_deg);
            let (p, q) = (-3.0 * towards.sin(), 3.0 * towards.cos());
            let robot = horse(ReflexMode::Reflex);
            let mut scene = Scene::new(&robot);
            scene.see((0.0, 0.0), [0.0; 3], 0.1);
            scene.see((0.2 * p, 0.2 * q), [p, q, 1.0], DT_S);
            let direction = scene.reflex.report().unwrap().direction.unwrap();
            assert!(directions.contains(&direction), "{towards_deg} + {off_deg}: {direction:?}");
        }
    }
    let robot = horse(ReflexMode::Reflex);
    let mut scene = Scene::new(&robot);
    scene.see((0.0, 0.0), [0.0; 3], 0.1);
    scene.see((0.4, 0.2), [2.0, 1.0, -4.0], DT_S);
    assert_eq!(scene.reflex.report().unwrap().direction, Some(Twisting));
    scene.step();
    assert_eq!(scene.reflex.kind(), "settling", "no key poses for it: its joints give way at once");
}

#[test]
fn every_side_it_may_lie_on_is_recognised() {
    use std::f64::consts::{FRAC_PI_2, PI};
    let at = |roll_rad, pitch_rad| {
        detect::lying(&BodyEstimate { is_known: true, roll_rad, pitch_rad, ..BodyEstimate::default() })
    };
    assert_eq!(at(0.3, -0.4), Some(Lying::Upright));
    assert_eq!(at(0.3, -0.6), Some(Lying::Back), "propped up on its rump");
    assert_eq!(at(-0.6, 0.1), Some(Lying::Left));
    assert_eq!(at(FRAC_PI_2, 0.2), Some(Lying::Right));
    assert_eq!(at(-1.2, 0.0), Some(Lying::Left));
    assert_eq!(at(0.4, 1.4), Some(Lying::Front), "nose down");
    assert_eq!(at(2.0, -1.5), Some(Lying::Back));
    assert_eq!(at(PI - 0.2, 0.1), Some(Lying::Over));
    assert_eq!(at(f64::NAN, 0.1), None);
}

#[test]
fn numbers_that_are_not_finite_and_a_silent_unit_show_no_fall() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = Scene::new(&robot);
    scene.see((0.0, 0.0), [0.0; 3], 0.1);
    assert_eq!(scene.see((f64::NAN, 0.0), [9.0, f64::NAN, 0.0], 0.2), ["steady"]);
    scene.state.body.is_known = false;
    assert_eq!(scene.see((1.0, 1.0), [9.0, 9.0, 9.0], 0.2), ["steady"]);
}

#[test]
fn a_unit_lost_in_the_middle_of_a_fall_ends_it_limp() {
    let robot = horse(ReflexMode::Reflex);
    for lose in [
        |body: &mut BodyEstimate| body.is_known = false,
        |body: &mut BodyEstimate| {
            body.roll_rad = f64::NAN;
        },
    ] {
        let mut scene = Scene::new(&robot);
        scene.see((0.0, 0.0), [0.0; 3], 0.1);
        scene.see((0.0, 0.4), [0.0, 3.0, 0.0], 0.05);
        assert_eq!(scene.reflex.kind(), "falling");
        lose(&mut scene.state.body);
        let kinds = scene.go_on(3.0);
        assert_eq!(kinds, ["falling", "settling", "lying", "letting go", "limp"]);
        assert!(scene.targets.aim() == Aim::Limp && scene.reflex.report().unwrap().lying.is_none());
    }
}

#[test]
fn a_robot_that_never_comes_to_rest_still_goes_limp() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = Scene::new(&robot);
    scene.see((0.0, 0.0), [0.0; 3], 0.1);
    let kinds = scene.see((1.5, 0.0), [3.0, 0.0, 0.0], 6.0);
    assert_eq!(kinds, ["falling", "settling", "lying", "letting go", "limp"]);
}

#[test]
fn a_trunk_that_leans_as_planned_does_not_count_as_falling() {
    let robot = horse(ReflexMode::Reflex);
    let mut scene = Scene::leaning(&robot, 0.6);
    assert_eq!(scene.see((0.0, 0.6), [0.0; 3], 1.0), ["steady"]);
    // It does not fall if held upright, either; it does if it goes further down, or over to the other side.
    assert_eq!(scene.see((0.0, 0.0), [0.0; 3], 1.0), ["steady"]);
    assert!(Scene::leaning(&robot, 0.6).see((0.0, 1.15), [0.0; 3], 0.1).contains(&"falling"));
    assert!(Scene::leaning(&robot, 0.6).see((0.0, -0.55), [0.0; 3], 0.1).contains(&"falling"));
}

#[test]
fn the_rate_detector_is_the_rule_of_the_paper() {
    let mut robot = horse(ReflexMode::Reflex);
    robot.reflex.as_mut().unwrap().detector = Detector::Rate(3.0);
    let mut scene = Scene::new(&robot);
    scene.see((0.0, 0.0), [0.0; 3], 0.1);
    assert_eq!(scene.see((0.5, 0.4), [0.0, 0.5, 9.0], 0.3), ["steady"], "however it leans, and turns");
    assert_eq!(scene.see((0.0, 0.0), [2.2, 2.2, 0.0], DT_S), ["falling"]);
}

#[test]
fn no_fall_is_noticed_before_standing_or_without_a_reflex() {
    let robot = horse(ReflexMode::Reflex);
    for activity in [Activity::Limp, Activity::Rising, Activity::Stopping, Activity::Done] {
        let mut scene = Scene { activity, ..Scene::new(&robot) };
        assert_eq!(scene.see((1.5, 0.0), [5.0, 0.0, 0.0], 0.2), ["steady"], "{activity:?}");
    }
    let mut robot = robot;
    robot.reflex = None;
    let mut scene = Scene::new(&robot);
    assert_eq!(scene.see((1.5, 0.0), [5.0, 0.0, 0.0], 0.2), ["steady"]);
    assert!(scene.reflex.report().is_none());
}
