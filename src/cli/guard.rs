//! The guard: a process that outlives the controller and takes the torque off if it dies without its safe stop.
//!
//! Feetech servos hold their last goal for ever, so a controller that is killed would leave the robot standing
//! under torque. The controller starts the guard before any torque is on and holds one end of a pipe to it. The
//! word at a safe end is [`SAFE`]; a pipe that closes without it means that the controller is gone, and its
//! ports, which nobody else could use till then, are free.
#![allow(clippy::print_stdout, reason = "a word to the controller")]

use std::ffi::OsString;
use std::io::{BufRead, BufReader, IsTerminal, Read, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::BadInput;
use super::ports::{PortOption, devices};
use crate::bus::Buses;
use crate::bus::serial::{Device, SerialPorts};
use crate::config;
use crate::model::Robot;
use crate::platform::{monotonic, sleep_until};

/// What the controller says at a safe end.
const SAFE: &[u8] = b"safe\n";
/// What the guard says when it is ready.
const READY: &str = "ready";
/// How long after one another the guard tries a bus it could not reach, when it says so, and when it gives up.
const PAUSE: Duration = Duration::from_millis(10);
const WORD_AFTER: Duration = Duration::from_millis(500);
const PATIENCE: Duration = Duration::from_secs(60);

/// The controller's hold on its guard.
#[derive(Debug)]
pub(super) struct Guard {
    child: Child,
    pipe: Option<ChildStdin>,
    /// True from the first torque until an end that all servos have heard.
    is_needed: bool,
}

impl Guard {
    /// Starts a guard over the `ports` of the robot in `robot_file`, and waits until it is ready.
    pub(super) fn start(robot_file: &Path, ports: &[PortOption]) -> Result<Guard> {
        let program = std::env::current_exe().context("the guard could not be started")?;
        let mut arguments: Vec<OsString> = vec!["guard".into(), robot_file.into()];
        for port in ports {
            arguments.extend(["--port".into(), port.to_argument()]);
        }
        let mut child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // A group of its own: Ctrl-C is for the controller.
            .process_group(0)
            .spawn()
            .context("the guard could not be started")?;
        let (Some(pipe), Some(words)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("the guard has no pipes");
        };
        let mut word = String::new();
        BufReader::new(words).read_line(&mut word).context("the guard said nothing")?;
        if word.trim() != READY {
            bail!("the guard did not get ready");
        }
        Ok(Guard { child, pipe: Some(pipe), is_needed: false })
    }
}

impl Guard {
    /// Does `work`, which puts torque on. Unless it fails to start, or ends so that every servo has heard it
    /// (`is_heard`), the guard takes the torque off once this process, or its hold on it, is gone.
    pub(super) fn over<R>(
        mut self,
        work: impl FnOnce() -> Result<R>,
        is_heard: impl Fn(&R) -> bool,
    ) -> Result<R> {
        self.is_needed = true;
        let done = work();
        // A start that failed has put torque on no servo.
        self.is_needed = done.as_ref().is_ok_and(|done| !is_heard(done));
        done
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        if self.is_needed {
            return;
        }
        if let Some(mut pipe) = self.pipe.take() {
            let _ = pipe.write_all(SAFE);
        }
        let _ = self.child.wait();
    }
}

/// `hippocamp guard`: waits for the end of the controller.
pub(super) fn guard(robot_file: &Path, ports: &[PortOption]) -> Result<()> {
    if std::io::stdin().is_terminal() {
        return Err(BadInput(
            "'guard' is for the program's own use: 'run' and 'jog' start it beside themselves on real servos, and it \
             takes their torque off if the controller dies; nothing was touched"
                .to_owned(),
        )
        .into());
    }
    // Whatever ends the controller's terminal or session must not end the guard before its work.
    let ignored = Arc::new(AtomicBool::new(false));
    for signal in [SIGHUP, SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&ignored)).context("signals could not be ignored")?;
    }
    let robot = config::load(robot_file)?.robot;
    let devices = devices(&robot, ports)?;
    println!("{READY}");

    let mut heard = Vec::new();
    std::io::stdin().read_to_end(&mut heard).context("the controller cannot be heard")?;
    if heard == SAFE {
        return Ok(());
    }
    // Each bus by itself: one whose adapter is gone must not keep the others under torque.
    let mut pending: Vec<(Robot, Device)> =
        devices.into_iter().enumerate().map(|(bus, device)| (only_bus(&robot, bus), device)).collect();
    let start = monotonic();
    let mut has_said = false;
    loop {
        pending.retain(|(robot, device)| !is_limp(robot, device));
        if pending.is_empty() {
            tell("the controller did not end safely: its guard took the torque off all servos");
            return Ok(());
        }
        let buses: Vec<&str> = pending.iter().map(|(robot, _)| robot.buses[0].name.as_str()).collect();
        let buses = buses.join(", ");
        let waited = monotonic().saturating_sub(start);
        if waited > PATIENCE {
            bail!("the guard could not reach the servos of bus {buses}: cut their power");
        }
        if !has_said && waited > WORD_AFTER {
            tell(&format!(
                "THE CONTROLLER DID NOT END SAFELY, AND NOT ALL SERVOS OF BUS {buses} ARE HEARD: CUT THEIR POWER. Its \
                 guard goes on trying to take their torque off"
            ));
            has_said = true;
        }
        sleep_until(monotonic() + PAUSE);
    }
}

/// What is left of `robot` on its bus number `bus`.
fn only_bus(robot: &Robot, bus: usize) -> Robot {
    let mut left = robot.clone();
    left.buses = vec![robot.buses[bus].clone()];
    left.joints.retain(|joint| joint.servo.is_some_and(|servo| servo.bus == bus));
    for joint in &mut left.joints {
        if let Some(servo) = &mut joint.servo {
            servo.bus = 0;
        }
    }
    left
}

/// Takes the torque off the servos of a robot of one bus; true if all have heard it.
fn is_limp(robot: &Robot, device: &Device) -> bool {
    let Ok(ports) = SerialPorts::open(std::slice::from_ref(device)) else { return false };
    Buses::new(robot, ports).limp()
}

/// To the terminal, if there still is one.
fn tell(words: &str) {
    let _ = writeln!(std::io::stderr(), "\nhippocamp: {words}");
}
