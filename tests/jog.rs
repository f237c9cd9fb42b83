//! One joint, through safety: on simulated buses, and as the command.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;

use std::path::Path;
use std::process::{Command, Output};

use common::{Spy, config_file, shipped};
use hippocamp::config;
use hippocamp::jog::{JogReport, jog};
use hippocamp::model::Robot;
use hippocamp::motion::{Activity, Order};
use hippocamp::signals::Status;
use hippocamp::simulation;
use hippocamp::telemetry::Outcome;
use hw_sim::{FaultScript, Shaft, World};

/// State of the shafts after each wait: which had torque, how fast they turned.
#[derive(Default)]
struct Seen {
    had_torque: Vec<bool>,
    fastest_rad_s: Vec<f64>,
    /// The hip's torque limit register at each look at which it had torque.
    hip_limits: Vec<u16>,
    /// At the last look.
    shafts: Vec<Shaft>,
}

impl Seen {
    /// Looks at the shafts of `servos`, by bus and id, and at the hip's torque limit.
    fn look(&mut self, world: &World, servos: &[(usize, u8)], limit_address: u16) {
        let shafts: Vec<Shaft> = servos.iter().map(|&(bus, id)| world.shaft(bus, id).unwrap()).collect();
        self.had_torque.resize(shafts.len(), false);
        self.fastest_rad_s.resize(shafts.len(), 0.0);
        for (index, shaft) in shafts.iter().enumerate() {
            self.had_torque[index] |= shaft.torque_on;
            self.fastest_rad_s[index] = self.fastest_rad_s[index].max(shaft.speed_rad_s.abs());
        }
        if shafts[HIP].torque_on {
            let (bus, id) = servos[HIP];
            let byte = |address| world.register(bus, id, address).unwrap();
            self.hip_limits.push(u16::from_le_bytes([byte(limit_address), byte(limit_address + 1)]));
        }
        self.shafts = shafts;
    }
}

const HIP: usize = 1;

/// Jogs the left hind hip of the robot of `name` to `goal_deg`, all joints starting at `start_deg` from the
/// middle of their ranges.
fn jogged(
    name: &str,
    goal_deg: f64,
    start_deg: f64,
    faults: &str,
    order: impl FnMut(&Status) -> Order,
) -> (JogReport, Seen) {
    let robot = shipped(name);
    let pose: Vec<f64> =
        robot.joints.iter().map(|joint| joint.middle_rad() + start_deg.to_radians()).collect();
    let faults = FaultScript::from_toml(faults).unwrap();
    let world = simulation::world_from_pose(&robot, &pose, 1, &faults).unwrap();
    let servos: Vec<_> =
        robot.joints.iter().map(|joint| joint.servo.map(|servo| (servo.bus, servo.id.0)).unwrap()).collect();
    let limit_address = robot.joints[HIP].servo.unwrap().model.registers.torque_limit.address;
    let mut seen = Seen::default();
    let ports = Spy::new(world, |ports| seen.look(ports.world(), &servos, limit_address));
    let report = jog(&robot, HIP, goal_deg.to_radians(), ports, order).unwrap();
    (report, seen)
}

fn only_the_hip_had_torque(seen: &Seen) {
    for (index, had_torque) in seen.had_torque.iter().enumerate() {
        assert_eq!(*had_torque, index == HIP, "joint {index}");
    }
    assert!(seen.shafts.iter().all(|shaft| !shaft.torque_on), "all limp afterwards");
}

/// From nothing and to nothing over `torque_ramp_s`: no step of the torque limit is larger than the steepest part
/// of a quintic step allows.
fn its_torque_rose_and_fell_smoothly(robot: &Robot, seen: &Seen) {
    let full = f64::from(robot.joints[HIP].servo.unwrap().model.torque_limit_full);
    let step = 1.875 * full * robot.period_s() / robot.safety.torque_ramp_s + 1.0;
    let limits: Vec<f64> = seen.hip_limits.iter().map(|limit| f64::from(*limit)).collect();
    let (first, last) = (limits[0], limits[limits.len() - 1]);
    assert!(first <= step && last <= step, "from {first} to {last} of {full}");
    for pair in limits.windows(2) {
        assert!((pair[1] - pair[0]).abs() <= step, "{} to {} of {full}", pair[0], pair[1]);
    }
}

#[test]
fn a_jogged_joint_moves_slowly_and_then_goes_limp() {
    for name in ["horse.toml", "horse-dynamixel.toml"] {
        let mut activities = Vec::new();
        let (report, seen) = jogged(name, -72.0, 0.0, "", |status| {
            if activities.last() != Some(&status.activity) {
                activities.push(status.activity);
            }
            Order::Go
        });
        assert_eq!((report.outcome, report.reason.as_str()), (Outcome::Completed, "turned and let go"));
        // To the nearest count, inwards: 0.088 degrees.
        assert!((report.goal_rad.to_degrees() + 72.0).abs() < 1e-9);
        let measured_deg = report.measured_rad.unwrap().to_degrees();
        assert!((measured_deg + 72.0).abs() < 2.0, "{name}: {measured_deg}");
        only_the_hip_had_torque(&seen);
        // No faster than slow_rate_deg_s, 30; a servo may overtake its goal for a moment.
        let fastest_deg_s = seen.fastest_rad_s[HIP].to_degrees();
        assert!(fastest_deg_s > 10.0 && fastest_deg_s < 45.0, "{name}: {fastest_deg_s}");
        assert_eq!(
            activities,
            [Activity::Limp, Activity::Jogging, Activity::Stopping, Activity::Done],
            "{name}"
        );
        its_torque_rose_and_fell_smoothly(&shipped(name), &seen);
    }
}

#[test]
fn a_joint_does_not_jump_when_its_torque_comes_on() {
    // Its goal is its present angle: 1 s of torque ramp, 0.5 s without a move, 1 s of hold.
    let (report, seen) = jogged("horse-dynamixel.toml", -85.0, 0.0, "", |_| Order::Go);
    assert!((report.measured_rad.unwrap().to_degrees() + 85.0).abs() < 0.1);
    assert!(seen.fastest_rad_s[HIP].to_degrees() < 2.0, "{}", seen.fastest_rad_s[HIP].to_degrees());
}

#[test]
fn a_jog_goal_is_limited_to_the_range_and_a_joint_outside_is_brought_in() {
    // -100 to -70 degrees; 20 from the middle is 5 outside.
    let (report, seen) = jogged("horse-dynamixel.toml", 400.0, 20.0, "", |_| Order::Go);
    let goal_deg = report.goal_rad.to_degrees();
    assert!(goal_deg <= -70.0 && goal_deg > -70.1, "{goal_deg}");
    assert!((report.measured_rad.unwrap().to_degrees() - goal_deg).abs() < 2.0);
    only_the_hip_had_torque(&seen);
}

#[test]
fn an_order_to_stop_makes_the_joint_limp_where_it_is() {
    // 1.1 s after power-up and later: on the way; before, while the torque still rises.
    for (stop, at_s) in [(Order::Stop, 1.3), (Order::StopAtOnce, 1.3), (Order::Stop, 0.5)] {
        let name = "horse-dynamixel.toml";
        let (report, seen) =
            jogged(name, -100.0, 0.0, "", |status| if status.time_s > at_s { stop } else { Order::Go });
        assert_eq!((report.outcome, report.reason.as_str()), (Outcome::Completed, "stopped by the operator"));
        let measured_deg = report.measured_rad.unwrap().to_degrees();
        let slowed_deg = seen.shafts[HIP].speed_rad_s.abs().to_degrees();
        assert!(measured_deg < -84.9 && measured_deg > -99.0, "on the way: {measured_deg}");
        assert!(slowed_deg < 1.0, "at rest: {slowed_deg}");
        only_the_hip_had_torque(&seen);
        its_torque_rose_and_fell_smoothly(&shipped(name), &seen);
    }
    let (report, seen) = jogged("horse.toml", -100.0, 0.0, "", |_| Order::Stop);
    assert_eq!(report.measured_rad, None);
    assert!(!seen.had_torque.contains(&true));
}

#[test]
fn a_jog_of_a_blocked_joint_ends() {
    // 29 degrees to go, and 25 is the most a joint may be off its goal; but above 80 % of its drive, 9 degrees off, the
    // servo's own overload protection trips after two seconds.
    let stuck = "[[fault]]\nat_s = 0\nkind = 'stuck'\nbus = 'main'\nid = 2\n";
    let (report, seen) = jogged("horse.toml", -70.0, -14.0, stuck, |_| Order::Go);
    assert_eq!(report.outcome, Outcome::StoppedBySafety);
    assert!(
        report.reason.contains("joint left_hind.hip") && report.reason.contains("alarm bits 0x20 (overload)"),
        "{}",
        report.reason
    );
    only_the_hip_had_torque(&seen);
}

#[test]
fn a_servo_that_falls_silent_ends_the_jog() {
    let silent = "[[fault]]\nat_s = 1.5\nkind = 'silent'\nbus = 'main'\nid = 9\n";
    let (report, seen) = jogged("horse.toml", -70.0, 0.0, silent, |_| Order::Go);
    assert_eq!(report.outcome, Outcome::StoppedBySafety);
    assert!(report.reason.contains("servo 9"), "{}", report.reason);
    only_the_hip_had_torque(&seen);
}

fn hippocamp(arguments: &[&str]) -> Output {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    Command::new(env!("CARGO_BIN_EXE_hippocamp")).current_dir(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn the_command_prints_goal_and_measured() {
    let output = hippocamp(&["jog", "config/horse.toml", "left_hind.hip", "-75", "--virtual"]);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{out}{err}");
    assert!(
        out.starts_with("horse: left_hind.hip to -75.0 degrees on simulated buses, virtual clock\n"),
        "{out}"
    );
    assert!(out.contains("completed: turned and let go\nleft_hind.hip: goal -75.00, measured -7"), "{out}");
}

#[test]
fn the_command_says_when_it_holds_the_angle_to_the_range() {
    let output = hippocamp(&["jog", "config/horse.toml", "left_hind.hip", "10", "--virtual"]);
    let out = text(&output.stdout);
    assert!(
        out.starts_with("10 degrees is outside the range of left_hind.hip, -100.0 to -70.0: held at -70.1\n"),
        "{out}"
    );
    assert_eq!(output.status.code(), Some(0), "{out}");
}

#[test]
fn impossible_jogs_are_bad_input() {
    let bad = |arguments: &[&str]| {
        let output = hippocamp(arguments);
        assert_eq!(output.status.code(), Some(2), "{}{}", text(&output.stdout), text(&output.stderr));
        text(&output.stderr)
    };
    let unknown = bad(&["jog", "config/horse.toml", "left_hind.hop", "-75", "--virtual"]);
    assert!(unknown.contains("expected one of left_hind.pelvis, left_hind.hip,"), "{unknown}");
    assert!(unknown.contains("did you mean left_hind.hip?"), "{unknown}");
    let no_angle = bad(&["jog", "config/horse.toml", "left_hind.hip", "nan", "--virtual"]);
    assert!(no_angle.contains("expected a number"), "{no_angle}");
    let paper = bad(&["jog", "config/thoroughbred.toml", "left_hind.hip", "-75", "--virtual"]);
    assert!(paper.contains("has no servo"), "{paper}");
}

/// A unit file in a folder of its own, with these lines after its head.
fn unit_file(test: &str, lines: &str) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("jog");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(format!("{test}.unit.toml"));
    std::fs::write(&path, format!("version = 1\nrobot_file = \"horse.toml\"\n{lines}")).unwrap();
    path.into_os_string().into_string().unwrap()
}

#[test]
fn the_simulation_has_the_zero_counts_of_the_unit_file() {
    let unit = unit_file("zero", "[[joint]]\nname = \"left_hind.hip\"\nzero_count = 1500\n");
    for command in ["jog", "run"] {
        let options: &[&str] = match command {
            "jog" => &["jog", "config/horse.toml", "left_hind.hip", "-75"],
            _ => &["run", "config/horse.toml", "--for", "1"],
        };
        let output = hippocamp(&[options, &["--virtual", "--unit", &unit]].concat());
        assert_eq!(output.status.code(), Some(0), "{}{}", text(&output.stdout), text(&output.stderr));
    }
    let seam = unit_file("seam", "[[joint]]\nname = \"left_hind.hip\"\nzero_count = 900\n");
    let output =
        hippocamp(&["jog", "config/horse.toml", "left_hind.hip", "-75", "--virtual", "--unit", &seam]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said.contains("seam.unit.toml:5: joint[0].zero_count = 900: expected a count from 1138"),
        "{said}"
    );
}

#[test]
fn nothing_moves_on_a_device_without_a_calibration() {
    let unit = unit_file("uncalibrated", "[[bus]]\nname = \"main\"\ndevice = \"/dev/serial/by-id/none\"\n");
    for options in [&["jog", "config/horse.toml", "left_hind.hip", "-75"][..], &["run", "config/horse.toml"]]
    {
        let output = hippocamp(&[options, &["--unit", &unit]].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("nothing moves on a real port without a calibrated unit file"), "{said}");
        assert!(said.contains("calibrated_on is not set"), "{said}");
    }
}

/// The same over a pseudo-terminal, in real time: the unit file names the device and the zero counts.
#[test]
fn with_a_calibrated_unit_file_it_moves_the_servo_on_the_device() {
    let folder = tempfile::tempdir().unwrap();
    let robot_file = folder.path().join("horse.toml");
    std::fs::copy(config_file("horse.toml"), &robot_file).unwrap();
    let file_robot = shipped("horse.toml");
    let mut built = file_robot.clone();
    for servo in built.joints.iter_mut().filter_map(|joint| joint.servo.as_mut()) {
        // No horn is where the robot file has it.
        servo.zero_count += 50.0;
    }
    for bus in &mut built.buses {
        // The terminal takes the adapter's place.
        bus.adapter_latency_us = 0;
    }
    let pose: Vec<f64> = built.joints.iter().map(hippocamp::model::Joint::middle_rad).collect();
    let world = simulation::world_from_pose(&built, &pose, 1, &FaultScript::default()).unwrap();
    let server = hw_sim::pty::PtyServer::start(world, folder.path()).unwrap();
    let hip = built.joints[HIP].servo.unwrap();
    let hip_deg = || {
        let shaft = server.with_world(|world| world.shaft(hip.bus, hip.id.0)).unwrap();
        hip.angle_of(shaft.position_counts).to_degrees()
    };

    let mut unit = config::Unit { robot_file: "horse.toml".to_owned(), ..config::Unit::default() };
    let device = server.paths()[0].display().to_string();
    unit.buses = vec![config::UnitBus { name: built.buses[0].name.clone(), device }];
    let entry = |joint: &hippocamp::model::Joint| config::UnitJoint {
        name: joint.name.clone(),
        zero_count: joint.servo.unwrap().zero_count,
        reversed: None,
        direction_checked: true,
        firmware: None,
    };
    unit.joints = built.joints.iter().map(entry).collect();
    let unit_path = config::default_unit_path(&robot_file);
    let robot_path = robot_file.to_str().unwrap();

    // Not calibrated yet: nothing happens.
    config::write_unit(&unit_path, &unit).unwrap();
    let output = hippocamp(&["jog", robot_path, "left_hind.hip", "-75"]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    assert!((hip_deg() + 85.0).abs() < 0.1, "{}", hip_deg());

    unit.seal(&file_robot, toml::value::Date { year: 2026, month: 1, day: 31 });
    config::write_unit(&unit_path, &unit).unwrap();
    let output = hippocamp(&["jog", robot_path, "left_hind.hip", "-75"]);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{out}{err}");
    assert!(
        out.contains(&format!("left_hind.hip to -75.0 degrees on {}", server.paths()[0].display())),
        "{out}"
    );
    assert!((hip_deg() + 75.0).abs() < 2.0, "{}", hip_deg());
}
