//! The inertial measurement unit in the trunk: its settings and its mounting.

use glam::DQuat;

/// Supported measurement rates of a WitMotion unit, Hz (WT901 datasheet v20-0702, 5.2.9), without those of no
/// use to a loop.
pub const IMU_RATES_HZ: [u32; 5] = [20, 50, 100, 125, 200];
/// Supported line rates, bit/s (5.2.10).
pub const IMU_BAUDS: [u32; 9] = [4_800, 9_600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800, 921_600];
/// Name of the unit's line among the buses: in `--port`, and in messages.
pub const IMU_LINE: &str = "imu";
/// Bytes of one measurement: acceleration, angular velocity and angle, a frame of 11 each (5.1).
pub const IMU_SAMPLE_BYTES: u32 = 33;

/// The unit in a robot file, combined with a unit file's data on the one that is built in.
#[derive(Debug, Clone, PartialEq)]
pub struct ImuSettings {
    /// Measurements per second.
    pub rate_hz: f64,
    /// Line rate, bit/s.
    pub baud: u32,
    /// Rotation from the unit's axes to the body frame.
    pub rotation: DQuat,
    /// -1 for a unit that reports left-handed angular velocities, otherwise 1.
    pub rate_sign: f64,
    /// Age of a measurement when its first byte leaves the unit, s.
    pub delay_s: f64,
    /// The controller does not act on a measurement older than this, s.
    pub stale_s: f64,
    /// Share of its top speed to which a horse is limited while the unit is silent.
    pub lost_speed_share: f64,
    /// Errors of a simulated unit.
    pub noise: ImuNoise,
}

/// Standard deviations of a simulated unit's errors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImuNoise {
    /// Noise of each acceleration, m/s^2.
    pub acceleration_m_s2: f64,
    /// Bias of each acceleration, m/s^2.
    pub acceleration_bias_m_s2: f64,
    /// Noise of each angular velocity, rad/s.
    pub rate_rad_s: f64,
    /// Bias of each angular velocity, rad/s.
    pub rate_bias_rad_s: f64,
    /// Noise of each angle, rad.
    pub angle_rad: f64,
    /// Slow part of each angle's error, rad.
    pub angle_drift_rad: f64,
}

impl ImuSettings {
    /// Transmission time of one measurement, s.
    pub fn wire_s(&self) -> f64 {
        f64::from(10 * IMU_SAMPLE_BYTES) / f64::from(self.baud)
    }
}
