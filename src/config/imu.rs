//! `[imu]`: the inertial measurement unit in the trunk.

use glam::DVec3;

use super::limb::rotation;
use super::number::Limits;
use super::reader::Section;
use crate::model::{IMU_BAUDS, IMU_RATES_HZ, IMU_SAMPLE_BYTES, ImuNoise, ImuSettings};

/// The highest possible rate.
const RATE_HZ: u32 = 200;
/// The slowest line rate that carries 200 measurements a second.
const BAUD: u32 = 115_200;
/// Delay of its filters and its arithmetic. The maker states none: an estimate, to be measured on a real one.
const DELAY_MS: f64 = 5.0;
/// Half a period of the slowest body that falls over its feet here: an older measurement says nothing about now.
const STALE_S: f64 = 0.1;
/// Slow enough for every gait to stay up without feedback.
const LOST_SPEED_SHARE: f64 = 0.5;

/// A key of `[imu.noise]`, a standard deviation.
struct Deviation(&'static str, &'static str, f64);

/// 300 micro-g and 0.01 degrees/s for each root of a Hz (InvenSense PS-MPU-9250A-01, tables 1 and 2: the sensor in
/// a WT901), over 100 Hz. Offsets are what its own calibration at rest may leave. Angle errors are what the maker
/// promises (0.05 degrees at rest, 0.1 in motion), and the effect of such offsets. Both are estimates.
const ACCELERATION: Deviation =
    Deviation("acceleration_m_s2", "the noise of each acceleration in m/s^2", 0.03);
const ACCELERATION_BIAS: Deviation =
    Deviation("acceleration_bias_m_s2", "the constant error of each acceleration in m/s^2", 0.1);
const RATE: Deviation = Deviation("rate_deg_s", "the noise of each turn rate in degrees/s", 0.1);
const RATE_BIAS: Deviation =
    Deviation("rate_bias_deg_s", "the constant error of each turn rate in degrees/s", 0.1);
const ANGLE: Deviation = Deviation("angle_deg", "the noise of each angle in degrees", 0.1);
const ANGLE_DRIFT: Deviation =
    Deviation("angle_drift_deg", "the slow part of each angle's error in degrees", 0.3);

/// Reads `[imu]`; `Some(None)` if it is not set.
pub(super) fn read(file: &Section<'_>, rate_hz: Option<f64>) -> Option<Option<ImuSettings>> {
    file.describe_default("imu", "the inertial measurement unit in the trunk, a table", "no unit");
    if !file.has("imu") {
        return Some(None);
    }
    file.section("imu", "the inertial measurement unit", |section| read_settings(section, rate_hz)).map(Some)
}

fn read_settings(section: &Section<'_>, loop_rate_hz: Option<f64>) -> Option<ImuSettings> {
    let imu_rate_hz = one_of(section, "rate_hz", "its measurements a second", &IMU_RATES_HZ, RATE_HZ);
    let baud = one_of(section, "baud", "its line's bits per second", &IMU_BAUDS, BAUD);
    if let (Some(rate_hz), Some(baud)) = (imu_rate_hz, baud)
        && 10 * IMU_SAMPLE_BYTES * rate_hz > baud
    {
        let least = 10 * IMU_SAMPLE_BYTES * rate_hz;
        section.fault("baud", format!("at least {least}, which {rate_hz} measurements a second need"));
    }
    let meaning = "roll, pitch and yaw of the unit in the body, in degrees";
    let rpy = section.vector_or("rpy_deg", meaning, DVec3::ZERO);
    let meaning = "the age in ms of a measurement when its first byte leaves the unit";
    let delay_ms = section.number_or("delay_ms", meaning, Limits::FromTo(0.0, 100.0), DELAY_MS);
    let meaning = "the age in s from which the loop ignores a measurement";
    let stale_s = section.number_or("stale_s", meaning, Limits::AboveToMost(0.0, 1.0), STALE_S);
    if let (Some(stale_s), Some(delay_ms), Some(imu_rate_hz), Some(rate_hz)) =
        (stale_s, delay_ms, imu_rate_hz, loop_rate_hz)
    {
        let least_s = delay_ms / 1000.0 + 2.0 / f64::from(imu_rate_hz) + 1.0 / rate_hz;
        if stale_s < least_s {
            let expected = format!("at least {least_s:.3}: delay, two measurements and a cycle of the loop");
            section.fault("stale_s", expected);
        }
    }
    let meaning = "the share of its top speed that a horse may use while the unit is silent";
    let lost_speed_share =
        section.number_or("lost_speed_share", meaning, Limits::AboveToMost(0.0, 1.0), LOST_SPEED_SHARE);
    let noise = section.section_or_empty("noise", "the errors of a simulated unit", read_noise);
    Some(ImuSettings {
        rate_hz: imu_rate_hz?.into(),
        baud: baud?,
        rotation: rotation(rpy?),
        rate_sign: 1.0,
        delay_s: delay_ms? / 1000.0,
        stale_s: stale_s?,
        lost_speed_share: lost_speed_share?,
        noise: noise?,
    })
}

fn one_of(
    section: &Section<'_>,
    key: &'static str,
    meaning: &str,
    known: &[u32],
    default: u32,
) -> Option<u32> {
    let words: Vec<String> = known.iter().map(u32::to_string).collect();
    let meaning = format!("{meaning}, one of {}", words.join(", "));
    let (least, most) = (known.first().copied()?, known.last().copied()?);
    let value = section.integer_or(key, &meaning, least..=most, default)?;
    if !known.contains(&value) {
        section.fault(key, meaning);
        return None;
    }
    Some(value)
}

fn read_noise(section: &Section<'_>) -> Option<ImuNoise> {
    let number = |Deviation(key, meaning, default): &Deviation| {
        section.number_or(key, meaning, Limits::FromTo(0.0, 100.0), *default)
    };
    let acceleration = number(&ACCELERATION);
    let acceleration_bias = number(&ACCELERATION_BIAS);
    let rate = number(&RATE);
    let rate_bias = number(&RATE_BIAS);
    let angle = number(&ANGLE);
    let angle_drift = number(&ANGLE_DRIFT);
    Some(ImuNoise {
        acceleration_m_s2: acceleration?,
        acceleration_bias_m_s2: acceleration_bias?,
        rate_rad_s: rate?.to_radians(),
        rate_bias_rad_s: rate_bias?.to_radians(),
        angle_rad: angle?.to_radians(),
        angle_drift_rad: angle_drift?.to_radians(),
    })
}
