//! Which built robot is meant, and whether its buses are real.
//!
//! Comes in: the robot, its unit file if there is one, what the user said. Goes out: "simulated", or a device
//! for every bus, or why neither. It opens no device.

use std::fmt;
use std::path::Path;

use anyhow::{Context, Result};

use super::BadInput;
use crate::config::{self, UnitFile, default_unit_path, nearest};
use crate::model::Robot;

/// What is said of real buses until there are ports for them.
pub(super) const NO_SERIAL_PORTS: &str =
    "this program cannot open serial ports yet: --simulate runs without hardware";

/// What the buses of a robot run over.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Lines {
    /// Simulated buses.
    Simulated,
    /// The serial device of each bus, in the robot's order of buses; all different.
    Devices(Vec<String>),
}

impl fmt::Display for Lines {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Lines::Simulated => f.write_str("simulated buses"),
            Lines::Devices(devices) => f.write_str(&devices.join(", ")),
        }
    }
}

/// The unit file the user named, or else the one beside the robot file, if there is one.
pub(super) fn find(robot_file: &Path, named: Option<&Path>) -> Result<Option<UnitFile>> {
    let beside = default_unit_path(robot_file);
    let path = match named {
        Some(path) => path,
        None if beside.exists() => &beside,
        None => return Ok(None),
    };
    Ok(Some(config::load_unit(path)?))
}

/// What the buses of `robot` run over. Real ones only where a calibrated unit file says so: its devices, or
/// those of `ports`, pairs of bus name and device, which go before them. `is_simulation` is the user's word
/// that nothing real is to be touched. Warnings go to standard error.
pub(super) fn lines(
    robot: &Robot,
    robot_file: &Path,
    unit: Option<&UnitFile>,
    ports: &[(String, String)],
    is_simulation: bool,
) -> Result<Lines> {
    if is_simulation {
        if let Some((bus, device)) = ports.first() {
            let said =
                format!("--port {bus}={device}: simulated buses have no device; leave out one of the two");
            return Err(BadInput(said).into());
        }
        return Ok(Lines::Simulated);
    }
    check_ports(robot, ports)?;
    let has_devices = unit.is_some_and(|unit| !unit.unit.buses.is_empty());
    if ports.is_empty() && !has_devices {
        return Ok(Lines::Simulated);
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
    for warning in unit.warnings(robot) {
        #[allow(clippy::print_stderr, reason = "a warning of the command")]
        {
            eprintln!("hippocamp: warning: {warning}");
        }
    }
    Ok(Lines::Devices(devices))
}

/// Each a bus of the robot, each once.
fn check_ports(robot: &Robot, ports: &[(String, String)]) -> Result<(), BadInput> {
    let names = || robot.buses.iter().map(|bus| bus.name.as_str());
    for (place, (bus, device)) in ports.iter().enumerate() {
        if !names().any(|name| name == bus) {
            let near =
                nearest(bus, names()).map(|near| format!("; did you mean {near}?")).unwrap_or_default();
            let names = names().collect::<Vec<_>>().join(", ");
            return Err(BadInput(format!("--port {bus}={device}: expected a bus, one of {names}{near}")));
        }
        if ports[..place].iter().any(|(earlier, _)| earlier == bus) {
            return Err(BadInput(format!("--port {bus}={device}: bus {bus} has a --port already")));
        }
    }
    Ok(())
}

/// A device for every bus.
fn devices(robot: &Robot, unit: &UnitFile, ports: &[(String, String)]) -> Result<Vec<String>, BadInput> {
    let mut devices: Vec<String> = Vec::new();
    for bus in &robot.buses {
        let port = ports.iter().find(|(name, _)| *name == bus.name).map(|(_, device)| device);
        let entry = unit.unit.buses.iter().find(|entry| entry.name == bus.name).map(|entry| &entry.device);
        let Some(device) = port.or(entry) else {
            return Err(BadInput(format!(
                "bus {} has no device: add it to the unit file as a [[bus]] with name and device, or give --port \
                 {}=PATH",
                bus.name, bus.name
            )));
        };
        if let Some(twin) = devices.iter().position(|other| other == device) {
            let (twin, name) = (&robot.buses[twin].name, &bus.name);
            return Err(BadInput(format!("buses {twin} and {name} are both on {device}: each has its own")));
        }
        devices.push(device.clone());
    }
    Ok(devices)
}

#[cfg(test)]
mod tests;
