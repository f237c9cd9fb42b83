use std::collections::VecDeque;

use super::*;
use crate::config;
use crate::units::Time;

/// A line with these bytes, each with the time at which it arrives.
#[derive(Default)]
struct Line {
    now: Time,
    bytes: VecDeque<(Time, u8)>,
    is_gone: bool,
}

impl Ports for Line {
    fn now(&mut self) -> Time {
        self.now
    }

    fn discard_input(&mut self, _bus: usize) -> Result<(), PortError> {
        Ok(())
    }

    fn send(&mut self, _bus: usize, _bytes: &[u8]) -> Result<(), PortError> {
        Ok(())
    }

    fn receive(&mut self, _bus: usize, _into: &mut [u8]) -> Result<usize, PortError> {
        Ok(0)
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        if self.is_gone {
            return Err(PortError::ImuGone);
        }
        let count = self.bytes.partition_point(|(at, _)| *at <= self.now).min(into.len());
        for (place, (_, byte)) in into.iter_mut().zip(self.bytes.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn wait_for_input(&mut self, _deadline: Time) {}

    fn wait_until(&mut self, _deadline: Time) {}
}

fn robot(imu: &str) -> Robot {
    let text = include_str!("../../config/horse.toml");
    let text = text.replace("rpy_deg = [0, 0, -90]", imu);
    config::parse(&text, "horse.toml").unwrap().robot
}

/// The frames of one measurement, from the manual.
fn sample(acceleration: [i16; 3], rate: [i16; 3], angle: [i16; 3]) -> Vec<u8> {
    let frame = |kind: u8, [x, y, z]: [i16; 3]| {
        let mut bytes = vec![0x55, kind];
        [x, y, z, 0].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.push(bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
        bytes
    };
    [frame(0x51, acceleration), frame(0x52, rate), frame(0x53, angle)].concat()
}

/// A measurement and the next, which differs only in the last digit of an acceleration.
fn twice([x, y, z]: [i16; 3], rate: [i16; 3], angle: [i16; 3]) -> Vec<u8> {
    [sample([x, y, z + 1], rate, angle), sample([x, y, z], rate, angle)].concat()
}

/// The reading of the unit in `robot` after these bytes.
fn heard(robot: &Robot, bytes: &[u8]) -> ImuReading {
    let mut line = Line { bytes: bytes.iter().map(|byte| (Time(0), *byte)).collect(), ..Line::default() };
    let mut imu = Imu::new(robot);
    imu.read(&mut line);
    *imu.reading()
}

/// Raw values of 10 degrees and of 100 degrees/s.
const TEN_DEG: i16 = 1820;
const HUNDRED_DEG_S: i16 = 1638;

#[test]
fn measurements_are_rotated_into_the_body_frame() {
    // Y points forward, X to the right. The nose turns down about the body's y, which is the unit's -x: its roll is
    // negative.
    let lying = robot("rpy_deg = [0, 0, -90]");
    let reading = heard(&lying, &twice([356, 0, 2017], [-HUNDRED_DEG_S, 0, 0], [-TEN_DEG, 0, 0]));
    assert!(reading.is_known);
    assert!((reading.pitch_rad.to_degrees() - 10.0).abs() < 0.01, "{reading:?}");
    assert!(reading.roll_rad.abs() < 1e-9, "{reading:?}");
    let rate_deg_s = reading.rate_rad_s.map(f64::to_degrees);
    assert!((rate_deg_s - DVec3::new(0.0, 100.0, 0.0)).length() < 0.1, "{rate_deg_s}");
    // The unit's x points to the body's right, its y forward.
    let force = reading.specific_force_m_s2;
    assert!((force - DVec3::new(0.0, -1.705, 9.659)).length() < 0.01, "{force}");
}

#[test]
fn a_unit_mounted_upside_down_gives_the_same_body_measurements() {
    // Half a turn about x: the unit's y points to the body's right, its z down. The right side is 10 degrees lower.
    let hanging = robot("rpy_deg = [180, 0, 0]");
    let angle = 32767 - TEN_DEG;
    let reading = heard(&hanging, &twice([0, 0, -2048], [HUNDRED_DEG_S, 0, 0], [-angle, 0, 0]));
    assert!((reading.roll_rad.to_degrees() - 10.0).abs() < 0.02, "{reading:?}");
    assert!(reading.pitch_rad.abs() < 1e-3, "{reading:?}");
    assert!((reading.rate_rad_s.x.to_degrees() - 100.0).abs() < 0.1);
    assert!((reading.specific_force_m_s2.z - 9.80665).abs() < 1e-9);
}

#[test]
fn the_age_of_a_measurement_includes_transfer_and_delay() {
    let robot = robot("delay_ms = 4");
    // 33 bytes at 115200 bit/s.
    let wire_s = 330.0 / 115_200.0;
    let (mut line, mut imu) = (Line::default(), Imu::new(&robot));
    imu.read(&mut line);
    assert!(!imu.reading().is_known);
    let mut last_s = 0.0;
    for cycle in 1..=100_u64 {
        // Complete 1 ms after each 5 ms; the loop looks each 10 ms, when the first half of the next is already
        // there.
        for half in [6, 11] {
            let whole_ns = (cycle * 10 - 10 + half) * 1_000_000;
            let bytes = sample([i16::try_from(cycle).unwrap(), half.try_into().unwrap(), 0], [0; 3], [0; 3]);
            line.bytes.extend(
                (0..33).zip(&bytes).map(|(place, byte)| (Time(whole_ns - (32 - place) * 86_806), *byte)),
            );
        }
        line.now = Time(cycle * 10_000_000);
        imu.read(&mut line);
        last_s = imu.reading().age_s;
    }
    // The true time since it was complete is 4 ms; it is known to within a byte.
    assert!((last_s - (0.004 + wire_s + 0.004)).abs() <= 100e-6, "{last_s}");
    line.is_gone = true;
    line.now = Time(1_500_000_000);
    imu.read(&mut line);
    assert!(imu.is_gone() && imu.reading().is_known);
    assert!((imu.reading().age_s - last_s - 0.5).abs() < 1e-9, "it grows old");
}

#[test]
fn a_full_buffer_is_discarded() {
    let robot = robot("delay_ms = 4");
    let bytes: Vec<u8> = (0..125).flat_map(|count| sample([count, 0, 0], [0; 3], [0; 3])).collect();
    assert!(bytes.len() > 4095);
    assert!(!heard(&robot, &bytes).is_known);
    assert!(heard(&robot, &bytes[..330]).is_known);
}

#[test]
fn a_robot_without_a_unit_reads_nothing() {
    let robot = config::parse(include_str!("../../config/tentacle.toml"), "tentacle.toml").unwrap().robot;
    assert_eq!(heard(&robot, &sample([0, 0, 2048], [0; 3], [0; 3])), ImuReading::default());
}
