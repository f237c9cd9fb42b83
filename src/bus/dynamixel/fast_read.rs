//! The reply to a fast sync read: one packet that all servos write in turn.
//!
//! ```text
//! FF FF FD 00 FE length 55 | error id data... crc | error id data... crc | ...
//! ```
//! One block per servo, in the order asked. Nothing is stuffed. Each servo's CRC covers everything before
//! it, other servos' CRCs included; so the last CRC is the packet's own.
//! Source: DynamixelSDK 3.8.1, `group_fast_sync_read`; ROBOTIS e-manual, Fast Sync Read.

use std::ops::Range;

use super::crc::crc16;
use super::{HEAD_BYTES, LENGTH_END};

/// Bytes of a block around its data: error, id, CRC.
pub(super) const BLOCK_FRAME_BYTES: usize = 4;

/// The blocks of the fast reply whose header is at the front of the window.
#[derive(Debug, Default)]
pub(super) struct FastReply {
    servos: usize,
    data_bytes: usize,
    blocks_read: usize,
    crc: u16,
    is_broken: bool,
}

/// The next item of a fast reply. Ranges count from its header.
pub(super) enum FastStep {
    /// The next block is incomplete.
    Wait,
    /// A block with a good CRC.
    Block { error: u8, id: u8, data: Range<usize> },
    /// A block with a wrong CRC.
    CorruptBlock { id: u8 },
    /// All blocks were read; `is_whole` if all were good.
    End { is_whole: bool },
}

impl FastReply {
    /// The reply of `servos` servos with `data_bytes` each.
    pub(super) fn new(servos: usize, data_bytes: usize) -> FastReply {
        FastReply { servos, data_bytes, ..FastReply::default() }
    }

    /// Returns to before the first block: another header is at the front now.
    pub(super) fn restart(&mut self) {
        *self = FastReply::new(self.servos, self.data_bytes);
    }

    /// Length of the whole packet.
    pub(super) fn packet_bytes(&self) -> usize {
        HEAD_BYTES + self.servos * self.block_bytes()
    }

    /// Value of the packet's length field: the bytes after it.
    pub(super) fn length_field(&self) -> usize {
        self.packet_bytes() - LENGTH_END
    }

    fn block_bytes(&self) -> usize {
        self.data_bytes + BLOCK_FRAME_BYTES
    }

    /// Reads the next block of `packet`, which begins with the header.
    pub(super) fn next_step(&mut self, packet: &[u8]) -> FastStep {
        if self.blocks_read == self.servos {
            return FastStep::End { is_whole: !self.is_broken };
        }
        let start = HEAD_BYTES + self.blocks_read * self.block_bytes();
        let end = start + self.block_bytes();
        let Some([body @ .., crc_low, crc_high]) = packet.get(start..end) else { return FastStep::Wait };
        let [error, id, ..] = body else { return FastStep::Wait };
        if self.blocks_read == 0 {
            self.crc = crc16(0, packet.get(..HEAD_BYTES).unwrap_or_default());
        }
        let received = u16::from_le_bytes([*crc_low, *crc_high]);
        let is_good = crc16(self.crc, body) == received;
        self.blocks_read += 1;
        // Continue from the CRC that this servo sent, even if the received bytes do not match it: the servo heard
        // the bytes as they were sent. So one changed byte costs one block, and each later block still has 16 check
        // bits of its own.
        self.crc = crc16(received, &[*crc_low, *crc_high]);
        if is_good {
            FastStep::Block { error: *error, id: *id, data: start + 2..end - 2 }
        } else {
            self.is_broken = true;
            FastStep::CorruptBlock { id: *id }
        }
    }
}
