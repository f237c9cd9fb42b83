//! The line of a unit outside the loop, on a real serial device.

use std::fmt::Display;
use std::time::Duration;

use rustix::io::Errno;
use serialport::{SerialPort, TTYPort};

use super::line::{ImuLine, ImuLineError};
use crate::bus::serial::{Device, OpenFault, device};
use crate::platform::{descriptor, monotonic, sleep_until};

/// A serial device, open for this program alone.
#[derive(Debug)]
pub struct SerialImu {
    device: Device,
    line: TTYPort,
}

impl SerialImu {
    /// Opens `device`.
    ///
    /// # Errors
    /// [`ImuLineError`] says why it cannot be used.
    pub fn open(device: &Device) -> Result<SerialImu, ImuLineError> {
        let line = device::open(device).map_err(|cause| {
            let fault = OpenFault { bus: device.bus.clone(), path: device.path.clone(), cause };
            ImuLineError(fault.to_string())
        })?;
        Ok(SerialImu { device: device.clone(), line })
    }

    fn error(&self, reason: &dyn Display) -> ImuLineError {
        ImuLineError(format!("{}: {reason}: plug its adapter in, or use another", self.device.path.display()))
    }
}

impl ImuLine for SerialImu {
    fn now(&mut self) -> Duration {
        monotonic()
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), ImuLineError> {
        self.line.set_baud_rate(baud).map_err(|error| self.error(&error))
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), ImuLineError> {
        match rustix::io::write(descriptor(&self.line), bytes) {
            Ok(_) | Err(Errno::AGAIN | Errno::INTR) => Ok(()),
            Err(error) => Err(self.error(&error)),
        }
    }

    fn receive(&mut self, into: &mut [u8]) -> Result<usize, ImuLineError> {
        match rustix::io::read(descriptor(&self.line), into) {
            Ok(0) => Err(self.error(&"it was hung up")),
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(error) => Err(self.error(&error)),
        }
    }

    fn wait(&mut self, time: Duration) {
        sleep_until(monotonic() + time);
    }
}
