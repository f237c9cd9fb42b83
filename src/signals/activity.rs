//! The robot's activity.

use serde::{Deserialize, Serialize};

/// The robot's activity, for display.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Activity {
    /// Without torque.
    Limp,
    /// Getting up.
    Rising,
    /// Standing; for arms, holding still; for a figure, in any of its poses.
    Standing,
    /// Walking.
    Walking,
    /// Moving its arms by strokes; for a figure, on the way to a pose.
    Performing,
    /// Holding its arms in the parked pose.
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
