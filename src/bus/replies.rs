//! What a client makes of bytes off a line, without a port or a clock.

use super::codec::Codec;
use super::packet::{Event, Status};
use crate::model::Protocol;
use crate::units::ServoId;

/// A status packet: id, error byte, and data without stuffing or checksum.
pub type Reply = (u8, u8, Vec<u8>);

/// The good status packets in `bytes`, of up to `data_max` data bytes each; no more bytes will come.
pub fn replies_in(protocol: Protocol, data_max: usize, bytes: &[u8]) -> Vec<Reply> {
    read_out(Codec::with_room(protocol, data_max, 1), bytes)
}

/// The same where `servos` were asked for `data_bytes` each by a fast sync read (Dynamixel): every good block of the
/// reply to it counts as a status packet.
pub fn replies_to_fast_read_in(servos: &[ServoId], data_bytes: u16, bytes: &[u8]) -> Vec<Reply> {
    let mut codec = Codec::with_room(Protocol::Dynamixel, data_bytes.into(), servos.len());
    codec.fast_sync_read(&mut Vec::new(), 0, data_bytes, servos);
    read_out(codec, bytes)
}

fn read_out(mut codec: Codec, bytes: &[u8]) -> Vec<Reply> {
    let (mut rest, mut found) = (bytes, Vec::new());
    let mut drain = |codec: &mut Codec| {
        while let Some(event) = codec.next_event() {
            if let Event::Status(Status { id, error, parameters }) = event {
                found.push((id.0, error, parameters.to_vec()));
            }
        }
    };
    while !rest.is_empty() {
        rest = rest.get(codec.push(rest)..).unwrap_or_default();
        drain(&mut codec);
    }
    codec.end_of_input();
    drain(&mut codec);
    found
}
