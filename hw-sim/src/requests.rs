//! How servos read bytes, without a line or a clock.

use crate::config::Protocol;
use crate::dynamixel::packet::Heard;
use crate::{dynamixel, feetech};

/// A request as a servo reads it: id, instruction, and parameters without stuffing or checksum.
pub type Request = (u8, u8, Vec<u8>);

/// The requests that servos of `protocol` find in `bytes`, if these come without a pause. An incomplete request at
/// the end may hold up others behind its header until more bytes, or a pause, come.
pub fn requests_in(protocol: Protocol, bytes: &[u8]) -> Vec<Request> {
    match protocol {
        Protocol::Dynamixel => {
            let mut decoder = dynamixel::packet::Decoder::default();
            let request = |heard| match heard {
                Heard::Request(of) => Some((of.id, of.instruction, of.parameters)),
                Heard::BadCrc { .. } => None,
            };
            bytes.iter().filter_map(|&byte| request(decoder.push(byte)?)).collect()
        }
        Protocol::Feetech => {
            let mut decoder = feetech::packet::Decoder::default();
            let found = bytes.iter().filter_map(|&byte| decoder.push(byte));
            found.map(|of| (of.id, of.instruction, of.parameters)).collect()
        }
    }
}
