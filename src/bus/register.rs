//! Converts numbers to register bits and back, according to a [`Register`].

use crate::model::servo_model::{Encoding, Register};

/// The bits that encode `value`, in the lowest `register.bytes` bytes. A value that the register cannot hold
/// becomes the nearest one it can.
pub(crate) fn encode(register: Register, value: i64) -> u64 {
    let bits = bits(register);
    match register.encoding {
        Encoding::Unsigned => value.clamp(0, (1 << bits) - 1).unsigned_abs(),
        Encoding::TwosComplement => {
            let half = 1i64 << (bits - 1);
            value.clamp(-half, half - 1).cast_unsigned() & ((1 << bits) - 1)
        }
        Encoding::SignMagnitude(sign_bit) => {
            let sign = 1i64 << u32::from(sign_bit).min(bits - 1);
            let magnitude = value.clamp(1 - sign, sign - 1).unsigned_abs();
            if value < 0 { magnitude | sign.unsigned_abs() } else { magnitude }
        }
    }
}

/// The same bits with the high byte first, if the servos use that order.
pub(super) fn ordered(raw: u64, register: Register, is_big_endian: bool) -> u64 {
    if is_big_endian { raw.swap_bytes() >> (64 - bits(register)) } else { raw }
}

/// [`decode`] of bytes with the high byte first, if the servos use that order.
pub(super) fn decode_ordered(register: Register, bytes: &[u8], is_big_endian: bool) -> Option<i64> {
    if !is_big_endian {
        return decode(register, bytes);
    }
    let mut word = [0; 4];
    let (from, used) =
        (bytes.get(..usize::from(register.bytes))?, word.get_mut(..usize::from(register.bytes))?);
    used.copy_from_slice(from);
    used.reverse();
    decode(register, used)
}

/// The number in the first `register.bytes` of `bytes`; `None` if there are too few bytes.
pub(crate) fn decode(register: Register, bytes: &[u8]) -> Option<i64> {
    let bits = bits(register);
    let raw = bytes
        .get(..usize::from(register.bytes))?
        .iter()
        .rev()
        .fold(0i64, |raw, byte| (raw << 8 | i64::from(*byte)) & ((1 << bits) - 1));
    Some(match register.encoding {
        Encoding::Unsigned => raw,
        Encoding::TwosComplement if raw >> (bits - 1) == 1 => raw - (1 << bits),
        Encoding::TwosComplement => raw,
        Encoding::SignMagnitude(sign_bit) => {
            let sign = 1i64 << u32::from(sign_bit).min(bits - 1);
            // Bits above the sign bit have no meaning.
            let magnitude = raw & (sign - 1);
            if raw & sign == 0 { magnitude } else { -magnitude }
        }
    })
}

/// Width in bits, 8 to 32: tables hold no wider registers.
fn bits(register: Register) -> u32 {
    8 * u32::from(register.bytes.clamp(1, 4))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::bus::dynamixel::DYNAMIXEL_X;
    use crate::bus::feetech::{FEETECH_SCS, FEETECH_STS};

    #[test]
    fn encodings_match_examples_of_the_manuals() {
        // Feetech wiki, ft-scs example 2: 18 05 is 1304.
        assert_eq!(decode(FEETECH_STS.present_position, &[0x18, 0x05]), Some(1304));
        // ROBOTIS e-manual, sync read example: 1F 08 00 00 is 2079.
        assert_eq!(decode(DYNAMIXEL_X.present_position, &[0x1F, 0x08, 0, 0]), Some(2079));
    }

    #[test]
    fn signs_are_encoded_as_the_register_says() {
        let position = FEETECH_STS.goal_position;
        assert_eq!(encode(position, -1), 0x8001);
        assert_eq!(encode(position, 4095), 0x0FFF);
        assert_eq!(decode(position, &[0x01, 0x80]), Some(-1));
        assert_eq!(decode(position, &[0x00, 0x80]), Some(0), "minus zero is zero");
        // Load, sign in bit 10: 0x400 + 100 is -100; bits above it are ignored.
        assert_eq!(decode(FEETECH_STS.present_load, &[0x64, 0x04]), Some(-100));
        assert_eq!(decode(FEETECH_STS.present_load, &[0x64, 0xF8]), Some(100));
        assert_eq!(encode(DYNAMIXEL_X.goal_position, -1), 0xFFFF_FFFF);
        assert_eq!(decode(DYNAMIXEL_X.present_position, &[0xFF; 4]), Some(-1));
        assert_eq!(decode(DYNAMIXEL_X.present_load, &[0xFE, 0xFF]), Some(-2));
    }

    #[test]
    fn scs_words_have_the_high_byte_first() {
        // Feetech wiki, memory-scscl: the highest angle limit as shipped, 1003, is 03 EB.
        let position = FEETECH_SCS.goal_position;
        assert_eq!(ordered(encode(position, 1003), position, true).to_le_bytes()[..2], [0x03, 0xEB]);
        assert_eq!(decode_ordered(position, &[0x03, 0xEB, 7], true), Some(1003));
        let torque = FEETECH_SCS.torque_enable;
        assert_eq!(ordered(encode(torque, 1), torque, true), 1);
        assert_eq!(decode_ordered(FEETECH_SCS.present_speed, &[0x80, 0x05], true), Some(-5));
        assert_eq!(decode_ordered(position, &[3], true), None);
        assert_eq!(ordered(0x0803, position, false), 0x0803);
    }

    #[test]
    fn a_value_that_does_not_fit_becomes_the_nearest_that_does() {
        assert_eq!(encode(FEETECH_STS.torque_limit, -5), 0);
        assert_eq!(encode(FEETECH_STS.torque_limit, 70_000), 0xFFFF);
        assert_eq!(encode(FEETECH_STS.goal_position, 40_000), 0x7FFF);
        assert_eq!(encode(FEETECH_STS.goal_position, i64::MIN), 0xFFFF);
        assert_eq!(encode(DYNAMIXEL_X.goal_position, i64::MAX), 0x7FFF_FFFF);
        assert_eq!(encode(DYNAMIXEL_X.goal_position, i64::MIN), 0x8000_0000);
    }

    #[test]
    fn too_few_bytes_decode_to_nothing() {
        assert_eq!(decode(FEETECH_STS.present_position, &[1]), None);
        assert_eq!(decode(DYNAMIXEL_X.present_position, &[]), None);
    }

    proptest! {
        #[test]
        fn decode_is_the_inverse_of_encode(value in any::<i32>()) {
            for register in [DYNAMIXEL_X.goal_position, FEETECH_STS.goal_position, FEETECH_STS.present_load,
                DYNAMIXEL_X.present_load, FEETECH_STS.torque_limit, FEETECH_STS.torque_enable] {
                let raw = encode(register, i64::from(value));
                let back = decode(register, &raw.to_le_bytes()).unwrap();
                prop_assert_eq!(encode(register, back), raw);
                prop_assert!(back.abs() <= i64::from(value).abs());
            }
            prop_assert_eq!(
                decode(DYNAMIXEL_X.goal_position, &encode(DYNAMIXEL_X.goal_position, i64::from(value)).to_le_bytes()),
                Some(i64::from(value))
            );
        }

        #[test]
        fn any_register_and_bytes_are_handled_without_a_panic(
            bytes in 0u8..12, sign in any::<u8>(), value in any::<i64>(), data in any::<[u8; 12]>(),
        ) {
            for encoding in [Encoding::Unsigned, Encoding::TwosComplement, Encoding::SignMagnitude(sign)] {
                let register = Register { address: 0, bytes, encoding };
                encode(register, value);
                decode(register, &data);
            }
        }
    }
}
