//! Numbers of a robot file, and the limits they keep.

use toml::de::DeValue;

/// Numbers beyond this are slips of the hand in every unit of the schema, and their squares could overflow.
pub(super) const LARGEST: f64 = 1e9;

/// Which finite numbers a key takes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Limits {
    /// Every number.
    Any,
    /// Above zero.
    Positive,
    /// Zero or more.
    NotNegative,
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
    /// True for the numbers it takes; false for NaN, whatever the limits.
    pub(super) fn contains(self, value: f64) -> bool {
        match self {
            Limits::Any => !value.is_nan(),
            Limits::Positive => value > 0.0,
            Limits::NotNegative => value >= 0.0,
            Limits::AboveToMost(low, high) => value > low && value <= high,
            Limits::Between(low, high) => value > low && value < high,
            Limits::FromToBelow(low, high) => value >= low && value < high,
            Limits::FromTo(low, high) => value >= low && value <= high,
        }
    }

    /// What it takes, in words.
    pub(super) fn words(self) -> String {
        match self {
            Limits::Any => "a number".to_owned(),
            Limits::Positive => "a number above 0".to_owned(),
            Limits::NotNegative => "a number of 0 or more".to_owned(),
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
