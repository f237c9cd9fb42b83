//! Opens lost lines again, beside the loop.

use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use serialport::TTYPort;

use super::device::{self, Device};

/// Time between two tries to open a lost device. An adapter takes about a second to be recognised.
const RETRY_EVERY: Duration = Duration::from_millis(250);

/// The thread that opens lost lines again. It sleeps while no line is lost, and ends when dropped.
#[derive(Debug)]
pub(super) struct Reopener {
    lost: Option<Sender<(usize, TTYPort)>>,
    returned: Receiver<(usize, TTYPort)>,
    thread: Option<JoinHandle<()>>,
}

impl Reopener {
    pub(super) fn start(devices: Vec<Device>) -> Reopener {
        // A line is in one place at a time, so that neither channel is ever full.
        let (lost, losses) = bounded(devices.len());
        let (returns, returned) = bounded(devices.len());
        let thread = std::thread::spawn(move || reopen(&devices, &losses, &returns));
        Reopener { lost: Some(lost), returned, thread: Some(thread) }
    }

    /// Has the line of `bus` closed and its device tried again. Never waits.
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

fn reopen(devices: &[Device], losses: &Receiver<(usize, TTYPort)>, returns: &Sender<(usize, TTYPort)>) {
    let mut lost: Vec<usize> = Vec::new();
    loop {
        let loss = match lost.is_empty() {
            true => losses.recv().map_err(|_| RecvTimeoutError::Disconnected),
            false => losses.recv_timeout(RETRY_EVERY),
        };
        match loss {
            Ok((bus, port)) => {
                // The system keeps a device's name taken until the dead line is closed.
                drop(port);
                lost.push(bus);
            }
            Err(RecvTimeoutError::Timeout) => lost.retain(|&bus| {
                let port = devices.get(bus).and_then(|device| device::open(device).ok());
                port.is_none_or(|port| returns.try_send((bus, port)).is_err())
            }),
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}
