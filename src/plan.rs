//! What a run is to do.

use crate::ik::Method;
use crate::motion::Plan;

/// What to run.
#[derive(Debug, Clone)]
pub struct RunPlan {
    /// What to do: of a horse gait, speed and posture; of arms the stroke; of a figure the pose.
    pub motion: Plan,
    /// How targets are solved.
    pub method: Method,
    /// How long to do that, from the first step to slowing down, s.
    pub move_for_s: f64,
    /// Who drives in the plan's place, for people: "the keyboard".
    pub driver: Option<String>,
}
