//! A robot behind pseudo-terminals, and the real program on it, in real time.
#![allow(dead_code, reason = "each test binary uses a part of it")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use hippocamp::config::{self, Unit, UnitBus, UnitImu, UnitJoint, write_unit};
use hippocamp::model::{Joint, Robot};
use hippocamp::platform::{monotonic, request_real_time, sleep_until};
use hippocamp::simulation;
use hw_sim::FaultScript;
use hw_sim::pty::PtyServer;
use tempfile::TempDir;
use toml::value::Date;

/// Nothing here takes longer, even on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// A robot behind pseudo-terminals, with a calibrated unit file that says so.
pub(crate) struct Rig {
    pub(crate) robot: Robot,
    pub(crate) robot_file: PathBuf,
    pub(crate) unit_file: PathBuf,
    pub(crate) server: Option<PtyServer>,
    pub(crate) folder: TempDir,
}

impl Rig {
    /// The robot of `file`, which rises quickly, its servos as the file has them, with these `faults`.
    pub(crate) fn new(file: &str, faults: &str) -> Rig {
        Rig::edited(file, faults, |text| text)
    }

    /// The same with an edited file.
    pub(crate) fn edited(file: &str, faults: &str, edit: impl Fn(String) -> String) -> Rig {
        let folder = tempfile::tempdir().unwrap();
        let robot_file = folder.path().join(file);
        let text = fs::read_to_string(Path::new("config").join(file)).unwrap();
        fs::write(&robot_file, edit(text.replace("slow_rate_deg_s = 30 ", "slow_rate_deg_s = 90 "))).unwrap();
        let robot = config::load(&robot_file).unwrap().robot;
        let mut without_adapters = Robot { physics: None, ..robot.clone() };
        for bus in &mut without_adapters.buses {
            // The terminal takes the adapter's place.
            bus.adapter_latency_us = 0;
        }
        let faults = FaultScript::from_toml(faults).unwrap();
        let world = simulation::world(&without_adapters, 1, &faults).unwrap();
        // Servos of a real line do not wait for a processor.
        let prepare = || drop(request_real_time(None));
        let server = PtyServer::start_prepared(world, folder.path(), prepare).unwrap();
        let buses = robot.buses.iter().zip(server.paths());
        let buses = buses
            .map(|(bus, path)| UnitBus { name: bus.name.clone(), device: path.display().to_string() })
            .collect();
        let imu_of = |path: &Path| UnitImu {
            device: path.display().to_string(),
            baud: None,
            rpy_deg: None,
            rates_reversed: None,
        };
        let unit = Unit { imu: server.imu_path().map(imu_of), ..calibrated(&robot, file, buses) };
        let unit_file = folder.path().join("built.unit.toml");
        write_unit(&unit_file, &unit).unwrap();
        Rig { robot, robot_file, unit_file, server: Some(server), folder }
    }

    /// `hippocamp COMMAND ROBOT --unit UNIT`, with these more arguments.
    pub(crate) fn start(&self, command: &str, arguments: &[&str]) -> Child {
        self.command(command, arguments).spawn().unwrap()
    }

    /// The same, not started yet.
    pub(crate) fn command(&self, name: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
        command.arg(name).arg(&self.robot_file).args(arguments).arg("--unit").arg(&self.unit_file);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// How many servos truly have torque.
    pub(crate) fn with_torque(&self) -> usize {
        let Some(server) = &self.server else { return 0 };
        let servos = self.robot.joints.iter().filter_map(|joint| joint.servo);
        server.with_world(|world| {
            servos
                .filter(|servo| world.shaft(servo.bus, servo.id.0).is_some_and(|shaft| shaft.torque_on))
                .count()
        })
    }

    /// Waits until all servos have torque, or none, and says how long it took.
    pub(crate) fn wait_for_torque(&self, on: bool) -> Duration {
        let start = monotonic();
        let wanted = if on { self.robot.joints.len() } else { 0 };
        while self.with_torque() != wanted {
            assert!(monotonic() - start < PATIENCE, "{} servos have torque", self.with_torque());
            sleep_until(monotonic() + Duration::from_millis(1));
        }
        monotonic() - start
    }
}

/// A unit file of the robot of this file, assembled as the file says.
pub(crate) fn calibrated(robot: &Robot, file: &str, buses: Vec<UnitBus>) -> Unit {
    let joint = |joint: &Joint| UnitJoint {
        name: joint.name.clone(),
        zero_count: joint.servo.unwrap().zero_count,
        reversed: None,
        direction_checked: true,
        firmware: None,
    };
    let joints = robot.joints.iter().map(joint).collect();
    let mut unit = Unit { robot_file: file.to_owned(), buses, joints, ..Unit::default() };
    unit.seal(robot, Date { year: 2026, month: 11, day: 22 });
    unit
}

/// Sends a signal to a process.
pub(crate) fn signal(process: u32, name: &str) {
    let status = Command::new("kill").args([&format!("-{name}"), &process.to_string()]).status().unwrap();
    assert!(status.success());
}

/// Processes that live and whose command line has `words` in it, other than this one: those that are dead and not yet
/// waited for have none.
pub(crate) fn processes_with(words: &Path) -> Vec<u32> {
    let words = words.as_os_str().as_encoded_bytes();
    let has_words = |process: &u32| {
        let line = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
        line.windows(words.len()).any(|part| part == words)
    };
    let all = fs::read_dir("/proc").unwrap().flatten();
    all.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).filter(has_words).collect()
}
