//! Ports on real serial lines.
//!
//! Takes the device of each bus. Moves bytes without ever waiting for a single line; one wait covers all lines.
//! A line that hangs up is gone and costs nothing while it is gone. It comes back by itself when its device does,
//! with the same servos on it: a separate thread tries to reopen it and asks which servos are there, because both
//! take milliseconds.
//! After opening, nothing here allocates, and a line that works needs no thread.

pub(crate) mod device;
mod latency;
mod reopener;

use std::time::Duration;

use rustix::io::Errno;
use rustix::termios::{QueueSelector, tcflush};
use serialport::TTYPort;

use super::port::{PortError, Ports};
use crate::model::Robot;
use crate::platform::{Meter, PollList, Readiness, Usage, descriptor, monotonic, sleep_until};
use crate::units::Time;
pub use device::{Device, OpenCause, OpenError, OpenFault};
use reopener::Reopener;

/// Old input is discarded in pieces of this size: as much as the system keeps of a line.
const PIECE_BYTES: usize = 4096;
/// Most pieces discarded at once, so that a line that never falls silent cannot hold up the loop.
const PIECES_MAX: usize = 16;

/// A robot's serial lines, all open, none shared with another program.
#[derive(Debug)]
pub struct SerialPorts {
    /// Each bus's line, then that of the inertial measurement unit, if there is one; `None` while a line is gone.
    lines: Vec<Option<TTYPort>>,
    /// Index of the unit's line.
    imu: Option<usize>,
    /// The buses' lines only: the loop never waits for the unit.
    poll_list: PollList,
    /// `None` if a lost line is lost for good.
    reopener: Option<Reopener>,
    /// Time 0 of the run, on the monotonic clock.
    start: Duration,
    notes: Vec<String>,
    /// Path of each bus's device, for messages.
    paths: Vec<String>,
    meter: Meter,
}

impl SerialPorts {
    /// Opens the line of every bus, in the robot's order of buses: raw, 8N1, at its rate, exclusive.
    ///
    /// # Errors
    /// Every device that cannot be used, and why. Then no line stays open.
    pub fn open(devices: &[Device]) -> Result<SerialPorts, OpenError> {
        SerialPorts::open_with_imu(devices, None)
    }

    /// Like [`SerialPorts::open`], with the line of the inertial measurement unit.
    ///
    /// # Errors
    /// The same as [`SerialPorts::open`].
    pub fn open_with_imu(buses: &[Device], imu: Option<&Device>) -> Result<SerialPorts, OpenError> {
        let devices: Vec<Device> = buses.iter().chain(imu).cloned().collect();
        let lines = device::open_all(&devices)?;
        let mut poll_list = PollList::new(buses.len());
        for (bus, port) in lines.iter().take(buses.len()).enumerate() {
            poll_list.set(bus, Some(port));
        }
        Ok(SerialPorts {
            lines: lines.into_iter().map(Some).collect(),
            imu: imu.map(|_| buses.len()),
            poll_list,
            start: monotonic(),
            notes: devices.iter().filter_map(latency::advice).collect(),
            paths: devices.iter().map(|device| device.path.display().to_string()).collect(),
            meter: Meter::default(),
            reopener: Some(Reopener::start(devices)),
        })
    }

    /// On an open port, the one line of `bus` of a robot with `count` buses, the others gone: to ask who is on it.
    fn with_only(bus: usize, count: usize, port: TTYPort) -> SerialPorts {
        let mut poll_list = PollList::new(count);
        poll_list.set(bus, Some(&port));
        let mut lines: Vec<Option<TTYPort>> = (0..count).map(|_| None).collect();
        if let Some(line) = lines.get_mut(bus) {
            *line = Some(port);
        }
        SerialPorts {
            lines,
            imu: None,
            poll_list,
            reopener: None,
            start: monotonic(),
            notes: Vec::new(),
            paths: Vec::new(),
            meter: Meter::default(),
        }
    }

    /// Returns the line of `bus`, if it is still there.
    fn into_line(mut self, bus: usize) -> Option<TTYPort> {
        self.lines.get_mut(bus).and_then(Option::take)
    }

    /// What could be better about the lines, and how; one sentence each, for a person to read.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    fn line(&self, bus: usize) -> Result<&TTYPort, PortError> {
        self.lines.get(bus).and_then(Option::as_ref).ok_or(PortError::Gone { bus })
    }

    /// Gives up a line and has its device tried again.
    fn lose(&mut self, bus: usize) -> PortError {
        if self.imu != Some(bus) {
            self.poll_list.set(bus, None);
        }
        let port = self.lines.get_mut(bus).and_then(Option::take);
        if let (Some(port), Some(reopener)) = (port, &self.reopener) {
            reopener.hand_over(bus, port);
        }
        PortError::Gone { bus }
    }

    /// Takes lines that have come back into use.
    fn take_back(&mut self) {
        while let Some((bus, port)) = self.reopener.as_ref().and_then(Reopener::returned) {
            if self.imu != Some(bus) {
                self.poll_list.set(bus, Some(&port));
            }
            if let Some(line) = self.lines.get_mut(bus) {
                *line = Some(port);
            }
        }
    }
}

impl Ports for SerialPorts {
    fn now(&mut self) -> Time {
        Time(u64::try_from(monotonic().saturating_sub(self.start).as_nanos()).unwrap_or(u64::MAX))
    }

    fn usage(&mut self) -> Usage {
        self.meter.usage()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        // An exchange begins here: it may use a line that was gone in the last one.
        self.take_back();
        let mut piece = [0; PIECE_BYTES];
        for _ in 0..PIECES_MAX {
            if self.receive(bus, &mut piece)? < PIECE_BYTES {
                break;
            }
        }
        Ok(())
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        let line = descriptor(self.line(bus)?);
        match rustix::io::write(line, bytes) {
            Ok(count) if count == bytes.len() => Ok(()),
            Ok(_) | Err(Errno::AGAIN | Errno::INTR) => {
                // The line does not drain. Goals that left it later would be old; a request cut short
                // shows as missing replies.
                let _ = tcflush(line, QueueSelector::OFlush);
                Ok(())
            }
            Err(_) => Err(self.lose(bus)),
        }
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        if into.is_empty() {
            return Ok(0);
        }
        match rustix::io::read(descriptor(self.line(bus)?), into) {
            // A working line with no data would report that; this is the end of a line that was hung up.
            Ok(0) => Err(self.lose(bus)),
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(_) => Err(self.lose(bus)),
        }
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        let Some(imu) = self.imu else { return Ok(0) };
        self.receive(imu, into).map_err(|_| PortError::ImuGone)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.poll_list.wait_until(self.start + Duration::from_nanos(deadline.0));
        for bus in 0..self.imu.unwrap_or(self.lines.len()) {
            // Without this, a line that has hung up would end every wait at once.
            if self.poll_list.readiness(bus) == Readiness::HungUp {
                self.lose(bus);
            }
        }
    }

    fn wait_until(&mut self, deadline: Time) {
        sleep_until(self.start + Duration::from_nanos(deadline.0));
    }

    fn device(&self, bus: usize) -> Option<&str> {
        self.paths.get(bus).map(String::as_str)
    }

    fn expect_servos(&mut self, robot: &Robot) {
        if let Some(reopener) = &self.reopener {
            reopener.expect(robot);
        }
    }

    fn strangers(&self) -> Vec<String> {
        self.reopener.as_ref().map(Reopener::strangers).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests;
