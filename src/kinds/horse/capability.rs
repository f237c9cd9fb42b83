//! The capability of a horse: how far its legs reach, and how fast each gait goes.

use super::postures;
use super::reach::{self, Reach, ReachError};
use super::top_speed::{self, TopSpeed};
use crate::model::{HorseMotion, Robot};
use crate::motion::Command;
use crate::motion::horse::{HorsePlan, Pace, ReachTable};

/// Capability of a horse.
#[derive(Debug, Clone)]
pub struct HorseCapability {
    /// Reach of each leg, in the order of [`crate::model::LEG_NAMES`].
    pub reaches: [Reach; 4],
    /// Reach by posture.
    pub table: ReachTable,
    /// Joint angles of the sitting robot, rad.
    pub sit_pose_rad: Vec<f64>,
    /// The lowest pose on its feet: height of the trunk, m, and joint angles, rad.
    pub crouch: (f64, Vec<f64>),
    /// Top speed of each gait, in the order of the robot file.
    pub top_speeds: Vec<TopSpeed>,
    /// True if servos turn its joints.
    pub is_driven: bool,
    /// True if the ground carries it.
    pub stays_on_ground: bool,
}

impl HorseCapability {
    /// Computes reach, sitting pose and top speeds of `robot`.
    ///
    /// # Errors
    /// If a leg cannot stand or sit as the file says.
    pub fn of(robot: &Robot, horse: &HorseMotion) -> Result<HorseCapability, ReachError> {
        let reaches = reach::of_legs(robot, horse)?;
        let sit_pose_rad = reach::sit_pose(robot, horse, &reaches)?;
        let crouch = reach::crouch(robot, horse, &reaches, &sit_pose_rad);
        let table = postures::table(robot, horse, &reaches);
        let is_driven = !robot.buses.is_empty();
        let stays_on_ground = robot.bears_weight && is_driven;
        let mut capability = HorseCapability {
            reaches,
            table,
            sit_pose_rad,
            crouch,
            top_speeds: Vec::new(),
            is_driven,
            stays_on_ground,
        };
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
            crouch: self.crouch.clone(),
            paces: self
                .top_speeds
                .iter()
                .map(|top| Pace { forward_m_s: top.m_s(), backward_m_s: top.backward_m_s })
                .collect(),
            is_driven: self.is_driven,
            stays_on_ground: self.stays_on_ground,
            command,
        }
    }
}
