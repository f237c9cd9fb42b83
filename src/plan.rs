//! The plan of a run.

use crate::ik::Method;
use crate::motion::Plan;

/// The plan of a run.
#[derive(Debug, Clone)]
pub struct RunPlan {
    /// The motion: gait, speed and posture of a horse; the stroke of arms; the pose of a figure.
    pub motion: Plan,
    /// Method of inverse kinematics.
    pub method: Method,
    /// Time from the first step to slowing down, s.
    pub move_for_s: f64,
    /// The driver that replaces the plan, for people: "the keyboard".
    pub driver: Option<String>,
}
