//! Fault scripts as typed in: TOML to a checked list. Knows no bus; names are looked up when a world is built.

use serde::Deserialize;
use toml::Spanned;

/// What is wrong with a fault script.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FaultError {
    /// Not TOML, an unknown or doubled key, or a value of the wrong type; the text shows the line.
    #[error("fault script: {0}")]
    Syntax(String),
    /// A key that this entry must have, must not have, or whose value cannot be.
    #[error("fault script: fault {entry} (line {line}): `{key}` {problem}")]
    Entry {
        /// Place in the script, from 1.
        entry: usize,
        /// Line the entry starts in, from 1.
        line: usize,
        /// The key.
        key: &'static str,
        /// What is wrong, and what was expected.
        problem: String,
    },
}

/// What can go wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// The servo neither listens nor answers; its motor goes on as last told.
    Silent,
    /// One bit of each reply is flipped on the way to the host; in a fast sync read, of the servo's own block.
    BitFlip,
    /// Random bytes run ahead of each reply.
    Noise,
    /// The adapter gives the host back what it sends.
    Echo,
    /// The adapter is gone.
    Unplugged,
    /// The host oversleeps once.
    LateHost {
        /// By how much, ms.
        delay_ms: f64,
    },
    /// The shaft does not turn, whatever the torque.
    Stuck,
    /// The supply of the whole bus has another voltage.
    LowVoltage {
        /// Which, V.
        volts: f64,
    },
    /// The servo has another temperature; afterwards it cools as it would.
    Hot {
        /// Which, °C.
        celsius: f64,
    },
}

/// One entry of a script.
#[derive(Debug, Clone, PartialEq)]
pub struct ScriptedFault {
    /// When it begins, s of virtual time, not negative.
    pub at_s: f64,
    /// How long it lasts, s, above 0; `None` means for good.
    pub for_s: Option<f64>,
    /// What happens.
    pub kind: FaultKind,
    /// Name of the bus; `None` means every bus.
    pub bus: Option<String>,
    /// Id of the servo; `None` means every servo.
    pub id: Option<u8>,
}

/// A checked list of faults. The default is none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaultScript {
    /// The entries, in the order of the script.
    pub faults: Vec<ScriptedFault>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScript {
    #[serde(default)]
    fault: Vec<Spanned<RawFault>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFault {
    at_s: f64,
    for_s: Option<f64>,
    kind: String,
    bus: Option<String>,
    id: Option<u8>,
    delay_ms: Option<f64>,
    volts: Option<f64>,
    celsius: Option<f64>,
}

const KINDS: &str = "silent, bit-flip, noise, echo, unplugged, late-host, stuck, low-voltage, hot";
/// Longest time a script may name, s: 100 days, far from where nanoseconds run out.
const TIME_MAX_S: f64 = 8.64e6;

/// The key and what is wrong with it.
type Problem = (&'static str, String);

impl FaultScript {
    /// Reads a script: a list of `[[fault]]`, each with `kind`, `at_s`, optionally `for_s` (else for good), `bus`
    /// (else every bus), `id` (else every servo), and the kind's own key: `delay_ms`, `volts` or `celsius`.
    ///
    /// # Errors
    /// [`FaultError`] names the entry, its line and the key.
    pub fn from_toml(text: &str) -> Result<FaultScript, FaultError> {
        let raw: RawScript = toml::from_str(text).map_err(|error| FaultError::Syntax(error.to_string()))?;
        let mut faults = Vec::new();
        for (entry, spanned) in (1..).zip(raw.fault) {
            let line = text.get(..spanned.span().start).map_or(0, |before| before.matches('\n').count()) + 1;
            let fault = check(spanned.into_inner());
            faults.push(fault.map_err(|(key, problem)| FaultError::Entry { entry, line, key, problem })?);
        }
        Ok(FaultScript { faults })
    }
}

fn check(raw: RawFault) -> Result<ScriptedFault, Problem> {
    number("at_s", raw.at_s, 0.0..=TIME_MAX_S)?;
    if let Some(for_s) = raw.for_s {
        number("for_s", for_s, 1e-9..=TIME_MAX_S)?;
    }
    if raw.id.is_some() && raw.bus.is_none() {
        return Err(("id", "needs a `bus` beside it: ids are only unique on a bus".into()));
    }
    let kind = kind(&raw)?;
    let is_of_the_host = matches!(kind, FaultKind::LateHost { .. });
    let is_of_a_bus = matches!(kind, FaultKind::Echo | FaultKind::Unplugged | FaultKind::LowVoltage { .. });
    for (key, is_given, is_wrong) in [
        ("for_s", raw.for_s.is_some(), is_of_the_host),
        ("bus", raw.bus.is_some(), is_of_the_host),
        ("id", raw.id.is_some(), is_of_the_host || is_of_a_bus),
        ("delay_ms", raw.delay_ms.is_some(), !is_of_the_host),
        ("volts", raw.volts.is_some(), !matches!(kind, FaultKind::LowVoltage { .. })),
        ("celsius", raw.celsius.is_some(), !matches!(kind, FaultKind::Hot { .. })),
    ] {
        if is_given && is_wrong {
            return Err((key, format!("does not belong to kind \"{}\"; leave it out", raw.kind)));
        }
    }
    Ok(ScriptedFault { at_s: raw.at_s, for_s: raw.for_s, kind, bus: raw.bus, id: raw.id })
}

fn kind(raw: &RawFault) -> Result<FaultKind, Problem> {
    let needed = |key: &'static str, value: Option<f64>, range| {
        let value = value.ok_or_else(|| (key, format!("is missing; kind \"{}\" needs it", raw.kind)))?;
        number(key, value, range)
    };
    Ok(match raw.kind.as_str() {
        "silent" => FaultKind::Silent,
        "bit-flip" => FaultKind::BitFlip,
        "noise" => FaultKind::Noise,
        "echo" => FaultKind::Echo,
        "unplugged" => FaultKind::Unplugged,
        "late-host" => FaultKind::LateHost { delay_ms: needed("delay_ms", raw.delay_ms, 0.0..=1e6)? },
        "stuck" => FaultKind::Stuck,
        "low-voltage" => FaultKind::LowVoltage { volts: needed("volts", raw.volts, 0.0..=100.0)? },
        "hot" => FaultKind::Hot { celsius: needed("celsius", raw.celsius, -40.0..=200.0)? },
        _ => return Err(("kind", format!("is \"{}\"; expected one of {KINDS}", raw.kind))),
    })
}

fn number(key: &'static str, value: f64, range: std::ops::RangeInclusive<f64>) -> Result<f64, Problem> {
    if range.contains(&value) {
        Ok(value)
    } else {
        Err((key, format!("is {value}; expected a number of {} to {}", range.start(), range.end())))
    }
}
