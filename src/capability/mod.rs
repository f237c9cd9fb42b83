//! A robot's capability, computed from its file: how far its legs reach, how fast each gait goes, how heavy
//! arms are.
//!
//! It is not a pipeline stage: `check` prints it, and a run is planned within it.

pub mod bus_costs;
mod figure;
mod follower;
pub mod loads;
mod postures;
pub mod reach;
mod tempo;
pub mod top_speed;

use crate::model::{FigureMotion, HorseMotion, Motion, Robot, TentacleMotion};
use crate::motion::horse::{HorsePlan, Pace, ReachTable};
use crate::motion::tentacle::TentaclePlan;
use crate::motion::{Command, StrokeCommand};
pub use figure::{FigureCapability, PoseError};
pub use loads::Load;
pub use reach::{Reach, ReachError};
pub use top_speed::TopSpeed;

/// A robot's own settings and its capability; one variant for each kind of motion.
#[derive(Debug, Clone)]
pub enum Capability {
    /// A horse.
    Horse(HorseMotion, Box<HorseCapability>),
    /// A robot with arms.
    Tentacle(TentacleMotion, TentacleCapability),
    /// A figure on two feet.
    Figure(FigureMotion, Box<FigureCapability>),
}

/// Reasons why a robot cannot do what its file says.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CapabilityError {
    /// A fault of a horse's legs.
    #[error(transparent)]
    Reach(#[from] ReachError),
    /// A fault of a figure's poses.
    #[error(transparent)]
    Pose(#[from] PoseError),
}

impl Capability {
    /// Computes the capability of `robot`.
    ///
    /// # Errors
    /// If it cannot do what its file says.
    pub fn of(robot: &Robot) -> Result<Capability, CapabilityError> {
        Ok(match &robot.motion {
            Motion::Horse(horse) => {
                Capability::Horse(horse.clone(), Box::new(HorseCapability::of(robot, horse)?))
            }
            Motion::Tentacle(tentacle) => {
                Capability::Tentacle(tentacle.clone(), TentacleCapability::of(robot, tentacle))
            }
            Motion::Figure(figure) => {
                Capability::Figure(figure.clone(), Box::new(FigureCapability::of(robot, figure)?))
            }
        })
    }
}

/// Capability of arms.
#[derive(Debug, Clone)]
pub struct TentacleCapability {
    /// Static load of each joint, in the robot's order.
    pub loads: Vec<Load>,
    /// Fastest swaying, walking and swimming, as multiples of the robot file's tempo.
    pub tempo_max: [f64; 3],
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
        TentaclePlan { tempo_max: self.tempo_max, ..TentaclePlan::new(robot, tentacle, command) }
    }
}

/// Capability of a horse.
#[derive(Debug, Clone)]
pub struct HorseCapability {
    /// Reach of each leg, in the order of [`crate::model::LEG_NAMES`].
    pub reaches: [Reach; 4],
    /// Reach by posture.
    pub table: ReachTable,
    /// Joint angles of the sitting robot, rad.
    pub sit_pose_rad: Vec<f64>,
    /// Top speed of each gait, in the order of the robot file.
    pub top_speeds: Vec<TopSpeed>,
    /// True if servos turn its joints.
    pub is_driven: bool,
}

impl HorseCapability {
    /// Computes reach, sitting pose and top speeds of `robot`.
    ///
    /// # Errors
    /// If a leg cannot stand or sit as the file says.
    pub fn of(robot: &Robot, horse: &HorseMotion) -> Result<HorseCapability, ReachError> {
        let reaches = reach::of_legs(robot, horse)?;
        let sit_pose_rad = reach::sit_pose(robot, horse, &reaches)?;
        let table = postures::table(robot, horse, &reaches);
        let is_driven = !robot.buses.is_empty();
        let mut capability =
            HorseCapability { reaches, table, sit_pose_rad, top_speeds: Vec::new(), is_driven };
        capability.top_speeds = top_speed::of_gaits(robot, &capability.plan(horse, Command::default()));
        Ok(capability)
    }

    /// The half-excursion of all legs, m.
    pub fn half_excursion_m(&self) -> f64 {
        self.table.level.half_excursion_m
    }

    /// A plan to carry out `command`.
    pub fn plan(&self, horse: &HorseMotion, command: Command) -> HorsePlan {
        HorsePlan {
            settings: horse.clone(),
            neutral_in_body: self.reaches.map(|reach| reach.neutral_in_body),
            reach: self.table.clone(),
            sit_pose_rad: self.sit_pose_rad.clone(),
            paces: self
                .top_speeds
                .iter()
                .map(|top| Pace { forward_m_s: top.m_s(), backward_m_s: top.backward_m_s })
                .collect(),
            is_driven: self.is_driven,
            command,
        }
    }
}
