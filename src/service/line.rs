//! A serial line to ask single servos on: rates, bytes, and one question with its answer.
//!
//! Dynamixel servos are asked through the crate `dynamixel2`, but for finding out who is there and whether the adapter
//! hands back what is sent: that is done with our own packets, and so is all the rest on an adapter that does, since
//! the crate does not expect an echo.

use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::io::Errno;
use serialport::TTYPort;

use super::ask::{Answer, Ask};
use super::dynamixel;
use super::error::{Address, ServiceError};
use crate::bus::frame::{Heard, Listener, exchange_bytes, request};
use crate::bus::serial::{Device, device};
use crate::bus::timing::wire_time;
use crate::model::Protocol;
use crate::platform::{PollList, Readiness, descriptor, monotonic, sleep_until};

/// The rate a line is opened at, which every adapter has; another is set before anything is sent.
const OPENING_BAUD: u32 = 57_600;
/// How much longer than its bytes an answer may take: FTDI adapters hold it back for up to 16 ms, and a servo that
/// stores a setting first takes some more.
const PATIENCE: Duration = Duration::from_millis(40);
/// How often a question is asked before it is given up.
const TRIES: u32 = 3;
/// Received bytes are moved in pieces of this size.
const PIECE_BYTES: usize = 512;

/// A serial line, open for this program alone, on which single servos are asked outside the loop.
#[derive(Debug)]
pub struct ServicePort {
    path: PathBuf,
    line: TTYPort,
    poll_list: PollList,
    baud: u32,
    is_echoing: bool,
    /// On a copy of the line's descriptor.
    dynamixel: dynamixel::Bus,
}

impl ServicePort {
    /// Opens the serial device at `path`.
    ///
    /// # Errors
    /// [`ServiceError::Open`] says why it cannot be used.
    pub fn open(path: &Path) -> Result<ServicePort, ServiceError> {
        let as_device =
            Device { bus: String::new(), path: path.to_owned(), baud: OPENING_BAUD, adapter_latency_us: 0 };
        let open_error = |cause| ServiceError::Open { path: path.to_owned(), cause };
        let line = device::open(&as_device).map_err(open_error)?;
        let dynamixel = dynamixel::open(&line)
            .map_err(|reason| open_error(crate::bus::serial::OpenCause::Unusable { reason }))?;
        let mut poll_list = PollList::new(1);
        poll_list.set(0, Some(&line));
        Ok(ServicePort {
            path: path.to_owned(),
            line,
            poll_list,
            baud: OPENING_BAUD,
            is_echoing: false,
            dynamixel,
        })
    }

    /// The device, as it was named when opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the adapter was heard to hand back what is sent.
    pub fn is_echoing(&self) -> bool {
        self.is_echoing
    }

    /// Sets the line's rate, bit/s.
    pub(super) fn set_baud(&mut self, baud: u32) -> Result<(), ServiceError> {
        if baud == self.baud {
            return Ok(());
        }
        self.dynamixel.set_baud_rate(baud).map_err(|error| match is_gone(&self.path) {
            true => self.gone(),
            false => ServiceError::Baud { path: self.path.clone(), baud, reason: error.to_string() },
        })?;
        self.baud = baud;
        Ok(())
    }

    /// Asks the servo at `address` up to three times, or once where twice would do harm.
    pub(super) fn ask(&mut self, address: Address, ask: &Ask<'_>) -> Result<Vec<u8>, ServiceError> {
        let tries = if ask.is_repeatable() { TRIES } else { 1 };
        let mut is_damaged = false;
        for number in 0..tries {
            match self.ask_once(address, ask)? {
                Answer::Data(data) => {
                    self.let_late_answers_pass(number)?;
                    return Ok(data);
                }
                Answer::Refused(error) => {
                    return Err(ServiceError::Refused { address, request: ask.to_string(), error });
                }
                Answer::Damaged => is_damaged = true,
                Answer::Missing => {}
            }
        }
        let request = ask.to_string();
        Err(match is_damaged {
            true => ServiceError::Damaged { address, request },
            false => ServiceError::NoAnswer { address, request },
        })
    }

    /// After a question that was asked more than once, the answers to all of them may still come, and one of them
    /// could pass for the answer to the next question.
    pub(super) fn let_late_answers_pass(&mut self, repetitions: u32) -> Result<(), ServiceError> {
        if repetitions > 0 {
            self.pause(PATIENCE);
            self.discard_input()?;
        }
        Ok(())
    }

    fn ask_once(&mut self, address: Address, ask: &Ask<'_>) -> Result<Answer, ServiceError> {
        if address.protocol == Protocol::Dynamixel && !self.is_echoing {
            self.set_baud(address.baud)?;
            return dynamixel::ask(&mut self.dynamixel, address.id, ask).map_err(|_| self.gone());
        }
        self.ask_raw(address, ask)
    }

    /// Asks once with our own packets, and notices an echo.
    pub(super) fn ask_raw(&mut self, address: Address, ask: &Ask<'_>) -> Result<Answer, ServiceError> {
        self.set_baud(address.baud)?;
        let (instruction, parameters, data_bytes) = ask.packet(address.protocol);
        let mut sent = Vec::new();
        request(address.protocol, &mut sent, address.id, instruction, &parameters);
        let bytes = exchange_bytes(address.protocol, parameters.len(), data_bytes);
        let deadline = monotonic() + wire_time(bytes, address.baud) + PATIENCE;

        self.discard_input()?;
        self.send(&sent)?;
        let mut listener = Listener::new(address.protocol, data_bytes);
        let mut answer = Answer::Missing;
        let mut echo = Echo::new(&sent);
        let (mut is_noisy, mut is_understood) = (false, false);
        while !matches!(answer, Answer::Data(_) | Answer::Refused(_)) && monotonic() < deadline {
            self.wait_for_input(deadline)?;
            let mut piece = [0; PIECE_BYTES];
            let count = self.receive(&mut piece)?;
            let heard = echo.strip(piece.get(..count).unwrap_or_default());
            is_noisy |= !heard.is_empty();
            listener.hear(&heard, |packet| {
                is_understood |= matches!(packet, Heard::Status { .. });
                answer.take(address, data_bytes, packet);
            });
        }
        if answer == Answer::Missing {
            listener.hear(&echo.rest(), |packet| answer.take(address, data_bytes, packet));
            listener.end(|packet| answer.take(address, data_bytes, packet));
        }
        // Two that talk at once spoil each other's headers, too.
        if answer == Answer::Missing && is_noisy && !is_understood {
            answer = Answer::Damaged;
        }
        self.is_echoing |= echo.is_whole();
        Ok(answer)
    }

    /// Throws away what has arrived.
    pub(super) fn discard_input(&mut self) -> Result<(), ServiceError> {
        let mut piece = [0; PIECE_BYTES];
        while self.receive(&mut piece)? > 0 {}
        Ok(())
    }

    /// Hands `bytes` to the line.
    pub(super) fn send(&mut self, bytes: &[u8]) -> Result<(), ServiceError> {
        match rustix::io::write(descriptor(&self.line), bytes) {
            // A line that does not drain shows as servos that do not answer.
            Ok(_) | Err(Errno::AGAIN | Errno::INTR) => Ok(()),
            Err(_) => Err(self.gone()),
        }
    }

    /// Takes what has arrived; never waits.
    pub(super) fn receive(&mut self, into: &mut [u8]) -> Result<usize, ServiceError> {
        match rustix::io::read(descriptor(&self.line), into) {
            Ok(0) => Err(self.gone()),
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(_) => Err(self.gone()),
        }
    }

    /// Waits until something has arrived, at most until `deadline` on the monotonic clock.
    pub(super) fn wait_for_input(&mut self, deadline: Duration) -> Result<(), ServiceError> {
        self.poll_list.wait_until(deadline);
        match self.poll_list.readiness(0) {
            Readiness::HungUp => Err(self.gone()),
            Readiness::Quiet | Readiness::Input => Ok(()),
        }
    }

    /// Lets some time pass.
    pub(crate) fn pause(&self, time: Duration) {
        sleep_until(monotonic() + time);
    }

    /// An echo was heard.
    pub(super) fn note_echo(&mut self) {
        self.is_echoing = true;
    }

    fn gone(&self) -> ServiceError {
        ServiceError::Gone { path: self.path.clone() }
    }
}

fn is_gone(path: &Path) -> bool {
    !path.exists()
}

/// Takes the echo of a request off what arrives, if there is one.
struct Echo<'a> {
    ahead: &'a [u8],
    held: Vec<u8>,
    is_over: bool,
}

impl Echo<'_> {
    fn new(sent: &[u8]) -> Echo<'_> {
        Echo { ahead: sent, held: Vec::new(), is_over: false }
    }

    fn is_whole(&self) -> bool {
        self.is_over && self.ahead.is_empty()
    }

    /// What is not, and cannot become, an echo.
    fn strip(&mut self, heard: &[u8]) -> Vec<u8> {
        if self.is_over {
            return heard.to_vec();
        }
        let equal = self.ahead.iter().zip(heard).take_while(|(sent, heard)| sent == heard).count();
        let (same, other) = heard.split_at(equal);
        self.ahead = self.ahead.get(equal..).unwrap_or_default();
        self.held.extend(same);
        if self.ahead.is_empty() {
            self.is_over = true;
            return other.to_vec();
        }
        if other.is_empty() {
            return Vec::new();
        }
        self.is_over = true;
        let mut all = std::mem::take(&mut self.held);
        all.extend(other);
        all
    }

    /// What only began like one.
    fn rest(&mut self) -> Vec<u8> {
        if self.is_over {
            return Vec::new();
        }
        self.is_over = true;
        std::mem::take(&mut self.held)
    }
}
