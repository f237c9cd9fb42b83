//! What both protocols share on the receiving side: a window of bytes, and the packets found in it.
//!
//! Comes in: bytes, in pieces of any size. Goes out: one [`Event`] after another. Never grows past the
//! capacity given at construction, never panics, whatever the bytes are.

use std::ops::Range;

use crate::units::ServoId;

/// A status packet whose checksum holds. Borrowed from the decoder until it is next used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Status<'a> {
    /// The servo that sent it.
    pub id: ServoId,
    /// The error byte: Feetech's alarm bits; Dynamixel's error number and, in bit 7, the alert.
    pub error: u8,
    /// The data, unstuffed.
    pub parameters: &'a [u8],
}

/// What a decoder found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Event<'a> {
    /// A whole, good status packet (or one servo's block of a fast sync read).
    Status(Status<'a>),
    /// Something of the shape of a status packet of this servo, with a wrong checksum. It may also have
    /// been noise that looked like a header, so a good packet of the same servo may still follow.
    Corrupt(ServoId),
}

/// Received bytes that no packet has claimed yet: a buffer that is refilled behind and read in front.
#[derive(Debug)]
pub(super) struct Window {
    bytes: Vec<u8>,
    start: usize,
    capacity: usize,
    is_ended: bool,
}

impl Window {
    /// A window for packets of up to `capacity` bytes. All its memory is taken here.
    pub(super) fn new(capacity: usize) -> Window {
        Window { bytes: Vec::with_capacity(capacity), start: 0, capacity, is_ended: false }
    }

    /// Forgets everything: a new request is about to be sent.
    pub(super) fn clear(&mut self) {
        self.bytes.clear();
        self.start = 0;
        self.is_ended = false;
    }

    /// Takes as many of `input` as fit and returns how many. It is more than none whenever all packets
    /// were read out before: what is left then is less than one packet.
    pub(super) fn push(&mut self, input: &[u8]) -> usize {
        self.bytes.drain(..self.start.min(self.bytes.len()));
        self.start = 0;
        let room = self.capacity.saturating_sub(self.bytes.len());
        let taken = input.get(..room).unwrap_or(input);
        self.bytes.extend_from_slice(taken);
        taken.len()
    }

    /// No more bytes will come: whatever is incomplete from now on is noise.
    pub(super) fn end(&mut self) {
        self.is_ended = true;
    }

    pub(super) fn is_ended(&self) -> bool {
        self.is_ended
    }

    /// The bytes not yet read.
    pub(super) fn unread(&self) -> &[u8] {
        self.bytes.get(self.start..).unwrap_or_default()
    }

    /// Marks the next `count` bytes as read. They stay where they are until the next push.
    pub(super) fn skip(&mut self, count: usize) {
        self.start = self.start.saturating_add(count).min(self.bytes.len());
    }

    /// Bytes that were just skipped: `range` is counted from where the unread bytes began before the
    /// last `skipped` bytes were skipped.
    pub(super) fn skipped(&mut self, skipped: usize, range: Range<usize>) -> &mut [u8] {
        let front = self.start.saturating_sub(skipped);
        self.bytes
            .get_mut(front.saturating_add(range.start)..front.saturating_add(range.end))
            .unwrap_or_default()
    }
}
