//! Every way out of a run on serial lines: the real program, killed, stopped, or left without its port, and
//! what its servos do then. In real time, over pseudo-terminals.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use hippocamp::config::{self, Unit, UnitBus, UnitJoint, write_unit};
use hippocamp::model::Robot;
use hippocamp::platform::{monotonic, sleep_until};
use hippocamp::simulation;
use hw_sim::FaultScript;
use hw_sim::pty::PtyServer;
use tempfile::TempDir;
use toml::value::Date;

/// Nothing here should take longer, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A robot behind pseudo-terminals, with a calibrated unit file that says so.
struct Rig {
    robot: Robot,
    robot_file: PathBuf,
    unit_file: PathBuf,
    server: Option<PtyServer>,
    _folder: TempDir,
}

fn rig(file: &str) -> Rig {
    rig_with(file, "")
}

fn rig_with(file: &str, faults: &str) -> Rig {
    let folder = tempfile::tempdir().unwrap();
    let robot_file = folder.path().join(file);
    // A robot that rises quickly, and whose adapter is a terminal.
    let text = fs::read_to_string(Path::new("config").join(file)).unwrap();
    fs::write(&robot_file, text.replace("slow_rate_deg_s = 30 ", "slow_rate_deg_s = 90 ")).unwrap();
    let robot = config::load(&robot_file).unwrap().robot;
    let mut without_adapters = robot.clone();
    for bus in &mut without_adapters.buses {
        bus.adapter_latency_us = 0;
    }
    let world = simulation::world(&without_adapters, 1, &FaultScript::from_toml(faults).unwrap()).unwrap();
    let server = PtyServer::start(world, folder.path()).unwrap();
    let mut unit = Unit {
        robot_file: file.to_owned(),
        buses: robot
            .buses
            .iter()
            .zip(server.paths())
            .map(|(bus, path)| UnitBus { name: bus.name.clone(), device: path.display().to_string() })
            .collect(),
        joints: robot
            .joints
            .iter()
            .map(|joint| UnitJoint {
                name: joint.name.clone(),
                zero_count: joint.servo.unwrap().zero_count,
                direction_checked: true,
                firmware: None,
            })
            .collect(),
        ..Unit::default()
    };
    unit.seal(&robot, Date { year: 2026, month: 11, day: 22 });
    let unit_file = folder.path().join("built.unit.toml");
    write_unit(&unit_file, &unit).unwrap();
    Rig { robot, robot_file, unit_file, server: Some(server), _folder: folder }
}

impl Rig {
    fn start(&self) -> Child {
        Command::new(env!("CARGO_BIN_EXE_hippocamp"))
            .arg("run")
            .arg(&self.robot_file)
            .arg("--unit")
            .arg(&self.unit_file)
            .args(["--for", "60"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    }

    /// How many servos truly have torque.
    fn with_torque(&self) -> usize {
        let Some(server) = &self.server else { return 0 };
        let servos = self.robot.joints.iter().filter_map(|joint| joint.servo);
        server.with_world(|world| {
            servos
                .filter(|servo| world.shaft(servo.bus, servo.id.0).is_some_and(|shaft| shaft.torque_on))
                .count()
        })
    }

    /// Waits until all servos have torque, or none.
    fn wait_for_torque(&self, on: bool) -> Duration {
        let start = monotonic();
        let wanted = if on { self.robot.joints.len() } else { 0 };
        while self.with_torque() != wanted {
            assert!(monotonic() - start < PATIENCE, "{} servos have torque", self.with_torque());
            sleep_until(monotonic() + Duration::from_millis(1));
        }
        monotonic() - start
    }
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

#[test]
fn a_killed_controller_leaves_no_torque() {
    for file in ["horse.toml", "horse-dynamixel.toml"] {
        let rig = rig(file);
        let mut child = rig.start();
        rig.wait_for_torque(true);
        signal(&child, "KILL");
        let took = rig.wait_for_torque(false);
        assert!(!child.wait().unwrap().success());
        println!("{file}: torque off {took:.1?} after SIGKILL");
    }
}

#[test]
fn a_controller_that_is_told_to_stop_ends_limp_by_itself() {
    for name in ["TERM", "INT", "HUP"] {
        let rig = rig("horse.toml");
        let mut child = rig.start();
        rig.wait_for_torque(true);
        signal(&child, name);
        let code = child.wait().unwrap().code();
        assert_eq!((code, rig.with_torque()), (Some(0), 0), "SIG{name}");
    }
}

#[test]
fn a_controller_without_its_port_ends_by_itself() {
    let mut rig = rig("horse.toml");
    let mut child = rig.start();
    rig.wait_for_torque(true);
    rig.server = None;
    assert_eq!(child.wait().unwrap().code(), Some(3), "stopped by safety");
}

#[test]
fn servos_that_could_not_hear_the_end_are_let_go_when_their_adapter_is_back() {
    // Away long enough for the controller to give up.
    let rig = rig_with("horse.toml", "[[fault]]\nkind = 'unplugged'\nat_s = 6.0\nfor_s = 12.0");
    let mut child = rig.start();
    rig.wait_for_torque(true);
    assert_eq!(child.wait().unwrap().code(), Some(3), "stopped by safety");
    assert_eq!(rig.with_torque(), rig.robot.joints.len(), "nobody can reach them");
    rig.wait_for_torque(false);
}

#[test]
fn without_a_calibration_nothing_is_opened_and_nothing_moves() {
    let rig = rig("horse.toml");
    let text = fs::read_to_string(&rig.unit_file).unwrap();
    fs::write(&rig.unit_file, text.replacen("direction_checked = true", "direction_checked = false", 1))
        .unwrap();
    assert_eq!(rig.start().wait().unwrap().code(), Some(2));
    assert_eq!(rig.with_torque(), 0);
}
