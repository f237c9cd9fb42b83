//! The half-duplex line. In: bursts of bytes with a start time. Out: each byte at the time its stop bit ends,
//! garbled if two talked at once. Knows no packets.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// Bits a byte takes: start, eight data, stop (8N1, both makers).
const BITS_PER_BYTE: u64 = 10;

/// The device that drives the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sender {
    Host,
    /// Index on the bus.
    Servo(usize),
}

/// What has crossed a bus since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct WireStatistics {
    /// Bytes the host put on the line.
    pub bytes_from_host: u64,
    /// Bytes the servos put on the line, noise included.
    pub bytes_from_servos: u64,
    /// Bytes corrupted by two talkers at once, or by a change of the host's rate while they crossed.
    pub bytes_garbled: u64,
    /// Time with a byte on the line, ns.
    pub busy_ns: u64,
}

#[derive(Debug)]
struct Burst {
    talker: Sender,
    /// Line rate of the burst, bit/s.
    baud: u32,
    start_ns: u64,
    end_ns: u64,
    /// When the byte at `sent` will have crossed; stored, because it is read far more often than it changes.
    byte_end_ns: u64,
    bytes: Vec<u8>,
    sent: usize,
}

/// One byte that has just left the line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WireByte {
    pub(crate) talker: Sender,
    pub(crate) at_ns: u64,
    pub(crate) byte: u8,
    /// True if it is not the byte that was sent.
    pub(crate) is_spoilt: bool,
}

#[derive(Debug)]
pub(crate) struct Wire {
    /// The host's line rate, bit/s. A servo at another rate does not understand it, so none talks at another.
    baud: u32,
    bursts: Vec<Burst>,
    /// The byte that crosses next: its time, and the index of its burst.
    next: Option<(u64, usize)>,
    busy_until_ns: u64,
    statistics: WireStatistics,
}

impl Wire {
    pub(crate) fn new(baud: u32) -> Wire {
        let statistics = WireStatistics::default();
        Wire { baud, bursts: Vec::new(), next: None, busy_until_ns: 0, statistics }
    }

    pub(crate) fn statistics(&self) -> WireStatistics {
        self.statistics
    }

    /// Time that `count` bytes take at the host's rate, ns, rounded up.
    pub(crate) fn duration_ns(&self, count: usize) -> u64 {
        duration_ns(count, self.baud)
    }

    /// Puts bytes on the line from `start_ns` on; returns when the last will have crossed.
    pub(crate) fn talk(&mut self, talker: Sender, start_ns: u64, bytes: Vec<u8>) -> u64 {
        let end_ns = start_ns + self.duration_ns(bytes.len());
        if !bytes.is_empty() {
            let byte_end_ns = start_ns + self.duration_ns(1);
            let baud = self.baud;
            self.bursts.push(Burst { talker, baud, start_ns, end_ns, byte_end_ns, bytes, sent: 0 });
            self.find_next();
        }
        end_ns
    }

    /// When a talker will have sent all its bytes, ns; 0 if it has none.
    pub(crate) fn busy_until_ns(&self, talker: Sender) -> u64 {
        let own = self.bursts.iter().filter(|burst| burst.talker == talker);
        own.map(|burst| burst.end_ns).max().unwrap_or_default()
    }

    /// Takes back what a talker has not sent yet.
    pub(crate) fn cut(&mut self, talker: Sender) {
        self.bursts.retain(|burst| burst.talker != talker || burst.sent > 0);
        for burst in self.bursts.iter_mut().filter(|burst| burst.talker == talker) {
            burst.bytes.truncate(burst.sent);
            burst.end_ns = burst.start_ns + duration_ns(burst.sent, burst.baud);
        }
        self.find_next();
    }

    /// When the next byte will have crossed.
    pub(crate) fn next_ns(&self) -> Option<u64> {
        self.next.map(|(at, _)| at)
    }

    /// When the first burst, under way or pending, will have crossed completely.
    pub(crate) fn next_burst_end_ns(&self) -> Option<u64> {
        let ahead = self.bursts.iter().filter(|burst| burst.sent < burst.bytes.len());
        ahead.map(|burst| burst.end_ns).min()
    }

    pub(crate) fn baud(&self) -> u32 {
        self.baud
    }

    /// Sets the rate at which the host talks and listens from now on; a burst under way keeps its own rate.
    pub(crate) fn set_baud(&mut self, baud: u32) {
        self.baud = baud.max(1);
    }

    fn find_next(&mut self) {
        let ahead = self.bursts.iter().enumerate().filter(|(_, burst)| burst.sent < burst.bytes.len());
        self.next = ahead.map(|(index, burst)| (burst.byte_end_ns, index)).min();
    }

    /// Lets the next byte cross.
    pub(crate) fn cross(&mut self, rng: &mut Pcg64Mcg) -> Option<WireByte> {
        let (end, index) = self.next?;
        let sent = self.bursts[index].sent;
        let burst = &mut self.bursts[index];
        let (talker, baud, mut byte) = (burst.talker, burst.baud, burst.bytes[sent]);
        let start = burst.start_ns + duration_ns(sent, baud);
        (burst.sent, burst.byte_end_ns) = (sent + 1, burst.start_ns + duration_ns(sent + 2, baud));
        let clashes = |other: &Burst| other.talker != talker && other.start_ns < end && other.end_ns > start;
        let is_spoilt = baud != self.baud || self.bursts.iter().any(clashes);
        if is_spoilt {
            byte ^= rng.random_range(1..=255u8);
            self.statistics.bytes_garbled += 1;
        }
        match talker {
            Sender::Host => self.statistics.bytes_from_host += 1,
            Sender::Servo(_) => self.statistics.bytes_from_servos += 1,
        }
        self.statistics.busy_ns += end.saturating_sub(start.max(self.busy_until_ns));
        self.busy_until_ns = self.busy_until_ns.max(end);
        // A burst is forgotten once it can no longer overlap a byte still to come.
        let horizon = end.saturating_sub(2 * self.duration_ns(1).max(duration_ns(1, baud)));
        self.bursts.retain(|burst| burst.sent < burst.bytes.len() || burst.end_ns > horizon);
        self.find_next();
        Some(WireByte { talker, at_ns: end, byte, is_spoilt })
    }
}

/// Time `count` bytes take at `baud`, ns, rounded up.
fn duration_ns(count: usize, baud: u32) -> u64 {
    let bits_ns = (count as u64).saturating_mul(BITS_PER_BYTE * 1_000_000_000);
    bits_ns.div_ceil(u64::from(baud))
}
