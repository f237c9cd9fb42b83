//! The parts of a world: buses, their servos, and the settings of both.

use crate::model::{Model, Protocol};

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
    /// Its model: one of [`Model::all`], or any other.
    pub model: Model,
    /// 0..=252 (Dynamixel) or 0..=253 (Feetech).
    pub id: u8,
    /// Time from the request's last bit to the reply's first, µs: even, 0..=508 (the register counts 2 µs).
    pub return_delay_us: u32,
    /// Shaft position at power-on, encoder counts; finite, may lie outside 0..=4095.
    pub position_counts: f64,
}
