//! Dynamixel Protocol 2.0 packets, both ways.
//!
//! Takes what to ask, or received bytes. Returns bytes to send, or status packets. No I/O.
//! Source: ROBOTIS e-manual, `dxl/protocol2`.
//!
//! ```text
//! FF FF FD 00  id  length (2)  instruction  [error]  parameters...  CRC (2)
//! ```
//! `length` counts the bytes after it; words are little endian. From the instruction to the last parameter
//! every `FF FF FD` is stuffed with one more `FD`, so that no data look like a header.

mod crc;
mod fast_read;
mod library;
mod models;
mod spec;
mod table;

use std::ops::Range;

use super::packet::{Decode, Event, Status, Window};
use super::protocols::Values;
use crate::model::Protocol;
use crate::units::ServoId;
use crc::crc16;
use fast_read::{FastReply, FastStep};
pub(super) use spec::SPEC;
#[cfg(test)]
pub(super) use {models::DYNAMIXEL_X, spec::X};

const HEADER: [u8; 4] = [0xFF, 0xFF, 0xFD, 0x00];
/// The sequence that is stuffed, and the byte added to it.
const STUFFED: [u8; 3] = [0xFF, 0xFF, 0xFD];
const STUFFING: u8 = 0xFD;
const BROADCAST: u8 = 0xFE;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const STATUS: u8 = 0x55;
const SYNC_READ: u8 = 0x82;
const SYNC_WRITE: u8 = 0x83;
const FAST_SYNC_READ: u8 = 0x8A;

/// Bytes up to and including the length field.
const LENGTH_END: usize = 7;
/// Bytes up to and including the instruction.
const HEAD_BYTES: usize = 8;

/// Bytes of a request around its parameters: header 4, id, length 2, instruction, CRC 2.
const REQUEST_FRAME_BYTES: usize = 10;
/// Bytes of a status packet around its parameters: those of a request and the error byte.
const STATUS_FRAME_BYTES: usize = 11;
/// Bytes of a fast reply before its first block: header 4, id, length 2, instruction.
const FAST_HEAD_BYTES: usize = HEAD_BYTES;

/// Appends any instruction to one servo.
fn request(out: &mut Vec<u8>, id: ServoId, instruction: u8, parameters: &[u8]) {
    let packet = Packet::open(out, id.0, instruction);
    parameters.iter().for_each(|byte| packet.push(out, *byte));
    packet.close(out);
}

/// Appends a read of `bytes` bytes from `address` on.
fn read(out: &mut Vec<u8>, id: ServoId, address: u16, bytes: u16) {
    let packet = Packet::open(out, id.0, READ);
    packet.push_word(out, address);
    packet.push_word(out, bytes);
    packet.close(out);
}

/// Appends a write of the lowest `bytes` bytes (at most 8) of `raw` to `address`, lowest first.
fn write(out: &mut Vec<u8>, id: ServoId, address: u16, bytes: u8, raw: u64) {
    let packet = Packet::open(out, id.0, WRITE);
    packet.push_word(out, address);
    packet.push_raw(out, bytes, raw);
    packet.close(out);
}

/// Appends a sync write of the lowest `bytes` bytes (at most 8) of each servo's value, lowest first.
/// With no servos it appends no packet.
fn sync_write(out: &mut Vec<u8>, address: u16, bytes: u8, values: Values<'_>) {
    let mut values = values.peekable();
    if values.peek().is_none() {
        return;
    }
    let packet = Packet::open(out, BROADCAST, SYNC_WRITE);
    packet.push_word(out, address);
    packet.push_word(out, u16::from(bytes));
    for (id, raw) in values {
        packet.push(out, id.0);
        packet.push_raw(out, bytes, raw);
    }
    packet.close(out);
}

/// Appends a sync read of `bytes` bytes from `address` on: each servo answers with a status packet, in
/// the order of `ids`.
fn sync_read(out: &mut Vec<u8>, address: u16, bytes: u16, ids: &[ServoId]) {
    group_read(out, SYNC_READ, address, bytes, ids);
}

/// Appends a fast sync read: the servos answer with one packet that they write in turn, in the order of
/// `ids`. If a servo does not answer, the servos after it are not heard.
fn fast_sync_read(out: &mut Vec<u8>, address: u16, bytes: u16, ids: &[ServoId]) {
    group_read(out, FAST_SYNC_READ, address, bytes, ids);
}

fn group_read(out: &mut Vec<u8>, instruction: u8, address: u16, bytes: u16, ids: &[ServoId]) {
    let packet = Packet::open(out, BROADCAST, instruction);
    packet.push_word(out, address);
    packet.push_word(out, bytes);
    for id in ids {
        packet.push(out, id.0);
    }
    packet.close(out);
}

/// A request being appended: the index at which it begins.
struct Packet {
    start: usize,
}

impl Packet {
    fn open(out: &mut Vec<u8>, id: u8, instruction: u8) -> Packet {
        let start = out.len();
        out.extend(HEADER);
        out.extend([id, 0, 0, instruction]);
        Packet { start }
    }

    /// Appends a parameter byte, stuffed where needed.
    fn push(&self, out: &mut Vec<u8>, byte: u8) {
        out.push(byte);
        if out.get(self.start + LENGTH_END..).is_some_and(|body| body.ends_with(&STUFFED)) {
            out.push(STUFFING);
        }
    }

    fn push_word(&self, out: &mut Vec<u8>, word: u16) {
        self.push_raw(out, 2, u64::from(word));
    }

    fn push_raw(&self, out: &mut Vec<u8>, bytes: u8, raw: u64) {
        for byte in raw.to_le_bytes().into_iter().take(usize::from(bytes)) {
            self.push(out, byte);
        }
    }

    /// Fills in the length and appends the CRC.
    fn close(&self, out: &mut Vec<u8>) {
        // The length includes the CRC to come. 253 servos with 8 bytes each are far from 65,535.
        let length = out.len().saturating_sub(self.start + LENGTH_END) + 2;
        let length = u16::try_from(length).unwrap_or(u16::MAX).to_le_bytes();
        for (field, byte) in out.iter_mut().skip(self.start + 5).zip(length) {
            *field = byte;
        }
        let crc = crc16(0, out.get(self.start..).unwrap_or_default());
        out.extend(crc.to_le_bytes());
    }
}

/// Finds status packets in received bytes.
#[derive(Debug)]
struct Decoder {
    window: Window,
    capacity: usize,
    length_max: usize,
    fast: Option<FastReply>,
}

impl Decoder {
    /// A decoder for status packets of up to `parameters_max` parameter bytes, and for fast replies of up
    /// to `servos_max` servos with as many bytes each. Tighter limits reject noise that looks like a
    /// header sooner.
    fn new(parameters_max: usize, servos_max: usize) -> Decoder {
        // Instruction, error and parameters, stuffed after every third byte in the worst case, and the CRC.
        let length_max = (parameters_max + 2) * 4 / 3 + 2;
        let length_max = length_max.min(usize::from(u16::MAX));
        let fast_bytes = FastReply::new(servos_max, parameters_max).packet_bytes();
        let capacity = fast_bytes.max(LENGTH_END + length_max);
        Decoder { window: Window::new(capacity), capacity, length_max, fast: None }
    }

    fn find(&mut self) -> Option<Found> {
        while !self.window.unread().is_empty() {
            let fast_length = self.fast.as_ref().map(FastReply::length_field);
            match scan(self.window.unread(), self.length_max, fast_length) {
                Step::Noise => self.skip(1),
                Step::Wait if self.window.is_ended() => self.skip(1),
                Step::Wait => return None,
                Step::Corrupt { id } => {
                    self.skip(1);
                    return Some(Found::Corrupt(id));
                }
                Step::Packet { id, body, packet_bytes } => {
                    self.skip(packet_bytes);
                    return Some(Found::Packet { id, body, packet_bytes });
                }
                // The decoder hands out the blocks one by one while their header stays at the front.
                Step::FastReply => match self.fast.as_mut()?.next_step(self.window.unread()) {
                    FastStep::Wait if self.window.is_ended() => self.skip(1),
                    FastStep::Wait => return None,
                    FastStep::Block { error, id, data } if id <= Protocol::ID_MAX => {
                        return Some(Found::Block { id, error, data });
                    }
                    FastStep::CorruptBlock { id } if id <= Protocol::ID_MAX => {
                        return Some(Found::Corrupt(id));
                    }
                    FastStep::Block { .. } | FastStep::CorruptBlock { .. } => {}
                    FastStep::End { is_whole: true } => self.skip(LENGTH_END + fast_length?),
                    // The header may have been noise, with a good packet after it.
                    FastStep::End { is_whole: false } => self.skip(1),
                },
            }
        }
        None
    }

    fn skip(&mut self, bytes: usize) {
        self.window.skip(bytes);
        if let Some(reply) = &mut self.fast {
            reply.restart();
        }
    }
}

impl Decode for Decoder {
    fn clear(&mut self) {
        self.window.clear();
        self.fast = None;
    }

    /// The reply gives a [`Status`] for each servo's block as soon as the block is there.
    fn expect_fast_reply(&mut self, servos: usize, bytes: usize) {
        let reply = FastReply::new(servos, bytes);
        self.fast = (reply.packet_bytes() <= self.capacity).then_some(reply);
    }

    fn push(&mut self, bytes: &[u8]) -> usize {
        self.window.push(bytes)
    }

    fn end_of_input(&mut self) {
        self.window.end();
    }

    fn next_event(&mut self) -> Option<Event<'_>> {
        match self.find()? {
            Found::Corrupt(id) => Some(Event::Corrupt(ServoId(id))),
            Found::Block { id, error, data } => {
                let parameters = self.window.unread().get(data).unwrap_or_default();
                Some(Event::Status(Status { id: ServoId(id), error, parameters }))
            }
            Found::Packet { id, body, packet_bytes } => {
                let body = unstuff(self.window.skipped(packet_bytes, body));
                let [error, parameters @ ..] = body else { return None };
                Some(Event::Status(Status { id: ServoId(id), error: *error, parameters }))
            }
        }
    }
}

/// What [`Decoder::find`] found. Ranges count from the packet's header.
enum Found {
    /// A packet or block with a wrong CRC.
    Corrupt(u8),
    /// A block of the fast reply, which is still at the front of the window.
    Block { id: u8, error: u8, data: Range<usize> },
    /// A packet, just skipped; `body` is its error byte and parameters, still stuffed.
    Packet { id: u8, body: Range<usize>, packet_bytes: usize },
}

/// What the bytes at the front of the window hold.
enum Step {
    /// The first byte does not begin a status packet.
    Noise,
    /// The bytes may begin a packet that is not complete yet.
    Wait,
    /// A packet with a wrong CRC, if it is a packet at all.
    Corrupt { id: u8 },
    /// A good packet, as in [`Found::Packet`].
    Packet { id: u8, body: Range<usize>, packet_bytes: usize },
    /// The header of the fast reply that is expected.
    FastReply,
}

fn scan(bytes: &[u8], length_max: usize, fast_length: Option<usize>) -> Step {
    let known = bytes.len().min(HEADER.len());
    if bytes.get(..known) != HEADER.get(..known) {
        return Step::Noise;
    }
    let [_, _, _, _, id, length_low, length_high, instruction, ..] = bytes else { return Step::Wait };
    let (id, length) = (*id, usize::from(u16::from_le_bytes([*length_low, *length_high])));
    if *instruction != STATUS {
        return Step::Noise;
    }
    if id == BROADCAST && Some(length) == fast_length {
        return Step::FastReply;
    }
    // A packet has at least instruction, error and CRC. Servos answer with the broadcast id only to fast reads.
    if id > Protocol::ID_MAX || !(4..=length_max).contains(&length) {
        return Step::Noise;
    }
    let packet_bytes = LENGTH_END + length;
    let Some([checked @ .., crc_low, crc_high]) = bytes.get(..packet_bytes) else { return Step::Wait };
    if crc16(0, checked) != u16::from_le_bytes([*crc_low, *crc_high]) {
        return Step::Corrupt { id };
    }
    Step::Packet { id, body: HEAD_BYTES..packet_bytes - 2, packet_bytes }
}

/// Removes the stuffing from `body` in place.
fn unstuff(body: &mut [u8]) -> &[u8] {
    let (mut last, mut before_last) = (0, 0);
    let mut kept = 0;
    let mut is_stuffing = false;
    for index in 0..body.len() {
        let byte = body.get(index).copied().unwrap_or_default();
        if is_stuffing && byte == STUFFING {
            // Matching restarts after the stuffing: FF FF FD FD does not end another FF FF FD.
            (before_last, last, is_stuffing) = (0, 0, false);
            continue;
        }
        is_stuffing = [before_last, last, byte] == STUFFED;
        (before_last, last) = (last, byte);
        if let Some(place) = body.get_mut(kept) {
            *place = byte;
            kept += 1;
        }
    }
    body.get(..kept).unwrap_or_default()
}

#[cfg(test)]
mod tests;
