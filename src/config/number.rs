//! Numbers of a robot file, and their limits.

use toml::de::DeValue;

/// Larger numbers are typing errors in every unit of the schema, and their squares could overflow.
pub(super) const LARGEST: f64 = 1e9;
/// Largest lengths and coordinates, mm, and masses, kg: larger than any robot and its surroundings. The
/// computations on a robot file rely on these limits.
const LENGTH_MAX_MM: f64 = 1e5;
const MASS_MAX_KG: f64 = 1e5;
/// Largest angles, degrees: ten turns; larger ones are typing errors too.
const ANGLE_MAX_DEG: f64 = 3600.0;
/// Largest times, s: 100 days, longer than any run.
const TIME_MAX_S: f64 = 8.64e6;

/// The finite numbers that a key accepts.
#[derive(Debug, Clone, Copy)]
pub(super) enum Limits {
    /// Every number.
    Any,
    /// Above the first, at most the second.
    AboveToMost(f64, f64),
    /// Above the first and below the second.
    Between(f64, f64),
    /// At least the first and below the second.
    FromToBelow(f64, f64),
    /// From the first to the second, both included.
    FromTo(f64, f64),
}

impl Limits {
    /// For a length, mm.
    pub(super) const LENGTH: Limits = Limits::AboveToMost(0.0, LENGTH_MAX_MM);
    /// For a length that may be 0, mm.
    pub(super) const LENGTH_OR_NONE: Limits = Limits::FromTo(0.0, LENGTH_MAX_MM);
    /// For a coordinate along an axis, mm; and for directions.
    pub(super) const PLACE: Limits = Limits::FromTo(-LENGTH_MAX_MM, LENGTH_MAX_MM);
    /// For a mass, kg.
    pub(super) const MASS: Limits = Limits::AboveToMost(0.0, MASS_MAX_KG);
    /// For a mass that may be 0, kg.
    pub(super) const MASS_OR_NONE: Limits = Limits::FromTo(0.0, MASS_MAX_KG);
    /// For an angle without another limit, degrees.
    pub(super) const ANGLE: Limits = Limits::FromTo(-ANGLE_MAX_DEG, ANGLE_MAX_DEG);
    /// For a point in time, s.
    pub(super) const MOMENT: Limits = Limits::FromTo(0.0, TIME_MAX_S);

    /// True for accepted numbers; false for NaN, whatever the limits.
    pub(super) fn contains(self, value: f64) -> bool {
        match self {
            Limits::Any => !value.is_nan(),
            Limits::AboveToMost(low, high) => value > low && value <= high,
            Limits::Between(low, high) => value > low && value < high,
            Limits::FromToBelow(low, high) => value >= low && value < high,
            Limits::FromTo(low, high) => value >= low && value <= high,
        }
    }

    /// The limits, in words.
    pub(super) fn words(self) -> String {
        match self {
            Limits::Any => "a number".to_owned(),
            Limits::AboveToMost(low, high) => format!("a number above {low} and at most {high}"),
            Limits::Between(low, high) => format!("a number above {low} and below {high}"),
            Limits::FromToBelow(low, high) => format!("a number of at least {low} and below {high}"),
            Limits::FromTo(low, high) => format!("a number from {low} to {high}"),
        }
    }
}

/// A whole number that is not negative.
pub(super) fn whole(value: &DeValue<'_>) -> Option<u32> {
    let integer = value.as_integer()?;
    u32::from_str_radix(integer.as_str(), integer.radix()).ok()
}

/// Any number; infinity and NaN too.
pub(super) fn real(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(integer) if integer.radix() != 10 => whole(value).map(f64::from),
        DeValue::Integer(integer) => integer.as_str().parse().ok(),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}
