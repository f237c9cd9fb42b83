//! The figure of config/figure.toml: its file, its poses from limp to limp, and the program's commands, on joints
//! that turn freely; and its stand in physics. With `HIPPOCAMP_FULL` set, from more sides and with more seeds.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic; figures are for people")]

mod common;

use std::path::Path;
use std::process::{Command, Output};

use common::{SharedPorts, config_file, in_physics, is_full, servo, shipped};
use glam::{DQuat, DVec3};
use hippocamp::config;
use hippocamp::cycle::Controller;
use hippocamp::ik::Method;
use hippocamp::kinds::figure::FigureCapability;
use hippocamp::model::ball_joint::SwingTwist;
use hippocamp::model::{Foot, Robot, hinges_in_place};
use hippocamp::motion::{Activity, Order};
use hippocamp::plan::RunPlan;
use hippocamp::reflex::FallOutcome;
use hippocamp::run::run;
use hippocamp::simulation;
use hippocamp::standing::{Sole, Standing, TrunkMotion};
use hippocamp::telemetry::{Outcome, Report};
use hw_sim::FaultScript;

const G: f64 = 9.806_65;

fn figure() -> Robot {
    shipped("figure.toml")
}

fn poses(robot: &Robot) -> usize {
    robot.motion.figure().unwrap().poses.len()
}

fn plan(robot: &Robot, move_for_s: f64) -> RunPlan {
    let capability = FigureCapability::of(robot, robot.motion.figure().unwrap()).unwrap();
    RunPlan { motion: capability.plan(0).into(), method: Method::CcdThenFinish, move_for_s, driver: None }
}

/// A run that follows `order` at each time since power-up, with `faults` (TOML).
fn run_with(
    robot: &Robot,
    faults: &str,
    order: impl FnMut(&hippocamp::signals::Status) -> Order,
) -> (Report, SharedPorts) {
    run_with_seed(robot, 1, faults, order)
}

fn run_with_seed(
    robot: &Robot,
    seed: u64,
    faults: &str,
    order: impl FnMut(&hippocamp::signals::Status) -> Order,
) -> (Report, SharedPorts) {
    let faults = FaultScript::from_toml(faults).unwrap();
    let ports = SharedPorts::new(simulation::world(robot, seed, &faults).unwrap());
    let report = run(robot, plan(robot, 1.0), ports.clone(), order).unwrap();
    (report, ports)
}

/// Whether the goals of every ball joint are inside its region.
fn assert_in_ball_ranges(robot: &Robot, angles: &[f64], when: &str) {
    for chain in &robot.chains {
        let joints = robot.joints_of(chain);
        for (last, joint) in joints.iter().enumerate() {
            let Some(ball) = &joint.ball else { continue };
            let hinges = hinges_in_place(joints, last);
            let turn = hinges.fold(DQuat::IDENTITY, |turn, hinge| {
                turn * DQuat::from_axis_angle(joints[hinge].axis, angles[chain.joints.start + hinge])
            });
            let asked = SwingTwist::of(turn);
            let nearest = ball.nearest(asked);
            let miss = nearest.swing.distance(asked.swing).max((nearest.twist_rad - asked.twist_rad).abs());
            assert!(miss < 1e-9, "{when}: {} is {miss} out of its region", joint.name);
        }
    }
}

#[test]
fn the_figure_has_human_proportions_and_two_buses() {
    let robot = figure();
    let height_m = 0.4;
    let near = |value: f64, share: f64, what: &str| {
        assert!((value - share * height_m).abs() < 1e-4, "{what}: {} of the height", value / height_m);
    };
    // Drillis and Contini 1966, as in Winter 2009, figure 4.1.
    let chain = |name: &str| robot.chains.iter().find(|chain| chain.name == name).unwrap();
    let link = |name: &str| robot.joints.iter().find(|joint| joint.name == name).unwrap().link_m;
    let (hip, shoulder, neck) = (chain("left_leg").root_m, chain("left_arm").root_m, chain("head").root_m);
    near(link("left_leg.hip_yaw").x, 0.245, "thigh");
    near(link("left_leg.knee").x, 0.246, "shank");
    near(link("left_leg.ankle_roll").x, 0.039, "height of the foot");
    near(2.0 * hip.y, 0.191, "hips");
    near(shoulder.z, 0.818 - 0.530, "shoulder above hip");
    near(2.0 * shoulder.y, 0.259 - 0.001, "shoulders");
    near(neck.z, 0.870 - 0.530, "chin above hip");
    near(neck.z + link("head.nod").x, 1.0 - 0.530, "top of the head above hip");
    near(link("left_arm.shoulder_yaw").x, 0.186, "upper arm");
    near(link("left_arm.elbow").x, 0.146 + 0.108, "forearm and hand");
    let Some(Foot::Plate { size_m, .. }) = chain("left_leg").foot else { panic!("no plate") };
    near(size_m.x, 0.152, "length of the foot");
    assert!((robot.mass_kg() - 2.1).abs() < 1e-9);
    // Winter 2009, table 4.1: values that servos do not change.
    let mass = |names: &[&str]| -> f64 {
        names.iter().map(|name| robot.joints.iter().find(|joint| joint.name == *name).unwrap().mass_kg).sum()
    };
    let thigh = ["left_leg.hip_pitch", "left_leg.hip_roll", "left_leg.hip_yaw"];
    for (names, share) in [
        (&thigh[..], 0.100),
        (&["left_leg.knee"], 0.0465),
        (&["head.nod"], 0.081),
        (&["left_arm.elbow"], 0.022),
    ] {
        assert!((mass(names) - share * 2.1).abs() < 1e-3, "{names:?}: {} kg", mass(names));
    }
    let mut ids: Vec<u8> = robot.joints.iter().map(|joint| servo(joint).id.0).collect();
    assert!(ids.len() >= 16 && robot.buses.len() == 2);
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), robot.joints.len(), "ids are distinct across the buses");
    let balls = robot.joints.iter().filter(|joint| joint.ball.is_some()).map(|joint| joint.name.as_str());
    let expected =
        ["left_leg.hip_yaw", "right_leg.hip_yaw", "left_arm.shoulder_yaw", "right_arm.shoulder_yaw"];
    assert_eq!(balls.collect::<Vec<_>>(), expected);
}

#[test]
fn right_is_the_mirror_image_of_left() {
    let robot = figure();
    let mirrored = |place: DVec3| place * DVec3::new(1.0, -1.0, 1.0);
    for (left, right) in [("left_leg", "right_leg"), ("left_arm", "right_arm")] {
        let chain = |name: &str| robot.chains.iter().find(|chain| chain.name == name).unwrap();
        let (left, right) = (chain(left), chain(right));
        // Turns about y are the same on both sides, others the other way round.
        let angles = [0.3, 0.2, -0.25, 0.7, -0.2, 0.15];
        let count = left.joints.len();
        let sense = |joint: usize| {
            if robot.joints[left.joints.start + joint].axis.y.abs() > 0.5 { 1.0 } else { -1.0 }
        };
        let opposite: Vec<f64> =
            angles[..count].iter().enumerate().map(|(joint, angle)| sense(joint) * angle).collect();
        let (a, b) =
            (robot.tip_in_body(left, angles[..count].iter().copied()), robot.tip_in_body(right, opposite));
        assert!(mirrored(a).distance(b) < 1e-12, "{a} and {b}");
        for joint in 0..count {
            let range = |chain: &hippocamp::model::Chain| robot.joints[chain.joints.start + joint].range_rad;
            let ((low, high), other) = (range(left), range(right));
            let same = if sense(joint) > 0.0 { (low, high) } else { (-high, -low) };
            assert!((same.0 - other.0).abs() < 1e-12 && (same.1 - other.1).abs() < 1e-12);
        }
    }
}

#[test]
fn the_centre_of_mass_is_over_the_feet_in_every_pose_and_servos_bear_it() {
    let robot = figure();
    let figure = robot.motion.figure().unwrap();
    let capability = FigureCapability::of(&robot, figure).unwrap();
    for (pose, center) in figure.poses.iter().zip(&capability.centers_m) {
        assert!(center.x.abs() < 1e-5, "{}: {center}", pose.name);
        // Between the outer edges of the soles.
        assert!(center.y.abs() < 0.0382 + 0.015, "{}: {center}", pose.name);
    }
    // The stand itself: weight on straight legs is light, and a lean puts it over one foot.
    let lean = figure.poses.iter().position(|pose| pose.name == "lean-left").unwrap();
    assert!(capability.centers_m[lean].y > 0.02);
    for load in &capability.loads {
        assert!(load.share_of_stall.unwrap() < 0.5, "{}: {load:?}", robot.joints[load.joint].name);
    }
    // The knees of the stand by hand: half the weight, less what hangs below, at its lever ahead of the knee.
    let plan = capability.plan(0);
    let leg = &robot.chains[figure.legs[0]];
    let places = robot.places_in_body(leg, plan.pose_rad[0][leg.joints.clone()].iter().copied());
    let lever_m = places[3].x - places[6].x;
    let hung_kg = robot.joints_of(leg)[3..].iter().map(|joint| joint.mass_kg).sum::<f64>();
    let torque_nm = lever_m * G * (0.5 * robot.mass_kg());
    let knee = capability.loads.iter().find(|load| robot.joints[load.joint].name == "left_leg.knee").unwrap();
    assert!(knee.torque_nm > 0.8 * (torque_nm - lever_m * G * hung_kg), "{knee:?}, by hand {torque_nm}");
}

#[test]
fn soles_stay_in_place_through_all_poses_and_no_goal_jumps() {
    let robot = figure();
    let dt_s = robot.period_s();
    let mut controller =
        Controller::new(&robot, plan(&robot, f64::MAX).motion, Method::CcdThenFinish, f64::MAX);
    let (mut stood_s, mut pose) = (None, 0);
    let mut seen: Vec<Vec<f64>> = Vec::new();
    let mut soles: Option<Vec<DVec3>> = None;
    for cycle in 0..20_000_u32 {
        // A new pose every 0.8 s: most are left on the way there.
        if let Some(stood) = stood_s {
            pose = usize::try_from((cycle - stood) / 160).unwrap();
        }
        let order =
            if pose >= 3 * poses(&robot) { Order::Stop } else { Order::Take(pose * 5 % poses(&robot)) };
        controller.decide(dt_s, order);
        controller.learn_from_goals();
        let record = controller.record(&[]);
        let activity = record.facts.activity;
        if activity == Activity::Done {
            break;
        }
        if activity == Activity::Standing && stood_s.is_none() {
            stood_s = Some(cycle);
        }
        let goals = &record.state.goal_rad;
        if activity != Activity::Limp {
            assert_in_ball_ranges(&robot, goals, &format!("cycle {cycle}, {activity:?}"));
        }
        if stood_s.is_none() || order == Order::Stop {
            continue;
        }
        assert_eq!(record.facts.interventions, 0, "safety held a goal back in cycle {cycle}");
        let places: Vec<DVec3> = robot
            .motion
            .figure()
            .unwrap()
            .legs
            .map(|leg| {
                let chain = &robot.chains[leg];
                let tip = robot.tip_in_body(chain, goals[chain.joints.clone()].iter().copied());
                record.targets.trunk_in_world + record.targets.trunk_orientation * tip
            })
            .to_vec();
        let first = soles.get_or_insert_with(|| places.clone());
        for (place, first) in places.iter().zip(first) {
            assert!(
                place.distance(*first) < 1e-5,
                "a sole went {} m in cycle {cycle}",
                place.distance(*first)
            );
        }
        seen.push(goals.clone());
        if let [.., a, b, c] = seen.as_slice() {
            for joint in 0..robot.joints.len() {
                let acceleration = (c[joint] - 2.0 * b[joint] + a[joint]) / (dt_s * dt_s);
                assert!(
                    acceleration.abs() < 0.9 * robot.safety.acceleration_rad_s2,
                    "{} leaps in cycle {cycle}: {acceleration} rad/s^2",
                    robot.joints[joint].name
                );
            }
        }
    }
    assert!(pose >= 3 * poses(&robot), "all poses were asked for");
    assert_eq!(controller.record(&[]).facts.activity, Activity::Done);
}

#[test]
fn a_whole_run_keeps_every_limit_and_ends_limp() {
    let robot = figure();
    let mut stood_s: Option<f64> = None;
    let (report, ports) = run_with(&robot, "", |status| {
        if status.activity == Activity::Standing {
            stood_s.get_or_insert(status.time_s);
        }
        match stood_s {
            Some(stood_s) if status.time_s > stood_s + 16.0 => Order::Stop,
            Some(stood_s) if status.time_s > stood_s => {
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some seconds")]
                let pose = (0.5 * (status.time_s - stood_s)) as usize;
                Order::Take(pose % poses(&robot))
            }
            _ => Order::Take(0),
        }
    });
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0));
    let feet = report.feet.unwrap();
    assert!(feet.stance_slip_planned_max_m < 1e-9 && feet.ik_residual_max_m < 1e-6, "{feet:?}");
    assert!(report.is_end_heard);
    let ports = ports.borrow();
    for joint in &robot.joints {
        let servo = servo(joint);
        assert!(!ports.world().shaft(servo.bus, servo.id.0).unwrap().torque_on, "{} has torque", joint.name);
    }
}

#[test]
fn a_servo_that_falls_silent_in_a_pose_makes_it_sit_down() {
    let robot = figure();
    // The left knee, for good; power-up to standing takes less.
    let faults = "[[fault]]\nat_s = 25\nkind = \"silent\"\nbus = \"legs\"\nid = 4\n";
    let (report, _) =
        run_with(
            &robot,
            faults,
            |status| {
                if status.time_s < 40.0 { Order::Take(1) } else { Order::StopAtOnce }
            },
        );
    assert_eq!(report.outcome, Outcome::StoppedBySafety, "{}", report.reason);
    assert!(report.reason.contains("left_leg.knee"), "{}", report.reason);
    assert!((25.0..40.0).contains(&report.duration_s), "{} s", report.duration_s);
    assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0));
}

fn hippocamp(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hippocamp")).args(arguments).current_dir(folder).output().unwrap()
}

#[test]
fn the_commands_of_other_rigs_work_on_a_figure() {
    let folder = tempfile::tempdir().unwrap();
    let file = config_file("figure.toml");
    let file = file.to_str().unwrap();
    let script = config_file("scripts/poses.toml");
    let script = script.to_str().unwrap();
    let said = |arguments: &[&str]| {
        let output = hippocamp(arguments, folder.path());
        let words = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{arguments:?}: {words}{}", String::from_utf8_lossy(&output.stderr));
        words
    };
    let checked = said(&["check", file, "--urdf", "figure.urdf"]);
    assert!(checked.contains("lean-left") && checked.contains("left_leg.knee"), "{checked}");
    let urdf = std::fs::read_to_string(folder.path().join("figure.urdf")).unwrap();
    assert_eq!(urdf.matches("type=\"revolute\"").count(), 21);
    let ran = said(&[
        "run",
        file,
        "--script",
        script,
        "--virtual",
        "--no-physics",
        "--record",
        "run.mcap",
        "--html",
        "run.html",
        "--report",
        "run.json",
    ]);
    assert!(ran.contains("completed"), "{ran}");
    let replayed = said(&["replay", "run.mcap"]);
    assert!(replayed.contains("all goals the same"), "{replayed}");
    assert!(std::fs::metadata(folder.path().join("run.html")).unwrap().len() > 10_000);
    said(&["plot", file, "--script", script, "--out", "pictures"]);
    for picture in ["joints.svg", "poses.svg", "front.svg"] {
        let svg = std::fs::read_to_string(folder.path().join("pictures").join(picture)).unwrap();
        assert!(svg.contains("squat") || picture == "joints.svg", "{picture}");
    }
    said(&["run", file, "--pose", "squat", "--for", "2", "--virtual", "--no-physics"]);
    for (arguments, words) in [
        (&["run", file, "--pose", "handstand", "--virtual"][..], "expected one of stand, squat"),
        (&["run", file, "--gait", "trot", "--virtual"], "a figure takes poses"),
        (&["show", file, "--virtual"], "is a figure"),
        (&["plot", file, "--script", script, "--out", "p", "--thesis"], "a figure has no gaits"),
    ] {
        let output = hippocamp(arguments, folder.path());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && said.contains(words), "{arguments:?}: {said}");
    }
}

#[test]
fn mistakes_in_a_figures_file_are_reported_with_their_key() {
    let text = std::fs::read_to_string(config_file("figure.toml")).unwrap();
    for (from, to, key, words) in [
        ("name = \"stand\"", "name = \"rest\"", "motion.pose", "the pose it stands in as the first"),
        ("joint = \"head.nod\"", "joint = \"left_leg.knee\"", "turn[0].joint", "feet stay on the ground"),
        ("joint = \"head.nod\"", "joint = \"head.shake\"", "turn[0].joint", "one of \"left_leg.hip_pitch\""),
        (
            "angle_deg = 20 },\n]\n\n[[motion.pose]]\nname = \"arms-up\"",
            "angle_deg = 90 },\n]\n\n[[motion.pose]]\nname = \"arms-up\"",
            "angle_deg",
            "-40.0 to 45.0",
        ),
        ("sit_height_mm = 160", "sit_height_mm = 260", "sit_height_mm", "at most the standing height"),
        (
            "axis = [1, 0, 0]\nlink_mm = [98, 0, 0]",
            "axis = [0, 1, 0]\nlink_mm = [98, 0, 0]",
            "joint[2].ball",
            "the limb's own direction",
        ),
        ("right = \"right_leg\" }", "right = \"left_leg\" }", "legs.right", "a chain of its own"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = config::parse(&text.replacen(from, to, 1), "figure.toml").unwrap_err().to_string();
        assert!(error.contains(key) && error.contains(words), "{to}: {error}");
    }
    // Facts that only the geometry of the robot shows.
    let robot = config::parse(&text.replacen("stand_height_mm = 205", "stand_height_mm = 215", 1), "x")
        .unwrap()
        .robot;
    let error = FigureCapability::of(&robot, robot.motion.figure().unwrap()).unwrap_err();
    assert_eq!(error.pose, Some(0), "{error}");
}

/// With `HIPPOCAMP_FULL` set a minute of ten seeds, else a quarter of one.
#[test]
fn small_pushes_do_not_make_a_figure_fall() {
    let robot = in_physics("figure.toml");
    // 0.015 N s a kg each second, to any side, from when hands have let go of it.
    let faults = "[[fault]]\nkind = \"push\"\nat_s = 15\nimpulse_n_s = 0.0315\nfor_s = 0.1\nevery_s = 1\n";
    let (seeds, until_s) = if is_full() { (10, 75.0) } else { (1, 30.0) };
    let order = |s: f64| if s < until_s { Order::Take(0) } else { Order::StopAtOnce };
    let (mut roll_deg, mut pitch_deg) = (0.0_f64, 0.0_f64);
    for seed in 1..=seeds {
        let (report, _) = run_with_seed(&robot, seed, faults, |status| order(status.time_s));
        let body = report.body.unwrap();
        assert!(!body.fell, "{seed}: {}: {body:?}", report.reason);
        assert_eq!(report.outcome, Outcome::Completed, "{seed}: {}", report.reason);
        (roll_deg, pitch_deg) = (roll_deg.max(body.roll_max_deg), pitch_deg.max(body.pitch_max_deg));
    }
    println!("[nudges]\n| runs of a minute | fell | roll at most | pitch at most |\n|---|---|---|---|");
    println!("| {seeds} | 0 | {roll_deg:.1} deg | {pitch_deg:.1} deg |");
    assert!(roll_deg < 5.0 && pitch_deg < 5.0, "{roll_deg} and {pitch_deg} degrees");
}

/// By then hands have set it down, and it takes all poses; a planned bow does not count as a fall.
#[test]
fn a_figure_on_the_ground_takes_every_pose() {
    let robot = in_physics("figure.toml");
    let mut stood_s: Option<f64> = None;
    let mut taken = vec![false; poses(&robot)];
    let (report, _) = run_with(&robot, "", |status| {
        let is_standing = status.activity == Activity::Standing;
        if is_standing {
            stood_s.get_or_insert(status.time_s);
        }
        let Some(stood_s) = stood_s else { return Order::Take(0) };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some seconds")]
        let pose = (0.25 * (status.time_s - stood_s)) as usize;
        let Some(taken) = taken.get_mut(pose) else { return Order::Stop };
        *taken |= is_standing;
        Order::Take(pose)
    });
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert!(taken.iter().all(|taken| *taken), "{taken:?}");
    let body = report.body.unwrap();
    assert!(!body.fell && body.height_error_max_m.unwrap() < 0.01, "{body:?}");
    assert!((body.pitch_max_deg - 25.0).abs() < 3.0 && body.roll_max_deg < 3.0, "{body:?}");
}

/// From any pose it can go straight to its sitting pose, and that does not count as a fall either.
#[test]
fn a_figure_stopped_in_any_pose_sits_down() {
    let robot = in_physics("figure.toml");
    // All poses, or a bow and a lean, from which the move is longest.
    let names = robot.motion.figure().unwrap().poses.iter().map(|pose| pose.name.as_str());
    let chosen = names.enumerate().filter(|(_, name)| is_full() || ["bow", "lean-left"].contains(name));
    for (pose, _) in chosen {
        let (report, _) =
            run_with(
                &robot,
                "",
                |status| {
                    if status.time_s < 24.0 { Order::Take(pose) } else { Order::StopAtOnce }
                },
            );
        assert_eq!(report.outcome, Outcome::Completed, "pose {pose}: {}", report.reason);
        assert_eq!(report.falls.map_or(0, |falls| falls.falls), 0, "pose {pose}: {}", report.reason);
    }
}

/// From the operator's motion to the reflex's and, if the figure keeps its feet, back: no goal jumps between two
/// cycles.
#[test]
fn the_reflex_takes_over_and_hands_back_without_a_jump() {
    let robot = in_physics("figure.toml");
    let pushed = |direction_deg: f64, impulse_n_s: f64| {
        let faults = format!(
            "[[fault]]\nkind = 'push'\nat_s = 21.2\nimpulse_n_s = {impulse_n_s}\nfor_s = 0.1\n\
             direction_deg = {direction_deg}\n"
        );
        // It is pushed on its way into a bow.
        let order = |s: f64| match s {
            ..20.9 => Order::Take(0),
            ..29.0 => Order::Take(4),
            _ => Order::Stop,
        };
        let (report, _) = run_with(&robot, &faults, |status| order(status.time_s));
        assert_eq!(
            (report.joints.range_violations, report.joints.rate_violations),
            (0, 0),
            "{impulse_n_s} N s to {direction_deg} degrees: {}",
            report.reason
        );
        report
    };
    for side in (0..8).step_by(if is_full() { 1 } else { 3 }) {
        let report = pushed(45.0 * f64::from(side), 0.8 * 2.1);
        assert_eq!(report.outcome, Outcome::Fallen, "side {side}: {}", report.reason);
        assert_eq!(report.falls.unwrap().outcome, FallOutcome::LiesLimp, "side {side}");
        assert!(report.body.unwrap().fell, "side {side}");
    }
    for side in [0, 3].into_iter().take(if is_full() { 2 } else { 1 }) {
        let report = pushed(45.0 * f64::from(side), 0.08 * 2.1);
        assert_eq!(report.outcome, Outcome::Completed, "side {side}: {}", report.reason);
        assert_eq!(report.falls.unwrap().falls, 0, "side {side}");
    }
}

#[test]
fn shared_weight_takes_less_torque_than_weight_split_equally_at_the_foot_centres() {
    let robot = in_physics("figure.toml");
    let figure = robot.motion.figure().unwrap();
    let capability = FigureCapability::of(&robot, figure).unwrap();
    let plan = capability.plan(0);
    let mut standing = Standing::new(&robot, &Sole::all_of(&robot), 0.8);
    println!("[torques]\n| pose | shared | split equally |\n|---|---|---|");
    for (place, pose) in figure.poses.iter().enumerate() {
        let trunk =
            TrunkMotion { roll_rad: pose.roll_rad, pitch_rad: pose.pitch_rad, ..TrunkMotion::default() };
        standing.solve(&plan.pose_rad[place], &trunk, &vec![1.0; robot.chains.len()]);
        let shared: f64 = standing.torques_nm().iter().map(|torque| torque * torque).sum();
        let split: f64 = capability.split_nm[place].iter().map(|torque| torque * torque).sum();
        println!("| {} | {shared:.4} | {split:.4} |", pose.name);
        assert!(standing.miss_share() < 2e-3, "{}: {} in the air", pose.name, standing.miss_share());
        // Over the middle between both feet an equal split is already best; beside it, it is not.
        let is_middle = capability.centers_m[place].y.abs() < 0.01;
        let most = if is_middle { 1.001 * split } else { 0.9 * split };
        assert!(shared < most, "{}: {shared} beside {split}", pose.name);
    }
}
