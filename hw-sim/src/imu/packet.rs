//! The unit's protocol: frames out, commands in. Written from the maker's manual (WitMotion, WT901 datasheet
//! v20-0702, sections 5.1 and 5.2, and the page "WIT Standard Communication Protocol").

use crate::convert::{low_byte, round_to_i64};

/// First byte of every frame.
const HEAD: u8 = 0x55;
/// Accelerations.
pub(super) const ACCELERATION: u8 = 0x51;
/// Angular rates.
pub(super) const RATE: u8 = 0x52;
/// Angles.
pub(super) const ANGLE: u8 = 0x53;
/// Four registers, in answer to a command.
pub(super) const REGISTERS: u8 = 0x5F;

/// A frame of four 16-bit numbers: head, kind, numbers low byte first, low byte of the sum of all before it.
pub(super) fn frame(kind: u8, numbers: [i16; 4]) -> [u8; 11] {
    let mut bytes = [0; 11];
    (bytes[0], bytes[1]) = (HEAD, kind);
    for (place, number) in bytes[2..10].chunks_exact_mut(2).zip(numbers) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    bytes[10] = low_byte(bytes[..10].iter().map(|byte| u32::from(*byte)).sum());
    bytes
}

/// `value` scaled so that `full` is 32768; the nearest possible number.
pub(super) fn number(value: f64, full: f64) -> i16 {
    let number = round_to_i64(value / full * 32768.0).clamp(i16::MIN.into(), i16::MAX.into());
    i16::try_from(number).unwrap_or_default()
}

/// The same for an angle, rad, which wraps beyond half a turn.
pub(super) fn angle(angle_rad: f64) -> i16 {
    let halves = angle_rad / std::f64::consts::PI;
    let number = round_to_i64((halves - 2.0 * (halves / 2.0).round()) * 32768.0);
    // Half a turn is both 32768, which does not fit, and -32768.
    i16::try_from(number).unwrap_or(i16::MIN)
}

/// Finds commands: FF AA, register, value low byte first.
#[derive(Debug, Default)]
pub(super) struct Commands {
    heard: Vec<u8>,
}

impl Commands {
    /// Takes one byte; returns the command that it completes, as register and value.
    pub(super) fn push(&mut self, byte: u8) -> Option<(u8, u16)> {
        self.heard.push(byte);
        loop {
            match *self.heard.as_slice() {
                [0xFF, 0xAA, register, low, high] => {
                    self.heard.clear();
                    return Some((register, u16::from_le_bytes([low, high])));
                }
                [] | [0xFF] | [0xFF, 0xAA, ..] => return None,
                _ => drop(self.heard.remove(0)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manuals_commands_are_found_behind_noise() {
        let mut commands = Commands::default();
        let bytes = [0xFF, 0xFF, 0xAA, 0x69, 0x88, 0xB5, 0x12, 0xFF, 0xAA, 0x03, 0x0B, 0x00];
        let found: Vec<_> = bytes.into_iter().filter_map(|byte| commands.push(byte)).collect();
        assert_eq!(found, [(0x69, 0xB588), (0x03, 0x000B)]);
    }

    #[test]
    fn half_a_turn_either_way_has_one_code() {
        let half = std::f64::consts::PI;
        assert_eq!((angle(half), angle(-half), angle(0.5 * half)), (-32768, -32768, 16384));
        assert_eq!(angle(1.5 * half), -16384);
        assert_eq!((number(40.0, 32.0), number(-40.0, 32.0), number(16.0, 32.0)), (32767, -32768, 16384));
    }
}
