//! A million random and mutated byte strings into every decoder, the client's and the servos', each against a plain
//! search for packets written here from the manuals.
//!
//! `HIPPOCAMP_STRINGS` sets another number of strings.
#![allow(clippy::unwrap_used, clippy::cast_possible_truncation, reason = "a test may panic")]

use hippocamp::bus::{replies_in, replies_to_fast_read_in};
use hippocamp::imu::{Frame, frames_in};
use hippocamp::model::Protocol;
use hippocamp::units::ServoId;
use hw_sim::requests_in;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Id, the byte after the length (or after the instruction of a status packet), data.
type Packet = (u8, u8, Vec<u8>);

/// Most data bytes of a status packet the client asks for here.
const DATA_MAX: usize = 8;
/// At most one string in this many, plus ten, may by chance form a packet that reaches into the good one after it:
/// a reader of the line cannot tell it from a real packet. A checksum of 16 bits passes by chance once in 65,536,
/// one of 8 bits once in 256.
const RARE: usize = 20_000;
const OFTEN: usize = 100;

fn strings() -> usize {
    std::env::var("HIPPOCAMP_STRINGS").map_or(1_000_000, |count| count.parse().unwrap())
}

/// Every packet in order; each search starts after the last packet found.
fn search(bytes: &[u8], whole_at: impl Fn(&[u8]) -> Option<(usize, Packet)>) -> Vec<Packet> {
    let (mut found, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        match whole_at(&bytes[at..]) {
            Some((length, packet)) => {
                found.push(packet);
                at += length;
            }
            None => at += 1,
        }
    }
    found
}

/// CRC-16, polynomial 0x8005 (e-manual, Protocol 2.0), bit by bit.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc: u16, &byte| {
        (0..8).fold(
            crc ^ u16::from(byte) << 8,
            |crc, _| {
                if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x8005 }
            },
        )
    })
}

/// A Dynamixel packet from its id and all between length and CRC.
fn dynamixel(id: u8, body: &[u8]) -> Vec<u8> {
    let mut stuffed: Vec<u8> = Vec::new();
    for &byte in body {
        stuffed.push(byte);
        if stuffed.ends_with(&[0xFF, 0xFF, 0xFD]) {
            stuffed.push(0xFD);
        }
    }
    let mut packet = vec![0xFF, 0xFF, 0xFD, 0x00, id];
    packet.extend((stuffed.len() as u16 + 2).to_le_bytes());
    packet.extend(stuffed);
    packet.extend(crc(&packet).to_le_bytes());
    packet
}

/// A Feetech packet; `fifth` is instruction or status.
fn feetech(id: u8, fifth: u8, data: &[u8]) -> Vec<u8> {
    let mut packet = vec![0xFF, 0xFF, id, data.len() as u8 + 2, fifth];
    packet.extend(data);
    packet.push(!packet[2..].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)));
    packet
}

/// The body of the Dynamixel packet at the front, unstuffed, where its length field is at least `least` and at most
/// `most`; and how long the packet is.
fn dynamixel_at(bytes: &[u8], least: usize, most: usize) -> Option<(usize, u8, Vec<u8>)> {
    let [0xFF, 0xFF, 0xFD, 0x00, id, low, high, ..] = *bytes else { return None };
    let length = usize::from(u16::from_le_bytes([low, high]));
    let packet = bytes.get(..7 + length).filter(|_| (least..=most).contains(&length))?;
    let (checked, sum) = packet.split_at(packet.len() - 2);
    if crc(checked).to_le_bytes() != *sum {
        return None;
    }
    let mut body = Vec::new();
    let mut fresh = 0;
    for &byte in &checked[7..] {
        if byte == 0xFD && body[fresh..].ends_with(&[0xFF, 0xFF, 0xFD]) {
            fresh = body.len();
        } else {
            body.push(byte);
        }
    }
    Some((packet.len(), id, body))
}

fn dynamixel_status_at(bytes: &[u8]) -> Option<(usize, Packet)> {
    // Instruction and error before the data, the CRC behind; at worst every third byte brings one more.
    let (length, id, body) = dynamixel_at(bytes, 4, (DATA_MAX + 2) * 4 / 3 + 2)?;
    let [0x55, error, data @ ..] = body.as_slice() else { return None };
    (id <= 252).then(|| (length, (id, *error, data.to_vec())))
}

fn dynamixel_request_at(bytes: &[u8]) -> Option<(usize, Packet)> {
    let (length, id, body) = dynamixel_at(bytes, 3, 1024)?;
    let (instruction, parameters) = body.split_first()?;
    Some((length, (id, *instruction, parameters.to_vec())))
}

/// The Feetech packet at the front, where its length field is at most `most`.
fn feetech_at(bytes: &[u8], id_max: u8, most: usize) -> Option<(usize, Packet)> {
    let [0xFF, 0xFF, id, length, fifth, ..] = *bytes else { return None };
    let length = usize::from(length);
    let packet = bytes.get(..4 + length).filter(|_| (2..=most).contains(&length) && id <= id_max)?;
    let (sum, checked) = packet.split_last().unwrap();
    let is_good = !checked[2..].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)) == *sum;
    is_good.then(|| (packet.len(), (id, fifth, checked[5..].to_vec())))
}

/// Random strings, strings of typical packet bytes, and mutated packets, from a separate random source.
struct Swamp {
    chance: Pcg64Mcg,
    /// Typical bytes of the packets of a protocol.
    marks: &'static [u8],
}

impl Swamp {
    fn below(&mut self, count: usize) -> usize {
        (self.chance.next_u32() as usize) % count
    }

    fn byte(&mut self) -> u8 {
        match self.below(2) {
            0 => self.chance.next_u32() as u8,
            _ => self.marks[self.below(self.marks.len())],
        }
    }

    fn bytes(&mut self, most: usize) -> Vec<u8> {
        let count = self.below(most + 1);
        (0..count).map(|_| self.byte()).collect()
    }

    /// The next string: noise, or packets of `packet` with a few mutations.
    fn string(&mut self, packet: impl Fn(&mut Swamp) -> Vec<u8>) -> Vec<u8> {
        if self.below(3) == 0 {
            return self.bytes(40);
        }
        let count = 1 + self.below(2);
        let mut string: Vec<u8> = (0..count).flat_map(|_| packet(self)).collect();
        for _ in 0..self.below(4) {
            let at = self.below(string.len().max(1));
            match self.below(5) {
                _ if string.is_empty() => {}
                0 => string[at] ^= 1 << self.below(8),
                1 => string[at] = self.byte(),
                2 => drop(string.remove(at)),
                3 => string.insert(at, self.byte()),
                _ => string.truncate(at),
            }
        }
        string
    }
}

const DYNAMIXEL_MARKS: &[u8] = &[0xFF, 0xFF, 0xFF, 0xFD, 0x00, 0x55, 0x01, 0x04, 0x07, 0xFE];
const IMU_MARKS: &[u8] = &[0x55, 0x55, 0x51, 0x52, 0x53, 0x00, 0xFF, 0x5F];
const FEETECH_MARKS: &[u8] = &[0xFF, 0xFF, 0xFF, 0x01, 0x02, 0x04, 0x06, 0xFE];

/// Runs every string, followed by a good packet, through `decode` and the search; counts the strings behind which the
/// good one is not found.
fn compare(
    marks: &'static [u8],
    good: &[u8],
    packet: impl Fn(&mut Swamp) -> Vec<u8>,
    decode: impl Fn(&[u8]) -> Vec<Packet>,
    whole_at: impl Fn(&[u8]) -> Option<(usize, Packet)>,
) -> usize {
    let mut swamp = Swamp { chance: Pcg64Mcg::seed_from_u64(11), marks };
    let (_, expected) = whole_at(good).unwrap();
    let mut hidden = 0;
    for _ in 0..strings() {
        let mut bytes = swamp.string(&packet);
        bytes.extend(good);
        let wanted = search(&bytes, &whole_at);
        let mut found = decode(&bytes);
        if found != wanted {
            // A header in the noise may wait for a packet that does not come: more bytes show that it does not.
            bytes.resize(bytes.len() + 1100, 0);
            found = decode(&bytes);
            assert_eq!(found, search(&bytes, &whole_at), "{bytes:02X?}");
        }
        hidden += usize::from(found.last() != Some(&expected));
    }
    hidden
}

#[test]
fn the_client_finds_dynamixel_status_packets_after_any_bytes() {
    let packet = |swamp: &mut Swamp| {
        let data = swamp.bytes(DATA_MAX);
        dynamixel(1 + swamp.below(3) as u8, &[&[0x55, 0], data.as_slice()].concat())
    };
    let good = dynamixel(7, &[0x55, 0, 0x12, 0x34, 0x56, 0x78]);
    let decode = |bytes: &[u8]| replies_in(Protocol::Dynamixel, DATA_MAX, bytes);
    let hidden = compare(DYNAMIXEL_MARKS, &good, packet, decode, dynamixel_status_at);
    assert!(hidden <= 10 + strings() / RARE, "{hidden}");
}

#[test]
fn the_client_finds_feetech_status_packets_after_any_bytes() {
    let packet = |swamp: &mut Swamp| {
        let data = swamp.bytes(DATA_MAX);
        feetech(1 + swamp.below(3) as u8, 0, &data)
    };
    let good = feetech(7, 0, &[0x12, 0x34, 0x56, 0x78]);
    let decode = |bytes: &[u8]| replies_in(Protocol::Feetech, DATA_MAX, bytes);
    let whole_at = |bytes: &[u8]| feetech_at(bytes, 252, DATA_MAX + 2);
    let hidden = compare(FEETECH_MARKS, &good, packet, decode, whole_at);
    assert!(hidden <= 10 + strings() / OFTEN, "{hidden}");
}

#[test]
fn servos_find_dynamixel_requests_after_any_bytes() {
    let packet = |swamp: &mut Swamp| {
        let body = [&[[1, 2, 3, 0x82, 0x83, 0x8A][swamp.below(6)]], swamp.bytes(12).as_slice()].concat();
        dynamixel(1 + swamp.below(3) as u8, &body)
    };
    let good = dynamixel(7, &[0x02, 0x84, 0x00, 0x04, 0x00]);
    let decode = |bytes: &[u8]| requests_in(hw_sim::Protocol::Dynamixel, bytes);
    let hidden = compare(DYNAMIXEL_MARKS, &good, packet, decode, dynamixel_request_at);
    assert!(hidden <= 10 + strings() / RARE, "{hidden}");
}

#[test]
fn servos_find_feetech_requests_after_any_bytes() {
    let packet = |swamp: &mut Swamp| {
        let data = swamp.bytes(12);
        feetech(1 + swamp.below(3) as u8, [1, 2, 3, 0x82, 0x83][swamp.below(5)], &data)
    };
    let good = feetech(7, 0x02, &[0x38, 0x02]);
    let decode = |bytes: &[u8]| requests_in(hw_sim::Protocol::Feetech, bytes);
    let whole_at = |bytes: &[u8]| feetech_at(bytes, 0xFE, 250);
    let hidden = compare(FEETECH_MARKS, &good, packet, decode, whole_at);
    assert!(hidden <= 10 + strings() / OFTEN, "{hidden}");
}

#[test]
fn damaged_replies_to_a_fast_read_hide_no_later_packet() {
    let servos = [1, 2, 3].map(ServoId);
    // One packet, a block a servo, each block's CRC over all before it (DynamixelSDK, group_sync_read).
    let reply = |swamp: &mut Swamp| {
        let mut packet = vec![0xFF, 0xFF, 0xFD, 0x00, 0xFE, 3 * 8 + 3 - 2, 0x00, 0x55];
        for id in 1..=3 {
            packet.extend([0, id]);
            packet.extend((0..4).map(|_| swamp.byte()));
            packet.extend(crc(&packet).to_le_bytes());
        }
        packet
    };
    let good = dynamixel(7, &[0x55, 0, 0x12, 0x34, 0x56, 0x78]);
    let mut swamp = Swamp { chance: Pcg64Mcg::seed_from_u64(12), marks: DYNAMIXEL_MARKS };
    let whole = reply(&mut swamp);
    assert_eq!(replies_to_fast_read_in(Protocol::Dynamixel, &servos, 4, &whole).len(), 3);
    let mut hidden = 0;
    for _ in 0..strings() {
        let mut bytes = swamp.string(reply);
        bytes.extend(&good);
        let found = replies_to_fast_read_in(Protocol::Dynamixel, &servos, 4, &bytes);
        hidden += usize::from(found.last() != Some(&(7, 0, vec![0x12, 0x34, 0x56, 0x78])));
    }
    assert!(hidden <= 10 + strings() / RARE, "{hidden}");
}

/// The frame of the inertial measurement unit at the front (WitMotion WT901 datasheet v20-0702, 5.1): 55, kind, eight
/// bytes, low byte of the sum.
fn frame_at(bytes: &[u8]) -> Option<(usize, Packet)> {
    let frame = bytes.get(..11)?;
    let sum = frame[..10].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    let is_good = frame[0] == 0x55 && (0x50..=0x5F).contains(&frame[1]) && frame[10] == sum;
    is_good.then(|| (11, (frame[1], 0, of_interest(frame))))
}

/// What our decoder keeps of a frame.
fn of_interest(frame: &[u8]) -> Vec<u8> {
    match frame[1] {
        0x51..=0x53 => frame[2..8].to_vec(),
        0x5F => frame[2..10].to_vec(),
        _ => Vec::new(),
    }
}

#[test]
fn frames_of_an_imu_are_found_after_any_bytes() {
    let frame = |kind: u8, data: &[u8]| {
        let mut frame = [&[0x55, kind], data].concat();
        frame.push(frame.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)));
        frame
    };
    let packet = |swamp: &mut Swamp| {
        let kind = [0x51, 0x52, 0x53, 0x54, 0x5F][swamp.below(5)];
        let data: Vec<u8> = (0..8).map(|_| swamp.byte()).collect();
        frame(kind, &data)
    };
    let numbers = |numbers: &[i16]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    let decode = |bytes: &[u8]| {
        let packet = |frame| match frame {
            Frame::Acceleration(values) => (0x51, 0, numbers(&values)),
            Frame::Rate(values) => (0x52, 0, numbers(&values)),
            Frame::Angle(values) => (0x53, 0, numbers(&values)),
            Frame::Registers(values) => (0x5F, 0, numbers(&values)),
            Frame::Other(kind) => (kind, 0, Vec::new()),
        };
        frames_in(bytes).into_iter().map(packet).collect::<Vec<Packet>>()
    };
    let good = frame(0x53, &[0x12, 0x34, 0x56, 0x78, 0x9A, 0xBC, 0xDE, 0xF0]);
    let hidden = compare(IMU_MARKS, &good, packet, decode, frame_at);
    assert!(hidden <= 10 + strings() / OFTEN, "{hidden}");
}
