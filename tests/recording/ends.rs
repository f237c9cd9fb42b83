//! However a run ends, its recording is complete, or readable up to its end.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use hippocamp::bus::{PortError, Ports, SimPorts};
use hippocamp::motion::Order;
use hippocamp::recording::{Ending, Recording};
use hippocamp::replay::replay;
use hippocamp::run::run_observed;
use hippocamp::signals::Status;
use hippocamp::simulation;
use hippocamp::telemetry::Outcome;
use hippocamp::units::Time;

use crate::common::{Memory, ROBOT_FILE, horse, plan, recorder};

/// Starts a run without end and returns once 15 s of it are over.
fn running(name: &str) -> (Child, PathBuf) {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    for old in [file.clone(), file.with_extension("mcap.part")] {
        let _ = std::fs::remove_file(old);
    }
    let mut child = Command::new(env!("CARGO_BIN_EXE_hippocamp"))
        .args(["run", ROBOT_FILE, "--virtual", "--for", "1e9", "--record"])
        .arg(&file)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let status = BufReader::new(child.stderr.as_mut().unwrap());
    assert!(status.lines().any(|line| line.unwrap().trim_start().starts_with("15.0 s")));
    (child, file)
}

#[test]
fn the_recording_of_a_killed_run_lacks_only_the_last_seconds() {
    let (mut child, file) = running("killed.mcap");
    child.kill().unwrap();
    child.wait().unwrap();
    // The data are in FILE.part, and `replay FILE` says so.
    let part = file.with_extension("mcap.part");
    let asked_for =
        |file: &Path| Command::new(env!("CARGO_BIN_EXE_hippocamp")).arg("replay").arg(file).output().unwrap();
    let refused = asked_for(&file);
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(said.contains(&format!("hippocamp replay {}", part.display())), "{said}");
    let said = String::from_utf8(asked_for(&part).stdout).unwrap();
    assert!(said.contains("CUT SHORT") && said.contains("all goals the same"), "{said}");

    let recording = Recording::read(&part).unwrap();
    assert!(matches!(recording.ending, Ending::CutShort { .. }));
    // Of 15 s, 2 may have waited for the thread, and 1 for its chunk to end.
    assert!(recording.samples.len() >= 1200, "{}", recording.samples.len());
    assert!(replay(&recording).unwrap().agrees());
}

#[test]
fn the_recording_of_a_run_ended_by_a_signal_is_complete() {
    let (mut child, file) = running("terminated.mcap");
    // Nothing reads the pipe any more: a full pipe must not delay the run.
    drop(child.stderr.take());
    assert!(Command::new("kill").arg(child.id().to_string()).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let recording = Recording::read(&file).unwrap();
    let Ending::Outcome(outcome) = &recording.ending else { panic!("{:?}", recording.ending) };
    assert_eq!(outcome["reason"], "stopped by the operator");
    assert_eq!(outcome["cycles"], recording.samples.len().to_string());
    assert!(replay(&recording).unwrap().agrees());
}

/// Ports whose wait panics once, at this time.
struct Panicking(SimPorts, Option<Time>);

impl Ports for Panicking {
    fn now(&mut self) -> Time {
        self.0.now()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.0.discard_input(bus)
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.0.send(bus, bytes)
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.0.receive(bus, into)
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        self.0.receive_imu(into)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.0.wait_for_input(deadline);
    }

    fn wait_until(&mut self, deadline: Time) {
        if self.1.is_some_and(|time| deadline >= time) {
            self.1 = None;
            panic!("a panic this test wants");
        }
        self.0.wait_until(deadline);
    }
}

#[test]
fn the_recording_is_complete_after_a_panic_of_the_loop() {
    let robot = horse();
    let world = simulation::world(&robot, 7, &hw_sim::FaultScript::default()).unwrap();
    let ports = Panicking(SimPorts::on_virtual_clock(world), Some(Time(6_000_000_000)));
    let memory = Memory::default();
    let mut recorder = recorder(&robot, memory.clone(), true);
    let report =
        run_observed(&robot, &plan(&robot), ports, &mut [&mut recorder], |_: &Status| Order::Go).unwrap();
    assert_eq!(report.outcome, Outcome::Failed);
    let recording = Recording::parse(&memory.0.lock().unwrap(), "test").unwrap();
    let Ending::Outcome(outcome) = &recording.ending else { panic!("{:?}", recording.ending) };
    assert_eq!(outcome["outcome"], "failed");
    assert_eq!(recording.samples.len() as u64, report.cycles);
}
