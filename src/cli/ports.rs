//! Which ports a run is on: simulated buses, or the devices the user named.

use std::ffi::OsString;
use std::path::PathBuf;
use std::str::FromStr;

use super::BadInput;
use crate::bus::serial::Device;
use crate::model::Robot;

/// `--port BUS=PATH`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PortOption {
    bus: String,
    path: PathBuf,
}

impl PortOption {
    /// As it is typed after `--port`.
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

/// Where the robot's buses are.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Choice {
    /// Nowhere: they are simulated.
    Simulated,
}

/// Decides where the buses of `robot` are. Opens nothing.
///
/// # Errors
/// When the ports do not fit the robot's buses; and otherwise too, because nothing moves on a real port without
/// a calibrated unit file, and there is none yet.
pub(super) fn choose(robot: &Robot, ports: &[PortOption]) -> Result<Choice, BadInput> {
    if ports.is_empty() {
        return Ok(Choice::Simulated);
    }
    devices(robot, ports)?;
    Err(BadInput(
        "no calibrated unit file: nothing moves on a real port before the zero and the direction of every joint are \
         known"
            .to_owned(),
    ))
}

/// The device of each bus, in the order of the robot's buses.
///
/// # Errors
/// A port for a bus the robot does not have, two for one bus, or a bus without one.
pub(super) fn devices(robot: &Robot, ports: &[PortOption]) -> Result<Vec<Device>, BadInput> {
    for (index, port) in ports.iter().enumerate() {
        let (bus, path) = (&port.bus, port.path.display());
        if !robot.buses.iter().any(|of| of.name == *bus) {
            let names: Vec<&str> = robot.buses.iter().map(|of| of.name.as_str()).collect();
            return Err(BadInput(format!(
                "--port {bus}={path}: {} has no bus {bus}; it has {}",
                robot.name,
                names.join(", ")
            )));
        }
        if ports.iter().take(index).any(|earlier| earlier.bus == *bus) {
            return Err(BadInput(format!("--port {bus}={path}: bus {bus} has a port already; give it one")));
        }
    }
    let path_of = |bus: &str| ports.iter().find(|port| port.bus == bus).map(|port| port.path.clone());
    let missing: Vec<&str> =
        robot.buses.iter().map(|bus| bus.name.as_str()).filter(|bus| path_of(bus).is_none()).collect();
    if !missing.is_empty() {
        return Err(BadInput(format!(
            "--port is missing for bus {}: give one for every bus of {}, or none to simulate them all",
            missing.join(", "),
            robot.name
        )));
    }
    Ok(robot.buses.iter().filter_map(|bus| path_of(&bus.name).map(|path| Device::of(bus, path))).collect())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn robot() -> Robot {
        crate::config::load(Path::new("config/horse-dynamixel.toml")).unwrap().robot
    }

    fn ports(texts: &[&str]) -> Vec<PortOption> {
        texts.iter().map(|text| text.parse().unwrap()).collect()
    }

    fn fault(texts: &[&str]) -> String {
        choose(&robot(), &ports(texts)).unwrap_err().to_string()
    }

    #[test]
    fn without_ports_all_buses_are_simulated() {
        assert_eq!(choose(&robot(), &[]).unwrap(), Choice::Simulated);
    }

    #[test]
    fn each_bus_gets_its_own_path_and_rate() {
        let texts = ["right_fore=/dev/d", "left_fore=/dev/b", "left_hind=/dev/a=b", "right_hind=/dev/c"];
        let devices = devices(&robot(), &ports(&texts)).unwrap();
        let paths: Vec<&str> = devices.iter().filter_map(|device| device.path.to_str()).collect();
        assert_eq!(paths, ["/dev/a=b", "/dev/b", "/dev/c", "/dev/d"]);
        assert!(devices.iter().all(|device| device.baud == 4_000_000));
        // But nothing moves on them.
        assert!(fault(&texts).starts_with("no calibrated unit file: "));
    }

    #[test]
    fn what_does_not_fit_the_buses_is_named() {
        assert_eq!(
            fault(&["left_hind=/dev/a", "right_hind=/dev/c"]),
            "--port is missing for bus left_fore, right_fore: give one for every bus of horse-dynamixel, or none \
             to simulate them all"
        );
        assert_eq!(
            fault(&["tail=/dev/t"]),
            "--port tail=/dev/t: horse-dynamixel has no bus tail; it has left_hind, left_fore, right_hind, right_fore"
        );
        let twice = fault(&["left_hind=/dev/a", "left_hind=/dev/b"]);
        assert!(twice.contains("left_hind=/dev/b: bus left_hind has a port already"), "{twice}");
        for text in ["", "legs", "=/dev/a", "legs="] {
            assert!(text.parse::<PortOption>().is_err(), "{text}");
        }
    }
}
