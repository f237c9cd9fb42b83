//! What one servo answered in one exchange, in the servo's own units.

/// A servo's reply, in its own counts and register units; [`crate::counts`] turns it into SI units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Feedback {
    /// Present position, counts; already sign-decoded.
    pub position: i32,
    /// Present speed, the model's speed unit; already sign-decoded.
    pub speed: i32,
    /// Present load (Feetech: 0.1 % of full duty; Dynamixel: the model's current unit); sign-decoded.
    pub load: i32,
    /// Supply voltage, 0.1 V.
    pub voltage_decivolt: u16,
    /// Temperature, degrees Celsius.
    pub temperature_c: u8,
    /// Alarm bits as they stood in the reply: Feetech's status byte; Dynamixel's alert bit (0x80).
    pub alarms: u8,
}

/// The result of one exchange for one servo. One slot a servo: a lost reply never discards the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Slot {
    /// A valid reply of this exchange.
    Fresh(Feedback),
    /// Bytes of a reply came, but did not pass their checksum or had the wrong shape.
    Corrupt,
    /// Nothing came before the deadline.
    #[default]
    Missing,
}
