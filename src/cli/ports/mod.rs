//! Which ports a run is on: simulated buses, or the devices that the unit file and the user name.
//!
//! Comes in: the robot, its unit file if there is one, what the user said. Goes out: "simulated", or a device
//! for every bus, or why neither.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result};

use super::{BadInput, UnitArguments};
use crate::bus::SerialPorts;
use crate::bus::serial::Device;
use crate::config::{UnitFile, default_unit_path, nearest};
use crate::model::Robot;

/// `--port BUS=PATH`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PortOption {
    bus: String,
    path: PathBuf,
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

/// Where the robot's buses are.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Choice {
    /// Nowhere: they are simulated.
    Simulated {
        /// On a virtual clock.
        is_virtual: bool,
    },
    /// On the device of each bus, in the robot's order of buses; all paths different.
    Devices(Vec<Device>),
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Choice::Simulated { is_virtual: false } => f.write_str("simulated buses"),
            Choice::Simulated { is_virtual: true } => f.write_str("simulated buses, virtual clock"),
            Choice::Devices(devices) => {
                let paths: Vec<_> = devices.iter().map(|device| device.path.display().to_string()).collect();
                f.write_str(&paths.join(", "))
            }
        }
    }
}

/// Decides where the buses of `robot`, loaded from `robot_file`, are. Opens nothing.
///
/// Simulated, if the user asks for that, or if neither `unit` nor the user names a device. Otherwise every bus
/// needs one, the user's before the unit file's, and the unit file must be a calibrated one of this robot.
///
/// # Errors
/// Bad input: ports that do not fit the robot's buses, no calibrated unit file, a bus without a device.
pub(super) fn choose(
    options: &UnitArguments,
    robot: &Robot,
    robot_file: &Path,
    unit: Option<&UnitFile>,
) -> Result<Choice> {
    let ports = &options.ports;
    check_ports(robot, ports)?;
    let has_devices = !ports.is_empty() || unit.is_some_and(|unit| !unit.unit.buses.is_empty());
    if options.simulate || options.is_virtual || !has_devices {
        return Ok(Choice::Simulated { is_virtual: options.is_virtual });
    }
    let Some(unit) = unit else {
        return Err(BadInput(format!(
            "nothing moves on a real port without a calibrated unit file of this very robot: expected {}, or \
             another named with --unit; --simulate in the place of --port runs without hardware",
            default_unit_path(robot_file).display()
        ))
        .into());
    };
    unit.check_calibrated(robot, robot_file).context(
        "nothing moves on a real port without a calibrated unit file; --simulate runs without hardware",
    )?;
    let devices = devices(robot, unit, ports)?;
    unit.warnings(robot).iter().for_each(|warning| warn(&warning.to_string()));
    Ok(Choice::Devices(devices))
}

/// Opens the devices, and says what could be better about them.
pub(super) fn open(devices: &[Device]) -> Result<SerialPorts> {
    let ports = SerialPorts::open(devices)?;
    ports.notes().iter().for_each(|note| warn(note));
    Ok(ports)
}

#[allow(clippy::print_stderr, reason = "warnings of the command")]
fn warn(text: &str) {
    eprintln!("hippocamp: warning: {text}");
}

/// Each for a bus of the robot, each bus once.
fn check_ports(robot: &Robot, ports: &[PortOption]) -> Result<(), BadInput> {
    for (index, port) in ports.iter().enumerate() {
        let names = || robot.buses.iter().map(|of| of.name.as_str());
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
            return Err(BadInput(format!("{port}: bus {} has a port already; give it one", port.bus)));
        }
    }
    Ok(())
}

/// The device of each bus, in the order of the robot's buses.
fn devices(robot: &Robot, unit: &UnitFile, ports: &[PortOption]) -> Result<Vec<Device>, BadInput> {
    let path_of = |bus: &str| {
        let named = ports.iter().find(|port| port.bus == bus).map(|port| port.path.clone());
        let entry = || unit.unit.buses.iter().find(|entry| entry.name == bus);
        named.or_else(|| entry().map(|entry| PathBuf::from(&entry.device)))
    };
    let missing: Vec<&str> =
        robot.buses.iter().map(|bus| bus.name.as_str()).filter(|bus| path_of(bus).is_none()).collect();
    if !missing.is_empty() {
        return Err(BadInput(format!(
            "there is no device for bus {}: add each to the unit file as a [[bus]] with name and device, or give \
             its --port",
            missing.join(", ")
        )));
    }
    let devices: Vec<Device> =
        robot.buses.iter().filter_map(|bus| path_of(&bus.name).map(|path| Device::of(bus, path))).collect();
    for (index, device) in devices.iter().enumerate() {
        if let Some(twin) = devices[..index].iter().find(|twin| twin.path == device.path) {
            let (a, b, path) = (&twin.bus, &device.bus, device.path.display());
            return Err(BadInput(format!("buses {a} and {b} are both on {path}: each has one of its own")));
        }
    }
    Ok(devices)
}

#[cfg(test)]
mod tests;
