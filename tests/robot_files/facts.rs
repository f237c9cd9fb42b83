//! The robots of good files, and that no text makes the loader panic.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::{Path, PathBuf};

use glam::DVec3;
use hippocamp::config::{self, RobotFile};
use hippocamp::model::{Gait, Protocol, Robot, StopAction};
use proptest::prelude::*;

use crate::GOOD;

fn config_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config").join(name)
}

fn shipped(name: &str) -> Robot {
    config::load(&config_file(name)).unwrap_or_else(|error| panic!("{error}")).robot
}

fn good() -> RobotFile {
    config::parse(GOOD, "good.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn assert_near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected} within {tolerance}");
}

/// Takizawa 2005, chapter 4, degrees.
const HIND_RANGES: [(f64, f64); 4] = [(55.0, 65.0), (-100.0, -70.0), (15.0, 100.0), (-130.0, -20.0)];
const FORE_RANGES: [(f64, f64); 4] = [(-38.0, -32.0), (79.0, 81.0), (-135.0, -20.0), (0.0, 120.0)];

/// Names, thesis ranges, axes, stiffness, and link lengths in m (to the thousandth of a millimetre).
fn assert_horse_legs(robot: &Robot, hind_m: [f64; 4], fore_m: [f64; 4]) {
    let names: Vec<_> = robot.chains.iter().map(|chain| chain.name.as_str()).collect();
    assert_eq!(names, ["left_hind", "left_fore", "right_hind", "right_fore"]);
    let horse = robot.motion.horse().unwrap();
    assert_eq!(horse.legs, [0, 1, 2, 3]);
    for (place, chain) in robot.chains.iter().enumerate() {
        let (lengths, ranges, joints, stiffness) = if place % 2 == 0 {
            (hind_m, HIND_RANGES, ["pelvis", "hip", "stifle", "hock"], [0.1, 1.0, 0.6, 0.6])
        } else {
            (fore_m, FORE_RANGES, ["scapula", "shoulder", "elbow", "carpus"], [0.1, 0.1, 1.0, 1.0])
        };
        assert_eq!(chain.joints, place * 4..place * 4 + 4);
        for (i, joint) in robot.joints[chain.joints.clone()].iter().enumerate() {
            assert_eq!(joint.name, format!("{}.{}", chain.name, joints[i]));
            assert_eq!(joint.axis, DVec3::Y);
            assert_near(joint.link_m.z, -lengths[i], 1e-6);
            assert_near(joint.link_m.length(), lengths[i], 1e-6);
            assert_near(joint.range_rad.0, ranges[i].0.to_radians(), 1e-12);
            assert_near(joint.range_rad.1, ranges[i].1.to_radians(), 1e-12);
            assert_near(joint.stiffness, stiffness[i], 0.0);
        }
    }
}

fn mass_kg(robot: &Robot) -> f64 {
    robot.trunk_mass_kg + robot.joints.iter().map(|joint| joint.mass_kg).sum::<f64>()
}

/// Servo on joint `i` has id `i + 1`; the right half is mounted as a mirror image; all zero counts put the
/// middle of the range at the servo's middle count.
fn assert_sixteen_servos(robot: &Robot, model: &str) {
    assert_eq!(robot.joints.len(), 16);
    for (joint, id) in robot.joints.iter().zip(1u8..) {
        let servo = joint.servo.expect("a servo on every joint");
        assert_eq!(servo.model.name, model);
        assert_eq!(servo.id.0, id);
        assert_eq!(servo.reversed, joint.name.starts_with("right"));
        let sign = if servo.reversed { -1.0 } else { 1.0 };
        let middle_rad = (joint.range_rad.0 + joint.range_rad.1) / 2.0;
        assert_near(servo.zero_count + sign * middle_rad * 4096.0 / TAU, 2048.0, 1e-9);
    }
}

#[test]
fn horse_is_a_sixth_of_a_horse_on_one_feetech_bus() {
    let robot = shipped("horse.toml");
    let sixth = |lengths: [f64; 4]| lengths.map(|length| length / 6.0);
    assert_horse_legs(&robot, sixth([0.30, 0.40, 0.36, 0.50]), sixth([0.36, 0.29, 0.40, 0.42]));
    assert_sixteen_servos(&robot, "STS3215-12V");
    assert_near(mass_kg(&robot), 2.13, 1e-9);
    assert_near(robot.rate_hz, 100.0, 0.0);
    assert_eq!(robot.stop_action, StopAction::SitThenLimp);
    let roots: Vec<_> = robot.chains.iter().map(|chain| chain.root_m).collect();
    let corner = |x, y| DVec3::new(x, y, 0.0);
    assert_eq!(
        roots,
        [corner(-0.085, 0.06), corner(0.085, 0.06), corner(-0.085, -0.06), corner(0.085, -0.06)]
    );
    assert_eq!(robot.buses.len(), 1);
    assert_eq!(robot.buses[0].protocol, Protocol::Feetech);
    assert_eq!(robot.buses[0].baud, 1_000_000);
    // The servos let go at 70 degrees C; they need 9 V.
    assert_near(robot.safety.temperature_c, 65.0, 0.0);
    assert_near(robot.buses[0].voltage_min_v, 9.0, 0.0);
}

#[test]
fn horse_dynamixel_is_the_same_body_on_a_bus_a_leg() {
    let (robot, feetech) = (shipped("horse-dynamixel.toml"), shipped("horse.toml"));
    assert_sixteen_servos(&robot, "XM430-W210");
    assert_near(robot.rate_hz, 500.0, 0.0);
    assert_eq!(robot.buses.len(), 4);
    for (place, (bus, chain)) in robot.buses.iter().zip(&robot.chains).enumerate() {
        assert_eq!((bus.name.as_str(), bus.baud), (chain.name.as_str(), 4_000_000));
        assert_eq!(bus.protocol, Protocol::Dynamixel);
        for joint in &robot.joints[chain.joints.clone()] {
            assert_eq!(joint.servo.map(|servo| servo.bus), Some(place));
        }
    }
    for (ours, theirs) in robot.joints.iter().zip(&feetech.joints) {
        assert_eq!(ours.name, theirs.name);
        assert_eq!((ours.link_m, ours.range_rad), (theirs.link_m, theirs.range_rad));
        assert_eq!((ours.axis, ours.center_m), (theirs.axis, theirs.center_m));
        assert_near(ours.mass_kg, theirs.mass_kg, 0.0);
    }
    for (ours, theirs) in robot.chains.iter().zip(&feetech.chains) {
        assert_eq!(ours.root_m, theirs.root_m);
    }
}

#[test]
fn the_y_axis_of_the_horses_imu_points_forward() {
    for name in ["horse.toml", "horse-dynamixel.toml"] {
        let imu = shipped(name).imu.unwrap();
        // Its x axis is then to the right.
        assert!((imu.rotation * DVec3::Y - DVec3::X).length() < 1e-12, "{name}");
        assert!((imu.rotation * DVec3::X + DVec3::Y).length() < 1e-12, "{name}");
    }
}

#[test]
fn thoroughbred_exists_on_paper_only() {
    let robot = shipped("thoroughbred.toml");
    let larger = |lengths: [f64; 4]| lengths.map(|length| length * 1.18);
    assert_horse_legs(&robot, larger([0.30, 0.40, 0.37, 0.58]), larger([0.36, 0.29, 0.43, 0.49]));
    assert!(robot.buses.is_empty());
    assert!(robot.joints.iter().all(|joint| joint.servo.is_none()));
    let horse = robot.motion.horse().unwrap();
    assert_near(horse.swing_time_s, 0.3, 0.0);
    assert_near(horse.swing_lift_m, 0.12, 0.0);
    // Without servos nothing can be too hot or short of voltage.
    assert!(robot.safety.temperature_c.is_infinite());
    assert!(robot.joints.iter().all(|joint| robot.voltage_min_v(joint) <= 0.0));
}

#[test]
fn built_in_gaits_match_the_thesis_table_and_our_additions() {
    let horse = shipped("horse.toml").motion.horse().unwrap().clone();
    // Phase offsets in the order LH LF RH RF: 0, D1, D2, D1 + D2 modulo 1.
    let expected = [
        ("walk", 0.70, [0.0, 0.20, 0.50, 0.70]),
        ("walk-steady", 0.75, [0.0, 0.25, 0.50, 0.75]),
        ("trot", 0.50, [0.0, 0.50, 0.50, 0.0]),
        ("canter", 0.30, [0.0, 0.20, 0.20, 0.40]),
        ("canter-left", 0.30, [0.0, 0.20, 0.80, 0.0]),
        ("gallop", 0.25, [0.0, 0.35, 0.20, 0.55]),
        ("gallop-left", 0.25, [0.0, 0.35, 0.80, 0.15]),
        ("rotary-gallop", 0.25, [0.0, 0.55, 0.20, 0.35]),
        ("rotary-gallop-left", 0.25, [0.0, 0.15, 0.80, 0.35]),
    ];
    assert_eq!(horse.gaits.len(), expected.len());
    for (gait, (name, duty_factor, lags)) in horse.gaits.iter().zip(expected) {
        assert_eq!(gait.name, name);
        assert_near(gait.duty_factor, duty_factor, 0.0);
        for (lag, expected) in gait.phase_offsets.iter().zip(lags) {
            assert_near(*lag, expected, 1e-12);
        }
    }
}

#[test]
fn every_key_reaches_the_robot_in_si_units() {
    let robot = good().robot;
    assert_eq!(robot.name, "foal");
    assert_near(robot.rate_hz, 120.0, 0.0);
    assert_eq!(robot.stop_action, StopAction::Hold);
    assert_near(robot.trunk_mass_kg, 1.1, 0.0);
    assert_eq!(robot.trunk_center_m, DVec3::new(0.005, 0.0, 0.010));

    let [left, right] = robot.buses.as_slice() else { panic!("two buses") };
    assert_eq!((left.adapter_latency_us, left.return_delay_us), (1000, 0));
    assert_eq!((right.adapter_latency_us, right.return_delay_us), (2000, 500));
    assert_near(left.supply_ohm, 0.1, 0.0);
    assert_near(right.supply_ohm, 0.25, 0.0);

    // Yawed by a quarter turn to the left, the chain's forward is the body's left.
    let forward = robot.chains[0].root_rotation * DVec3::X;
    assert!(forward.abs_diff_eq(DVec3::Y, 1e-12), "{forward}");

    let hip = &robot.joints[1];
    assert_eq!(hip.name, "lh.hip");
    assert_eq!(hip.link_m, DVec3::new(0.0, 0.0, -0.150));
    assert_eq!(hip.center_m, DVec3::new(0.001, 0.002, -0.060));
    assert_near(hip.mass_kg, 0.25, 0.0);
    // Unless given, the centre is the link's middle.
    assert_eq!(robot.joints[2].center_m, DVec3::new(0.0, 0.0, -0.0755));
    assert_eq!(robot.joints[3].axis, DVec3::new(0.0, 0.6, 0.8));

    // Middle of 15..100 is 57.5 degrees, 654.222 counts; the mirrored servo has its zero on the other side.
    let zero_count = |joint: usize| robot.joints[joint].servo.expect("a servo").zero_count;
    assert_near(zero_count(1), 2048.0 - 57.5 / 360.0 * 4096.0, 1e-9);
    assert_near(zero_count(3), 2048.0 + 57.5 / 360.0 * 4096.0, 1e-9);

    assert_near(robot.safety.rate_share, 0.5, 0.0);
    assert_near(robot.safety.temperature_c, 65.0, 0.0);
    // A limit a bus, the highest of its models' minima: an STS3250 needs 9 V, an XM430 ten.
    assert_near(left.voltage_min_v, 9.0, 0.0);
    assert_near(right.voltage_min_v, 10.0, 0.0);
    assert_near(robot.safety.slow_rate_rad_s, 30f64.to_radians(), 1e-12);

    let horse = robot.motion.horse().unwrap();
    assert_near(horse.stand_height_m, 0.140, 0.0);
    assert_near(horse.sit_height_m, 0.090, 0.0);
    assert_near(horse.acceleration_m_s2, 0.25, 0.0);
    let [.., amble, rotary] = horse.gaits.as_slice() else { panic!("two gaits") };
    assert_near(amble.phase_offsets[3], 0.2, 1e-12);
    for (lag, expected) in rotary.phase_offsets.iter().zip([0.0, 0.7, 0.1, 0.6]) {
        assert_near(*lag, expected, 0.0);
    }
}

#[test]
fn a_gait_may_use_the_old_names_of_its_keys_but_not_both() {
    let old = GOOD
        .replace("fore_hind_phase_offset", "fore_hind_lag")
        .replace("left_right_phase_offset", "left_right_lag")
        .replace("phase_offsets = [", "bob_mm = 3\nlags = [");
    let robot = config::parse(&old, "old").unwrap().robot;
    let [.., amble, rotary] = robot.motion.horse().unwrap().gaits.as_slice() else { panic!("two gaits") };
    assert_near(amble.phase_offsets[3], 0.2, 1e-12);
    assert_near(rotary.phase_offsets[1], 0.7, 0.0);
    assert_near(rotary.vertical_oscillation.rise_m, 0.003, 1e-12);
    let wrong = config::parse(&old.replace("lags = [0,", "lags = [7,"), "old").unwrap_err().to_string();
    assert!(wrong.contains("motion.gait[1].lags[0]"), "{wrong}");
    let both = old.replace("bob_mm = 3", "bob_mm = 3\nvertical_oscillation_mm = 4");
    let refused = config::parse(&both, "old").unwrap_err().to_string();
    assert!(refused.contains("either bob_mm, an old name, or vertical_oscillation_mm"), "{refused}");
    assert_eq!(refused.matches("an old name").count(), 1, "{refused}");
}

#[test]
fn gaits_of_a_file_are_added_to_the_built_in_ones_or_replace_one() {
    let gaits_of = |robot: Robot| {
        let horse = robot.motion.horse().unwrap().clone();
        horse.gaits
    };
    let names = |gaits: &[Gait]| gaits.iter().map(|gait| gait.name.clone()).collect::<Vec<_>>();
    let built_in = gaits_of(shipped("horse.toml"));
    let own = gaits_of(good().robot);
    assert_eq!(names(&own), [names(&built_in), vec!["amble".to_owned(), "rotary".to_owned()]].concat());
    assert_eq!(own[..built_in.len()], built_in);

    let text = GOOD.replace("name = \"amble\"", "name = \"trot\"");
    let robot = config::parse(&text, "good.toml").unwrap_or_else(|error| panic!("{error}")).robot;
    let own = gaits_of(robot);
    assert_eq!(names(&own), [names(&built_in), vec!["rotary".to_owned()]].concat());
    let trot = own.iter().find(|gait| gait.name == "trot").expect("a trot");
    assert_near(trot.duty_factor, 0.6, 0.0);
}

#[test]
fn roll_pitch_and_yaw_turn_about_the_body_axes_in_that_order() {
    let text = GOOD.replace("root_rpy_deg = [0, 0, 90]", "root_rpy_deg = [90, 90, 0]");
    let robot = config::parse(&text, "good.toml").unwrap_or_else(|error| panic!("{error}")).robot;
    // Rolled by a quarter turn, left points up; pitched by one after that, up points forward.
    let left = robot.chains[0].root_rotation * DVec3::Y;
    assert!(left.abs_diff_eq(DVec3::X, 1e-12), "{left}");
}

#[test]
fn an_axis_of_almost_unit_length_is_normalised() {
    let text = GOOD.replace("axis = [0, 0.6, 0.8]", "axis = [0, 0.7071, 0.7071]");
    let robot = config::parse(&text, "good.toml").unwrap_or_else(|error| panic!("{error}")).robot;
    assert_near(robot.joints[3].axis.length(), 1.0, 1e-15);
    assert_near(robot.joints[3].axis.angle_between(DVec3::Y), FRAC_PI_2 / 2.0, 1e-12);
}

#[test]
fn numbers_may_be_written_in_every_way_toml_has() {
    for spelling in ["1_2_0", "0x78", "0b1111000", "0o170", "120.0", "1.2e2", "+120"] {
        let text = GOOD.replace("loop_rate_hz = 120", &format!("loop_rate_hz = {spelling}"));
        let robot = config::parse(&text, "good.toml").unwrap_or_else(|error| panic!("{error}")).robot;
        assert_near(robot.rate_hz, 120.0, 0.0);
    }
}

#[test]
fn later_checks_find_line_and_value_of_any_key() {
    let file = good();
    let said = |key: &str| file.fault(key, "something else").to_string();
    assert_eq!(
        said("chain[0].joint[1].range_deg"),
        "good.toml:39: chain[0].joint[1].range_deg = [15, 100]: expected something else"
    );
    assert_eq!(
        said("motion.stand_height_mm"),
        "good.toml:73: motion.stand_height_mm = 140: expected something else"
    );
    assert_eq!(said("loop_rate_hz"), "good.toml:2: loop_rate_hz = 120: expected something else");
    // Not set: the line of the section.
    assert_eq!(said("safety.hold_s"), "good.toml:66: safety.hold_s is not set: expected something else");
    assert_eq!(said("chain[1].joint[0].colour").split(": ").next(), Some("good.toml:49"));
    assert_eq!(said("no.such[9].key"), "good.toml:1: no.such[9].key is not set: expected something else");
}

/// One change to the bytes of a file.
#[derive(Debug, Clone)]
enum Edit {
    Change(u8),
    Insert(u8),
    Remove(usize),
    Repeat(usize),
}

fn apply(bytes: &mut Vec<u8>, at: usize, edit: &Edit) {
    let at = at % bytes.len();
    let end = |length: usize| (at + length).min(bytes.len());
    match edit {
        Edit::Change(byte) => bytes[at] = *byte,
        Edit::Insert(byte) => bytes.insert(at, *byte),
        Edit::Remove(length) => drop(bytes.drain(at..end(*length))),
        Edit::Repeat(length) => {
            let piece = bytes[at..end(*length)].to_vec();
            bytes.splice(at..at, piece);
        }
    }
}

fn edits() -> impl Strategy<Value = Vec<(usize, Edit)>> {
    // Mostly characters that mean something in TOML.
    let byte =
        || prop_oneof![any::<u8>(), proptest::sample::select(b"[]{}=.,\"'#\n-+e0123456789_ ".to_vec())];
    let edit = prop_oneof![
        byte().prop_map(Edit::Change),
        byte().prop_map(Edit::Insert),
        (1usize..40).prop_map(Edit::Remove),
        (1usize..400).prop_map(Edit::Repeat),
    ];
    proptest::collection::vec((any::<usize>(), edit), 1..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// A spoiled file is loaded or refused with faults that stand inside it.
    #[test]
    fn no_change_of_bytes_makes_it_panic(edits in edits()) {
        let mut bytes = GOOD.as_bytes().to_vec();
        for (at, edit) in &edits {
            apply(&mut bytes, *at, edit);
        }
        let text = String::from_utf8_lossy(&bytes);
        if let Err(error) = config::parse(&text, "spoiled.toml") {
            prop_assert!(!error.faults.is_empty());
            let lines = text.split('\n').count();
            for fault in &error.faults {
                prop_assert!((1..=lines).contains(&fault.line), "{fault}");
                prop_assert!(!fault.expected.is_empty());
            }
        }
    }

    #[test]
    fn no_text_makes_it_panic(text in ".{0,200}") {
        if let Err(error) = config::parse(&text, "noise.toml") {
            prop_assert!(!error.faults.is_empty());
        }
    }
}

/// Servos of 7.4 V and of 12 V, each kind on a bus with a supply of its own.
#[test]
fn each_bus_has_the_voltage_limit_of_its_own_servos() {
    let text = include_str!("../robots/two-voltages.toml");
    let robot = config::parse(text, "dog").unwrap().robot;
    let limits: Vec<f64> = robot.buses.iter().map(|bus| bus.voltage_min_v).collect();
    let least = |bus: usize| {
        let servos = robot.joints.iter().filter_map(|joint| joint.servo).filter(|servo| servo.bus == bus);
        servos.map(|servo| servo.model.voltage_min_v).fold(0.0, f64::max)
    };
    assert_eq!(limits, [least(0), least(1)]);
    assert!(limits[0] < limits[1], "{limits:?}");
    // A limit for one bus alone; one that suits only one bus is refused with the bus.
    let one = text.replacen("baud = 1000000", "baud = 1000000\nvoltage_min_v = 7", 1);
    assert_near(config::parse(&one, "dog").unwrap().robot.buses[0].voltage_min_v, 7.0, 0.0);
    let both = format!("{text}\n[safety]\nvoltage_min_v = 9\n");
    let error = config::parse(&both, "dog").unwrap_err().to_string();
    assert!(error.contains("safety.voltage_min_v = 9") && error.contains("each [[bus]] may have"), "{error}");
    assert!(!error.contains("known key"), "{error}");
}

/// Lengths in metres and angles in radians are the mistakes of people who come from URDF.
#[test]
fn units_that_are_mixed_up_are_named() {
    let text = include_str!("../../config/horse.toml");
    let scaled = |key: &str, factor: f64| {
        let scale = |line: &str| {
            let Some((name, values)) = line.split_once(" = [").filter(|(name, _)| *name == key) else {
                return line.to_owned();
            };
            let values = values.split(']').next().unwrap().split(',');
            let values: Vec<String> =
                values.map(|value| (value.trim().parse::<f64>().unwrap() * factor).to_string()).collect();
            format!("{name} = [{}]", values.join(", "))
        };
        text.lines().map(scale).collect::<Vec<_>>().join("\n")
    };
    for (key, factor, words) in [("link_mm", 1e-3, "metres"), ("range_deg", 1_f64.to_radians(), "radians")] {
        let error = config::parse(&scaled(key, factor), "horse").unwrap_err().to_string();
        let likely = error.lines().find(|line| line.contains("probably in")).unwrap_or_default();
        assert!(likely.contains(&format!("chain[0].joint[0].{key}")) && likely.contains(words), "{error}");
    }
}
