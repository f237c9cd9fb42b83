//! What crosses a line, as servos of all protocols read it.

use std::fmt;

/// A request, without stuffing or checksum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Request {
    pub(crate) id: u8,
    pub(crate) instruction: u8,
    pub(crate) parameters: Vec<u8>,
}

/// A packet to servos that answer it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Received {
    Request(Request),
    /// A packet for this id whose checksum is wrong. Feetech servos ignore such packets, so their decoder gives none.
    BadChecksum {
        id: u8,
    },
}

/// Finds packets in the bytes that cross a line. All servos of a bus hear the same bytes, so they share one decoder.
pub(crate) trait LineDecoder: fmt::Debug + Send {
    /// Drops an incomplete packet.
    fn reset(&mut self);

    /// Takes a byte; returns the packet that it completes.
    fn push(&mut self, byte: u8) -> Option<Received>;
}
