//! The kinds of fault, in one table: their names and keys in scripts, and what they affect.
//!
//! To add a kind, write its variant and its line of [`KINDS`] here, and its effect where it acts: code there asks
//! `BusFaults` or `ImuFaults` for the kind. A kind with a value of its own also has an arm of [`FaultKind::own`].
//! Campaigns draw it by itself.

use std::mem::discriminant;
use std::ops::RangeInclusive;

use super::script::ScriptedPush;
use crate::convert::nearest_u8;

/// How long a push lasts if the script does not say, s: a shove with a hand.
pub(super) const PUSH_S: f64 = 0.1;

/// A fault, with its own value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// The servo neither listens nor answers; its motor continues with its last command.
    Silent,
    /// Replies come late.
    Slow {
        /// Delay, ms.
        delay_ms: f64,
    },
    /// One bit of each reply flips on the way to the host; in a fast sync read, one in the servo's own block.
    BitFlip,
    /// Every byte of each reply is changed.
    Garbled,
    /// The content of a reply is changed but header, id and length stay true: 1 in 256 passes an 8-bit sum.
    Scrambled {
        /// Share of the replies affected, 0 to 1.
        share: f64,
    },
    /// Each reply stops before its end.
    CutShort,
    /// Random bytes precede each reply.
    Noise,
    /// The adapter gives the host back what it sends.
    Echo,
    /// The servo takes another servo's id for its own: two servos answer to one id and talk over each other.
    WrongId {
        /// The wrong id.
        as_id: u8,
    },
    /// For a whole bus, the adapter is gone; for one servo, its plug is out, and its supply with it.
    Unplugged,
    /// The host oversleeps once.
    LateHost {
        /// Delay, ms.
        delay_ms: f64,
    },
    /// The shaft does not turn, whatever the torque.
    Stuck,
    /// The servo's overload protection detects an overload.
    Overload,
    /// The supply of the whole bus is gone; when it returns, the servos restart.
    BrownOut,
    /// The servo restarts, once.
    Reset,
    /// The supply of the whole bus changes to the given voltage.
    LowVoltage {
        /// The voltage, V.
        volts: f64,
    },
    /// Something pushes the trunk.
    Push(ScriptedPush),
    /// The servo has the given temperature; afterwards it cools normally.
    Hot {
        /// The temperature, °C.
        celsius: f64,
    },
    /// The inertial measurement unit sends nothing.
    ImuSilent,
    /// It repeats its last output.
    ImuFrozen,
    /// Every byte it sends is changed.
    ImuGarbled,
    /// Its adapter is gone.
    ImuUnplugged,
}

/// The target of a kind, which decides which keys it has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The host, once: no `for_s`, `bus` or `id`.
    Host,
    /// Whole buses: no `id`.
    Buses,
    /// Servos, one or all of a bus.
    Servos,
    /// Servos, once: no `for_s`.
    ServosOnce,
    /// The inertial measurement unit: no `bus` or `id`.
    Imu,
    /// The trunk: no `bus` or `id`, and keys of its own.
    Trunk,
}

/// One line of the table: a kind of fault as scripts name it.
#[derive(Debug, Clone)]
pub struct Kind {
    /// Its name.
    pub word: &'static str,
    /// What it affects.
    pub scope: Scope,
    /// The key that only this kind has, its meaning, and its limits.
    pub own: Option<(&'static str, &'static str, RangeInclusive<f64>)>,
    /// Makes the fault from the value of that key; kinds without such a key ignore it.
    pub make: fn(f64) -> FaultKind,
}

const fn kind(word: &'static str, scope: Scope, make: fn(f64) -> FaultKind) -> Kind {
    Kind { word, scope, own: None, make }
}

/// Every kind of fault. Random faults depend on their order.
pub static KINDS: &[Kind] = &[
    kind("silent", Scope::Servos, |_| FaultKind::Silent),
    Kind {
        own: Some(("delay_ms", "by how many ms replies come late", 0.0..=1e6)),
        ..kind("slow", Scope::Servos, |delay_ms| FaultKind::Slow { delay_ms })
    },
    kind("bit-flip", Scope::Servos, |_| FaultKind::BitFlip),
    kind("garbled", Scope::Servos, |_| FaultKind::Garbled),
    Kind {
        own: Some(("share", "which share of the replies says something else", 0.0..=1.0)),
        ..kind("scrambled", Scope::Servos, |share| FaultKind::Scrambled { share })
    },
    kind("cut-short", Scope::Servos, |_| FaultKind::CutShort),
    kind("noise", Scope::Servos, |_| FaultKind::Noise),
    kind("echo", Scope::Buses, |_| FaultKind::Echo),
    Kind {
        own: Some(("as_id", "the id the servo takes for its own", 0.0..=253.0)),
        ..kind("wrong-id", Scope::Servos, |as_id| FaultKind::WrongId { as_id: nearest_u8(as_id) })
    },
    kind("unplugged", Scope::Servos, |_| FaultKind::Unplugged),
    Kind {
        own: Some(("delay_ms", "by how many ms the host oversleeps", 0.0..=1e6)),
        ..kind("late-host", Scope::Host, |delay_ms| FaultKind::LateHost { delay_ms })
    },
    kind("stuck", Scope::Servos, |_| FaultKind::Stuck),
    kind("overload", Scope::Servos, |_| FaultKind::Overload),
    kind("brown-out", Scope::Buses, |_| FaultKind::BrownOut),
    kind("reset", Scope::ServosOnce, |_| FaultKind::Reset),
    Kind {
        own: Some(("volts", "the voltage of the supply", 0.0..=100.0)),
        ..kind("low-voltage", Scope::Buses, |volts| FaultKind::LowVoltage { volts })
    },
    Kind {
        own: Some(("celsius", "the temperature of the servo", -40.0..=200.0)),
        ..kind("hot", Scope::Servos, |celsius| FaultKind::Hot { celsius })
    },
    kind("imu-silent", Scope::Imu, |_| FaultKind::ImuSilent),
    kind("imu-frozen", Scope::Imu, |_| FaultKind::ImuFrozen),
    kind("imu-garbled", Scope::Imu, |_| FaultKind::ImuGarbled),
    kind("imu-unplugged", Scope::Imu, |_| FaultKind::ImuUnplugged),
    kind("push", Scope::Trunk, |impulse_n_s| {
        FaultKind::Push(ScriptedPush {
            impulse_n_s,
            for_s: PUSH_S,
            towards_rad: None,
            place_m: [0.0; 3],
            every_s: None,
        })
    }),
];

/// The words of all kinds.
pub fn words() -> impl Iterator<Item = &'static str> {
    KINDS.iter().map(|kind| kind.word)
}

impl FaultKind {
    /// Its line of the table.
    pub(super) fn entry(self) -> Option<&'static Kind> {
        KINDS.iter().find(|kind| discriminant(&(kind.make)(0.0)) == discriminant(&self))
    }

    /// Its name in scripts.
    pub fn name(self) -> &'static str {
        self.entry().map_or("", |kind| kind.word)
    }

    /// What it affects.
    pub fn scope(self) -> Scope {
        self.entry().map_or(Scope::Servos, |kind| kind.scope)
    }

    /// The value of the key that only this kind has.
    pub(super) fn own(self) -> Option<f64> {
        match self {
            FaultKind::Slow { delay_ms: own }
            | FaultKind::LateHost { delay_ms: own }
            | FaultKind::Scrambled { share: own }
            | FaultKind::LowVoltage { volts: own }
            | FaultKind::Hot { celsius: own } => Some(own),
            FaultKind::WrongId { as_id } => Some(f64::from(as_id)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_makes_a_kind_of_its_own_that_keeps_its_value() {
        for kind in KINDS {
            let middle = kind.own.as_ref().map(|(.., range)| range.start().midpoint(*range.end()).round());
            let fault = (kind.make)(middle.unwrap_or_default());
            assert_eq!((fault.name(), fault.own()), (kind.word, middle));
        }
    }
}
