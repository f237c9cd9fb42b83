//! A serial line for requests to single servos: rates, bytes, and one request with its answer.
//!
//! Requests go through a library by others where the protocol has one. Two things use our own packets: finding the
//! servos, and finding out whether the adapter echoes. If it does, all requests use them, since a library does not
//! expect an echo.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::io::Errno;
use serial2::SerialPort;
use serialport::TTYPort;

use super::error::{Address, ServiceError};
use crate::bus::ask::{Answer, Ask, Library};
use crate::bus::frame::{Heard, Listener, exchange_bytes, request};
use crate::bus::serial::{Device, OpenCause, device};
use crate::bus::timing::wire_time;
use crate::model::Protocol;
use crate::platform::{PollList, Readiness, descriptor, monotonic, sleep_until};

/// Rate at which a line is opened, since every adapter supports it; the real rate is set before anything is sent.
const OPENING_BAUD: u32 = 57_600;
/// Extra time for an answer, beyond that of its bytes: FTDI adapters hold it back for up to 16 ms, and a servo that
/// first stores a setting takes longer.
const PATIENCE: Duration = Duration::from_millis(40);
/// Number of attempts at a request.
const TRIES: u32 = 3;
/// Size of the pieces in which received bytes are moved.
const PIECE_BYTES: usize = 512;

/// A serial line, reserved for this program, for requests to single servos outside the loop.
#[derive(Debug)]
pub struct ServicePort {
    path: PathBuf,
    line: TTYPort,
    poll_list: PollList,
    baud: u32,
    is_echoing: bool,
    /// Sets the line's rate, on a copy of its descriptor: any rate, even one the system has no name for.
    rate: SerialPort,
    /// The libraries of the protocols that have one; each works on a copy of the line's descriptor.
    libraries: Vec<(Protocol, Box<dyn Library>)>,
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
        let unusable = |reason| open_error(OpenCause::Unusable { reason });
        let copy = descriptor(&line).try_clone_to_owned().map_err(|error| unusable(error.to_string()))?;
        let mut libraries = Vec::new();
        for protocol in Protocol::all() {
            if let Some(open) = protocol.spec().library {
                libraries.push((protocol, open(&line).map_err(unusable)?));
            }
        }
        let mut poll_list = PollList::new(1);
        poll_list.set(0, Some(&line));
        Ok(ServicePort {
            path: path.to_owned(),
            line,
            poll_list,
            baud: OPENING_BAUD,
            is_echoing: false,
            rate: SerialPort::from(copy),
            libraries,
        })
    }

    /// The device, as named when opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// True once the adapter was found to echo.
    pub fn is_echoing(&self) -> bool {
        self.is_echoing
    }

    /// Sets the line's rate, bit/s.
    pub(super) fn set_baud(&mut self, baud: u32) -> Result<(), ServiceError> {
        if baud == self.baud {
            return Ok(());
        }
        self.set_rate(baud).map_err(|error| match is_gone(&self.path) {
            true => self.gone(),
            false => ServiceError::Baud { path: self.path.clone(), baud, reason: error.to_string() },
        })?;
        self.baud = baud;
        Ok(())
    }

    fn set_rate(&mut self, baud: u32) -> io::Result<()> {
        let mut settings = self.rate.get_configuration()?;
        settings.set_baud_rate(baud)?;
        self.rate.set_configuration(&settings)?;
        self.libraries.iter_mut().try_for_each(|(_, library)| library.set_baud(baud))
    }

    /// Sends a request to the servo at `address` up to three times, or once if repeating it would do harm.
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

    /// Waits, after a repeated request, for late answers to all its repetitions: one of them could pass for the
    /// answer to the next request.
    pub(super) fn let_late_answers_pass(&mut self, repetitions: u32) -> Result<(), ServiceError> {
        if repetitions > 0 {
            self.pause(PATIENCE);
            self.discard_input()?;
        }
        Ok(())
    }

    fn ask_once(&mut self, address: Address, ask: &Ask<'_>) -> Result<Answer, ServiceError> {
        if self.is_echoing {
            return self.ask_raw(address, ask);
        }
        self.set_baud(address.baud)?;
        let gone = ServiceError::Gone { path: self.path.clone() };
        match self.libraries.iter_mut().find(|(of, _)| *of == address.protocol) {
            Some((_, library)) => library.ask(address.id, ask).map_err(|_| gone),
            None => self.ask_raw(address, ask),
        }
    }

    /// Sends the request once with our own packets, and notices an echo.
    pub(super) fn ask_raw(&mut self, address: Address, ask: &Ask<'_>) -> Result<Answer, ServiceError> {
        self.set_baud(address.baud)?;
        let spec = address.protocol.spec();
        let (instruction, parameters, data_bytes) = ask.packet(spec);
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
                answer.take(spec, address.id, data_bytes, packet);
            });
        }
        if answer == Answer::Missing {
            listener.hear(&echo.rest(), |packet| answer.take(spec, address.id, data_bytes, packet));
            listener.end(|packet| answer.take(spec, address.id, data_bytes, packet));
        }
        // Two servos that talk at once spoil each other's headers, too.
        if answer == Answer::Missing && is_noisy && !is_understood {
            answer = Answer::Damaged;
        }
        self.is_echoing |= echo.is_whole();
        Ok(answer)
    }

    /// Discards the received bytes.
    pub(super) fn discard_input(&mut self) -> Result<(), ServiceError> {
        let mut piece = [0; PIECE_BYTES];
        while self.receive(&mut piece)? > 0 {}
        Ok(())
    }

    /// Sends `bytes`.
    pub(super) fn send(&mut self, bytes: &[u8]) -> Result<(), ServiceError> {
        match rustix::io::write(descriptor(&self.line), bytes) {
            // A line that does not drain shows up as servos that do not answer.
            Ok(_) | Err(Errno::AGAIN | Errno::INTR) => Ok(()),
            Err(_) => Err(self.gone()),
        }
    }

    /// Takes the received bytes; never waits.
    pub(super) fn receive(&mut self, into: &mut [u8]) -> Result<usize, ServiceError> {
        match rustix::io::read(descriptor(&self.line), into) {
            Ok(0) => Err(self.gone()),
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(_) => Err(self.gone()),
        }
    }

    /// Waits for received bytes, at most until `deadline` on the monotonic clock.
    pub(super) fn wait_for_input(&mut self, deadline: Duration) -> Result<(), ServiceError> {
        self.poll_list.wait_until(deadline);
        match self.poll_list.readiness(0) {
            Readiness::HungUp => Err(self.gone()),
            Readiness::Quiet | Readiness::Input => Ok(()),
        }
    }

    /// Waits for `time`.
    pub(crate) fn pause(&self, time: Duration) {
        sleep_until(monotonic() + time);
    }

    /// Notes that the adapter echoes.
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

/// Removes the echo of a request from the received bytes, if there is one.
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

    /// The bytes that are no echo, and cannot become one.
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

    /// The bytes that began like an echo but were none.
    fn rest(&mut self) -> Vec<u8> {
        if self.is_over {
            return Vec::new();
        }
        self.is_over = true;
        std::mem::take(&mut self.held)
    }
}
