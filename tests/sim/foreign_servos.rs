//! This program's commands on simulated servos by others: those of the Python package feetech-cli.
//!
//! Left out, and said so, where `HIPPOCAMP_PYTHON` does not name a Python that has it.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use hippocamp::config::{self, write_unit};
use tempfile::TempDir;

use crate::python_clients::python;
use crate::rig::calibrated;

/// The package's simulated bus behind a pseudo-terminal.
struct Foreign {
    child: Child,
    said: BufReader<std::process::ChildStdout>,
    folder: TempDir,
}

impl Foreign {
    fn start(python: &Path, servos: usize) -> Foreign {
        let folder = tempfile::tempdir().unwrap();
        let mut child = Command::new(python)
            .args(["-B", "tests/python/feetech_cli_bus.py"])
            .arg(folder.path().join("port"))
            .arg(servos.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        said.read_line(&mut line).unwrap();
        assert_eq!(line, "ready\n");
        Foreign { child, said, folder }
    }

    fn port(&self) -> PathBuf {
        self.folder.path().join("port")
    }

    /// Ends it; returns the last goals of its servos.
    fn goals(mut self) -> Vec<i32> {
        drop(self.child.stdin.take());
        let mut said = String::new();
        self.said.read_to_string(&mut said).unwrap();
        self.child.wait().unwrap();
        said.split_whitespace().map(|goal| goal.parse().unwrap()).collect()
    }
}

/// Output of `hippocamp` with these arguments; it must succeed.
fn hippocamp(arguments: &[&str]) -> String {
    let Output { status, stdout, stderr } =
        Command::new(env!("CARGO_BIN_EXE_hippocamp")).args(arguments).output().unwrap();
    let said = String::from_utf8_lossy(&stdout).into_owned();
    assert!(status.success(), "{arguments:?}: {said}{}", String::from_utf8_lossy(&stderr));
    said
}

#[test]
fn scan_read_write_and_move_servos_of_feetech_cli() {
    let Some(python) = python() else { return };
    let foreign = Foreign::start(&python, 3);
    let port = foreign.port();
    let port = port.to_str().unwrap();
    let found = hippocamp(&["scan", port, "--protocol", "feetech", "--baud", "1000000", "--ids", "0-20"]);
    assert_eq!(found.matches("STS3215-12V").count(), 3, "{found}");

    let here = ["--protocol", "feetech", "--baud", "1000000"];
    let of = |words: &[&str]| hippocamp(&[&["servo"], words, &here].concat());
    let read = of(&["read", port, "2", "present_position"]);
    assert!(read.contains("(2048)"), "{read}");
    // A setting: it must be unlocked for that, and locked again.
    of(&["write", port, "2", "temperature_limit", "65", "--yes"]);
    assert!(of(&["read", port, "2", "temperature_limit"]).contains("65"));
    of(&["write", port, "2", "goal_position", "90", "--yes"]);
    let read = of(&["read", port, "2", "present_position"]);
    assert!(read.contains("(1024)"), "90 degrees: {read}");
    of(&["id", port, "3", "9", "--yes"]);
    assert!(of(&["read", port, "9", "present_position"]).contains("(2048)"));
    assert_eq!(foreign.goals(), [2048, 1024, 2048]);
}

#[test]
fn jog_turns_a_joint_of_a_robot_made_of_them() {
    let Some(python) = python() else { return };
    let foreign = Foreign::start(&python, 16);
    let robot_file = foreign.folder.path().join("horse.toml");
    let text = std::fs::read_to_string("config/horse.toml").unwrap();
    std::fs::write(&robot_file, text.replace("slow_rate_deg_s = 30 ", "slow_rate_deg_s = 90 ")).unwrap();
    let robot = config::load(&robot_file).unwrap().robot;
    let unit = calibrated(&robot, "horse.toml", Vec::new());
    write_unit(&foreign.folder.path().join("horse.unit.toml"), &unit).unwrap();

    let (index, hip) =
        robot.joints.iter().enumerate().find(|(_, joint)| joint.name == "left_hind.hip").unwrap();
    let middle_rad = f64::midpoint(hip.range_rad.0, hip.range_rad.1);
    let goal_rad = middle_rad + 0.2;
    let (file, port) = (robot_file.to_str().unwrap(), format!("main={}", foreign.port().display()));
    hippocamp(&["jog", file, "left_hind.hip", &goal_rad.to_degrees().to_string(), "--port", &port]);
    let goals = foreign.goals();
    let expected = hip.servo.unwrap().count_of(goal_rad);
    assert!((f64::from(goals[index]) - expected).abs() < 1.0, "{expected}: {goals:?}");
}
