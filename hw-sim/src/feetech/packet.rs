//! FT-SCS packets: `FF FF id length instruction parameters checksum`; length counts from the instruction on.
//!
//! In: bytes off the line. Out: requests with a good checksum; and status packets as bytes. There is no byte
//! stuffing, so after a bad checksum the search for a header restarts one byte later.

use crate::convert::{length_u8, low_byte};
pub(crate) use crate::decoder::Request;

/// Id that every servo listens to.
pub(crate) const BROADCAST: u8 = 0xFE;
/// Longest accepted length field: vendor SDKs refuse packets over 250 bytes.
const LENGTH_MAX: u8 = 250;

/// Low byte of the complement of the sum of everything between header and checksum.
pub(crate) fn checksum(body: &[u8]) -> u8 {
    !low_byte(body.iter().map(|&byte| u32::from(byte)).sum())
}

/// A status packet: its fifth byte holds the alarm bits.
pub(crate) fn status(id: u8, alarms: u8, parameters: &[u8]) -> Vec<u8> {
    let mut packet = vec![0xFF, 0xFF, id, length_u8(parameters.len() + 2), alarms];
    packet.extend_from_slice(parameters);
    packet.push(checksum(&packet[2..]));
    packet
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

    /// Takes one byte; returns the request that it completes.
    pub(crate) fn push(&mut self, byte: u8) -> Option<Request> {
        self.buffer.push(byte);
        loop {
            // Drop what cannot be the start of a packet.
            let bad_start = match self.buffer.as_slice() {
                [] => return None,
                [first, ..] if *first != 0xFF => true,
                [_, second, ..] if *second != 0xFF => true,
                // A third FF is no id: the header starts one byte later.
                [_, _, 0xFF, ..] => true,
                [_, _, _, length, ..] => *length < 2 || *length > LENGTH_MAX,
                _ => false,
            };
            if bad_start {
                self.buffer.remove(0);
                continue;
            }
            let &[_, _, id, length, ref rest @ ..] = self.buffer.as_slice() else { return None };
            if rest.len() < usize::from(length) {
                return None;
            }
            let end = 4 + usize::from(length) - 1;
            if checksum(&self.buffer[2..end]) == self.buffer[end] {
                let request =
                    Request { id, instruction: self.buffer[4], parameters: self.buffer[5..end].to_vec() };
                self.buffer.drain(..=end);
                return Some(request);
            }
            self.buffer.remove(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test vectors of the Feetech wiki, protocol ft-scs.
    #[test]
    fn vendor_vectors() {
        let mut decoder = Decoder::default();
        let mut requests = Vec::new();
        for byte in [0xFF, 0xFF, 0x01, 0x04, 0x02, 0x38, 0x02, 0xBE] {
            requests.extend(decoder.push(byte));
        }
        assert_eq!(requests, [Request { id: 1, instruction: 2, parameters: vec![0x38, 2] }]);
        assert_eq!(status(1, 0, &[]), [0xFF, 0xFF, 0x01, 0x02, 0x00, 0xFC]);
        assert_eq!(status(1, 0, &[0x18, 0x05]), [0xFF, 0xFF, 0x01, 0x04, 0x00, 0x18, 0x05, 0xDD]);
    }
}
