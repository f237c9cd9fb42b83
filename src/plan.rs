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
        match &self.motion {
            Plan::Horse(_) => "walked for the time asked",
            Plan::Tentacle(_) => "moved for the time asked",
            Plan::Figure(_) => "stood for the time asked",
        }
    }

    /// Name of the gait that a horse was planned for, and its speed, m/s; none for other robots.
    pub fn gait_and_speed(&self) -> (Option<String>, Option<f64>) {
        match &self.motion {
            Plan::Horse(horse) => {
                let gait = horse.gait_name(horse.command.gait).to_owned();
                (Some(gait), Some(horse.command.speed_m_s))
            }
            Plan::Tentacle(_) | Plan::Figure(_) => (None, None),
        }
    }
}
