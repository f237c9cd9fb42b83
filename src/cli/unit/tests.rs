use super::*;
use crate::config::{ConfigError, Unit, UnitBus, UnitJoint, parse_unit};

const ROBOT_FILE: &str = "config/horse-dynamixel.toml";

fn robot() -> Robot {
    config::parse(include_str!("../../../config/horse-dynamixel.toml"), "horse").unwrap().robot
}

fn device(bus: &str) -> String {
    format!("/dev/serial/by-id/{bus}")
}

/// A calibrated unit with devices for these buses.
fn unit(robot: &Robot, buses: &[&str]) -> Unit {
    let joint = |joint: &crate::model::Joint| UnitJoint {
        name: joint.name.clone(),
        zero_count: joint.servo.unwrap().zero_count,
        direction_checked: true,
        serial: None,
        firmware: None,
    };
    let bus = |name: &&str| UnitBus { name: (*name).to_owned(), device: device(name) };
    let mut unit = Unit {
        robot_file: "horse-dynamixel.toml".to_owned(),
        buses: buses.iter().map(bus).collect(),
        joints: robot.joints.iter().map(joint).collect(),
        ..Unit::default()
    };
    unit.seal(robot, "2026-01-31".parse::<toml::value::Datetime>().unwrap().date.unwrap());
    unit
}

const ALL: [&str; 4] = ["left_hind", "left_fore", "right_hind", "right_fore"];

fn file(unit: &Unit) -> UnitFile {
    parse_unit(&format!("version = 1\n{}", toml::to_string(unit).unwrap()), "a.unit.toml").unwrap()
}

fn ports(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
    pairs.iter().map(|(bus, device)| ((*bus).to_owned(), (*device).to_owned())).collect()
}

fn choose(unit: Option<&Unit>, pairs: &[(&str, &str)], is_simulation: bool) -> Result<Lines> {
    let file = unit.map(file);
    lines(&robot(), Path::new(ROBOT_FILE), file.as_ref(), &ports(pairs), is_simulation)
}

/// What is said; all of it is bad input, exit code 2.
fn said(result: Result<Lines>) -> String {
    let error = result.unwrap_err();
    assert!(error.is::<BadInput>() || error.is::<ConfigError>(), "{error:#}");
    format!("{error:#}")
}

#[test]
fn without_any_device_buses_are_simulated() {
    assert_eq!(choose(None, &[], false).unwrap(), Lines::Simulated);
    let without_buses = unit(&robot(), &[]);
    assert_eq!(choose(Some(&without_buses), &[], false).unwrap(), Lines::Simulated);
}

#[test]
fn a_calibrated_unit_file_gives_every_bus_its_device() {
    let mut backwards = ALL;
    backwards.reverse();
    let lines = choose(Some(&unit(&robot(), &backwards)), &[], false).unwrap();
    assert_eq!(lines, Lines::Devices(ALL.map(device).to_vec()), "in the robot's order");
}

#[test]
fn who_asks_for_a_simulation_gets_one() {
    let robot = robot();
    assert_eq!(choose(Some(&unit(&robot, &ALL)), &[], true).unwrap(), Lines::Simulated);
    let mut uncalibrated = unit(&robot, &ALL);
    uncalibrated.joints.clear();
    assert_eq!(choose(Some(&uncalibrated), &[], true).unwrap(), Lines::Simulated);
    let said = said(choose(None, &[("left_hind", "/dev/a")], true));
    assert!(said.contains("--port left_hind=/dev/a: simulated buses have no device"), "{said}");
}

#[test]
fn ports_go_before_the_unit_file_s_devices_and_may_fill_them_up() {
    let robot = robot();
    let lines = choose(Some(&unit(&robot, &ALL)), &[("left_fore", "/dev/pts/3")], false).unwrap();
    let mut expected = ALL.map(device).to_vec();
    expected[1] = "/dev/pts/3".to_owned();
    assert_eq!(lines, Lines::Devices(expected));
    let pairs = ALL.map(|bus| (bus, bus));
    let lines = choose(Some(&unit(&robot, &[])), &pairs, false).unwrap();
    assert_eq!(lines, Lines::Devices(ALL.map(str::to_owned).to_vec()));
}

#[test]
fn nothing_moves_on_a_real_port_without_a_calibrated_unit_file() {
    let pairs = ALL.map(|bus| (bus, bus));
    let without = said(choose(None, &pairs, false));
    assert!(without.contains("without a calibrated unit file of this very robot"), "{without}");
    assert!(
        without.contains("expected config/horse-dynamixel.unit.toml, or another named with --unit"),
        "{without}"
    );

    let robot = robot();
    let good = unit(&robot, &ALL);
    type Spoil = fn(&mut Unit);
    let spoilt: [(Spoil, &str); 5] = [
        (|unit| drop(unit.joints.pop()), "[[joint]] \"right_fore.carpus\" is not set"),
        (|unit| unit.joints[2].direction_checked = false, "joint[2].direction_checked = false"),
        (|unit| unit.joints[2].zero_count += 3.0, "calibration_hash"),
        (|unit| unit.robot_file = "horse.toml".to_owned(), "robot_file = \"horse.toml\""),
        (|unit| unit.calibrated_on = None, "calibrated_on is not set"),
    ];
    for (spoil, words) in spoilt {
        let mut unit = good.clone();
        spoil(&mut unit);
        for ports in [&[][..], &pairs] {
            let said = said(choose(Some(&unit), ports, false));
            assert!(
                said.starts_with("nothing moves on a real port without a calibrated unit file"),
                "{said}"
            );
            assert!(said.contains(words) && said.contains("--simulate"), "{said}");
        }
    }
}

#[test]
fn every_bus_needs_a_device_of_its_own() {
    let robot = robot();
    let missing = said(choose(Some(&unit(&robot, &ALL[..3])), &[], false));
    assert!(
        missing.contains("bus right_fore has no device") && missing.contains("--port right_fore=PATH"),
        "{missing}"
    );
    let twin = device("left_hind");
    let twice = said(choose(Some(&unit(&robot, &ALL)), &[("right_hind", &twin)], false));
    assert!(
        twice.contains("buses left_hind and right_hind are both on /dev/serial/by-id/left_hind"),
        "{twice}"
    );
}

#[test]
fn ports_of_no_bus_and_twice_of_one() {
    let stranger = said(choose(None, &[("left_hint", "/dev/a")], false));
    assert!(stranger.contains("expected a bus, one of left_hind, left_fore"), "{stranger}");
    assert!(stranger.contains("did you mean left_hind?"), "{stranger}");
    let twice = said(choose(None, &[("left_hind", "/dev/a"), ("left_hind", "/dev/b")], false));
    assert!(twice.contains("--port left_hind=/dev/b: bus left_hind has a --port already"), "{twice}");
}

#[test]
fn a_named_unit_file_must_be_there_and_one_beside_the_robot_file_need_not() {
    assert!(find(Path::new(ROBOT_FILE), None).unwrap().is_none());
    let error = find(Path::new(ROBOT_FILE), Some(Path::new("absent.unit.toml"))).unwrap_err();
    assert!(
        error.is::<ConfigError>() && error.to_string().contains("absent.unit.toml: expected a unit file")
    );
    let folder = std::env::temp_dir().join(format!("hippocamp-{}-find", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("horse.unit.toml"), "version = 1\nrobot_file = \"horse.toml\"\n").unwrap();
    let found = find(&folder.join("horse.toml"), None).unwrap();
    assert_eq!(found.unwrap().unit.robot_file, "horse.toml");
    std::fs::remove_dir_all(folder).unwrap();
}
