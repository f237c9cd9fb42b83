use super::*;
use crate::config::{self, ConfigError, Unit, UnitBus, UnitJoint, parse_unit};

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
        reversed: None,
        direction_checked: true,
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

fn choose_with(unit: Option<&Unit>, ports: &[&str], is_simulation: bool) -> Result<Choice> {
    let ports = ports.iter().map(|text| text.parse().unwrap()).collect();
    let options = UnitArguments {
        unit: None,
        ports,
        simulate: is_simulation,
        is_virtual: false,
        no_physics: false,
        processor: None,
    };
    choose(&options, &robot(), Path::new(ROBOT_FILE), unit.map(file).as_ref())
}

/// Message for `--no-physics` with a calibrated unit file that names devices.
#[test]
fn joints_of_real_devices_do_not_turn_freely() {
    let unit = unit(&robot(), &ALL);
    for (simulate, is_refused) in [(false, true), (true, false)] {
        let options = UnitArguments {
            unit: None,
            ports: Vec::new(),
            simulate,
            is_virtual: false,
            no_physics: true,
            processor: None,
        };
        let choice = choose(&options, &robot(), Path::new(ROBOT_FILE), Some(&file(&unit)));
        match choice {
            Ok(choice) => assert!(!is_refused && choice == SIMULATED),
            Err(error) => {
                let said = error.to_string();
                assert!(is_refused && said.contains("--no-physics") && said.contains("--simulate"), "{said}");
            }
        }
    }
}

const SIMULATED: Choice = Choice::Simulated { is_virtual: false };

/// Paths of the devices, in the robot's order of buses.
fn paths(unit: Option<&Unit>, ports: &[&str]) -> Vec<String> {
    let Choice::Devices(ports) = choose_with(unit, ports, false).unwrap() else { panic!("simulated") };
    let devices = devices(&robot(), &ports).unwrap();
    assert!(devices.iter().zip(ALL).all(|(device, bus)| device.bus == bus && device.baud == 4_000_000));
    devices.iter().map(|device| device.path.display().to_string()).collect()
}

/// The error message; every such error is bad input, exit code 2.
fn said(result: Result<Choice>) -> String {
    let error = result.unwrap_err();
    assert!(error.is::<BadInput>() || error.is::<ConfigError>(), "{error:#}");
    format!("{error:#}")
}

/// A port for every bus.
const PORTS: [&str; 4] = ["right_fore=/dev/d", "left_fore=/dev/b", "left_hind=/dev/a=b", "right_hind=/dev/c"];

#[test]
fn without_any_device_buses_are_simulated() {
    assert_eq!(choose_with(None, &[], false).unwrap(), SIMULATED);
    assert_eq!(choose_with(Some(&unit(&robot(), &[])), &[], false).unwrap(), SIMULATED);
}

#[test]
fn a_calibrated_unit_file_gives_every_bus_its_device() {
    let mut backwards = ALL;
    backwards.reverse();
    assert_eq!(paths(Some(&unit(&robot(), &backwards)), &[]), ALL.map(device));
}

#[test]
fn the_option_for_a_simulation_gives_simulated_buses() {
    let mut uncalibrated = unit(&robot(), &ALL);
    uncalibrated.joints.clear();
    for unit in [unit(&robot(), &ALL), uncalibrated] {
        assert_eq!(choose_with(Some(&unit), &[], true).unwrap(), SIMULATED);
        let options = UnitArguments {
            unit: None,
            ports: Vec::new(),
            simulate: false,
            is_virtual: true,
            no_physics: false,
            processor: None,
        };
        let choice = choose(&options, &robot(), Path::new(ROBOT_FILE), Some(&file(&unit))).unwrap();
        assert_eq!(choice, Choice::Simulated { is_virtual: true });
    }
}

#[test]
fn port_options_override_the_devices_of_the_unit_file_and_may_complete_them() {
    let robot = robot();
    let mut expected = ALL.map(device);
    expected[1] = "/dev/pts/3".to_owned();
    assert_eq!(paths(Some(&unit(&robot, &ALL)), &["left_fore=/dev/pts/3"]), expected);
    assert_eq!(paths(Some(&unit(&robot, &[])), &PORTS), ["/dev/a=b", "/dev/b", "/dev/c", "/dev/d"]);
}

#[test]
fn nothing_moves_on_a_real_port_without_a_calibrated_unit_file() {
    let without = said(choose_with(None, &PORTS, false));
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
        for ports in [&[][..], &PORTS] {
            let said = said(choose_with(Some(&unit), ports, false));
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
    let missing = said(choose_with(Some(&unit(&robot, &ALL[..3])), &[], false));
    assert!(
        missing.contains("there is no device for bus right_fore: add each to the unit file"),
        "{missing}"
    );
    let twin = format!("right_hind={}", device("left_hind"));
    let twice = said(choose_with(Some(&unit(&robot, &ALL)), &[&twin], false));
    assert!(
        twice.contains("buses left_hind and right_hind are both on /dev/serial/by-id/left_hind"),
        "{twice}"
    );
}

#[test]
fn port_options_for_an_unknown_bus_or_twice_for_one_are_refused() {
    let stranger = said(choose_with(None, &["left_hint=/dev/a"], false));
    assert!(
        stranger.contains(
            "--port left_hint=/dev/a: horse-dynamixel has no bus left_hint; it has left_hind, left_fore"
        ),
        "{stranger}"
    );
    assert!(stranger.contains("did you mean left_hind?"), "{stranger}");
    let twice = said(choose_with(None, &["left_hind=/dev/a", "left_hind=/dev/b"], false));
    assert!(twice.contains("--port left_hind=/dev/b: bus left_hind already has a port"), "{twice}");
    for text in ["", "legs", "=/dev/a", "legs="] {
        assert!(text.parse::<PortOption>().is_err(), "{text}");
    }
}
