//! Converts counts of a register to the units people use, and back.

use std::fmt;

use super::{Identity, RegisterInfo, Scale, Series};
use crate::bus::{decode, encode};
use crate::model::servo_model::Register;

/// The bytes of `raw` in a register, in the byte order of `series`.
pub(crate) fn encode_bytes(series: &Series, register: Register, raw: i64) -> Vec<u8> {
    let mut bytes = encode(register, raw).to_le_bytes().to_vec();
    bytes.truncate(usize::from(register.bytes));
    if series.registers.is_big_endian {
        bytes.reverse();
    }
    bytes
}

/// The count that these bytes encode; 0 if there are too few.
pub(crate) fn decode_bytes(series: &Series, register: Register, bytes: &[u8]) -> i64 {
    let mut bytes = bytes.to_vec();
    if series.registers.is_big_endian {
        bytes.reverse();
    }
    decode(register, &bytes).unwrap_or(0)
}

/// The value of a register, as a count and in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// The count in the register.
    pub raw: i64,
    /// The same in `unit`.
    pub physical: f64,
    /// The unit, such as `deg`; empty for plain numbers.
    pub unit: &'static str,
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.unit {
            "" => write!(f, "{}", self.raw),
            unit if self.physical.fract().abs() < 1e-9 => write!(f, "{:.0} {unit}", self.physical),
            unit => write!(f, "{:.2} {unit}", self.physical),
        }
    }
}

/// A value that a register cannot take.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} {value}: expected {expected}")]
pub struct BadValue {
    /// The register.
    pub name: String,
    /// The value to write.
    pub value: String,
    /// The values that it can take.
    pub expected: String,
}

const BAUD: &str = "baud";

impl Identity {
    /// The meaning of `raw` in `register`.
    pub fn value(&self, register: &RegisterInfo, raw: i64) -> Value {
        if register.scale == Scale::Baud {
            return match self.series.protocol.baud_of_code(raw) {
                Some(baud) => Value { raw, physical: f64::from(baud), unit: BAUD },
                None => Value { raw, physical: to_f64(raw), unit: "" },
            };
        }
        let (per_count, unit) = self.unit(register);
        Value { raw, physical: to_f64(raw) * per_count, unit }
    }

    /// The count of `register` nearest to `physical`, which is in the register's unit.
    ///
    /// # Errors
    /// If the register is read-only, or cannot take such a value.
    pub fn count(&self, register: &RegisterInfo, physical: f64) -> Result<i64, BadValue> {
        let bad = |expected: String| BadValue {
            name: register.name.to_string(),
            value: physical.to_string(),
            expected,
        };
        if register.scale == Scale::Baud {
            let codes = self.series.protocol.spec().rates;
            let code = codes.iter().position(|baud| (f64::from(*baud) - physical).abs() < 0.5);
            let known = || codes.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
            let code = code.ok_or_else(|| bad(format!("one of {}", known())))?;
            return i64::try_from(code).map_err(|_| bad(known()));
        }
        let (per_count, unit) = self.unit(register);
        let count = (physical / per_count).round();
        let (low, high) = register.range;
        // A NaN is in no range.
        if !(to_f64(low)..=to_f64(high)).contains(&count) {
            let (a, b) = (self.value(register, low).physical, self.value(register, high).physical);
            return Err(bad(match unit {
                "" => format!("{low} to {high}"),
                unit => format!("{a:.2} to {b:.2} {unit}"),
            }));
        }
        #[allow(clippy::cast_possible_truncation, reason = "a whole number inside the range")]
        Ok(count as i64)
    }

    /// Converts a count of `register` from the caller to a whole number, and checks its range.
    ///
    /// # Errors
    /// If it is no whole number, or outside the register's range.
    pub fn raw_count(&self, register: &RegisterInfo, count: f64) -> Result<i64, BadValue> {
        let plain = RegisterInfo { scale: Scale::Plain, ..register.clone() };
        match count.fract().abs() > 0.0 {
            true => Err(BadValue {
                name: register.name.to_string(),
                value: count.to_string(),
                expected: "a whole number of counts".to_owned(),
            }),
            false => self.count(&plain, count),
        }
    }

    /// One count, in the register's unit.
    fn unit(&self, register: &RegisterInfo) -> (f64, &'static str) {
        match register.scale {
            Scale::Plain | Scale::Baud => (1.0, ""),
            Scale::Linear(per_count, unit) => (per_count, unit),
            Scale::Current => {
                ((self.series.current_unit_a)(self.model_number).map_or(1.0, |unit| unit * 1e3), "mA")
            }
            // 1 count/s is 360 / 4096 / 6 rpm.
            Scale::PhasedSpeed if self.is_speed_fine => (60.0 / 4096.0, super::RPM),
            Scale::PhasedSpeed => (50.0 * 60.0 / 4096.0, super::RPM),
        }
    }
}

/// Registers have 32 bits at most.
#[allow(clippy::cast_precision_loss, reason = "32 bits at most")]
fn to_f64(raw: i64) -> f64 {
    raw as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::dynamixel::X;
    use crate::bus::feetech::{SCS, STS};
    use crate::model::Firmware;

    fn identity(series: &'static Series, model_number: u16, is_speed_fine: bool) -> Identity {
        Identity { series, model_number, firmware: Firmware { major: 3, minor: Some(10) }, is_speed_fine }
    }

    fn said(identity: Identity, name: &str, raw: i64) -> String {
        identity.value(&identity.register(name).unwrap(), raw).to_string()
    }

    /// Values from the makers' pages.
    #[test]
    fn counts_convert_to_units_as_the_manuals_say() {
        let xm = identity(&X, 1030, true);
        assert_eq!(said(xm, "present_position", 2048), "180 deg");
        assert_eq!(said(xm, "present_velocity", -100), "-22.90 rpm");
        assert_eq!(said(xm, "present_current", 1193), "3209.17 mA");
        assert_eq!(said(xm, "present_input_voltage", 121), "12.10 V");
        assert_eq!(said(xm, "pwm_limit", 885), "100 %");
        assert_eq!(said(xm, "baud_rate", 6), "4000000 baud");
        assert_eq!(said(xm, "return_delay_time", 250), "500 us");
        assert_eq!(said(identity(&X, 1200, true), "current_limit", 1750), "1750 mA");
        assert_eq!(said(identity(&X, 1060, true), "present_load", 500), "50 %");
        let sts = identity(&STS, 777, true);
        assert_eq!(said(sts, "baud_rate", 5), "76800 baud");
        // 0.0146 rpm and 0.732 rpm a count.
        assert_eq!(said(sts, "present_velocity", 1000), "14.65 rpm");
        assert_eq!(said(identity(&STS, 777, false), "present_velocity", 100), "73.24 rpm");
        assert_eq!(said(identity(&SCS, 1284, true), "present_position", 1023), "299.71 deg");
    }

    #[test]
    fn every_count_in_range_round_trips_and_others_are_refused() {
        for (series, number) in [(&X, 1200), (&STS, 777), (&SCS, 1284)] {
            let identity = identity(series, number, true);
            for register in identity.registers().iter().filter(|of| of.range != (0, 0)) {
                let (low, high) = register.range;
                for raw in (0..=64).map(|n| low + (high - low) * n / 64) {
                    let value = identity.value(register, raw);
                    assert_eq!(identity.count(register, value.physical), Ok(raw), "{}", register.name);
                }
                let (per_count, _) = identity.unit(register);
                for raw in [low - 1, high + 1] {
                    let result = identity.count(register, to_f64(raw) * per_count);
                    assert!(register.scale == Scale::Baud || result.is_err(), "{}: {raw}", register.name);
                }
                assert!(identity.count(register, f64::NAN).is_err(), "{}", register.name);
                assert!(identity.count(register, f64::INFINITY).is_err(), "{}", register.name);
            }
        }
    }

    #[test]
    fn a_wrong_value_is_reported_with_its_range() {
        let xm = identity(&X, 1030, true);
        let told = |name, value| xm.count(&xm.register(name).unwrap(), value).unwrap_err().to_string();
        assert_eq!(told("max_position_limit", 400.0), "max_position_limit 400: expected 0.00 to 359.91 deg");
        assert_eq!(
            told("baud_rate", 76_800.0),
            "baud_rate 76800: expected one of 9600, 57600, 115200, 1000000, 2000000, 3000000, 4000000, 4500000"
        );
    }
}
