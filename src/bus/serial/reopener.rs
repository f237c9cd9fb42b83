//! Opens lost lines again, outside the loop, and returns those that still have the same servos.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use serialport::TTYPort;

use super::SerialPorts;
use super::device::{self, Device};
use crate::bus::buses::{Buses, Occupants};
use crate::model::Robot;

/// Time between two tries to open a lost device. An adapter takes about a second to be recognised.
const RETRY_EVERY: Duration = Duration::from_millis(250);

/// The thread that opens lost lines again. It sleeps while no line is lost, and ends when dropped.
#[derive(Debug)]
pub(super) struct Reopener {
    lost: Option<Sender<(usize, TTYPort)>>,
    returned: Receiver<(usize, TTYPort)>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    devices: Vec<Device>,
    /// The robot whose servos are on the lines; empty before they have been identified for the first time.
    robot: OnceLock<Robot>,
    /// The last fault found on the line of each bus. The loop never locks it.
    strangers: Mutex<Vec<Option<String>>>,
}

impl Reopener {
    pub(super) fn start(devices: Vec<Device>) -> Reopener {
        // A line is in only one place at a time, so neither channel is ever full.
        let (lost, losses) = bounded(devices.len());
        let (returns, returned) = bounded(devices.len());
        let strangers = Mutex::new(vec![None; devices.len()]);
        let shared = Arc::new(Shared { devices, robot: OnceLock::new(), strangers });
        let theirs = Arc::clone(&shared);
        let thread = std::thread::spawn(move || reopen(&theirs, &losses, &returns));
        Reopener { lost: Some(lost), returned, shared, thread: Some(thread) }
    }

    /// From now on a lost line comes back only with the servos of `robot`.
    pub(super) fn expect(&self, robot: &Robot) {
        let _ = self.shared.robot.set(robot.clone());
    }

    /// Faults found on lines that were open again, a sentence each.
    pub(super) fn strangers(&self) -> Vec<String> {
        let strangers = self.shared.strangers.lock().unwrap_or_else(PoisonError::into_inner);
        strangers.iter().flatten().cloned().collect()
    }

    /// Closes the line of `bus` and has its device tried again. Never waits.
    pub(super) fn hand_over(&self, bus: usize, port: TTYPort) {
        if let Some(lost) = &self.lost {
            let _ = lost.try_send((bus, port));
        }
    }

    /// A line that is open again, if there is one. Never waits.
    pub(super) fn returned(&self) -> Option<(usize, TTYPort)> {
        self.returned.try_recv().ok()
    }
}

impl Drop for Reopener {
    fn drop(&mut self) {
        // Closing the channel ends the thread.
        self.lost = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn reopen(shared: &Shared, losses: &Receiver<(usize, TTYPort)>, returns: &Sender<(usize, TTYPort)>) {
    let mut lost: Vec<usize> = Vec::new();
    loop {
        let loss = match lost.is_empty() {
            true => losses.recv().map_err(|_| RecvTimeoutError::Disconnected),
            false => losses.recv_timeout(RETRY_EVERY),
        };
        match loss {
            Ok((bus, port)) => {
                // The system keeps the device's name occupied until the dead line is closed.
                drop(port);
                lost.push(bus);
            }
            Err(RecvTimeoutError::Timeout) => lost.retain(|&bus| {
                let port = shared.devices.get(bus).and_then(|device| device::open(device).ok());
                let port = port.and_then(|port| shared.recognise(bus, port));
                port.is_none_or(|port| returns.try_send((bus, port)).is_err())
            }),
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

impl Shared {
    /// Returns a reopened line if the servos of `bus` are on it. Only reads.
    fn recognise(&self, bus: usize, port: TTYPort) -> Option<TTYPort> {
        let Some(robot) = self.robot.get() else { return Some(port) };
        if bus >= robot.buses.len() {
            // An inertial measurement unit has no identity to ask for.
            return Some(port);
        }
        let mut buses = Buses::new(robot, SerialPorts::with_only(bus, robot.buses.len(), port));
        let found = match buses.occupants(robot, bus) {
            Occupants::Own => return buses.into_ports().into_line(bus),
            // The servos may have no power yet.
            Occupants::Nobody => return None,
            Occupants::Foreign(found) => found,
        };
        let device = self.devices.get(bus)?;
        let said = format!(
            "bus {}: {} came back with other servos on it, and is not used: {found}; put each adapter back in its \
             place",
            device.bus,
            device.path.display()
        );
        if let Some(place) = self.strangers.lock().unwrap_or_else(PoisonError::into_inner).get_mut(bus) {
            *place = Some(said);
        }
        None
    }
}
