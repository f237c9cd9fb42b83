//! Decodes bytes from a line as a client does, without a port or a clock.

use super::codec::Codec;
use super::frame::{Heard, Listener};
use crate::model::Protocol;
use crate::units::ServoId;

/// A status packet: id, error byte, and data without stuffing or checksum.
pub type Reply = (u8, u8, Vec<u8>);

/// The good status packets in `bytes`, of up to `data_max` data bytes each; no more bytes follow.
pub fn replies_in(protocol: Protocol, data_max: usize, bytes: &[u8]) -> Vec<Reply> {
    read_out(Listener::new(protocol, data_max), bytes)
}

/// The same for a fast sync read that asked `servos` for `data_bytes` each: every good block of the
/// reply counts as a status packet.
pub fn replies_to_fast_read_in(
    protocol: Protocol,
    servos: &[ServoId],
    data_bytes: u16,
    bytes: &[u8],
) -> Vec<Reply> {
    let mut codec = Codec::with_room(protocol, data_bytes.into(), servos.len());
    codec.fast_sync_read(&mut Vec::new(), 0, data_bytes, servos);
    read_out(Listener::over(codec), bytes)
}

fn read_out(mut listener: Listener, bytes: &[u8]) -> Vec<Reply> {
    let mut replies = Vec::new();
    let mut take = |heard| {
        if let Heard::Status { id, error, data } = heard {
            replies.push((id.0, error, data));
        }
    };
    listener.hear(bytes, &mut take);
    listener.end(&mut take);
    replies
}
