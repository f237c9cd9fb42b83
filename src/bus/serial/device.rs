//! Opens the serial device of a bus, and says why one cannot be opened.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use serialport::{ErrorKind, SerialPort, TTYPort};

use crate::model::{Bus, IMU_LINE, ImuSettings};
use crate::platform::{descriptor, set_low_latency};

/// Links to the connected adapters, named after maker and serial number (udev).
const BY_ID: &str = "/dev/serial/by-id";
/// Largest error of the line rate, as a share of the wanted rate: a UART samples the last of a byte's 10 bits
/// wrongly when the clocks differ by half a bit in 9.5, and both ends may be off.
const BAUD_TOLERANCE: f64 = 0.02;

/// The serial device of a bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Device {
    /// Name of the bus, for messages.
    pub bus: String,
    /// The device, or a link to it.
    pub path: PathBuf,
    /// Line rate, bit/s.
    pub baud: u32,
    /// Expected delay of the adapter beyond the time on the wire, microseconds.
    pub adapter_latency_us: u32,
}

impl Device {
    /// `bus` on the device at `path`.
    pub fn of(bus: &Bus, path: PathBuf) -> Device {
        Device { bus: bus.name.clone(), path, baud: bus.baud, adapter_latency_us: bus.adapter_latency_us }
    }
}

impl Device {
    /// The inertial measurement unit on the device at `path`.
    pub fn of_imu(imu: &ImuSettings, path: PathBuf) -> Device {
        Device { bus: IMU_LINE.to_owned(), path, baud: imu.baud, adapter_latency_us: 1000 }
    }
}

/// Why the lines of a robot could not be opened: every fault found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct OpenError {
    /// Faults in the order of the buses; at least one.
    pub faults: Vec<OpenFault>,
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let faults: Vec<String> = self.faults.iter().map(OpenFault::to_string).collect();
        f.write_str(&faults.join("\n"))
    }
}

/// Why one device could not be opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OpenFault {
    /// Name of the bus.
    pub bus: String,
    /// The device.
    pub path: PathBuf,
    /// The fault.
    pub cause: OpenCause,
}

/// The fault of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OpenCause {
    /// No such path.
    NotThere {
        /// Adapters that are connected.
        adapters: Vec<PathBuf>,
    },
    /// This user has no permission.
    NotPermitted,
    /// Another program holds it.
    Busy,
    /// It is also the device of another bus.
    SharedWith {
        /// Name of that bus.
        bus: String,
    },
    /// It cannot run at the bus's rate.
    OtherBaud {
        /// Rate wanted, bit/s.
        wanted: u32,
        /// Rate that it reports instead, bit/s.
        got: u32,
    },
    /// It is not a serial device, or does not work.
    Unusable {
        /// Reason that the system gives.
        reason: String,
    },
}

impl fmt::Display for OpenFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "bus {}: ", self.bus)?;
        self.cause.write(f, &self.path)
    }
}

impl OpenCause {
    /// A sentence about the device at `path`.
    pub(crate) fn write(&self, f: &mut fmt::Formatter<'_>, path: &Path) -> fmt::Result {
        write!(f, "{} ", path.display())?;
        match self {
            OpenCause::NotThere { adapters } if adapters.is_empty() => {
                write!(
                    f,
                    "does not exist, and no adapter is plugged in ({BY_ID} is empty): plug in the adapter of \
                     the bus"
                )
            }
            OpenCause::NotThere { adapters } => {
                let adapters: Vec<String> = adapters.iter().map(|path| path.display().to_string()).collect();
                write!(f, "does not exist: plug in its adapter, or use one of {}", adapters.join(", "))
            }
            OpenCause::NotPermitted => write!(
                f,
                "cannot be opened with your permissions: join the group that owns it ('sudo usermod -aG dialout \
                 $USER'; 'uucp' on some systems) and log in again"
            ),
            OpenCause::Busy => {
                write!(f, "is in use by another program: end it ('fuser {}' names it)", path.display())
            }
            OpenCause::SharedWith { bus } => {
                write!(f, "is also the device of bus {bus}: each bus needs an adapter of its own")
            }
            OpenCause::OtherBaud { wanted, got } => write!(
                f,
                "cannot run at {wanted} baud, only at {got}: use another adapter, or set bus and servos to a rate \
                 that it supports"
            ),
            OpenCause::Unusable { reason } => {
                write!(f, "cannot be used as a serial line ({reason}): give the path of the bus's adapter")
            }
        }
    }
}

/// Opens all devices, or names every one that cannot be opened.
pub(super) fn open_all(devices: &[Device]) -> Result<Vec<TTYPort>, OpenError> {
    let mut ports = Vec::new();
    let mut faults = Vec::new();
    for (index, device) in devices.iter().enumerate() {
        let result = match devices.iter().take(index).find(|other| is_same(&other.path, &device.path)) {
            Some(other) => Err(OpenCause::SharedWith { bus: other.bus.clone() }),
            None => open(device),
        };
        match result {
            Ok(port) => ports.push(port),
            Err(cause) => {
                faults.push(OpenFault { bus: device.bus.clone(), path: device.path.clone(), cause });
            }
        }
    }
    if faults.is_empty() { Ok(ports) } else { Err(OpenError { faults }) }
}

fn is_same(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

/// Opens one device: raw, 8N1, no flow control, exclusive, non-blocking.
pub(crate) fn open(device: &Device) -> Result<TTYPort, OpenCause> {
    let settings = serialport::new(device.path.to_string_lossy(), device.baud).exclusive(true);
    let port = TTYPort::open(&settings).map_err(|error| match error.kind() {
        ErrorKind::NoDevice => OpenCause::Busy,
        ErrorKind::Io(io::ErrorKind::NotFound) => {
            OpenCause::NotThere { adapters: adapters(Path::new(BY_ID)) }
        }
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => OpenCause::NotPermitted,
        _ => OpenCause::Unusable { reason: error.to_string() },
    })?;
    let unusable = |error: &dyn fmt::Display| OpenCause::Unusable { reason: error.to_string() };
    let got = port.baud_rate().map_err(|error| unusable(&error))?;
    if (f64::from(got) / f64::from(device.baud) - 1.0).abs() > BAUD_TOLERANCE {
        return Err(OpenCause::OtherBaud { wanted: device.baud, got });
    }
    let flags = fcntl_getfl(descriptor(&port)).map_err(|error| unusable(&error))?;
    fcntl_setfl(descriptor(&port), flags | OFlags::NONBLOCK).map_err(|error| unusable(&error))?;
    // Drivers without the flag have no latency to lower.
    let _ = set_low_latency(&port);
    Ok(port)
}

/// The connected adapters, sorted.
fn adapters(folder: &Path) -> Vec<PathBuf> {
    let mut adapters: Vec<PathBuf> =
        folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    adapters.sort();
    adapters
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(path: &str) -> Device {
        Device { bus: "legs".into(), path: path.into(), baud: 1_000_000, adapter_latency_us: 1000 }
    }

    #[test]
    fn every_cause_of_a_failed_open_is_named() {
        let error = open_all(&[device("/nowhere/at/all"), device("/dev/null")]).unwrap_err();
        assert_eq!(error.faults.len(), 2);
        assert!(matches!(error.faults[0].cause, OpenCause::NotThere { .. }), "{error}");
        assert!(matches!(error.faults[1].cause, OpenCause::Unusable { .. }), "{error}");
        let text = error.to_string();
        assert!(text.contains("bus legs: /nowhere/at/all does not exist"), "{text}");
        assert!(text.contains("bus legs: /dev/null cannot be used as a serial line"), "{text}");
    }

    #[test]
    fn present_adapters_are_suggested() {
        let adapters = adapters(Path::new("config"));
        assert!(adapters.contains(&PathBuf::from("config/horse.toml")));
        let fault =
            OpenFault { bus: "legs".into(), path: "/dev/x".into(), cause: OpenCause::NotThere { adapters } };
        assert!(fault.to_string().contains("config/horse.toml, "), "{fault}");
    }

    #[test]
    fn one_device_cannot_serve_two_buses() {
        let (_near, far) = TTYPort::pair().unwrap();
        let path = far.name().unwrap();
        drop(far);
        let error = open_all(&[device(&path), Device { bus: "arms".into(), ..device(&path) }]).unwrap_err();
        assert_eq!(error.faults[0].bus, "arms");
        assert_eq!(error.faults[0].cause, OpenCause::SharedWith { bus: "legs".into() });
    }
}
