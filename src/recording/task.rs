//! The task of a run while its operator only orders it to go.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::strokes::StrokeFields;
use crate::motion::{Command, Intent, Plan};

/// The task of a run; fields of `run.json`. Robots of several kinds may share a variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Task {
    /// Task of a robot that goes by gaits.
    Horse {
        /// Name of the gait.
        gait: String,
        /// Gait, speed and posture.
        command: Command,
    },
    /// Task of a robot that performs strokes.
    Tentacle {
        /// The strokes.
        strokes: StrokeFields,
    },
    /// Task of a robot that takes poses.
    Figure {
        /// Name of the pose.
        pose: String,
    },
}

impl Task {
    /// The task of a plan.
    pub fn of(plan: &Plan) -> Task {
        match plan.intent() {
            Intent::Drive { gait, command } => Task::Horse { gait: gait.to_owned(), command },
            Intent::Perform(command) => Task::Tentacle { strokes: command.into() },
            Intent::Take { pose } => Task::Figure { pose: pose.to_owned() },
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
