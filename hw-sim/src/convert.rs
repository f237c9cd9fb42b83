//! The only functions in which a number may lose range or fraction. In: any number. Out: the nearest one that
//! fits.

/// Largest whole number that a conversion returns: callers can still add to it and negate it without
/// overflow.
const LARGEST: i64 = 1 << 61;

/// Nearest whole number; at most 2^61 in size, and NaN becomes 0. A script can throw a body so far that its
/// measurements have any size.
#[expect(clippy::cast_possible_truncation, reason = "`as` saturates, and the value is already whole")]
pub(crate) fn round_to_i64(value: f64) -> i64 {
    (value.round() as i64).clamp(-LARGEST, LARGEST)
}

/// Nearest byte.
pub(crate) fn nearest_u8(value: f64) -> u8 {
    u8::try_from(round_to_i64(value).clamp(0, 255)).unwrap_or(u8::MAX)
}

/// Seconds as whole nanoseconds, 0 for negative values and NaN.
pub(crate) fn nanoseconds(seconds: f64) -> u64 {
    u64::try_from(round_to_i64(seconds * 1e9)).unwrap_or(0)
}

/// The low byte of a sum, as checksums are defined.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_never_overflows_later_arithmetic() {
        for value in [f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 9.3e18, -9.3e18] {
            let whole = round_to_i64(value);
            assert_eq!(whole.signum().to_string(), if value > 0.0 { "1" } else { "-1" });
            assert!(whole.checked_abs().is_some() && whole.checked_mul(3).is_some(), "{value}");
        }
        assert_eq!(
            [round_to_i64(f64::NAN), round_to_i64(-2.5), round_to_i64(1e15)],
            [0, -3, 1_000_000_000_000_000]
        );
    }
}
