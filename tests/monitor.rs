//! The monitor: its output, and that it writes nothing to a servo.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;

use std::fs::File;
use std::io::Read;
use std::process::{Command, Stdio};
use std::time::Duration;

use common::{ROBOTS, Spy, config_file, shipped};
use hippocamp::bus::{Ports, SimPorts};
use hippocamp::model::{Joint, Robot};
use hippocamp::monitor::{LastGoal, Monitor};
use hippocamp::simulation;
use hw_sim::FaultScript;
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

/// The servos of `robot` in the middle of their ranges, with `faults`.
fn ports(robot: &Robot, faults: &str) -> Spy<fn(&SimPorts)> {
    let pose: Vec<f64> = robot.joints.iter().map(Joint::middle_rad).collect();
    let faults = FaultScript::from_toml(faults).unwrap();
    Spy::new(simulation::world_from_pose(robot, &pose, 1, &faults).unwrap(), |_| {})
}

/// Polls ten times a second until `until_s`.
fn look_until<P: Ports>(monitor: &mut Monitor<'_, P>, until_s: f64) {
    loop {
        monitor.look();
        let now = monitor.ports_mut().now();
        if now.0 as f64 * 1e-9 >= until_s {
            return;
        }
        monitor.ports_mut().wait_until(now + Duration::from_millis(100));
    }
}

#[test]
fn the_monitor_sends_only_reads_and_shows_every_joint() {
    for name in ROBOTS {
        let robot = shipped(name);
        let mut monitor = Monitor::new(&robot, ports(&robot, ""));
        // Long enough for fast sync reads to be tried.
        look_until(&mut monitor, 7.0);
        for row in monitor.rows() {
            assert!(!row.is_lost && row.alarms.is_empty(), "{name}: {row:?}");
            assert_eq!(row.goal, LastGoal::Limp, "{name}: {}", row.joint.name);
            let error = row.state.position_rad - row.joint.middle_rad();
            assert!(error.abs() <= row.servo.count_rad(), "{name}: {} {error}", row.joint.name);
        }
        assert_eq!(monitor.rows().count(), robot.joints.len());
        // Instruction numbers of Dynamixel Protocol 2.0 and Feetech: Read, Sync Read, Fast Sync Read.
        let at = if name == "horse.toml" { 4 } else { 7 };
        let sent = &monitor.ports_mut().sent;
        assert!(sent.iter().all(|packet| [0x02, 0x82, 0x8A].contains(&packet[at])), "{name}");
    }
}

#[test]
fn a_lost_servo_is_shown_as_lost_and_comes_back_and_no_other_is() {
    for name in ROBOTS {
        let robot = shipped(name);
        let bus = &robot.buses[0].name;
        let silent = format!("[[fault]]\nkind = 'silent'\nat_s = 1\nfor_s = 2\nbus = '{bus}'\nid = 3\n");
        let mut monitor = Monitor::new(&robot, ports(&robot, &silent));
        let lost = |monitor: &Monitor<'_, _>| -> Vec<String> {
            monitor.rows().filter(|row| row.is_lost).map(|row| row.joint.name.clone()).collect()
        };
        look_until(&mut monitor, 0.9);
        assert!(lost(&monitor).is_empty(), "{name}");
        look_until(&mut monitor, 2.8);
        assert_eq!(lost(&monitor), ["left_hind.stifle"], "{name}");
        let age_s = monitor.rows().nth(2).unwrap().state.age_s;
        assert!((1.7..2.0).contains(&age_s), "{name}: {age_s}");
        look_until(&mut monitor, 3.2);
        assert!(lost(&monitor).is_empty(), "{name}");
    }
}

/// Feetech wiki, ft-scs: header, id, length, Write, address, data, checksum.
fn feetech_write(id: u8, address: u8, data: &[u8]) -> Vec<u8> {
    let length = u8::try_from(data.len() + 3).unwrap();
    let body: Vec<u8> = [&[id, length, 3, address][..], data].concat();
    let sum = body.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    [&[0xFF, 0xFF][..], &body, &[!sum]].concat()
}

#[test]
fn the_goal_that_a_servo_holds_is_shown_and_kept() {
    let robot = shipped("horse.toml");
    let mut ports = ports(&robot, "[[fault]]\nkind = 'hot'\nat_s = 1\nid = 2\ncelsius = 75\n");
    // Hip (2): goal 2100, 52 counts from where it stands; torque on.
    for packet in [feetech_write(2, 42, &2100_u16.to_le_bytes()), feetech_write(2, 40, &[1])] {
        ports.send(0, &packet).unwrap();
        // Until it has answered.
        let answered = ports.now() + Duration::from_millis(10);
        ports.wait_until(answered);
    }
    let mut monitor = Monitor::new(&robot, ports);
    look_until(&mut monitor, 0.9);
    let hip = monitor.rows().nth(1).unwrap();
    let goal_rad = hip.servo.angle_of(2100.0);
    assert_eq!(hip.goal, LastGoal::Angle(goal_rad));
    let off_deg = (hip.state.position_rad - goal_rad).to_degrees();
    assert!(off_deg.abs() < 2.0, "it went there: {off_deg}");
    assert!(monitor.rows().enumerate().all(|(at, row)| at == 1 || row.goal == LastGoal::Limp));
    // Status bit 2 is heat; the unload mask of a servo out of the box takes its torque off then.
    look_until(&mut monitor, 2.0);
    assert_eq!(monitor.rows().nth(1).unwrap().alarms, "overheating");
}

fn hippocamp(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
    command.arg("monitor").arg(config_file("horse.toml")).args(arguments);
    command
}

#[test]
fn json_has_one_line_per_time() {
    let output =
        hippocamp(&["--virtual", "--no-physics", "--json", "--for", "2", "--every", "0.5"]).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 5, "{text}");
    let last = lines.last().unwrap();
    assert!(last["time_s"].as_f64().unwrap() >= 2.0);
    let hip = &last["joints"][1];
    assert_eq!((hip["name"].as_str(), hip["id"].as_u64()), (Some("left_hind.hip"), Some(2)));
    assert_eq!((hip["is_lost"].as_bool(), hip["has_torque"].as_bool()), (Some(false), Some(false)));
    assert!((hip["voltage_v"].as_f64().unwrap() - 12.0).abs() < 0.2);
    assert!((-103.0..=-67.0).contains(&hip["position_deg"].as_f64().unwrap()));
}

#[test]
fn the_table_is_redrawn_in_place() {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let ours = openpt(flags).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let program = ioctl_tiocgptpeer(&ours, flags).unwrap();
    tcsetwinsize(&program, Winsize { ws_row: 12, ws_col: 60, ws_xpixel: 0, ws_ypixel: 0 }).unwrap();
    let mut command = hippocamp(&["--virtual", "--for", "2"]);
    let mut child = command.stdout(program).stderr(Stdio::null()).spawn().unwrap();
    drop(command);
    // A terminal without a program reads as an error on Linux; what came before stays.
    let mut shown = Vec::new();
    let _ = File::from(ours).read_to_end(&mut shown);
    assert!(child.wait().unwrap().success());
    let mut screen = vt100::Parser::new(12, 60, 100);
    screen.process(&shown);
    let rows: Vec<String> = screen.screen().rows(0, 60).collect();
    assert!(rows[0].starts_with("horse on simulated buses, virtual clock, 2."), "{rows:?}");
    assert!(rows[2].starts_with("left_hind.pelvis") && rows[2].contains("limp"), "{rows:?}");
    assert!(rows[10].starts_with("... 8 more: make the window taller"), "{rows:?}");
    screen.screen_mut().set_scrollback(100);
    assert_eq!(screen.screen().scrollback(), 0, "nothing has scrolled away");
}

#[test]
fn an_invalid_time_is_bad_input() {
    for arguments in [["--for", "0"], ["--every", "-1"], ["--for", "nan"]] {
        let output = hippocamp(&arguments).arg("--virtual").output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(arguments[0]), "{said}");
    }
}
