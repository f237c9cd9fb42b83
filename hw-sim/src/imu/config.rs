//! How a unit is mounted and how well it measures.

use crate::error::BuildError;

/// Output rates, as (register code, Hz) (WT901 datasheet v20-0702, 5.2.9).
pub(super) const RATES: [(u16, f64); 9] = [
    (0x03, 1.0),
    (0x04, 2.0),
    (0x05, 5.0),
    (0x06, 10.0),
    (0x07, 20.0),
    (0x08, 50.0),
    (0x09, 100.0),
    (0x0A, 125.0),
    (0x0B, 200.0),
];
/// Line rates, as (register code, bit/s) (5.2.10).
pub(super) const BAUDS: [(u16, u32); 9] = [
    (1, 4_800),
    (2, 9_600),
    (3, 19_200),
    (4, 38_400),
    (5, 57_600),
    (6, 115_200),
    (7, 230_400),
    (8, 460_800),
    (9, 921_600),
];

/// An inertial measurement unit at the origin of the trunk's frame, already set up.
#[derive(Debug, Clone, PartialEq)]
pub struct ImuConfig {
    /// Outputs per second at power-on: 1, 2, 5, 10, 20, 50, 100, 125 or 200.
    pub rate_hz: f64,
    /// Line rate at power-on and of the host, bit/s: 4800 to 921600, each double the one before except 57600 to
    /// 115200.
    pub baud: u32,
    /// Rotation from the unit's axes to the trunk's: unit quaternion x, y, z, w.
    pub rotation: [f64; 4],
    /// Age of a measurement when its first byte leaves, s, 0 to 1.
    pub delay_s: f64,
    /// Standard deviation of each acceleration, m/s^2.
    pub acceleration_noise_m_s2: f64,
    /// Standard deviation of each axis's constant error, m/s^2.
    pub acceleration_bias_m_s2: f64,
    /// Standard deviation of each angular rate, rad/s.
    pub rate_noise_rad_s: f64,
    /// Standard deviation of each axis's constant error, rad/s.
    pub rate_bias_rad_s: f64,
    /// Standard deviation of each angle, rad.
    pub angle_noise_rad: f64,
    /// Standard deviation of the slow part of each angle's error, rad; that of yaw grows without limit.
    pub angle_drift_rad: f64,
}

impl ImuConfig {
    /// Level in the trunk, 200 Hz at 115200 bit/s, without any error or delay.
    pub fn perfect() -> ImuConfig {
        ImuConfig {
            rate_hz: 200.0,
            baud: 115_200,
            rotation: [0.0, 0.0, 0.0, 1.0],
            delay_s: 0.0,
            acceleration_noise_m_s2: 0.0,
            acceleration_bias_m_s2: 0.0,
            rate_noise_rad_s: 0.0,
            rate_bias_rad_s: 0.0,
            angle_noise_rad: 0.0,
            angle_drift_rad: 0.0,
        }
    }

    /// Register codes of rate and line rate.
    pub(super) fn check(&self) -> Result<(u16, u16), BuildError> {
        let bad = |key: &'static str, value: f64, expected: String| {
            Err(BuildError::BadImu { key, value: value.to_string(), expected })
        };
        let Some((rate, _)) = RATES.iter().find(|(_, hz)| (hz - self.rate_hz).abs() < 1e-9) else {
            return bad("rate_hz", self.rate_hz, list(RATES.iter().map(|(_, hz)| hz.to_string())));
        };
        let Some((baud, _)) = BAUDS.iter().find(|(_, baud)| *baud == self.baud) else {
            return bad("baud", self.baud.into(), list(BAUDS.iter().map(|(_, baud)| baud.to_string())));
        };
        let length = self.rotation.iter().map(|part| part * part).sum::<f64>().sqrt();
        if (length - 1.0).abs() > 1e-6 || length.is_nan() {
            return bad("rotation", length, "a quaternion of length 1".into());
        }
        if !(0.0..=1.0).contains(&self.delay_s) {
            return bad("delay_s", self.delay_s, "0 to 1 s".into());
        }
        for (key, value) in [
            ("acceleration_noise_m_s2", self.acceleration_noise_m_s2),
            ("acceleration_bias_m_s2", self.acceleration_bias_m_s2),
            ("rate_noise_rad_s", self.rate_noise_rad_s),
            ("rate_bias_rad_s", self.rate_bias_rad_s),
            ("angle_noise_rad", self.angle_noise_rad),
            ("angle_drift_rad", self.angle_drift_rad),
        ] {
            if !(0.0..=1e3).contains(&value) {
                return bad(key, value, "0 to 1000".into());
            }
        }
        Ok((*rate, *baud))
    }
}

fn list(words: impl Iterator<Item = String>) -> String {
    format!("one of {}", words.collect::<Vec<_>>().join(", "))
}
