//! Shared receiving side of both protocols: a window of bytes, and the packets found in it.
//!
//! Takes bytes in pieces of any size. Returns one [`Event`] after another. Never grows past the
//! capacity given at construction, and never panics, whatever the bytes are.

use std::fmt;
use std::ops::Range;

use crate::units::ServoId;

/// A status packet with a good checksum. Borrowed from the decoder until it is next used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Status<'a> {
    /// The servo that sent it.
    pub id: ServoId,
    /// The error byte: Feetech's alarm bits; Dynamixel's error number and, in bit 7, the alert.
    pub error: u8,
    /// The data, unstuffed.
    pub parameters: &'a [u8],
}

/// A packet that a decoder found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Event<'a> {
    /// A complete, good status packet (or one servo's block of a fast sync read).
    Status(Status<'a>),
    /// Bytes in the shape of a status packet of this servo, with a wrong checksum. They may also have
    /// been noise that looked like a header, so a good packet of the same servo may still follow.
    Corrupt(ServoId),
}

/// Finds the status packets of one protocol in received bytes.
pub(super) trait Decode: fmt::Debug + Send {
    /// Forgets everything received.
    fn clear(&mut self);

    /// Takes as many bytes as fit and returns how many: at least one, if [`Decode::next_event`] has been called
    /// until it gave `None`.
    fn push(&mut self, bytes: &[u8]) -> usize;

    /// Tells the decoder that no more bytes will come: it no longer waits for the rest of an incomplete packet and
    /// searches the bytes after its header.
    fn end_of_input(&mut self);

    /// The next packet, or `None` when more bytes are needed.
    ///
    /// After anything but a good packet the search resumes at the very next byte, so a header found in
    /// noise never swallows the packet after it.
    fn next_event(&mut self) -> Option<Event<'_>>;

    /// Prepares for the reply to a fast read of `bytes` bytes of `servos` servos. A protocol without such a read
    /// has nothing to prepare.
    fn expect_fast_reply(&mut self, _servos: usize, _bytes: usize) {}
}

/// Received bytes that no packet has claimed yet: a buffer that is filled at its end and read at its front.
#[derive(Debug)]
pub(super) struct Window {
    bytes: Vec<u8>,
    start: usize,
    capacity: usize,
    is_ended: bool,
}

impl Window {
    /// A window for packets of up to `capacity` bytes. All its memory is allocated here.
    pub(super) fn new(capacity: usize) -> Window {
        Window { bytes: Vec::with_capacity(capacity), start: 0, capacity, is_ended: false }
    }

    /// Forgets everything: a new request is about to be sent.
    pub(super) fn clear(&mut self) {
        self.bytes.clear();
        self.start = 0;
        self.is_ended = false;
    }

    /// Takes as many bytes of `input` as fit and returns their number. It is at least one whenever all packets
    /// were read out before: the remaining bytes are then less than one packet.
    pub(super) fn push(&mut self, input: &[u8]) -> usize {
        self.bytes.drain(..self.start.min(self.bytes.len()));
        self.start = 0;
        let room = self.capacity.saturating_sub(self.bytes.len());
        let taken = input.get(..room).unwrap_or(input);
        self.bytes.extend_from_slice(taken);
        taken.len()
    }

    /// Notes that no more bytes will come: everything incomplete from now on is noise.
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

    /// Bytes that were just skipped: `range` counts from where the unread bytes began before the
    /// last `skipped` bytes were skipped.
    pub(super) fn skipped(&mut self, skipped: usize, range: Range<usize>) -> &mut [u8] {
        let front = self.start.saturating_sub(skipped);
        self.bytes
            .get_mut(front.saturating_add(range.start)..front.saturating_add(range.end))
            .unwrap_or_default()
    }
}
