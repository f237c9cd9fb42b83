//! The inertial measurement unit in the trunk: what is expected of it, and how it is built in.

use glam::DQuat;

/// Rates a WitMotion unit can measure at, Hz (WT901 datasheet v20-0702, 5.2.9); those a loop has no use for left out.
pub const IMU_RATES_HZ: [u32; 5] = [20, 50, 100, 125, 200];
/// Line rates it can be set to, bit/s (5.2.10).
pub const IMU_BAUDS: [u32; 9] = [4_800, 9_600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800, 921_600];
/// What the unit's line is called where buses have names: in `--port`, and in messages.
pub const IMU_LINE: &str = "imu";
/// Bytes of one measurement: acceleration, turn rate and angle, a frame of 11 each (5.1).
pub const IMU_SAMPLE_BYTES: u32 = 33;

/// The unit of a robot file, with what a unit file says of the one that is built in.
#[derive(Debug, Clone, PartialEq)]
pub struct ImuSettings {
    /// Measurements a second.
    pub rate_hz: f64,
    /// Line rate, bit/s.
    pub baud: u32,
    /// Turn from the unit's axes to the body frame.
    pub rotation: DQuat,
    /// -1 for a unit that tells its turn rates left-handed, else 1.
    pub rate_sign: f64,
    /// Age of a measurement when its first byte leaves the unit, s.
    pub delay_s: f64,
    /// A measurement older than this is not acted on, s.
    pub stale_s: f64,
    /// Share of its top speed a horse keeps to while the unit is not heard.
    pub lost_speed_share: f64,
    /// How wrong a simulated unit is.
    pub noise: ImuNoise,
}

/// Standard deviations of a simulated unit's errors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImuNoise {
    /// Of each acceleration, m/s^2.
    pub acceleration_m_s2: f64,
    /// Of what each acceleration is wrong by all the time, m/s^2.
    pub acceleration_bias_m_s2: f64,
    /// Of each turn rate, rad/s.
    pub rate_rad_s: f64,
    /// Of what each turn rate is wrong by all the time, rad/s.
    pub rate_bias_rad_s: f64,
    /// Of each angle, rad.
    pub angle_rad: f64,
    /// Of the slow part of each angle's error, rad.
    pub angle_drift_rad: f64,
}

impl ImuSettings {
    /// Time the bytes of one measurement take on the line, s.
    pub fn wire_s(&self) -> f64 {
        f64::from(10 * IMU_SAMPLE_BYTES) / f64::from(self.baud)
    }
}
