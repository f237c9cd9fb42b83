//! What the servos of a bus say after a request, in order. In: nothing. Out: the data both protocols hand to the bus.

/// One stretch of the line after a request; each begins where the one before ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Slot {
    /// A servo talks.
    Talk {
        /// Index on the bus.
        servo: usize,
        /// What it says.
        bytes: Vec<u8>,
        /// How long it waits before.
        delay_ns: u64,
        /// This slot starts a packet (a fast sync read is one packet by many servos).
        starts_packet: bool,
    },
    /// Nobody talks for as long as a reply of this many bytes, and a guard time, would take.
    Missing {
        /// Length of the reply that does not come.
        bytes: usize,
    },
}

/// How much longer than a missing reply the next servo waits before it takes its turn, ns.
/// The makers do not state it; 100 µs is our choice, short against a client's own patience.
pub(crate) const MISSING_GUARD_NS: u64 = 100_000;
