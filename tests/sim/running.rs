//! A running `hippocamp sim`.

use std::io::{BufRead, BufReader, Lines, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};

use tempfile::TempDir;

/// A running `hippocamp sim`, ended when dropped.
pub(crate) struct Sim {
    child: Child,
    input: Option<ChildStdin>,
    said: Lines<BufReader<ChildStdout>>,
    folder: TempDir,
}

impl Sim {
    /// Starts it on a robot of `config/` whose joints turn freely, and waits until its buses are there.
    pub(crate) fn start(robot: &str, arguments: &[&str]) -> Sim {
        let folder = tempfile::tempdir().unwrap();
        let mut child = command(robot, arguments)
            .arg("--no-physics")
            .arg("--link")
            .arg(folder.path().join("ports"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut sim = Sim { input: child.stdin.take(), child, said, folder };
        while !sim.said().starts_with("Type help") {}
        sim
    }

    /// Where the bus of this name is.
    pub(crate) fn port(&self, bus: &str) -> PathBuf {
        self.folder.path().join("ports").join(bus)
    }

    /// Its next line.
    pub(crate) fn said(&mut self) -> String {
        self.said.next().expect("it has not ended").unwrap()
    }

    /// Types a line; returns the answer, one line.
    pub(crate) fn asked(&mut self, line: &str) -> String {
        writeln!(self.input.as_ref().unwrap(), "{line}").unwrap();
        self.said()
    }

    /// Ends its standard input.
    pub(crate) fn close_input(&mut self) {
        self.input = None;
    }

    /// Sends it a signal, and waits for its end.
    pub(crate) fn end_by(&mut self, signal: &str) -> ExitStatus {
        let process = self.child.id().to_string();
        assert!(Command::new("kill").args([&format!("-{signal}"), &process]).status().unwrap().success());
        self.child.wait().unwrap()
    }
}

impl Drop for Sim {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// `hippocamp sim` on a robot of `config/`.
pub(crate) fn command(robot: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
    command.arg("sim").arg(format!("config/{robot}")).args(arguments);
    command
}
