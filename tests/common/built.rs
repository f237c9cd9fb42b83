//! A built robot: simulated servos behind pseudo-terminals, a calibrated unit file with their devices, and the real
//! program to drive it.

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use hippocamp::config::{self, Unit, UnitBus, UnitJoint, write_unit};
use hippocamp::model::Robot;
use hippocamp::platform::{monotonic, request_real_time, sleep_until};
use hippocamp::simulation;
use hw_sim::pty::PtyServer;
use hw_sim::{FaultScript, World};
use tempfile::TempDir;
use toml::value::Date;

use super::config_file;

/// Seed for the start angles of the limp joints.
pub(crate) const SEED: u64 = 1;

/// Longest time for anything, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) struct Built {
    pub(crate) robot: Robot,
    pub(crate) robot_file: PathBuf,
    pub(crate) unit_file: PathBuf,
    /// `None` once its ports are gone for good.
    pub(crate) server: Option<PtyServer>,
    /// Folder for the files that the program writes.
    pub(crate) folder: TempDir,
}

impl Built {
    /// The shipped robot `file`, made to rise quickly. Its servos keep the requests they hear, and are as punctual
    /// as the system allows: servos on a real line do not wait for a processor.
    pub(crate) fn new(file: &str) -> Built {
        let served = |robot: &Robot| {
            let mut world = world(robot);
            world.keep_requests();
            world
        };
        Built::served(file, served, || drop(request_real_time(None)))
    }

    /// The same with its servos in a world that the caller makes, served by a thread that calls `prepare` first.
    pub(crate) fn served(
        file: &str,
        servos: impl FnOnce(&Robot) -> World,
        prepare: impl FnOnce() + Send + 'static,
    ) -> Built {
        let folder = tempfile::tempdir().unwrap();
        let robot_file = folder.path().join(file);
        let text = fs::read_to_string(config_file(file)).unwrap();
        fs::write(&robot_file, text.replace("slow_rate_deg_s = 30 ", "slow_rate_deg_s = 90 ")).unwrap();
        let robot = config::load(&robot_file).unwrap().robot;
        let server = PtyServer::start_prepared(servos(&robot), folder.path(), prepare).unwrap();
        let unit_file = folder.path().join("built.unit.toml");
        write_unit(&unit_file, &unit(file, &robot, &server)).unwrap();
        Built { robot, robot_file, unit_file, server: Some(server), folder }
    }

    /// `hippocamp run` on this robot, without input; its output goes to a file unless the caller changes that.
    pub(crate) fn run(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
        command.arg("run").arg(&self.robot_file).arg("--unit").arg(&self.unit_file);
        let said = File::create(self.said()).unwrap();
        command.stdin(Stdio::null()).stdout(said.try_clone().unwrap()).stderr(said);
        command
    }

    /// The output file of the last run begun by [`Built::run`].
    fn said(&self) -> PathBuf {
        self.folder.path().join("said.txt")
    }

    /// Period of the loop.
    pub(crate) fn period(&self) -> Duration {
        Duration::from_secs_f64(self.robot.period_s())
    }

    /// Calls `look` with the servos' world.
    ///
    /// # Panics
    /// If the servos are gone.
    pub(crate) fn with_world<R>(&self, look: impl FnOnce(&mut World) -> R) -> R {
        self.server.as_ref().unwrap().with_world(look)
    }

    /// Waits until `is_so`.
    ///
    /// # Panics
    /// If that takes too long even for a busy machine.
    pub(crate) fn wait_for(&self, what: &str, mut is_so: impl FnMut() -> bool) {
        let start = monotonic();
        while !is_so() {
            assert!(
                monotonic() - start < PATIENCE,
                "no {what}; {} servos have torque; said: {}",
                self.with_torque(),
                fs::read_to_string(self.said()).unwrap_or_default()
            );
            sleep_until(monotonic() + Duration::from_millis(1));
        }
    }

    /// Number of servos that truly have torque.
    pub(crate) fn with_torque(&self) -> usize {
        let servos = self.robot.joints.iter().filter_map(|joint| joint.servo);
        let has_torque = |world: &World, bus, id| world.shaft(bus, id).is_some_and(|shaft| shaft.torque_on);
        self.with_world(|world| servos.filter(|servo| has_torque(world, servo.bus, servo.id.0)).count())
    }
}

/// The servos of `robot`. The adapter's latency is 0: a terminal, or nothing, takes its place.
pub(crate) fn world(robot: &Robot) -> World {
    let mut without_adapters = Robot { physics: None, ..robot.clone() };
    for bus in &mut without_adapters.buses {
        bus.adapter_latency_us = 0;
    }
    simulation::world(&without_adapters, SEED, &FaultScript::default()).unwrap()
}

/// The unit file of `robot`, with its buses served by `server`.
fn unit(file: &str, robot: &Robot, server: &PtyServer) -> Unit {
    let bus = |(name, path): (&String, &PathBuf)| UnitBus {
        name: name.clone(),
        device: path.display().to_string(),
    };
    let names = robot.buses.iter().map(|bus| &bus.name);
    let mut unit = Unit {
        robot_file: file.to_owned(),
        buses: names.zip(server.paths()).map(bus).collect(),
        joints: robot
            .joints
            .iter()
            .map(|joint| UnitJoint {
                name: joint.name.clone(),
                zero_count: joint.servo.unwrap().zero_count,
                reversed: None,
                direction_checked: true,
                firmware: None,
            })
            .collect(),
        ..Unit::default()
    };
    unit.seal(robot, Date { year: 2026, month: 11, day: 22 });
    unit
}
