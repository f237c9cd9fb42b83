//! One bus: adapter, line, servos. In: bytes from the host and scripted faults. Out: bytes for the host.

use std::collections::VecDeque;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::config::BusConfig;
use crate::decoder::{LineDecoder, Received, Request};
use crate::error::Unplugged;
use crate::faults::{BusFaults, FaultKind};
use crate::model::Protocol;
use crate::reply::{MISSING_GUARD_NS, Slot};
use crate::servo::Servo;
use crate::supply::Supply;
use crate::wire::{Sender, Wire, WireByte};

/// A packet with a pause this long inside is dropped, so that noise cannot swallow the packet after it. Our
/// choice; the makers state none.
const PACKET_PAUSE_NS: u64 = 10_000_000;
/// Most bytes of one piece of noise.
const NOISE_BYTES_MAX: usize = 8;
/// Most bytes an adapter hands over at once: a full-speed USB packet less the two status bytes FTDI's adapters
/// put before them (FTDI AN232B-04).
const HANDOVER_BYTES_MAX: usize = 62;

/// A request that every servo of a bus has heard complete, as it crossed the line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HeardRequest {
    /// When its last byte had crossed, ns since power-up.
    pub at_ns: u64,
    /// Id of its addressee; 0xFE for all.
    pub id: u8,
    /// Instruction, in the protocol's own numbers.
    pub instruction: u8,
    /// Bytes after the instruction, without checksum or stuffing.
    pub parameters: Vec<u8>,
}

#[derive(Debug)]
pub(crate) struct Bus {
    pub(crate) name: String,
    pub(crate) servos: Vec<Servo>,
    pub(crate) wire: Wire,
    pub(crate) faults: BusFaults,
    pub(crate) supply: Supply,
    protocol: Protocol,
    /// Register code of the host's rate; `None` if the servos know no such rate.
    baud_code: Option<i64>,
    decoder: Box<dyn LineDecoder>,
    last_byte_ns: u64,
    /// True if a byte from the host was corrupted since the last complete request.
    is_spoilt: bool,
    latency_ns: u64,
    /// Time until which the adapter sends the bytes it already has from the host.
    host_until_ns: u64,
    /// Bytes for the host with the arrival time of each, in order.
    inbox: VecDeque<(u64, u8)>,
    /// Requests so far; `None` unless the caller wants them kept.
    pub(crate) requests: Option<Vec<HeardRequest>>,
    rng: Pcg64Mcg,
}

impl Bus {
    pub(crate) fn new(config: &BusConfig, servos: Vec<Servo>, faults: BusFaults, seed: u64) -> Bus {
        Bus {
            name: config.name.clone(),
            servos,
            wire: Wire::new(config.baud),
            faults,
            supply: Supply::new(config.supply_v, config.supply_ohm),
            protocol: config.protocol,
            baud_code: config.protocol.baud_code(config.baud),
            decoder: (config.protocol.spec().decoder)(),
            last_byte_ns: 0,
            is_spoilt: false,
            latency_ns: u64::from(config.adapter_latency_us) * 1_000,
            host_until_ns: 0,
            inbox: VecDeque::new(),
            requests: None,
            rng: Pcg64Mcg::seed_from_u64(seed),
        }
    }

    pub(crate) fn send(&mut self, now_ns: u64, bytes: &[u8]) -> Result<(), Unplugged> {
        self.check_plugged(now_ns)?;
        let start = now_ns.max(self.host_until_ns);
        self.host_until_ns = self.wire.talk(Sender::Host, start, bytes.to_vec());
        Ok(())
    }

    pub(crate) fn receive(&mut self, now_ns: u64, into: &mut [u8]) -> Result<usize, Unplugged> {
        self.check_plugged(now_ns)?;
        let count = self.pending(now_ns).min(into.len());
        for (place, (_, byte)) in into.iter_mut().zip(self.inbox.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    pub(crate) fn pending(&self, now_ns: u64) -> usize {
        self.inbox.partition_point(|&(at, _)| at <= now_ns)
    }

    /// When the host gets its next byte; may be in the past.
    pub(crate) fn first_arrival_ns(&self) -> Option<u64> {
        self.inbox.front().map(|&(at, _)| at)
    }

    /// Next time to look at this bus, for a host that is served in pieces: when a burst has crossed, or the
    /// adapter has a piece to hand over.
    pub(crate) fn next_handover_ns(&self) -> Option<u64> {
        let piece = self.inbox.len().min(HANDOVER_BYTES_MAX).checked_sub(1);
        let arrival = piece.and_then(|last| self.inbox.get(last)).map(|&(at, _)| at);
        arrival.into_iter().chain(self.wire.next_burst_end_ns()).min()
    }

    /// Sets the rate at which the host talks and listens from now on, bit/s.
    pub(crate) fn set_host_baud(&mut self, baud: u32) {
        self.wire.set_baud(baud);
        self.baud_code = self.protocol.baud_code(baud);
    }

    pub(crate) fn is_unplugged(&self, now_ns: u64) -> bool {
        self.faults.is_unplugged(now_ns)
    }

    fn check_plugged(&self, now_ns: u64) -> Result<(), Unplugged> {
        if self.is_unplugged(now_ns) { Err(Unplugged) } else { Ok(()) }
    }

    /// Switches a servo's supply on or off; when off, the servo's unsent bytes are dropped.
    pub(crate) fn set_power(&mut self, place: usize, has_power: bool, now_ns: u64) {
        let was_awake = self.servos[place].is_awake();
        self.servos[place].set_power(has_power, now_ns);
        if was_awake && !self.servos[place].is_awake() {
            self.wire.cut(Sender::Servo(place));
        }
    }

    /// Disconnects the servo at this index, if there is one; its unsent bytes are dropped.
    pub(crate) fn pull_servo_out(&mut self, place: usize) {
        if let Some(servo) = self.servos.get_mut(place) {
            servo.pull_out();
            self.wire.cut(Sender::Servo(place));
        }
    }

    /// When the next event on this bus happens by itself.
    pub(crate) fn next_ns(&self) -> Option<u64> {
        self.wire.next_ns().into_iter().chain(self.faults.next_unplug_ns()).min()
    }

    /// Carries out that event.
    pub(crate) fn step(&mut self) {
        let wire_ns = self.wire.next_ns();
        if let Some(unplug_ns) = self.faults.next_unplug_ns()
            && wire_ns.is_none_or(|at| unplug_ns <= at)
        {
            // Bytes on their way in either direction are lost with the adapter.
            self.faults.take_unplug();
            self.wire.cut(Sender::Host);
            self.host_until_ns = unplug_ns;
            self.inbox.clear();
            return;
        }
        let Some(crossed) = self.wire.cross(&mut self.rng) else { return };
        let reaches_host = match crossed.talker {
            Sender::Host => self.faults.echoes(crossed.at_ns),
            Sender::Servo(_) => true,
        };
        if reaches_host && !self.faults.is_unplugged(crossed.at_ns) {
            self.inbox.push_back((crossed.at_ns + self.latency_ns, crossed.byte));
        }
        if crossed.talker == Sender::Host {
            self.listen(crossed);
        }
    }

    /// Lets the servos hear the host; they recognise status packets of their own kind and skip them.
    fn listen(&mut self, crossed: WireByte) {
        let is_late = crossed.at_ns > self.last_byte_ns + PACKET_PAUSE_NS;
        self.last_byte_ns = crossed.at_ns;
        self.is_spoilt |= crossed.is_spoilt;
        let now_ns = crossed.at_ns;
        if is_late {
            self.decoder.reset();
        }
        let Some(packet) = self.decoder.push(crossed.byte) else { return };
        if let (Some(requests), Received::Request(request)) = (&mut self.requests, &packet) {
            let Request { id, instruction, parameters } = request.clone();
            requests.push(HeardRequest { at_ns: now_ns, id, instruction, parameters });
        }
        self.mistake_ids(now_ns);
        for (number, hears) in self.hearers(now_ns).into_iter().enumerate() {
            let slots = (self.protocol.spec().answer)(&packet, &mut self.servos, &hears, now_ns);
            // A twin that talks at the same time: now and then the line carries the other's answer whole.
            if number > 0 && self.rng.random_bool(self.protocol.spec().drowned_twin_share) {
                continue;
            }
            self.schedule(now_ns, slots);
        }
        self.note_misled();
    }

    /// Notes, after a request, which servos took a command that was not meant for them.
    fn note_misled(&mut self) {
        let is_spoilt = std::mem::take(&mut self.is_spoilt);
        for (servo, home_id) in self.servos.iter_mut().zip(&self.faults.home_ids) {
            if std::mem::take(&mut servo.takes_now) {
                servo.is_misled = is_spoilt || servo.wrong_id.is_some_and(|wrong_id| wrong_id != *home_id);
            }
        }
    }

    /// The servo that answers to this id now.
    pub(crate) fn servo_with_id(&self, id: u8) -> Option<usize> {
        self.servos.iter().position(|servo| servo.id() == id)
    }

    /// Servos that understand the line: awake, at the right baud rate, and not silenced by a fault. They come
    /// in groups in which no two have the same id: servos with equal ids do not know of each other, and talk
    /// at the same time.
    fn hearers(&self, now_ns: u64) -> Vec<Vec<bool>> {
        let mut groups = vec![vec![false; self.servos.len()]];
        let mut with_id = [0_usize; 256];
        for (index, servo) in self.servos.iter().enumerate() {
            if !servo.is_awake()
                || !self.is_tuned(servo)
                || self.faults.has(now_ns, self.home_id(index), FaultKind::Silent)
            {
                continue;
            }
            let group = &mut with_id[usize::from(servo.id())];
            if *group == groups.len() {
                groups.push(vec![false; self.servos.len()]);
            }
            groups[*group][index] = true;
            *group += 1;
        }
        groups
    }

    /// Whether a servo listens at the host's rate.
    pub(crate) fn is_tuned(&self, servo: &Servo) -> bool {
        Some(servo.baud_code()) == self.baud_code
    }

    /// Makes servos take another id for their own if the fault script says so.
    fn mistake_ids(&mut self, now_ns: u64) {
        for (servo, home_id) in self.servos.iter_mut().zip(&self.faults.home_ids) {
            servo.wrong_id = self.faults.wrong_id(now_ns, *home_id);
        }
    }

    /// Voltage at the servos, V: the one a fault forces, or the supply's.
    pub(crate) fn volts(&self, now_ns: u64) -> f64 {
        self.faults.volts(now_ns).unwrap_or_else(|| self.supply.volts())
    }

    /// The id by which a fault script names the servo: the one it was built with.
    pub(crate) fn home_id(&self, servo: usize) -> u8 {
        self.faults.home_ids[servo]
    }

    fn schedule(&mut self, request_end_ns: u64, slots: Vec<Slot>) {
        let mut at = request_end_ns;
        for slot in slots {
            match slot {
                Slot::Missing { bytes } => at += self.wire.duration_ns(bytes) + MISSING_GUARD_NS,
                Slot::Talk { servo, mut bytes, delay_ns, starts_packet } => {
                    let id = self.home_id(servo);
                    at += delay_ns + self.faults.late_ns(at, id);
                    // A servo answers one request after the other.
                    at = at.max(self.wire.busy_until_ns(Sender::Servo(servo)));
                    if self.faults.has(at, id, FaultKind::BitFlip) {
                        let place = self.rng.random_range(0..bytes.len() * 8);
                        bytes[place / 8] ^= 1 << (place % 8);
                    }
                    if self.faults.has(at, id, FaultKind::Garbled) {
                        bytes.iter_mut().for_each(|byte| *byte ^= self.rng.random_range(1..=255u8));
                    }
                    let scrambled_share = self.faults.scrambled_share(at, id);
                    if scrambled_share > 0.0 && self.rng.random_bool(scrambled_share) {
                        // Bytes that do not begin a packet have no header.
                        let first_data_byte =
                            if starts_packet { self.protocol.spec().first_data_byte } else { 0 };
                        let begun = first_data_byte.min(bytes.len());
                        bytes[begun..].iter_mut().for_each(|byte| *byte = self.rng.random());
                    }
                    if self.faults.has(at, id, FaultKind::CutShort) {
                        bytes.truncate(self.rng.random_range(1..bytes.len().max(2)));
                    }
                    if starts_packet && self.faults.has(at, id, FaultKind::Noise) {
                        let count = self.rng.random_range(1..=NOISE_BYTES_MAX);
                        bytes.splice(0..0, (0..count).map(|_| self.rng.random::<u8>()));
                    }
                    at = self.wire.talk(Sender::Servo(servo), at, bytes);
                }
            }
        }
    }
}
