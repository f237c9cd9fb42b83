//! The supply that all servos of a bus share. In: the current they draw. Out: the voltage at the servos.

/// Share of a change in voltage that happens within a millisecond: the capacitors of servos and adapter slow it
/// (estimate).
const SETTLING_SHARE: f64 = 0.25;

#[derive(Debug)]
pub(crate) struct Supply {
    /// Voltage without current, V.
    source_v: f64,
    /// Resistance of source, wires and plugs, ohm.
    source_ohm: f64,
    volts: f64,
}

impl Supply {
    pub(crate) fn new(source_v: f64, source_ohm: f64) -> Supply {
        Supply { source_v, source_ohm, volts: source_v }
    }

    /// Voltage at the servos, V.
    pub(crate) fn volts(&self) -> f64 {
        self.volts
    }

    /// Draws this current for a millisecond, A. The supply does not take current that motors feed back.
    pub(crate) fn draw(&mut self, current_a: f64) {
        let settled = (self.source_v - self.source_ohm * current_a.max(0.0)).max(0.0);
        self.volts += SETTLING_SHARE * (settled - self.volts);
    }
}
