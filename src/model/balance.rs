//! How a robot keeps its balance on its feet.

/// Feedback from the trunk's attitude and the joints' load. A foot's position counts as that of its leg's
/// root in the body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BalanceSettings {
    /// The assumed friction between feet and ground.
    pub friction: f64,
    /// True if goals compensate for how far joints give way under load.
    pub sag_correction: bool,
    /// A foot is raised by the product of this, the roll rate (rad/s) and its distance to the left (m), s.
    pub roll_rate_s: f64,
    /// A foot is lowered by the product of this, the pitch rate (rad/s) and its distance forward (m), s.
    pub pitch_rate_s: f64,
    /// For a figure: the product of this, the trunk's angular velocity and its height above the soles brakes
    /// its lean, 1/s.
    pub lean_brake_hz: f64,
    /// How much faster the left feet go, and slower the right ones, per radian that the trunk is turned to
    /// the left of its planned heading, m/s.
    pub heading_m_s: f64,
}
