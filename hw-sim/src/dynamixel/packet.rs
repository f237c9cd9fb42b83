//! Protocol 2.0 packets: `FF FF FD 00 id length(2) instruction parameters crc(2)`, with byte stuffing.
//!
//! In: bytes off the line. Out: requests with a good CRC, unstuffed; a note of each with a bad one; and
//! status packets as bytes. After a bad CRC the search restarts one byte later.

use crate::convert::length_u16;
use crate::decoder::{Received, Request};

/// Id that every servo listens to.
pub(crate) const BROADCAST: u8 = 0xFE;
/// Instruction field of a status packet.
pub(crate) const STATUS: u8 = 0x55;
/// Header and reserved byte.
const HEADER: [u8; 4] = [0xFF, 0xFF, 0xFD, 0x00];
/// Longest accepted length field; a servo's buffer is not larger.
const LENGTH_MAX: usize = 1024;

/// CRC of every single byte, so that the CRC takes one step for each byte instead of eight.
const CRC_OF_BYTE: [u16; 256] = {
    let mut table = [0; 256];
    let mut byte = 0u16;
    while byte < 256 {
        let mut crc = byte << 8;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x8005 };
            bit += 1;
        }
        table[byte as usize] = crc;
        byte += 1;
    }
    table
};

/// CRC-16 with polynomial 0x8005, start 0, most significant bit first, continued from `crc`.
pub(crate) fn crc16(crc: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(crc, |crc, &byte| crc << 8 ^ CRC_OF_BYTE[usize::from(crc.to_be_bytes()[0] ^ byte)])
}

/// A status packet; `error` has the alert bit in bit 7.
pub(crate) fn status(id: u8, error: u8, parameters: &[u8]) -> Vec<u8> {
    let mut body = vec![STATUS, error];
    body.extend_from_slice(parameters);
    let body = stuff(&body);
    let mut packet = HEADER.to_vec();
    packet.push(id);
    packet.extend(length_u16(body.len() + 2).to_le_bytes());
    packet.extend(body);
    packet.extend(crc16(0, &packet).to_le_bytes());
    packet
}

/// Beginning of the one packet that answers a fast sync read: everything before the first servo's block.
/// `blocks` is the length of all blocks together.
pub(crate) fn fast_status_head(blocks: usize) -> Vec<u8> {
    let mut packet = HEADER.to_vec();
    packet.push(BROADCAST);
    packet.extend(length_u16(blocks + 1).to_le_bytes());
    packet.push(STATUS);
    packet
}

/// Inserts one more `FD` after every `FF FF FD`.
fn stuff(body: &[u8]) -> Vec<u8> {
    let mut stuffed = Vec::with_capacity(body.len());
    for &byte in body {
        stuffed.push(byte);
        if stuffed.ends_with(&[0xFF, 0xFF, 0xFD]) {
            stuffed.push(0xFD);
        }
    }
    stuffed
}

/// Removes the `FD` after every `FF FF FD`.
fn unstuff(body: &[u8]) -> Vec<u8> {
    let mut plain = Vec::with_capacity(body.len());
    let mut skip_at = None;
    for (index, &byte) in body.iter().enumerate() {
        if skip_at == Some(index) && byte == 0xFD {
            continue;
        }
        plain.push(byte);
        if index >= 2 && body[index - 2..=index] == [0xFF, 0xFF, 0xFD] {
            skip_at = Some(index + 1);
        }
    }
    plain
}

/// Finds requests in a stream of bytes.
#[derive(Debug, Default)]
pub(crate) struct Decoder {
    buffer: Vec<u8>,
}

impl Decoder {
    /// Drops a partial packet.
    pub(crate) fn reset(&mut self) {
        self.buffer.clear();
    }

    /// Takes one byte; returns the packet that it completes.
    pub(crate) fn push(&mut self, byte: u8) -> Option<Received> {
        self.buffer.push(byte);
        let mut bad = None;
        while !self.buffer.is_empty() {
            let known = self.buffer.len().min(HEADER.len());
            if self.buffer[..known] != HEADER[..known] {
                self.buffer.remove(0);
                continue;
            }
            let &[_, _, _, _, id, low, high, ref rest @ ..] = self.buffer.as_slice() else { return bad };
            let length = usize::from(u16::from_le_bytes([low, high]));
            if !(3..=LENGTH_MAX).contains(&length) {
                self.buffer.remove(0);
                continue;
            }
            if rest.len() < length {
                return bad;
            }
            let crc_at = 7 + length - 2;
            let crc = crc16(0, &self.buffer[..crc_at]).to_le_bytes();
            if crc[..] == self.buffer[crc_at..crc_at + 2] {
                let body = unstuff(&self.buffer[7..crc_at]);
                self.buffer.drain(..crc_at + 2);
                let (&instruction, parameters) = body.split_first()?;
                return Some(Received::Request(Request { id, instruction, parameters: parameters.to_vec() }));
            }
            bad = Some(Received::BadChecksum { id });
            self.buffer.remove(0);
        }
        bad
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bytes: &[u8]) -> Vec<Received> {
        let mut decoder = Decoder::default();
        bytes.iter().filter_map(|&byte| decoder.push(byte)).collect()
    }

    fn request(id: u8, instruction: u8, parameters: &[u8]) -> Received {
        Received::Request(Request { id, instruction, parameters: parameters.to_vec() })
    }

    /// Test vectors of the e-manual, Protocol 2.0.
    #[test]
    fn vendor_vectors() {
        let ping = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E];
        assert_eq!(decode(&ping), [request(1, 1, &[])]);
        let read = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x02, 0x84, 0x00, 0x04, 0x00, 0x1D, 0x15];
        assert_eq!(decode(&read), [request(1, 2, &[0x84, 0, 4, 0])]);
        let reply = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00, 0x06, 0x04, 0x26, 0x65, 0x5D];
        assert_eq!(status(1, 0, &[0x06, 0x04, 0x26]), reply);
    }

    #[test]
    fn after_a_bad_crc_the_next_packet_is_found() {
        let mut bytes = vec![0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4F];
        bytes.extend([0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E]);
        assert_eq!(decode(&bytes), [Received::BadChecksum { id: 1 }, request(1, 1, &[])]);
    }

    #[test]
    fn stuffing_is_removed_even_if_data_contain_the_stuffed_form() {
        for data in [
            &[0xFF, 0xFF, 0xFD][..],
            &[0xFF, 0xFF, 0xFD, 0xFD],
            &[0xFF, 0xFF, 0xFF, 0xFD, 0xFF, 0xFF, 0xFD],
            &[0xFF, 0xFF, 0xFD, 0xFF, 0xFF, 0xFD, 0x00],
        ] {
            assert_eq!(unstuff(&stuff(data)), data);
        }
        assert_eq!(stuff(&[0xFF, 0xFF, 0xFD, 0x01]), [0xFF, 0xFF, 0xFD, 0xFD, 0x01]);
    }
}
