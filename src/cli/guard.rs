//! The guard: a process that outlives the controller and takes the torque off if it dies without its safe stop.
//!
//! Feetech servos hold their last goal for ever, so a controller that is killed would leave the robot standing
//! under torque. The controller starts the guard before any torque is on and holds one end of a pipe to it. The
//! word at a safe end is [`SAFE`]; a pipe that closes without it means that the controller is gone, and its
//! ports, which nobody else could use till then, are free.
#![allow(clippy::print_stdout, reason = "a word to the controller")]

use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::ports::{PortOption, devices};
use crate::bus::serial::SerialPorts;
use crate::bus::{Buses, Ports};
use crate::config;

/// What the controller says at a safe end.
const SAFE: &[u8] = b"safe\n";
/// What the guard says when it is ready.
const READY: &str = "ready";
/// How often, and how long after one another, the guard tries to open the ports the dead controller left.
const OPEN_TRIES: u32 = 40;
const OPEN_PAUSE: Duration = Duration::from_millis(5);

/// The controller's hold on its guard.
#[derive(Debug)]
pub(super) struct Guard {
    child: Child,
    pipe: Option<ChildStdin>,
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
        Ok(Guard { child, pipe: Some(pipe) })
    }
}

impl Drop for Guard {
    /// Tells the guard that the robot is safe, and waits for it to end. A panic is no safe end.
    fn drop(&mut self) {
        if let Some(mut pipe) = self.pipe.take()
            && !std::thread::panicking()
        {
            let _ = pipe.write_all(SAFE);
        }
        let _ = self.child.wait();
    }
}

/// `hippocamp guard`: waits for the end of the controller.
pub(super) fn guard(robot_file: &Path, ports: &[PortOption]) -> Result<()> {
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
    let mut tries = 0;
    let opened = loop {
        tries += 1;
        match SerialPorts::open(&devices) {
            Ok(opened) => break opened,
            Err(error) if tries == OPEN_TRIES => {
                tell(&format!(
                    "THE CONTROLLER DIED AND ITS GUARD CANNOT REACH THE SERVOS: CUT THE POWER. {error}"
                ));
                return Err(error.into());
            }
            Err(_) => crate::platform::sleep_until(crate::platform::monotonic() + OPEN_PAUSE),
        }
    };
    let mut buses = Buses::new(&robot, opened);
    buses.limp();
    tell("the controller died without its safe stop: its guard took the torque off all servos");
    // Bytes still in the adapter leave before the ports close.
    let drained = buses.ports_mut().now() + OPEN_PAUSE;
    buses.ports_mut().wait_until(drained);
    Ok(())
}

/// To the terminal, if there still is one.
fn tell(words: &str) {
    let _ = writeln!(std::io::stderr(), "\nhippocamp: {words}");
}
