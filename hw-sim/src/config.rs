//! The parts of a world: buses, their servos, and the settings of both.

use std::fmt;

/// The protocol of a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// ROBOTIS Dynamixel Protocol 2.0.
    Dynamixel,
    /// Feetech FT-SCS, little-endian (STS) series.
    Feetech,
}

impl Protocol {
    /// Number of the first byte in a reply that follows header, id and length; 0 for bytes that do not begin
    /// a packet.
    pub(crate) fn first_said(self, starts_packet: bool) -> usize {
        match self {
            _ if !starts_packet => 0,
            // FF FF id length.
            Protocol::Feetech => 4,
            // FF FF FD 00 id length length.
            Protocol::Dynamixel => 7,
        }
    }

    /// Line rates a servo can be set to, as (register code, bit/s).
    /// Sources: ROBOTIS e-manual, Baud Rate (8); Feetech wiki, memory-sts, address 6.
    pub(crate) fn bauds(self) -> &'static [(i64, u32)] {
        match self {
            Protocol::Dynamixel => &[
                (0, 9_600),
                (1, 57_600),
                (2, 115_200),
                (3, 1_000_000),
                (4, 2_000_000),
                (5, 3_000_000),
                (6, 4_000_000),
                (7, 4_500_000),
            ],
            Protocol::Feetech => &[
                (0, 1_000_000),
                (1, 500_000),
                (2, 250_000),
                (3, 128_000),
                (4, 115_200),
                (5, 76_800),
                (6, 57_600),
                (7, 38_400),
            ],
        }
    }

    /// Register code of a line rate, if servos can be set to it.
    pub(crate) fn baud_code(self, baud: u32) -> Option<i64> {
        self.bauds().iter().find(|(_, known)| *known == baud).map(|&(code, _)| code)
    }

    /// Highest id a servo may have.
    pub(crate) fn id_max(self) -> u8 {
        match self {
            Protocol::Dynamixel => 252,
            Protocol::Feetech => 253,
        }
    }
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Protocol::Dynamixel => "dynamixel",
            Protocol::Feetech => "feetech",
        })
    }
}

/// One bus: an adapter at the host's end, a half-duplex line, a supply and servos.
#[derive(Debug, Clone, PartialEq)]
pub struct BusConfig {
    /// Name that fault scripts use.
    pub name: String,
    /// Protocol of every servo on it.
    pub protocol: Protocol,
    /// Line rate of the host and of every servo at power-on, bit/s. Must be a rate of the protocol.
    pub baud: u32,
    /// Time from a byte leaving the line to the host seeing it, µs.
    pub adapter_latency_us: u32,
    /// Supply voltage without current, V, above 0.
    pub supply_v: f64,
    /// Resistance of the supply with its wires and plugs, ohm, 0 to 10: the voltage at the servos sags by
    /// this much for each ampere they draw.
    pub supply_ohm: f64,
    /// The servos; ids are unique on a bus.
    pub servos: Vec<ServoConfig>,
}

/// One servo with its id and line rate already set.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoConfig {
    /// Name of an entry of [`crate::MODELS`].
    pub model: String,
    /// 0..=252 (Dynamixel) or 0..=253 (Feetech).
    pub id: u8,
    /// Time from the request's last bit to the reply's first, µs: even, 0..=508 (the register counts 2 µs).
    pub return_delay_us: u32,
    /// Shaft position at power-on, encoder counts; finite, may lie outside 0..=4095.
    pub position_counts: f64,
}
