//! The capability of arms: how heavy they are, and how fast their strokes go.

use super::tempo;
use crate::kinds::loads::{self, Load};
use crate::model::{Robot, TentacleMotion};
use crate::motion::StrokeCommand;
use crate::motion::tentacle::TentaclePlan;

/// Capability of arms.
#[derive(Debug, Clone)]
pub struct TentacleCapability {
    /// Static load of each joint, in the robot's order.
    pub loads: Vec<Load>,
    /// Fastest tempo of each stroke, as in [`TentaclePlan::tempo_max`].
    pub tempo_max: Vec<f64>,
}

impl TentacleCapability {
    /// Computes loads and tempos of `robot`.
    pub fn of(robot: &Robot, tentacle: &TentacleMotion) -> TentacleCapability {
        let plan = TentaclePlan::new(robot, tentacle, StrokeCommand::default());
        TentacleCapability {
            loads: loads::of_joints(robot, tentacle),
            tempo_max: tempo::of_strokes(robot, &plan),
        }
    }

    /// A plan to carry out `command`.
    pub fn plan(&self, robot: &Robot, tentacle: &TentacleMotion, command: StrokeCommand) -> TentaclePlan {
        TentaclePlan { tempo_max: self.tempo_max.clone(), ..TentaclePlan::new(robot, tentacle, command) }
    }
}
