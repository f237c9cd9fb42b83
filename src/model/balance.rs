//! How a robot keeps its balance on its feet.

/// What a robot does about how it lies and how its joints are loaded. A foot's place is that of its leg's root in the
/// body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BalanceSettings {
    /// The friction between feet and ground that is counted on.
    pub friction: f64,
    /// Goals are moved by what joints give way under their load.
    pub sag_correction: bool,
    /// A foot is raised by this, the roll rate (rad/s) and its place to the left (m), s.
    pub roll_rate_s: f64,
    /// A foot is lowered by this, the pitch rate (rad/s) and its place ahead (m), s.
    pub pitch_rate_s: f64,
    /// Of a figure: its lean is braked by this, the trunk's turn rate and its height above the soles, 1/s.
    pub lean_brake_hz: f64,
    /// How much faster the left feet go, and slower the right ones, for each radian the trunk is turned left of its
    /// planned heading, m/s.
    pub heading_m_s: f64,
}
