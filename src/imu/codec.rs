//! WitMotion's standard protocol: decodes bytes to frames and encodes commands to bytes.
//!
//! A frame has 11 bytes: 0x55, its kind, four 16-bit numbers low byte first, and the low byte of the sum of all
//! bytes before it (WT901 datasheet v20-0702, 5.1). A command has five: FF AA, register, value low byte first
//! (5.2).

use glam::DVec3;

/// Bytes of a frame.
const FRAME_BYTES: usize = 11;
/// First byte of a frame.
const HEAD: u8 = 0x55;
/// Kinds of frame: time is 0x50, registers 0x5F.
const KINDS: std::ops::RangeInclusive<u8> = 0x50..=0x5F;
/// Full scale of accelerations, m/s^2: 16 g (5.1.2).
const ACCELERATION_FULL_M_S2: f64 = 16.0 * 9.806_65;
/// Full scale of turn rates, rad/s: 2000 degrees/s (5.1.3).
const RATE_FULL_RAD_S: f64 = 2000.0 / 180.0 * std::f64::consts::PI;
/// Full scale of angles, rad: half a turn (5.1.4).
const ANGLE_FULL_RAD: f64 = std::f64::consts::PI;
/// Kind of the frame of a quaternion ("WIT Standard Communication Protocol").
const QUATERNION: u8 = 0x59;
/// Full scale of every number.
const FULL: f64 = 32768.0;

/// Contents of a frame, as raw numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// Acceleration minus gravity along the unit's axes; level and at rest z is one g.
    Acceleration([i16; 3]),
    /// Turn rate about the unit's axes.
    Rate([i16; 3]),
    /// Roll, pitch and yaw: the unit turned by yaw about z, then by pitch about the new y, then by roll about the
    /// new x (5.1.4).
    Angle([i16; 3]),
    /// Four registers, in answer to [`read_command`].
    Registers([i16; 4]),
    /// Another kind of frame; its number.
    Other(u8),
}

/// Finds frames in received bytes.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    bytes: [u8; FRAME_BYTES],
    count: usize,
}

impl Decoder {
    /// Takes one byte; returns the frame that ends with it. If the bytes are not a frame, the decoder drops only
    /// the first, so that it finds a frame that begins among them.
    pub fn push(&mut self, byte: u8) -> Option<Frame> {
        if let Some(place) = self.bytes.get_mut(self.count) {
            *place = byte;
            self.count += 1;
        }
        while self.count > 0 {
            let is_head = self.bytes[0] == HEAD && (self.count < 2 || KINDS.contains(&self.bytes[1]));
            if is_head && self.count < FRAME_BYTES {
                return None;
            }
            let sum = self.bytes[..FRAME_BYTES - 1].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
            if is_head && sum == self.bytes[FRAME_BYTES - 1] {
                self.count = 0;
                return Some(self.frame());
            }
            self.bytes.copy_within(1..self.count, 0);
            self.count -= 1;
        }
        None
    }

    fn frame(&self) -> Frame {
        let [_, kind, a, b, c, d, e, f, g, h, _] = self.bytes;
        let [x, y, z, last] = [[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes);
        match kind {
            0x51 => Frame::Acceleration([x, y, z]),
            0x52 => Frame::Rate([x, y, z]),
            0x53 => Frame::Angle([x, y, z]),
            0x5F => Frame::Registers([x, y, z, last]),
            kind => Frame::Other(kind),
        }
    }
}

/// One measurement: the contents of the three frames of one output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RawSample {
    acceleration: [i16; 3],
    rate: [i16; 3],
    angle: [i16; 3],
}

impl RawSample {
    /// The output of a unit that measures this: acceleration minus gravity (m/s^2), turn rate (rad/s) and angles
    /// (rad).
    #[cfg(test)]
    pub(super) fn of(specific_force_m_s2: DVec3, rate_rad_s: DVec3, angles_rad: DVec3) -> RawSample {
        #[allow(clippy::cast_possible_truncation, reason = "full scale fits")]
        let raw = |values: DVec3, full: f64| (values * (FULL / full)).to_array().map(|value| value as i16);
        RawSample {
            acceleration: raw(specific_force_m_s2, ACCELERATION_FULL_M_S2),
            rate: raw(rate_rad_s, RATE_FULL_RAD_S),
            angle: raw(angles_rad, ANGLE_FULL_RAD),
        }
    }

    /// Acceleration minus gravity along the unit's axes, m/s^2.
    pub fn specific_force_m_s2(&self) -> DVec3 {
        scaled(self.acceleration, ACCELERATION_FULL_M_S2)
    }

    /// Turn rate about the unit's axes, rad/s, as the unit sends it.
    pub fn rate_rad_s(&self) -> DVec3 {
        scaled(self.rate, RATE_FULL_RAD_S)
    }

    /// Roll, pitch and yaw of the unit, rad, as the unit sends them.
    pub fn angles_rad(&self) -> DVec3 {
        scaled(self.angle, ANGLE_FULL_RAD)
    }
}

fn scaled(numbers: [i16; 3], full: f64) -> DVec3 {
    DVec3::from_array(numbers.map(f64::from)) * (full / FULL)
}

/// Joins the frames of one output. A unit sends them in the order of their kinds, so an angle ends a
/// measurement; a measurement that lost a frame is dropped.
#[derive(Debug, Clone, Default)]
pub struct Sampler {
    decoder: Decoder,
    acceleration: Option<[i16; 3]>,
    rate: Option<[i16; 3]>,
    kinds: KindsHeard,
}

/// The kinds of frame that a unit has sent so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct KindsHeard {
    acceleration: bool,
    rate: bool,
    angle: bool,
    quaternion: bool,
    other: bool,
}

impl KindsHeard {
    /// Words for a unit that is heard, but does not send all that a robot needs; `None` for any other.
    pub fn missing(&self) -> Option<String> {
        let KindsHeard { acceleration, rate, angle, quaternion, other } = *self;
        let needed = [(acceleration, "acceleration"), (rate, "turn rate"), (angle, "angle")];
        let all = needed.into_iter().chain([(quaternion, "quaternion"), (other, "other frames")]);
        let sent: Vec<&str> = all.filter(|(is_sent, _)| *is_sent).map(|(_, name)| name).collect();
        let lacking: Vec<&str> =
            needed.iter().filter(|(is_sent, _)| !is_sent).map(|(_, name)| *name).collect();
        if sent.is_empty() || lacking.is_empty() {
            return None;
        }
        Some(format!(
            "heard, but it does not send {}: it sends {}; 'hippocamp imu setup' switches on what is missing",
            lacking.join(" and "),
            sent.join(" and ")
        ))
    }
}

impl Sampler {
    /// The kinds of frame that have come so far.
    pub fn kinds(&self) -> KindsHeard {
        self.kinds
    }

    /// Takes one byte; returns the measurement that ends with it.
    pub fn push(&mut self, byte: u8) -> Option<RawSample> {
        let frame = self.decoder.push(byte)?;
        let kinds = &mut self.kinds;
        *match frame {
            Frame::Acceleration(_) => &mut kinds.acceleration,
            Frame::Rate(_) => &mut kinds.rate,
            Frame::Angle(_) => &mut kinds.angle,
            Frame::Other(QUATERNION) => &mut kinds.quaternion,
            Frame::Registers(_) | Frame::Other(_) => &mut kinds.other,
        } = true;
        match frame {
            Frame::Acceleration(acceleration) => {
                (self.acceleration, self.rate) = (Some(acceleration), None);
                None
            }
            Frame::Rate(rate) => {
                self.rate = Some(rate);
                None
            }
            Frame::Angle(angle) => {
                let (acceleration, rate) = (self.acceleration.take(), self.rate.take());
                Some(RawSample { acceleration: acceleration?, rate: rate?, angle })
            }
            Frame::Registers(_) | Frame::Other(_) => None,
        }
    }
}

/// Every frame in `bytes`.
pub fn frames_in(bytes: &[u8]) -> Vec<Frame> {
    let mut decoder = Decoder::default();
    bytes.iter().filter_map(|byte| decoder.push(*byte)).collect()
}

/// A register of the unit (5.2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Register {
    /// Writing 0 stores the settings permanently.
    Save = 0x00,
    /// Which frames the unit sends: bit 1 acceleration, 2 turn rate, 3 angle.
    Content = 0x02,
    /// Output rate: see [`rate_code`].
    Rate = 0x03,
    /// Line rate: see [`baud_code`].
    Baud = 0x04,
    /// Which registers to report.
    Read = 0x27,
    /// Writing [`KEY`] lets the unit take commands for 10 s ("WIT Standard Communication Protocol").
    Key = 0x69,
}

/// The value that unlocks the unit through [`Register::Key`].
pub const KEY: u16 = 0xB588;
/// Value of [`Register::Content`] for exactly what a robot needs.
pub const CONTENT: u16 = 0x0E;

/// The command that sets a register.
pub fn command(register: Register, value: u16) -> [u8; 5] {
    let [low, high] = value.to_le_bytes();
    [0xFF, 0xAA, register as u8, low, high]
}

/// The command that requests a register and the next three in a [`Frame::Registers`].
pub fn read_command(register: Register) -> [u8; 5] {
    command(Register::Read, u16::from(register as u8))
}

/// Value of [`Register::Rate`] for a rate (5.2.9); `None` if the unit has no such rate.
pub fn rate_code(rate_hz: u32) -> Option<u16> {
    let codes = [(1, 3), (2, 4), (5, 5), (10, 6), (20, 7), (50, 8), (100, 9), (125, 10), (200, 11)];
    codes.iter().find(|(hz, _)| *hz == rate_hz).map(|(_, code)| *code)
}

/// Value of [`Register::Baud`] for a line rate (5.2.10); `None` if the unit has no such rate.
pub fn baud_code(baud: u32) -> Option<u16> {
    let place = crate::model::IMU_BAUDS.iter().position(|known| *known == baud)?;
    u16::try_from(place + 1).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of 55, kind, numbers and sum, written from the manual.
    fn frame(kind: u8, numbers: [i16; 4]) -> Vec<u8> {
        let mut bytes = vec![0x55, kind];
        numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.push(bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
        bytes
    }

    #[test]
    fn scales_match_the_manual() {
        let sample =
            RawSample { acceleration: [0, 0, 2048], rate: [16384, -16384, 1], angle: [8192, -16384, 0] };
        assert!((sample.specific_force_m_s2().z - 9.80665).abs() < 1e-9, "2048 of 32768 of 16 g is 1 g");
        let rate = sample.rate_rad_s().map(f64::to_degrees);
        assert!((rate - DVec3::new(1000.0, -1000.0, 0.061_035)).length() < 1e-5, "{rate}");
        let angles = sample.angles_rad().map(f64::to_degrees);
        assert!((angles - DVec3::new(45.0, -90.0, 0.0)).length() < 1e-9, "{angles}");
    }

    #[test]
    fn commands_match_the_manual() {
        assert_eq!(command(Register::Key, KEY), [0xFF, 0xAA, 0x69, 0x88, 0xB5]);
        assert_eq!(command(Register::Rate, rate_code(200).unwrap()), [0xFF, 0xAA, 0x03, 0x0B, 0x00]);
        assert_eq!(command(Register::Baud, baud_code(115_200).unwrap()), [0xFF, 0xAA, 0x04, 0x06, 0x00]);
        assert_eq!(command(Register::Save, 0), [0xFF, 0xAA, 0x00, 0x00, 0x00]);
        assert_eq!((rate_code(150), baud_code(1_000_000)), (None, None));
    }

    #[test]
    fn a_measurement_with_a_missing_frame_is_dropped() {
        let [acceleration, rate, angle] =
            [(0x51, 100), (0x52, 200), (0x53, 300)].map(|(kind, x)| frame(kind, [x, 0, 0, 0]));
        let samples = |frames: &[&Vec<u8>]| {
            let mut sampler = Sampler::default();
            let bytes = frames.iter().flat_map(|frame| frame.iter());
            bytes.filter_map(|byte| sampler.push(*byte)).collect::<Vec<_>>()
        };
        let whole = RawSample { acceleration: [100, 0, 0], rate: [200, 0, 0], angle: [300, 0, 0] };
        assert_eq!(samples(&[&acceleration, &rate, &angle]), [whole]);
        assert_eq!(samples(&[&acceleration, &angle, &rate, &angle]), []);
        assert_eq!(samples(&[&acceleration, &rate, &acceleration, &angle]), []);
        let other = frame(0x54, [1, 2, 3, 4]);
        assert_eq!(samples(&[&acceleration, &rate, &other, &angle, &angle]), [whole]);
    }

    #[test]
    fn a_unit_that_sends_a_part_is_told_by_what_is_missing() {
        let missing = |kinds: &[u8]| {
            let mut sampler = Sampler::default();
            let bytes = kinds.iter().flat_map(|kind| frame(*kind, [1, 2, 3, 4]));
            bytes.for_each(|byte| {
                sampler.push(byte);
            });
            sampler.kinds().missing()
        };
        let says = |kinds: &[u8], words: &str| {
            let said = missing(kinds).unwrap();
            assert!(said.starts_with(words), "{kinds:x?}: {said}");
        };
        says(&[0x53], "heard, but it does not send acceleration and turn rate: it sends angle;");
        says(
            &[0x51, 0x52, 0x59],
            "heard, but it does not send angle: it sends acceleration and turn rate and quaternion;",
        );
        says(
            &[0x54],
            "heard, but it does not send acceleration and turn rate and angle: it sends other frames;",
        );
        assert_eq!((missing(&[]), missing(&[0x51, 0x52, 0x53])), (None, None));
        assert_eq!(missing(&[0x51, 0x52, 0x53, 0x59]), None);
    }

    #[test]
    fn a_frame_that_begins_inside_noise_is_found() {
        let good = frame(0x53, [1, -2, 3, 4]);
        for noise in [&[0x55][..], &[0x55, 0x51], &[0x55, 0x55, 0x53, 0, 1], &[0xFF; 30]] {
            let found = frames_in(&[noise, &good].concat());
            assert_eq!(found, [Frame::Angle([1, -2, 3])], "{noise:x?}");
        }
        let mut broken = good.clone();
        broken[4] ^= 1;
        assert_eq!(frames_in(&[broken, good].concat()), [Frame::Angle([1, -2, 3])]);
    }
}
