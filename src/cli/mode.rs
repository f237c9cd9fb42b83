//! The command that runs the robot.

use super::RunArguments;

/// Length of a run whose options give none, s.
const FOR_S: f64 = 20.0;

/// The command that runs the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RunMode {
    Run,
    Show,
}

impl RunMode {
    /// How long it lasts, s.
    pub(super) fn for_s(self, options: &RunArguments) -> f64 {
        let otherwise_s = match self {
            RunMode::Run => FOR_S,
            RunMode::Show => f64::MAX,
        };
        options.walk_for_s.unwrap_or(otherwise_s)
    }
}
