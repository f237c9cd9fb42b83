//! The guard's work: takes the torque off, bus by bus, as soon as it can reach each.

use std::os::fd::OwnedFd;
use std::time::Duration;

use anyhow::{Result, bail};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::bus::Buses;
use crate::bus::serial::{Device, OpenCause, SerialPorts};
use crate::cli::say::complain;
use crate::model::Robot;
use crate::platform::{monotonic, sleep_until};

/// Time between the guard's attempts to reach a bus, time until it reports the failure, and time until it gives up.
const PAUSE: Duration = Duration::from_millis(10);
const WORD_AFTER: Duration = Duration::from_millis(500);
const PATIENCE: Duration = Duration::from_secs(60);
/// A bus that another program has had for this long belongs to that program: a controller started meanwhile, which
/// has made its servos limp at its start and has a guard of its own.
const TAKEN_AFTER: Duration = Duration::from_secs(1);

/// A bus whose servos may have torque.
struct Pending {
    /// The robot with only this bus.
    robot: Robot,
    device: Device,
    /// Time since which another program has had it.
    busy_since: Option<Duration>,
}

/// Result of one attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Attempt {
    /// All servos have confirmed.
    Limp,
    /// The device is not there, or not all servos answered.
    Unheard,
    /// Another program has the device.
    Busy,
}

/// Takes the torque off all servos, and reports what happened to the `controller` (`what`).
pub(super) fn take_torque_off(
    robot: &Robot,
    devices: Vec<Device>,
    controller: &OwnedFd,
    what: &str,
) -> Result<()> {
    let left = match reach_all(robot, devices, controller, what)?.join(", ") {
        none if none.is_empty() => none,
        buses => format!(" but those of bus {buses}, which another program uses now"),
    };
    tell(&format!("{what}: its guard took the torque off all servos{left}"));
    Ok(())
}

/// The same without the final report; returns the buses that other programs have taken over.
fn reach_all(robot: &Robot, devices: Vec<Device>, controller: &OwnedFd, what: &str) -> Result<Vec<String>> {
    // Each bus on its own: one without an adapter must not keep the others under torque.
    let pending = |(bus, device)| Pending { robot: only_bus(robot, bus), device, busy_since: None };
    let mut pending: Vec<Pending> = devices.into_iter().enumerate().map(pending).collect();
    let mut taken: Vec<String> = Vec::new();
    let start = monotonic();
    let mut has_said = false;
    loop {
        let is_dead = has_ended(controller);
        pending.retain_mut(|pending| match pending.take_off() {
            Attempt::Limp => false,
            Attempt::Unheard => {
                pending.busy_since = None;
                true
            }
            // Until the controller is dead, it still holds its ports itself.
            Attempt::Busy if !is_dead => true,
            Attempt::Busy => {
                let since = *pending.busy_since.get_or_insert_with(monotonic);
                let is_taken = monotonic().saturating_sub(since) >= TAKEN_AFTER;
                if is_taken {
                    taken.push(pending.name().to_owned());
                }
                !is_taken
            }
        });
        if pending.is_empty() {
            return Ok(taken);
        }
        let buses: Vec<&str> = pending.iter().map(Pending::name).collect();
        let buses = buses.join(", ");
        let waited = monotonic().saturating_sub(start);
        if waited > PATIENCE {
            bail!("the guard could not reach the servos of bus {buses}: cut their power");
        }
        if !has_said && waited > WORD_AFTER {
            tell(&format!(
                "{what}, AND NOT ALL SERVOS OF BUS {buses} ANSWER: CUT THEIR POWER. Its guard keeps trying to take \
                 their torque off"
            ));
            has_said = true;
        }
        sleep_until(monotonic() + PAUSE);
    }
}

impl Pending {
    fn name(&self) -> &str {
        &self.device.bus
    }

    /// Takes the torque off its servos, if it can reach them.
    fn take_off(&self) -> Attempt {
        match SerialPorts::open(std::slice::from_ref(&self.device)) {
            Ok(ports) => match Buses::new(&self.robot, ports).limp() {
                true => Attempt::Limp,
                false => Attempt::Unheard,
            },
            Err(error) if error.faults.iter().any(|fault| fault.cause == OpenCause::Busy) => Attempt::Busy,
            Err(_) => Attempt::Unheard,
        }
    }
}

/// True if the process has ended, and all its files are closed.
fn has_ended(process: &OwnedFd) -> bool {
    let now = Timespec { tv_sec: 0, tv_nsec: 0 };
    poll(&mut [PollFd::new(process, PollFlags::IN)], Some(&now)).is_ok_and(|count| count > 0)
}

/// The part of `robot` on its bus number `bus`.
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

/// Writes to the terminal, if there still is one.
fn tell(words: &str) {
    // The controller may have left the cursor behind a status line.
    complain("");
    complain(&format!("hippocamp: {words}"));
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::process::Command;

    use rustix::process::{Pid, PidfdFlags, pidfd_open};
    use serialport::{SerialPort, TTYPort};

    use super::*;
    use crate::bus::serial::device;
    use crate::config;

    #[test]
    fn a_bus_that_another_program_keeps_open_is_left_to_it() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/horse.toml");
        let robot = config::load(&path).unwrap().robot;
        let (_near, far) = TTYPort::pair().unwrap();
        let port = Device::of(&robot.buses[0], far.name().unwrap().into());
        drop(far);
        let _another = device::open(&port).unwrap();
        let mut controller = Command::new("true").spawn().unwrap();
        let process = pidfd_open(Pid::from_child(&controller), PidfdFlags::empty()).unwrap();
        controller.wait().unwrap();
        assert!(has_ended(&process));
        assert_eq!(reach_all(&robot, vec![port], &process, "a test").unwrap(), ["main"]);
    }
}
