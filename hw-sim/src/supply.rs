//! The supply that all servos of a bus share. In: the current they draw. Out: the voltage that is left for them.

/// How much of the way to its end a change of voltage goes in a millisecond: what the capacitors of servos and adapter
/// leave of it (estimate).
const SETTLING_SHARE: f64 = 0.25;

#[derive(Debug)]
pub(crate) struct Supply {
    /// Without current, V.
    source_v: f64,
    /// Of source, wires and plugs, ohm.
    source_ohm: f64,
    volts: f64,
}

impl Supply {
    pub(crate) fn new(source_v: f64, source_ohm: f64) -> Supply {
        Supply { source_v, source_ohm, volts: source_v }
    }

    /// At the servos, V.
    pub(crate) fn volts(&self) -> f64 {
        self.volts
    }

    /// A millisecond with this current, A. What motors give back is not taken.
    pub(crate) fn draw(&mut self, current_a: f64) {
        let settled = (self.source_v - self.source_ohm * current_a.max(0.0)).max(0.0);
        self.volts += SETTLING_SHARE * (settled - self.volts);
    }
}
