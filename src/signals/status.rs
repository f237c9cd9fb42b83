//! What a run shows while it goes on.

use super::{Activity, Outage, Permission};

/// What a person wants to see while it runs. Small and copied, so that it can be handed to another thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Status {
    /// Time of the run, s.
    pub time_s: f64,
    /// What the robot is doing.
    pub activity: Activity,
    /// The gait it goes in, index into [`crate::model::HorseMotion::gaits`]; none while it takes no steps.
    pub gait: Option<usize>,
    /// Name of the stroke its arms do; none for a horse, and at rest.
    pub stroke: Option<&'static str>,
    /// Planned speed, m/s.
    pub speed_m_s: f64,
    /// Planned turn, rad/s, to the left.
    pub yaw_rate_rad_s: f64,
    /// What safety permits.
    pub permission: Permission,
    /// Joints that are out of service: they have no torque.
    pub frozen: usize,
    /// The one that came to be so in the last cycle, if one did.
    pub outage: Option<Outage>,
    /// Cycles that began late.
    pub late_cycles: u64,
    /// Hottest servo, degrees Celsius.
    pub hottest_c: f64,
    /// Lowest supply voltage, V.
    pub lowest_v: f64,
    /// What the inertial measurement unit says is too old to act on; false on a robot that has none.
    pub is_imu_lost: bool,
    /// The recording has broken off, which stops the robot.
    pub is_recording_lost: bool,
}
