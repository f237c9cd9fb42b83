//! Typed commands, its end, and that the servos obey.

use std::path::Path;

use hippocamp::bus::serial::Device;
use hippocamp::bus::{Ports, SerialPorts};
use hippocamp::config;
use hippocamp::model::Robot;
use hippocamp::units::Time;

use crate::running::{Sim, command};

/// The robot most of these are about.
fn robot() -> Robot {
    config::load(Path::new("config/horse.toml")).unwrap().robot
}

/// Its only bus, open.
fn opened(sim: &Sim) -> SerialPorts {
    let robot = robot();
    SerialPorts::open(&[Device::of(&robot.buses[0], sim.port(&robot.buses[0].name))]).unwrap()
}

/// The reply of `count` bytes to a request.
fn exchange(ports: &mut SerialPorts, request: &[u8], count: usize) -> Vec<u8> {
    ports.send(0, request).unwrap();
    let mut answer = vec![0; count];
    let mut got = 0;
    while got < count {
        ports.wait_for_input(Time(u64::MAX));
        got += ports.receive(0, &mut answer[got..]).unwrap();
    }
    answer
}

/// A Feetech packet (Feetech wiki, protocol ft-scs).
fn packet(id: u8, fifth: u8, parameters: &[u8]) -> Vec<u8> {
    let mut packet = vec![0xFF, 0xFF, id, u8::try_from(parameters.len()).unwrap() + 2, fifth];
    packet.extend(parameters);
    let sum = packet[2..].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    packet.push(!sum);
    packet
}

#[test]
fn servos_outlive_standard_input_and_a_signal_removes_the_links() {
    let mut sim = Sim::start("horse.toml", &[]);
    let port = sim.port("main");
    assert!(port.read_link().unwrap().starts_with("/dev/pts"));
    sim.close_input();
    assert_eq!(exchange(&mut opened(&sim), &packet(1, 1, &[]), 6), packet(1, 0, &[]));

    let folder = port.parent().unwrap().to_owned();
    let second = command("horse.toml", &["--link", folder.to_str().unwrap()]).output().unwrap();
    assert_eq!(second.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&second.stderr).contains("in use by another hippocamp sim"));
    assert!(port.exists(), "the first one's links stay");

    assert!(sim.end_by("TERM").success());
    assert!(!folder.exists());
}

#[test]
fn joints_are_turned_by_hand_and_servos_pulled_out() {
    let mut sim = Sim::start("horse.toml", &[]);
    assert_eq!(sim.asked("turn left_hind.hip -80"), "left_hind.hip: at -80.0 degrees, limp, id 2 on main");
    let mut ports = opened(&sim);
    let robot = robot();
    let hip = robot.joints.iter().find(|joint| joint.name == "left_hind.hip").unwrap();
    let read = |ports: &mut SerialPorts| {
        let answer = exchange(ports, &packet(2, 2, &[56, 2]), 8);
        f64::from(u16::from_le_bytes([answer[5], answer[6]]))
    };
    let expected = hip.servo.unwrap().count_of(-80_f64.to_radians());
    assert!((read(&mut ports) - expected).abs() <= 1.0);

    // With torque it holds against a hand.
    let goal = read(&mut ports);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 4095")]
    let [low, high] = (goal as u16).to_le_bytes();
    exchange(&mut ports, &packet(2, 3, &[42, low, high]), 6);
    exchange(&mut ports, &packet(2, 3, &[40, 1]), 6);
    let said = sim.asked("turn main:2 -40");
    assert!(said.starts_with("left_hind.hip: at -8") && said.contains("holds with torque"), "{said}");

    assert_eq!(sim.asked("unplug left_hind.hip"), "left_hind.hip: unplugged");
    ports.send(0, &packet(2, 1, &[])).unwrap();
    // The others are present: the answer of servo 1 comes first.
    assert_eq!(exchange(&mut ports, &packet(1, 1, &[]), 6), packet(1, 0, &[]));
    assert_eq!(sim.asked("plug left_hind.hip"), "left_hind.hip: plugged in");
    assert_eq!(exchange(&mut ports, &packet(2, 2, &[40, 1]), 7)[5], 0, "it comes back limp");
}

#[test]
fn unknown_console_commands_are_reported_and_change_nothing() {
    let mut sim = Sim::start("horse.toml", &[]);
    let nearest = sim.asked("unplug left_hind.hips");
    assert!(nearest.ends_with("did you mean left_hind.hip?"), "{nearest}");
    assert!(sim.asked("turn left_hind.hip up").contains("expected an angle in degrees"));
    assert!(sim.asked("turn left_hind.hip nan").contains("expected an angle in degrees"));
    assert!(sim.asked("plugin left_hind.hip").contains("expected one of these"));
    while !sim.said().starts_with("SERVO is") {}
    assert_eq!(exchange(&mut opened(&sim), &packet(2, 1, &[]), 6), packet(2, 0, &[]));
    // A foreign file in the place of a link is not changed.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("main"), "mine").unwrap();
    let output = command("horse.toml", &["--link", folder.path().to_str().unwrap()]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(folder.path().join("main")).unwrap(), "mine");
    for wrong in [&["--reversed", "left_hind.hips"][..], &["--faults", "config/horse.toml"]] {
        let output = command("horse.toml", wrong).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
    }
}

#[test]
fn a_box_of_new_servos_is_empty_until_they_are_plugged_in_and_all_have_id_1() {
    let mut sim = Sim::start("horse.toml", &["--factory-new", "--reversed", "left_hind.hip"]);
    let mut ports = opened(&sim);
    assert!(sim.asked("list").ends_with("unplugged, id 1 on main"));
    (1..robot().joints.len()).for_each(|_| assert!(sim.said().ends_with("unplugged, id 1 on main")));
    sim.asked("plug left_hind.hip");
    assert_eq!(exchange(&mut ports, &packet(1, 1, &[]), 6), packet(1, 0, &[]));
    let read = |ports: &mut SerialPorts| {
        let answer = exchange(ports, &packet(1, 2, &[56, 2]), 8);
        i32::from(u16::from_le_bytes([answer[5], answer[6]]))
    };
    // 10 degrees are 114 counts; the other way round than the robot file says.
    let robot = robot();
    let hip = robot.joints.iter().find(|joint| joint.name == "left_hind.hip").unwrap();
    let as_filed = if hip.servo.unwrap().reversed { -114 } else { 114 };
    sim.asked("turn left_hind.hip -80");
    let before = read(&mut ports);
    sim.asked("turn left_hind.hip -70");
    let turned = (read(&mut ports) - before + 2048).rem_euclid(4096) - 2048;
    assert!((turned + as_filed).abs() <= 1, "{turned}");

    assert!(sim.end_by("INT").success());
}
