//! A short run of the horse on simulated buses and a virtual clock, recorded.

use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};

use hippocamp::bus::SimPorts;
use hippocamp::config;
use hippocamp::ik::Method;
use hippocamp::kinds::horse::HorseCapability;
use hippocamp::model::Robot;
use hippocamp::motion::{Command, Order};
use hippocamp::plan::RunPlan;
use hippocamp::recording::{Recorder, RunHeader};
use hippocamp::run::run_observed;
use hippocamp::signals::Status;
use hippocamp::simulation;
use hippocamp::telemetry::Report;

pub(crate) const ROBOT_FILE: &str = "config/horse.toml";

/// The horse, its joints turning freely.
pub(crate) fn horse() -> Robot {
    horse_in_physics().without_body()
}

pub(crate) fn horse_in_physics() -> Robot {
    config::load(Path::new(ROBOT_FILE)).unwrap().robot
}

/// A trot at half the speed it can go.
pub(crate) fn plan(robot: &Robot) -> RunPlan {
    let motion = robot.motion.horse().unwrap().clone();
    let plan = HorseCapability::of(robot, &motion).unwrap().plan(&motion, Command::default());
    let trot = plan.gait_choice("trot").unwrap();
    let horse = plan.at_share(trot, 0.5);
    RunPlan { motion: horse.into(), method: Method::CcdThenFinish, move_for_s: 2.0, driver: None }
}

pub(crate) fn recorder(robot: &Robot, sink: impl Write + Send + 'static, waits: bool) -> Recorder {
    let header = RunHeader::new(robot, &plan(robot), ROBOT_FILE, 0);
    let text = std::fs::read_to_string(ROBOT_FILE).unwrap();
    Recorder::start(robot, header, text, "test.mcap".to_owned(), sink, waits).unwrap()
}

/// Runs and records into `sink`, with `faults` (TOML) on the buses.
pub(crate) fn run(faults: &str, sink: impl Write + Send + 'static) -> Report {
    run_robot(&horse(), faults, sink)
}

fn run_robot(robot: &Robot, faults: &str, sink: impl Write + Send + 'static) -> Report {
    let faults = hw_sim::FaultScript::from_toml(faults).unwrap();
    let ports = SimPorts::on_virtual_clock(simulation::world(robot, 7, &faults).unwrap());
    let mut recorder = recorder(robot, sink, true);
    run_observed(robot, &plan(robot), ports, &mut [&mut recorder], |_: &Status| Order::Go).unwrap()
}

/// A run that nothing disturbs, into memory, made once.
pub(crate) fn record() -> &'static (Report, Vec<u8>) {
    static RECORDED: OnceLock<(Report, Vec<u8>)> = OnceLock::new();
    RECORDED.get_or_init(|| record_with(""))
}

/// A run of its own, with `faults` (TOML) on the buses, into memory.
pub(crate) fn record_with(faults: &str) -> (Report, Vec<u8>) {
    record_robot(&horse(), faults)
}

/// The horse on the ground under random pushes, into memory, made once.
pub(crate) fn record_in_physics() -> &'static (Report, Vec<u8>) {
    static RECORDED: OnceLock<(Report, Vec<u8>)> = OnceLock::new();
    RECORDED.get_or_init(record_in_physics_anew)
}

/// The same run once more.
pub(crate) fn record_in_physics_anew() -> (Report, Vec<u8>) {
    let pushes = "[[fault]]\nkind = \"push\"\nat_s = 7\nevery_s = 0.5\nimpulse_n_s = 0.1\n";
    record_robot(&horse_in_physics(), pushes)
}

fn record_robot(robot: &Robot, faults: &str) -> (Report, Vec<u8>) {
    let memory = Memory::default();
    let report = run_robot(robot, faults, memory.clone());
    let bytes = memory.0.lock().unwrap().clone();
    (report, bytes)
}

/// A sink whose content can be read.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memory(pub(crate) Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
