//! The only places where a number may lose range or fraction. In: any number. Out: the nearest one that fits.

/// Nearest whole number; saturates, and NaN becomes 0.
#[expect(clippy::cast_possible_truncation, reason = "`as` saturates, and the value is already whole")]
pub(crate) fn round_to_i64(value: f64) -> i64 {
    value.round() as i64
}

/// Nearest byte.
pub(crate) fn nearest_u8(value: f64) -> u8 {
    u8::try_from(round_to_i64(value).clamp(0, 255)).unwrap_or(u8::MAX)
}

/// Seconds as whole nanoseconds, 0 for what is negative or NaN.
pub(crate) fn nanoseconds(seconds: f64) -> u64 {
    u64::try_from(round_to_i64(seconds * 1e9)).unwrap_or(0)
}

/// The low byte of a sum: checksums are defined by it.
pub(crate) fn low_byte(value: u32) -> u8 {
    value.to_le_bytes()[0]
}

/// A length as a 16-bit field; packets here are far shorter.
pub(crate) fn length_u16(length: usize) -> u16 {
    u16::try_from(length).unwrap_or(u16::MAX)
}

/// A length as an 8-bit field.
pub(crate) fn length_u8(length: usize) -> u8 {
    u8::try_from(length).unwrap_or(u8::MAX)
}
