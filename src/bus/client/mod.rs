//! One bus: the bytes to send each cycle, and the replies.
//!
//! Takes goals and received bytes. Returns bytes to send, a [`Slot`] for each servo, and how long to wait.
//! Does no I/O and has no clock; allocates nothing after construction; never panics.

mod echo;
mod inbox;
mod read_mode;

use std::time::Duration;

use super::codec::Codec;
use super::frame::status_bytes;
use super::register::{encode, ordered};
use super::timing::{
    CycleCost, GroupRead, cycle_cost, reply_deadline, single_read_time, sync_write_bytes, wire_time,
};
use super::{ServoGoal, Slot};
use crate::model::servo_model::Register;
use crate::model::{Bus, Registers};
use crate::signals::Question;
use crate::units::ServoId;
use echo::EchoFilter;
pub(super) use inbox::Answer;
use inbox::{Awaited, Inbox, RequestKind};
use read_mode::ReadMode;

/// Traffic on one bus since the start, in exchanges. Single transactions are not counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Exchanges finished, including those that could not be sent.
    pub exchanges: u64,
    /// Bytes handed to the port.
    pub bytes_out: u64,
    /// Bytes received from the port, including echo and noise.
    pub bytes_in: u64,
    /// Slots that stayed [`Slot::Missing`].
    pub missing: u64,
    /// Slots that ended as [`Slot::Corrupt`].
    pub corrupt: u64,
}

/// How much longer than its bytes a single transaction may take. A long timeout is cheap outside the loop: only
/// a silent servo costs it, and a servo that first stores a setting permanently answers late.
const TRANSACTION_PATIENCE: Duration = Duration::from_millis(20);

/// The client of one bus.
#[derive(Debug)]
pub(super) struct BusClient {
    bus: Bus,
    codec: Codec,
    inbox: Inbox,
    request: Vec<u8>,
    echo: EchoFilter,
    read_mode: ReadMode,
    plain_cost: CycleCost,
    fast_cost: CycleCost,
    reply_deadline: Duration,
    counters: Counters,
    /// For each servo, in the order of the ids: true if the next cycle's request writes its settings again.
    renewal: Vec<bool>,
    /// The bus watchdog value that the renewal writes.
    watchdog_units: Option<u8>,
    /// The servo that the next cycle's request restarts.
    restart: Option<ServoId>,
    /// The question that the next cycle's request asks instead of feedback.
    question: Option<Question>,
    /// Where servos are asked one by one: index of the servo whose turn it is.
    turn: usize,
}

impl BusClient {
    /// The client of `bus`, whose servos have `registers` and these `ids` (each once). Allocates all memory
    /// here. At most 242 servos fit a Feetech sync read; any after those would stay [`Slot::Missing`].
    pub(super) fn new(bus: &Bus, registers: &'static Registers, ids: &[ServoId]) -> BusClient {
        let plain_cost = cycle_cost(bus, registers, ids.len(), GroupRead::Plain);
        let fast_cost = cycle_cost(bus, registers, ids.len(), GroupRead::Fast);
        // Some cycles write the settings again, and the watchdog twice. Stuffing makes a packet longer by a third
        // at most; 64 bytes hold any single request.
        let settings =
            registers.preparation.iter().map(|(register, _)| register).chain(&registers.bus_watchdog);
        let renewal_bytes: usize =
            settings.map(|register| sync_write_bytes(bus.protocol, ids.len(), *register)).sum();
        let request_bytes = (plain_cost.bytes_out + renewal_bytes) * 4 / 3 + 64;
        BusClient {
            bus: bus.clone(),
            codec: Codec::new(bus.protocol, registers, ids.len()),
            inbox: Inbox::new(bus.protocol, registers, ids),
            request: Vec::with_capacity(request_bytes),
            echo: EchoFilter::default(),
            read_mode: match bus.protocol.spec().fast_read {
                None => ReadMode::PlainOnly,
                Some(_) => ReadMode::new(),
            },
            plain_cost,
            fast_cost,
            reply_deadline: Duration::ZERO,
            counters: Counters::default(),
            renewal: vec![false; ids.len()],
            watchdog_units: None,
            restart: None,
            question: None,
            turn: 0,
        }
    }

    /// Name of the bus.
    pub(super) fn name(&self) -> &str {
        &self.bus.name
    }

    /// The registers of the servos on this bus.
    pub(super) fn registers(&self) -> &'static Registers {
        self.inbox.registers
    }

    /// Meaning and cure of the number of a refusal.
    pub(super) fn refusal(&self, error: u8) -> &'static str {
        (self.bus.protocol.spec().refusal)(error)
    }

    /// Begins an exchange and returns what to send, in one piece. `goals` are in the order of the ids; a
    /// servo without one goes limp.
    ///
    /// Every cycle sends everything, though the servo already holds most of it: if a write is lost on the
    /// line, the next cycle repairs it.
    ///
    /// The order is settings, torque limit, goal, torque enable: a servo that wakes has its new limit and goal
    /// and never jumps to an old one.
    pub(super) fn begin_cycle(&mut self, goals: &[ServoGoal]) -> &[u8] {
        let question = self.question.take();
        self.restart(Awaited::Feedback(question));
        let Inbox { ids, registers, .. } = &self.inbox;
        let (codec, request) = (&mut self.codec, &mut self.request);
        if ids.is_empty() {
            return &[];
        }
        let goals = || ids.iter().zip(goals.iter().copied().chain(std::iter::repeat(ServoGoal::Limp)));
        let moving = || {
            goals().filter_map(|(id, goal)| match goal {
                ServoGoal::Move { position, torque_limit } => Some((*id, position, torque_limit)),
                ServoGoal::Limp | ServoGoal::Keep => None,
            })
        };
        let switched = || goals().filter(|(_, goal)| *goal != ServoGoal::Keep);
        let raw = |register, value| ordered(encode(register, value), register, registers.is_big_endian);
        let limit = |(id, _, limit)| (id, raw(registers.torque_limit, i64::from(limit)));
        let position = |(id, position, _)| (id, raw(registers.goal_position, i64::from(position)));
        let enable = |(id, goal): (&ServoId, _)| (*id, u64::from(goal != ServoGoal::Limp));
        let renewal = &mut self.renewal;
        if renewal.contains(&true) {
            let settings = registers.preparation.iter().filter(|(to, _)| *to != registers.torque_enable);
            let units = registers.bus_watchdog.zip(self.watchdog_units.take().map(i64::from));
            for (register, value) in settings.copied().chain(units) {
                let renewed = ids.iter().zip(renewal.iter()).filter(|(_, is_renewed)| **is_renewed);
                codec.sync_write(request, register, renewed.map(|(id, _)| (*id, raw(register, value))));
            }
            renewal.fill(false);
        }
        let renewal_bytes = request.len();
        codec.sync_write(request, registers.torque_limit, moving().map(limit));
        codec.sync_write(request, registers.goal_position, moving().map(position));
        codec.sync_write(request, registers.torque_enable, switched().map(enable));
        if let Some(id) = self.restart.take() {
            // The servo may answer the restart, so this cycle asks no servo: two would speak at once.
            codec.restart(request, id);
            self.inbox.expect(Awaited::Nothing);
            self.reply_deadline = Duration::ZERO;
            self.counters.bytes_out += length(&self.request);
            return &self.request;
        }
        self.ask_for_feedback(renewal_bytes, question)
    }

    /// Begins an exchange that only reads: nothing is written to any servo.
    pub(super) fn begin_look(&mut self) -> &[u8] {
        self.restart(Awaited::Feedback(None));
        if self.inbox.ids.is_empty() { &[] } else { self.ask_for_feedback(0, None) }
    }

    /// Ends the request of an exchange; `extra_bytes` of it are not sent in every cycle.
    fn ask_for_feedback(&mut self, extra_bytes: usize, question: Option<Question>) -> &[u8] {
        let (address, bytes) = self.inbox.asked_of(question);
        let Inbox { ids, registers, .. } = &self.inbox;
        let (codec, request) = (&mut self.codec, &mut self.request);
        self.turn = 0;
        match self.read_mode.group_read() {
            _ if !registers.has_sync_read => {
                ids.iter().take(1).for_each(|id| codec.read_block(request, *id, address, bytes));
            }
            GroupRead::Plain => codec.sync_read(request, address, bytes, ids),
            GroupRead::Fast => codec.fast_sync_read(request, address, bytes, ids),
        }
        self.reply_deadline = reply_deadline(self.cycle_time() + wire_time(extra_bytes, self.bus.baud));
        self.counters.bytes_out += length(&self.request);
        &self.request
    }

    /// Where servos are asked one by one: whether the servo whose turn it is has answered.
    pub(super) fn is_turn_over(&self) -> bool {
        !self.inbox.registers.has_sync_read
            && matches!(self.inbox.awaited, Awaited::Feedback(_))
            && self.inbox.slots.get(self.turn).is_some_and(Slot::is_good)
    }

    /// How long after its request to wait for the servo whose turn it is, or for all servos if all are asked at
    /// once.
    pub(super) fn turn_deadline(&self) -> Duration {
        if self.inbox.registers.has_sync_read || !matches!(self.inbox.awaited, Awaited::Feedback(_)) {
            return self.reply_deadline;
        }
        reply_deadline(single_read_time(&self.bus, self.inbox.registers, self.request.len()))
    }

    /// Begins the next servo's turn, where servos are asked one by one, and returns what to send; `None` when all
    /// have had their turn.
    pub(super) fn begin_turn(&mut self) -> Option<&[u8]> {
        let Awaited::Feedback(question) = self.inbox.awaited else { return None };
        if self.inbox.registers.has_sync_read {
            return None;
        }
        self.end_input();
        self.turn += 1;
        let id = *self.inbox.ids.get(self.turn)?;
        self.codec.clear();
        self.echo.restart();
        self.request.clear();
        let (address, bytes) = self.inbox.asked_of(question);
        self.codec.read_block(&mut self.request, id, address, bytes);
        self.counters.bytes_out += length(&self.request);
        Some(&self.request)
    }

    /// Has the next cycle's request write the settings, except torque, again to the servo number `index`. It clears
    /// the servo's bus watchdog and sets it to `watchdog_units`, before the servo's goals: a servo that restarted
    /// has lost both, and a servo that its watchdog stopped takes goals again.
    pub(super) fn renew(&mut self, index: usize, watchdog_units: Option<u8>) {
        if let Some(is_renewed) = self.renewal.get_mut(index) {
            *is_renewed = true;
            self.watchdog_units = watchdog_units;
        }
    }

    /// Has the next cycle's request ask all servos this question instead of their feedback.
    pub(super) fn ask(&mut self, question: Question) {
        self.question = Some(question);
    }

    /// Has the next cycle's request restart the servo number `index`; that cycle asks no servo.
    pub(super) fn restart_servo(&mut self, index: usize) {
        self.restart = self.inbox.ids.get(index).copied();
    }

    /// Begins a write of `units` to every servo's bus watchdog; no servo answers it. Nothing to send on a bus
    /// whose servos have no watchdog.
    pub(super) fn begin_watchdog(&mut self, units: u8) -> &[u8] {
        self.restart(Awaited::Nothing);
        let Inbox { ids, registers, .. } = &self.inbox;
        if let Some(register) = registers.bus_watchdog {
            let values = ids.iter().map(|id| (*id, u64::from(units)));
            self.codec.sync_write(&mut self.request, register, values);
        }
        &self.request
    }

    /// Begins a write that takes the torque off every servo; no servo answers it.
    pub(super) fn begin_limp(&mut self) -> &[u8] {
        self.restart(Awaited::Nothing);
        let Inbox { ids, registers, .. } = &self.inbox;
        let values = ids.iter().map(|id| (*id, 0));
        self.codec.sync_write(&mut self.request, registers.torque_enable, values);
        &self.request
    }

    /// Ends an exchange that could not be sent: every servo is [`Slot::Missing`], and is counted so.
    pub(super) fn miss_cycle(&mut self) -> &[Slot] {
        self.restart(Awaited::Feedback(None));
        self.finish()
    }

    /// Begins a ping of `id`, which may be unknown on this bus.
    ///
    /// On Feetech, a servo whose only alarm is the voltage answers with the bytes of the request. They could be
    /// an adapter's echo, so the answer is [`Answer::Missing`]; [`BusClient::begin_read`] then settles it.
    pub(super) fn begin_ping(&mut self, id: ServoId) -> &[u8] {
        self.restart(Awaited::Answer { id, question: RequestKind::Ping, answer: Answer::Missing });
        self.codec.ping(&mut self.request, id);
        self.end_transaction_request(self.bus.protocol.spec().ping_bytes)
    }

    /// Begins a read of one register of `id`.
    pub(super) fn begin_read(&mut self, id: ServoId, register: Register) -> &[u8] {
        self.restart(Awaited::Answer { id, question: RequestKind::Read(register), answer: Answer::Missing });
        self.codec.read(&mut self.request, id, register);
        self.end_transaction_request((self.bus.protocol.spec().asked_bytes)(u16::from(register.bytes)))
    }

    /// Begins a write of one register of `id`. A value that the register cannot hold becomes the nearest it can.
    pub(super) fn begin_write(&mut self, id: ServoId, register: Register, value: i64) -> &[u8] {
        self.restart(Awaited::Answer { id, question: RequestKind::Write, answer: Answer::Missing });
        let raw = ordered(encode(register, value), register, self.registers().is_big_endian);
        self.codec.write(&mut self.request, id, register, raw);
        self.end_transaction_request(0)
    }

    fn restart(&mut self, awaited: Awaited) {
        self.codec.clear();
        self.echo.restart();
        self.request.clear();
        self.inbox.expect(awaited);
    }

    fn end_transaction_request(&mut self, reply_bytes: u16) -> &[u8] {
        let bytes = self.request.len() + status_bytes(self.bus.protocol, usize::from(reply_bytes));
        let waits = u64::from(self.bus.return_delay_us) + u64::from(self.bus.adapter_latency_us);
        self.reply_deadline =
            wire_time(bytes, self.bus.baud) + Duration::from_micros(waits) + TRANSACTION_PATIENCE;
        &self.request
    }

    /// How long after sending to wait for replies to the last request.
    pub(super) fn reply_deadline(&self) -> Duration {
        self.reply_deadline
    }

    /// Takes received bytes, in pieces of any size. Drops the echo of the request, if there is one.
    pub(super) fn feed(&mut self, bytes: &[u8]) {
        if matches!(self.inbox.awaited, Awaited::Feedback(_)) {
            self.counters.bytes_in += length(bytes);
        }
        let (held, rest) = self.echo.pass(&self.request, bytes);
        self.inbox.decode(&mut self.codec, held);
        self.inbox.decode(&mut self.codec, rest);
    }

    /// True if every awaited reply has arrived.
    pub(super) fn is_complete(&self) -> bool {
        self.inbox.is_complete()
    }

    /// Ends the exchange: one slot for each servo, in the order of the ids.
    pub(super) fn finish(&mut self) -> &[Slot] {
        if matches!(self.inbox.awaited, Awaited::Feedback(_)) {
            self.end_input();
            let count = |kind: Slot| self.inbox.slots.iter().filter(|slot| **slot == kind).count();
            let (missing, corrupt) = (count(Slot::Missing), count(Slot::Corrupt));
            if !self.inbox.ids.is_empty() {
                self.counters.exchanges += 1;
                self.counters.missing += u64::try_from(missing).unwrap_or(u64::MAX);
                self.counters.corrupt += u64::try_from(corrupt).unwrap_or(u64::MAX);
                self.read_mode.end_cycle(missing + corrupt == 0);
            }
            self.inbox.awaited = Awaited::Nothing;
        }
        &self.inbox.slots
    }

    /// Ends a single transaction.
    pub(super) fn finish_transaction(&mut self) -> Answer {
        self.end_input();
        match std::mem::replace(&mut self.inbox.awaited, Awaited::Nothing) {
            Awaited::Answer { answer, .. } => answer,
            Awaited::Nothing | Awaited::Feedback(_) => Answer::Missing,
        }
    }

    /// Reads what still follows an incomplete packet, and any bytes held back because they could begin the echo.
    fn end_input(&mut self) {
        let held = self.echo.rest(&self.request);
        self.inbox.decode(&mut self.codec, held);
        self.codec.end_of_input();
        self.inbox.drain(&mut self.codec);
    }

    /// Time from sending to the last byte of the last reply if all goes well, with the present kind of read.
    pub(super) fn cycle_time(&self) -> Duration {
        self.cycle_cost().time
    }

    /// Bytes sent and received in an exchange in which every servo moves and answers.
    #[cfg(test)]
    fn cycle_bytes(&self) -> (usize, usize) {
        let cost = self.cycle_cost();
        (cost.bytes_out, cost.bytes_in)
    }

    fn cycle_cost(&self) -> CycleCost {
        match self.read_mode.group_read() {
            GroupRead::Plain => self.plain_cost,
            GroupRead::Fast => self.fast_cost,
        }
    }

    /// Kind of read for the next exchange.
    pub(super) fn group_read(&self) -> GroupRead {
        self.read_mode.group_read()
    }

    /// Traffic on the bus since the start.
    pub(super) fn counters(&self) -> Counters {
        self.counters
    }

    /// Good packets from ids that were not asked, since the start: perhaps a second servo with a wrong id.
    pub(super) fn unknown_replies(&self) -> u64 {
        self.inbox.unknown
    }
}

fn length(bytes: &[u8]) -> u64 {
    u64::try_from(bytes.len()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
