//! What a robot is doing.

use serde::{Deserialize, Serialize};

/// What the robot is doing, for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Activity {
    /// Without torque.
    Limp,
    /// Getting up.
    Rising,
    /// Standing; of arms, holding still; of a figure, in any of its poses.
    Standing,
    /// Walking.
    Walking,
    /// Moving its arms by strokes; of a figure, on the way to a pose.
    Performing,
    /// Holding its arms where they are parked.
    Parked,
    /// Turning one joint.
    Jogging,
    /// Falling.
    Falling,
    /// Lying where it fell.
    Lying,
    /// Taking the stop action.
    Stopping,
    /// The stop action is complete.
    Done,
}
