//! How servos read bytes, without a line or a clock.

use crate::decoder::Received;
use crate::model::Protocol;

/// A request as a servo reads it: id, instruction, and parameters without stuffing or checksum.
pub type Request = (u8, u8, Vec<u8>);

/// The requests that servos of `protocol` find in `bytes`, if these come without a pause. An incomplete request at
/// the end may hold up others behind its header until more bytes, or a pause, come.
pub fn requests_in(protocol: Protocol, bytes: &[u8]) -> Vec<Request> {
    let mut decoder = (protocol.spec().decoder)();
    let mut found = Vec::new();
    for &byte in bytes {
        if let Some(Received::Request(request)) = decoder.push(byte) {
            found.push((request.id, request.instruction, request.parameters));
        }
    }
    found
}
