//! The replies of the servos of a bus after a request, in order. In: nothing. Out: the data both protocols hand to
//! the bus.

/// One stretch of the line after a request; each begins where the one before ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Slot {
    /// A servo talks.
    Talk {
        /// Index on the bus.
        servo: usize,
        /// The bytes.
        bytes: Vec<u8>,
        /// How long it waits first, ns.
        delay_ns: u64,
        /// True if this slot starts a packet (a fast sync read is one packet by many servos).
        starts_packet: bool,
    },
    /// No servo talks for as long as a reply of this many bytes, and a guard time, would take.
    Missing {
        /// Length of the missing reply.
        bytes: usize,
    },
}

/// Extra time beyond a missing reply before the next servo takes its turn, ns. The makers do not state it; 100 µs
/// is our choice, short compared with a client's timeout.
pub(crate) const MISSING_GUARD_NS: u64 = 100_000;
