//! The status that a run shows while it lasts.

use super::{Activity, Outage, Permission};

/// The state of a run that an operator wants to see. Small and copied, so that it can be passed to another thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Status {
    /// Time of the run, s.
    pub time_s: f64,
    /// The robot's activity.
    pub activity: Activity,
    /// Its gait, index into [`crate::model::HorseMotion::gaits`]; `None` while it takes no steps.
    pub gait: Option<usize>,
    /// Name of the arms' stroke; `None` for a horse, and at rest.
    pub stroke: Option<&'static str>,
    /// Planned speed, m/s.
    pub speed_m_s: f64,
    /// Planned yaw rate, rad/s, positive to the left.
    pub yaw_rate_rad_s: f64,
    /// Safety's permission.
    pub permission: Permission,
    /// Number of joints that are out of service: they have no torque.
    pub frozen: usize,
    /// The joint that was taken out of service in the last cycle, if any.
    pub outage: Option<Outage>,
    /// Number of cycles that began late.
    pub late_cycles: u64,
    /// Temperature of the hottest servo, degrees Celsius.
    pub hottest_c: f64,
    /// Lowest supply voltage, V.
    pub lowest_v: f64,
    /// True if the reading of the inertial measurement unit is too old to act on; false on a robot without one.
    pub is_imu_lost: bool,
    /// Why the run has lost its purpose, which stops the robot, in words that fit after "because".
    pub objection: Option<&'static str>,
}

impl Status {
    /// A limp robot before it has heard its servos.
    pub const LIMP: Status = Status {
        time_s: 0.0,
        activity: Activity::Limp,
        gait: None,
        stroke: None,
        speed_m_s: 0.0,
        yaw_rate_rad_s: 0.0,
        permission: Permission::Move,
        frozen: 0,
        outage: None,
        late_cycles: 0,
        hottest_c: 0.0,
        lowest_v: f64::INFINITY,
        is_imu_lost: false,
        objection: None,
    };
}
