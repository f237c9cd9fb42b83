//! Finds the servos on a line: asks every id, at one rate after another, in both protocols.
//!
//! The scan asks every id by itself, since servos that answer a broadcast talk over each other. It does not wait
//! for slow adapters: it asks the next id as soon as an answer would have crossed the line. A later answer still
//! carries its servo's id.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::error::{Address, ServiceError};
use super::line::ServicePort;
use crate::bus::ask::{Answer, Ask};
use crate::bus::frame::{Heard, Listener, exchange_bytes, request, status_bytes};
use crate::bus::protocols::IdentifyRequest;
use crate::bus::table::Identity;
use crate::bus::timing::wire_time;
use crate::model::Protocol;
use crate::platform::monotonic;
use crate::units::ServoId;

/// Extra time beyond the bytes: the longest return delay of a servo (254 x 2 us), and the jitter of USB, which
/// sends once a millisecond.
const SLACK: Duration = Duration::from_micros(508 + 1500);
/// Extra time in the second pass, after noise: as long as a slow adapter may hold an answer back.
const LONG_SLACK: Duration = Duration::from_millis(12);
/// Time to wait for answers after the last request: FTDI adapters hold them back for up to 16 ms.
const LINGER: Duration = Duration::from_millis(40);
const PIECE_BYTES: usize = 512;

/// How often a servo that answered is asked again, since one of two servos with one id is at times understood; and, once
/// an answer did not come whole, how often in all.
const AGAIN: u32 = 5;
const AGAIN_IN_DOUBT: u32 = 15;
/// Share of answers that do not come whole from which two servos are the cause, not a bad line.
const TWIN_SHARE: f64 = 0.3;

/// Rates to try, likely ones first.
pub fn scan_bauds(protocol: Protocol) -> &'static [u32] {
    protocol.spec().likely_rates
}

/// Approximate duration of one pass over `ids` ids at `baud`.
pub fn pass_time(protocol: Protocol, baud: u32, ids: usize) -> Duration {
    pace(protocol, baud, SLACK).saturating_mul(u32::try_from(ids).unwrap_or(u32::MAX)) + LINGER
}

/// A servo that answered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Its address.
    pub address: Address,
    /// The model and firmware that it reports.
    pub identity: Identity,
    /// True if more than one answer came: two servos have this id.
    pub is_twin: bool,
}

/// The result of one pass.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pass {
    /// Servos, by id.
    pub found: Vec<Found>,
    /// Ids from which only damaged answers came.
    pub damaged: Vec<ServoId>,
    /// True if the user broke it off.
    pub is_interrupted: bool,
}

impl ServicePort {
    /// Asks each of `ids` at one rate in one protocol; ends early once `stop` is set.
    ///
    /// # Errors
    /// If the line cannot be used, or not at this rate.
    pub fn scan(
        &mut self,
        protocol: Protocol,
        baud: u32,
        ids: &[ServoId],
        stop: &AtomicBool,
    ) -> Result<Pass, ServiceError> {
        self.set_baud(baud)?;
        let mut first = self.scan_once(protocol, baud, ids, SLACK, stop)?;
        if first.pass.is_interrupted {
            return Ok(first.pass);
        }
        for found in first.pass.found.iter_mut().filter(|found| !found.is_twin) {
            found.is_twin = self.is_twin(found.address)?;
        }
        if !first.has_noise {
            return Ok(first.pass);
        }
        // Two servos have talked at once, or the line is bad. Do not ask servos again that answered.
        let is_heard = |id: &ServoId| first.pass.found.iter().any(|found| found.address.id == *id);
        let unheard: Vec<ServoId> = ids.iter().copied().filter(|id| !is_heard(id)).collect();
        let second = self.scan_once(protocol, baud, &unheard, LONG_SLACK, stop)?;
        for mut found in second.pass.found {
            found.is_twin |= self.is_twin(found.address)?;
            first.pass.found.push(found);
        }
        first.pass.found.sort_by_key(|found| found.address.id);
        first.pass.damaged = second.pass.damaged;
        first.pass.is_interrupted = second.pass.is_interrupted;
        Ok(first.pass)
    }

    /// True if two servos answer at `address`. They talk at the same time, so that many of their answers are lost.
    fn is_twin(&mut self, address: Address) -> Result<bool, ServiceError> {
        let ask = question(address.protocol);
        let mut lost = 0;
        let mut asked = 0;
        while asked < if lost == 0 { AGAIN } else { AGAIN_IN_DOUBT } {
            asked += 1;
            let answer = self.ask_raw(address, &ask)?;
            lost += u32::from(!matches!(answer, Answer::Data(_)));
        }
        Ok(f64::from(lost) > TWIN_SHARE * f64::from(asked))
    }

    fn scan_once(
        &mut self,
        protocol: Protocol,
        baud: u32,
        ids: &[ServoId],
        slack: Duration,
        stop: &AtomicBool,
    ) -> Result<PassLog, ServiceError> {
        let ask = question(protocol);
        let (instruction, parameters, data_bytes) = ask.packet(protocol.spec());
        let pace = pace(protocol, baud, slack);
        let mut pass_listener = PassListener {
            protocol,
            baud,
            data_bytes,
            listener: Listener::new(protocol, data_bytes),
            log: PassLog::default(),
        };
        self.discard_input()?;
        let mut echoed = Vec::new();
        for id in ids {
            if stop.load(Ordering::Relaxed) {
                pass_listener.log.pass.is_interrupted = true;
                break;
            }
            let mut sent = Vec::new();
            request(protocol, &mut sent, *id, instruction, &parameters);
            self.send(&sent)?;
            let echo_bytes = if self.is_echoing() { sent.len() } else { 0 };
            echoed.push(sent);
            let noise = pass_listener.log.noise();
            self.hear_until(monotonic() + pace, Some(*id), &mut pass_listener)?;
            // At this slow pace, noise comes from the servo that was asked.
            if slack == LONG_SLACK
                && pass_listener.log.noise() > noise + echo_bytes
                && !pass_listener.has(*id)
            {
                pass_listener.log.pass.damaged.push(*id);
            }
        }
        self.hear_until(monotonic() + LINGER, None, &mut pass_listener)?;
        pass_listener.end();
        if pass_listener.log.is_echo_of(&echoed) {
            self.note_echo();
        }
        let echo_bytes = if self.is_echoing() { echoed.iter().map(Vec::len).sum() } else { 0 };
        pass_listener.log.has_noise =
            !pass_listener.log.pass.damaged.is_empty() || pass_listener.log.noise() > echo_bytes;
        Ok(pass_listener.log)
    }

    /// Listens until `deadline`, or until servo `asked` has answered.
    fn hear_until(
        &mut self,
        deadline: Duration,
        asked: Option<ServoId>,
        pass_listener: &mut PassListener,
    ) -> Result<(), ServiceError> {
        let mut piece = [0; PIECE_BYTES];
        loop {
            let count = self.receive(&mut piece)?;
            pass_listener.hear(piece.get(..count).unwrap_or_default());
            let has_answered = asked.is_some_and(|id| pass_listener.has(id));
            if count == 0 && (has_answered || monotonic() >= deadline) {
                return Ok(());
            }
            if count == 0 {
                self.wait_for_input(deadline)?;
            }
        }
    }
}

fn question(protocol: Protocol) -> Ask<'static> {
    match protocol.spec().identify {
        IdentifyRequest::Ping => Ask::Ping,
        IdentifyRequest::Read { brief, .. } => Ask::Read { start: 0, bytes: brief },
    }
}

fn pace(protocol: Protocol, baud: u32, slack: Duration) -> Duration {
    let (_, parameters, data_bytes) = question(protocol).packet(protocol.spec());
    wire_time(exchange_bytes(protocol, parameters.len(), data_bytes), baud) + slack
}

/// The bytes heard in one pass, and what they contained.
#[derive(Debug, Default)]
struct PassLog {
    pass: Pass,
    /// All received bytes.
    bytes: Vec<u8>,
    /// Number of bytes in good answers.
    good: usize,
    has_noise: bool,
}

impl PassLog {
    /// Number of bytes outside good answers.
    fn noise(&self) -> usize {
        self.bytes.len().saturating_sub(self.good)
    }

    fn is_echo_of(&self, sent: &[Vec<u8>]) -> bool {
        let holds = |request: &Vec<u8>| self.bytes.windows(request.len()).any(|bytes| bytes == request);
        !sent.is_empty() && sent.iter().take(4).all(holds)
    }
}

struct PassListener {
    protocol: Protocol,
    baud: u32,
    data_bytes: usize,
    listener: Listener,
    log: PassLog,
}

impl PassListener {
    fn hear(&mut self, bytes: &[u8]) {
        self.log.bytes.extend(bytes);
        let mut packets = Vec::new();
        self.listener.hear(bytes, |packet| packets.push(packet));
        packets.into_iter().for_each(|packet| self.take(packet));
    }

    fn end(&mut self) {
        let mut packets = Vec::new();
        self.listener.end(|packet| packets.push(packet));
        packets.into_iter().for_each(|packet| self.take(packet));
        let pass = &mut self.log.pass;
        pass.found.sort_by_key(|found| found.address.id);
        pass.damaged.sort();
        pass.damaged.dedup();
        pass.damaged.retain(|id| pass.found.iter().all(|found| found.address.id != *id));
    }

    fn take(&mut self, packet: Heard) {
        match packet {
            Heard::Status { id, data, .. } if data.len() == self.data_bytes => {
                let Some(identity) = (self.protocol.spec().identity)(&data) else { return };
                self.log.good += status_bytes(self.protocol, data.len());
                let address = Address { protocol: self.protocol, baud: self.baud, id };
                match self.log.pass.found.iter_mut().find(|found| found.address.id == id) {
                    Some(found) => found.is_twin = true,
                    None => self.log.pass.found.push(Found { address, identity, is_twin: false }),
                }
            }
            Heard::Status { .. } => {}
            Heard::Damaged(id) => self.log.pass.damaged.push(id),
        }
    }

    fn has(&self, id: ServoId) -> bool {
        self.log.pass.found.iter().any(|found| found.address.id == id)
    }
}
