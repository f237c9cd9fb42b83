//! Feetech FT-SCS packets, both ways.
//!
//! Takes what to ask, or received bytes. Returns bytes to send, or status packets. No I/O.
//! Source: Feetech wiki, `reference/protocol/ft-scs.md`, sections 2 to 4.
//!
//! ```text
//! FF FF  id  length  instruction or alarms  parameters...  checksum
//! ```
//! `length` counts the bytes after it. The checksum is the complement of the sum of all bytes from `id` on. There
//! is no byte stuffing: data may hold `FF FF`, so a header alone proves nothing.

mod models;
mod spec;
mod table;

use std::ops::Range;

use super::packet::{Decode, Event, Status, Window};
use super::protocols::Values;
use crate::model::Protocol;
use crate::units::ServoId;
pub(super) use spec::SPEC;
#[cfg(test)]
pub(super) use {
    models::{FEETECH_SCS, FEETECH_STS},
    spec::{SCS, STS},
};

const HEADER: u8 = 0xFF;
const BROADCAST: u8 = 0xFE;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const SYNC_READ: u8 = 0x82;
const SYNC_WRITE: u8 = 0x83;

/// Bytes of a packet around its parameters: header 2, id, length, instruction or alarms, checksum.
const FRAME_BYTES: usize = 6;
/// Longest packet sent to a servo; the vendor's own libraries refuse longer ones.
const PACKET_BYTES_MAX: usize = 250;

/// Appends any instruction to one servo, with at most 244 bytes of parameters.
fn request(out: &mut Vec<u8>, id: ServoId, instruction: u8, parameters: &[u8]) {
    let start = open(out, id.0, instruction);
    out.extend(parameters);
    close(out, start);
}

/// Addresses and counts have one byte; the tables hold no larger values.
fn low_byte(word: u16) -> u8 {
    let [low, _] = word.to_le_bytes();
    low
}

/// Appends a read of `bytes` bytes from `address` on.
fn read(out: &mut Vec<u8>, id: ServoId, address: u16, bytes: u16) {
    let start = open(out, id.0, READ);
    out.extend([low_byte(address), low_byte(bytes)]);
    close(out, start);
}

/// Appends a write of the lowest `bytes` bytes (at most 8) of `raw` to `address`, lowest first.
fn write(out: &mut Vec<u8>, id: ServoId, address: u16, bytes: u8, raw: u64) {
    let start = open(out, id.0, WRITE);
    out.push(low_byte(address));
    out.extend(raw.to_le_bytes().iter().take(usize::from(bytes)));
    close(out, start);
}

/// Appends a sync write of the lowest `bytes` bytes (at most 8) of each servo's value, lowest first.
///
/// If the servos exceed [`PACKET_BYTES_MAX`], they are spread over several packets; no servos give no packet.
fn sync_write(out: &mut Vec<u8>, address: u16, bytes: u8, values: Values<'_>) {
    let item_bytes = 1 + usize::from(bytes);
    let mut packet: Option<usize> = None;
    for (id, raw) in values {
        if let Some(start) = packet
            && out.len() - start + item_bytes + 1 > PACKET_BYTES_MAX
        {
            close(out, start);
            packet = None;
        }
        packet.get_or_insert_with(|| {
            let start = open(out, BROADCAST, SYNC_WRITE);
            out.extend([low_byte(address), bytes]);
            start
        });
        out.push(id.0);
        out.extend(raw.to_le_bytes().iter().take(usize::from(bytes)));
    }
    if let Some(start) = packet {
        close(out, start);
    }
}

/// Appends a sync read of `bytes` bytes from `address` on: each servo answers with a status packet, in
/// the order of `ids`. At most 242 ids fit ([`PACKET_BYTES_MAX`]); any after those are not asked.
fn sync_read(out: &mut Vec<u8>, address: u16, bytes: u16, ids: &[ServoId]) {
    let start = open(out, BROADCAST, SYNC_READ);
    out.extend([low_byte(address), low_byte(bytes)]);
    out.extend(ids.iter().map(|id| id.0).take(PACKET_BYTES_MAX - FRAME_BYTES - 2));
    close(out, start);
}

fn open(out: &mut Vec<u8>, id: u8, instruction: u8) -> usize {
    let start = out.len();
    out.extend([HEADER, HEADER, id, 0, instruction]);
    start
}

/// Fills in the length and appends the checksum.
fn close(out: &mut Vec<u8>, start: usize) {
    // The length leaves out header, id and length, but includes the checksum. Packets are at most 250 bytes.
    let length = out.len().saturating_sub(start + 3);
    if let Some(field) = out.get_mut(start + 3) {
        *field = u8::try_from(length).unwrap_or(u8::MAX);
    }
    let sum = checksum(out.get(start + 2..).unwrap_or_default());
    out.push(sum);
}

/// Complement of the sum of everything between header and checksum.
fn checksum(bytes: &[u8]) -> u8 {
    !bytes.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte))
}

/// Finds status packets in received bytes.
///
/// A changed bit always changes the checksum. 8 bits cannot exclude a false packet: one in 256 stretches of
/// noise with a header and a plausible length passes. A servo's data never hold such a header (`FF FF` would be
/// a position beyond 32,000 counts), and a caller that knows the length it asked for rejects nearly all the
/// others.
#[derive(Debug)]
struct Decoder {
    window: Window,
    parameters_max: usize,
}

impl Decoder {
    /// A decoder for status packets of up to `parameters_max` parameter bytes. A tighter limit rejects noise that
    /// looks like a header sooner.
    fn new(parameters_max: usize) -> Decoder {
        let parameters_max = parameters_max.min(PACKET_BYTES_MAX - FRAME_BYTES);
        Decoder { window: Window::new(parameters_max + FRAME_BYTES), parameters_max }
    }
}

impl Decode for Decoder {
    fn clear(&mut self) {
        self.window.clear();
    }

    fn push(&mut self, bytes: &[u8]) -> usize {
        self.window.push(bytes)
    }

    fn end_of_input(&mut self) {
        self.window.end();
    }

    fn next_event(&mut self) -> Option<Event<'_>> {
        while !self.window.unread().is_empty() {
            match scan(self.window.unread(), self.parameters_max) {
                Step::Wait if !self.window.is_ended() => return None,
                Step::Wait | Step::Noise => self.window.skip(1),
                Step::Corrupt(id) => {
                    self.window.skip(1);
                    return Some(Event::Corrupt(id));
                }
                Step::Good { id, error, parameters, packet_bytes } => {
                    self.window.skip(packet_bytes);
                    let parameters = self.window.skipped(packet_bytes, parameters);
                    return Some(Event::Status(Status { id, error, parameters }));
                }
            }
        }
        None
    }
}

/// What the bytes at the front of the window hold.
enum Step {
    /// The first byte does not begin a status packet.
    Noise,
    /// The bytes may begin a packet that is not complete yet.
    Wait,
    /// A packet with a wrong checksum, if it is a packet at all.
    Corrupt(ServoId),
    /// A good packet; `parameters` counts from the front of the window.
    Good { id: ServoId, error: u8, parameters: Range<usize>, packet_bytes: usize },
}

fn scan(bytes: &[u8], parameters_max: usize) -> Step {
    let [HEADER, HEADER, id, length, rest @ ..] = bytes else {
        let is_start = matches!(bytes, [HEADER] | [HEADER, HEADER] | [HEADER, HEADER, _]);
        return if is_start { Step::Wait } else { Step::Noise };
    };
    let (id, length) = (*id, usize::from(*length));
    // Servos never answer with the broadcast id: a packet with it is an echoed request.
    if id > Protocol::ID_MAX || !(2..=parameters_max + 2).contains(&length) {
        return Step::Noise;
    }
    let Some([error, .., sum]) = rest.get(..length) else { return Step::Wait };
    let packet_bytes = 4 + length;
    if checksum(bytes.get(2..packet_bytes - 1).unwrap_or_default()) != *sum {
        return Step::Corrupt(ServoId(id));
    }
    Step::Good { id: ServoId(id), error: *error, parameters: 5..packet_bytes - 1, packet_bytes }
}

#[cfg(test)]
mod tests;
