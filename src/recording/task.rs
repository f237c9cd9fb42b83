//! The task of a run while its operator only orders it to go.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::strokes::StrokeFields;
use crate::motion::{Command, Plan};

/// The task of a run; fields of `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Task {
    /// Task of a horse.
    Horse {
        /// Name of the gait.
        gait: String,
        /// Gait, speed and posture.
        command: Command,
    },
    /// Task of a rig of arms.
    Tentacle {
        /// The strokes.
        strokes: StrokeFields,
    },
    /// Task of a figure.
    Figure {
        /// Name of the pose.
        pose: String,
    },
}

impl Task {
    /// The task of a plan.
    pub fn of(plan: &Plan) -> Task {
        match plan {
            Plan::Horse(plan) => Task::Horse { gait: plan.commanded_gait().into(), command: plan.command },
            Plan::Tentacle(plan) => Task::Tentacle { strokes: plan.command.into() },
            Plan::Figure(plan) => Task::Figure { pose: plan.pose_name().to_owned() },
        }
    }
}

/// Fits after "it was to do ...".
impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Task::Horse { gait, command } => write!(f, "{gait} at {:.3} m/s", command.speed_m_s),
            Task::Tentacle { strokes } => strokes.fmt(f),
            Task::Figure { pose } => f.write_str(pose),
        }
    }
}
