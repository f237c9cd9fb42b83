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

impl RunPlan {
    /// The reason why a run ends that went as planned.
    pub fn done(&self) -> &'static str {
        self.motion.done()
    }

    /// Name of the gait that a horse was planned for, and its speed, m/s; none for other robots.
    pub fn gait_and_speed(&self) -> (Option<String>, Option<f64>) {
        self.motion.gait().map(|(gait, speed_m_s)| (gait.to_owned(), speed_m_s)).unzip()
    }
}
