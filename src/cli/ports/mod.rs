//! The ports of a run: simulated buses, or the devices that the unit file and the user name.
//!
//! In: the robot, its unit file if there is one, the user's options. Out: "simulated", or a device for every bus,
//! or the reason for neither.

use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use anyhow::{Context, Result};

use super::say::complain;
use super::{BadInput, UnitArguments};
use crate::bus::SerialPorts;
use crate::bus::serial::{Device, OpenCause, OpenError};
use crate::config::{UnitBus, UnitFile, default_unit_path, nearest};
use crate::model::{Bus, IMU_LINE, Robot};
use crate::platform::{monotonic, sleep_until};

/// How long to wait for a device that another program holds, and time between attempts.
const BUSY_PATIENCE: Duration = Duration::from_secs(1);
const BUSY_PAUSE: Duration = Duration::from_millis(10);

/// `--port BUS=PATH`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PortOption {
    bus: String,
    path: PathBuf,
}

impl PortOption {
    /// True for a bus; false for the inertial measurement unit.
    pub(super) fn is_bus(&self) -> bool {
        self.bus != IMU_LINE
    }

    /// The entry for a unit file.
    pub(super) fn to_unit_bus(&self) -> UnitBus {
        // Not canonicalised: a link in /dev/serial/by-id must remain a link.
        let path = std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone());
        UnitBus { name: self.bus.clone(), device: path.display().to_string() }
    }

    /// The device.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The text to type after `--port`.
    pub(super) fn to_argument(&self) -> OsString {
        let mut argument = OsString::from(&self.bus);
        argument.push("=");
        argument.push(&self.path);
        argument
    }
}

impl FromStr for PortOption {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<PortOption, Self::Err> {
        match text.split_once('=') {
            Some((bus, path)) if !bus.is_empty() && !path.is_empty() => {
                Ok(PortOption { bus: bus.to_owned(), path: path.into() })
            }
            _ => Err("expected BUS=PATH, as in legs=/dev/ttyUSB0"),
        }
    }
}

impl fmt::Display for PortOption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "--port {}={}", self.bus, self.path.display())
    }
}

/// Location of the robot's buses.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Choice {
    /// Simulated, without devices.
    Simulated {
        /// True for a virtual clock.
        is_virtual: bool,
    },
    /// On real ports: one for each bus, in the robot's order of buses, followed by that of the inertial measurement
    /// unit, if there is one; all paths different.
    Devices(Vec<PortOption>),
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Choice::Simulated { is_virtual: false } => f.write_str("simulated buses"),
            Choice::Simulated { is_virtual: true } => f.write_str("simulated buses, virtual clock"),
            Choice::Devices(ports) => {
                let paths: Vec<_> = ports.iter().map(|port| port.path.display().to_string()).collect();
                f.write_str(&paths.join(", "))
            }
        }
    }
}

/// Decides whether the buses of `robot`, loaded from `robot_file`, are simulated or on devices. Opens nothing.
///
/// They are simulated if the user asks for that, or if neither `unit` nor the user names a device. Otherwise every
/// bus needs a device: the user's takes precedence over the unit file's. The unit file must then be a calibrated
/// one of this robot.
///
/// # Errors
/// Bad input: ports that do not fit the robot's buses, no calibrated unit file, a bus without a device.
pub(super) fn choose(
    options: &UnitArguments,
    robot: &Robot,
    robot_file: &Path,
    unit: Option<&UnitFile>,
) -> Result<Choice> {
    check_ports(robot, &options.ports)?;
    if is_simulated(options, unit)? {
        return Ok(Choice::Simulated { is_virtual: options.is_virtual });
    }
    let Some(unit) = unit else {
        return Err(BadInput(format!(
            "nothing moves on a real port without a calibrated unit file of this very robot: expected {}, or \
             another named with --unit; --simulate instead of --port runs without hardware",
            default_unit_path(robot_file).display()
        ))
        .into());
    };
    unit.check_calibrated(robot, robot_file).context(
        "nothing moves on a real port without a calibrated unit file; --simulate runs without hardware",
    )?;
    let ports = fill_up(robot, Some(unit), &options.ports)?;
    unit.warnings(robot).iter().for_each(|warning| warn(&warning.to_string()));
    Ok(Choice::Devices(ports))
}

/// The same for commands that only look: the unit file may be uncalibrated or missing.
///
/// # Errors
/// Bad input: ports that do not fit the robot's buses, a bus without a device while others have one.
pub(super) fn choose_to_look(
    options: &UnitArguments,
    robot: &Robot,
    unit: Option<&UnitFile>,
) -> Result<Choice, BadInput> {
    check_ports(robot, &options.ports)?;
    if is_simulated(options, unit)? {
        return Ok(Choice::Simulated { is_virtual: options.is_virtual });
    }
    Ok(Choice::Devices(fill_up(robot, unit, &options.ports)?))
}

/// A device for each bus, in the order of the robot's buses; the user's takes precedence over the unit file's. For
/// commands that talk to single servos.
///
/// # Errors
/// Bad input: ports that do not fit the robot's buses, a bus without a device.
pub(super) fn devices_for_tools(
    robot: &Robot,
    unit: Option<&UnitFile>,
    ports: &[PortOption],
) -> Result<Vec<PortOption>, BadInput> {
    check_ports(robot, ports)?;
    fill_up(robot, unit, ports)
}

/// True if the buses are simulated.
///
/// # Errors
/// Bad input: `--no-physics`, an option for simulated joints, together with devices.
pub(super) fn is_simulated(options: &UnitArguments, unit: Option<&UnitFile>) -> Result<bool, BadInput> {
    let has_devices = !options.ports.is_empty() || unit.is_some_and(|unit| !unit.unit.buses.is_empty());
    let is_simulated = options.simulate || options.is_virtual || !has_devices;
    if options.no_physics && !is_simulated {
        return Err(BadInput(
            "--no-physics: only simulated joints turn freely, and the unit file names devices; add --simulate, or leave \
             --no-physics out"
                .to_owned(),
        ));
    }
    Ok(is_simulated)
}

/// Opens `ports`, one for each bus of `robot`, and prints advice about their settings.
pub(super) fn open(robot: &Robot, ports: &[PortOption]) -> Result<SerialPorts> {
    let imu = imu_device(robot, ports);
    if robot.imu.is_some() && imu.is_none() {
        warn(
            "the robot file has an inertial measurement unit, and there is no device for it: the robot goes slower, without \
             feedback ('hippocamp imu setup', or --port imu=PATH)",
        );
    }
    let ports = open_when_free(&devices(robot, ports)?, imu.as_ref())?;
    ports.notes().iter().for_each(|note| warn(note));
    Ok(ports)
}

/// Opens all. Retries a device in use for a while: the guard of an earlier run may hold it to take the torque off.
fn open_when_free(buses: &[Device], imu: Option<&Device>) -> Result<SerialPorts, OpenError> {
    let start = monotonic();
    let mut has_said = false;
    loop {
        let error = match SerialPorts::open_with_imu(buses, imu) {
            Ok(ports) => return Ok(ports),
            Err(error) => error,
        };
        let is_busy = error.faults.iter().all(|fault| fault.cause == OpenCause::Busy);
        if !is_busy || monotonic().saturating_sub(start) >= BUSY_PATIENCE {
            return Err(error);
        }
        if !has_said {
            warn("a device is in use, perhaps by the guard of an earlier run: waiting for it");
            has_said = true;
        }
        sleep_until(monotonic() + BUSY_PAUSE);
    }
}

pub(super) fn warn(text: &str) {
    complain(&format!("hippocamp: warning: {text}"));
}

/// Checks that each port names a bus of the robot, and each bus only once.
fn check_ports(robot: &Robot, ports: &[PortOption]) -> Result<(), BadInput> {
    for (index, port) in ports.iter().enumerate() {
        let imu = robot.imu.as_ref().map(|_| IMU_LINE);
        let names = || robot.buses.iter().map(|of| of.name.as_str()).chain(imu);
        if !names().any(|name| name == port.bus) {
            let near =
                nearest(&port.bus, names()).map(|near| format!("; did you mean {near}?")).unwrap_or_default();
            let names = names().collect::<Vec<_>>().join(", ");
            return Err(BadInput(format!(
                "{port}: {} has no bus {}; it has {names}{near}",
                robot.name, port.bus
            )));
        }
        if ports[..index].iter().any(|earlier| earlier.bus == port.bus) {
            return Err(BadInput(format!("{port}: bus {} already has a port; give it only one", port.bus)));
        }
    }
    Ok(())
}

/// A port for each bus, in the order of the robot's buses: from `ports`, or else the unit file's device.
fn fill_up(
    robot: &Robot,
    unit: Option<&UnitFile>,
    ports: &[PortOption],
) -> Result<Vec<PortOption>, BadInput> {
    let port_of = |bus: &str| {
        let entry = || unit?.unit.buses.iter().find(|entry| entry.name == bus);
        let from_unit = || Some(PortOption { bus: bus.to_owned(), path: PathBuf::from(&entry()?.device) });
        ports.iter().find(|port| port.bus == bus).cloned().or_else(from_unit)
    };
    let names = || robot.buses.iter().map(|bus| bus.name.as_str());
    let missing: Vec<&str> = names().filter(|bus| port_of(bus).is_none()).collect();
    if !missing.is_empty() {
        return Err(BadInput(format!(
            "there is no device for bus {}: add each to the unit file as a [[bus]] with name and device, or give \
             its --port",
            missing.join(", ")
        )));
    }
    let imu = robot.imu.as_ref().and_then(|_| imu_port(unit, ports));
    let all: Vec<PortOption> = names().filter_map(port_of).chain(imu).collect();
    for (index, port) in all.iter().enumerate() {
        if let Some(twin) = all[..index].iter().find(|twin| twin.path == port.path) {
            let (a, b, path) = (&twin.bus, &port.bus, port.path.display());
            return Err(BadInput(format!("buses {a} and {b} are both on {path}: each needs one of its own")));
        }
    }
    Ok(all)
}

/// The port of the inertial measurement unit, if known; the user's takes precedence over the unit file's.
pub(super) fn imu_port(unit: Option<&UnitFile>, ports: &[PortOption]) -> Option<PortOption> {
    let from_unit = || {
        let entry = unit?.unit.imu.as_ref()?;
        Some(PortOption { bus: IMU_LINE.to_owned(), path: PathBuf::from(&entry.device) })
    };
    ports.iter().find(|port| port.bus == IMU_LINE).cloned().or_else(from_unit)
}

/// The device of the inertial measurement unit, if `ports` has one.
pub(super) fn imu_device(robot: &Robot, ports: &[PortOption]) -> Option<Device> {
    let port = ports.iter().find(|port| port.bus == IMU_LINE)?;
    Some(Device::of_imu(robot.imu.as_ref()?, port.path.clone()))
}

/// The device of each bus, in the order of the robot's buses.
///
/// # Errors
/// A port for a bus the robot does not have, two for one bus, or a bus without one.
pub(super) fn devices(robot: &Robot, ports: &[PortOption]) -> Result<Vec<Device>, BadInput> {
    check_ports(robot, ports)?;
    let device = |bus: &Bus| {
        let port = ports.iter().find(|port| port.bus == bus.name);
        let missing = || BadInput(format!("--port is missing for bus {}", bus.name));
        port.map(|port| Device::of(bus, port.path.clone())).ok_or_else(missing)
    };
    robot.buses.iter().map(device).collect()
}

#[cfg(test)]
mod tests;
