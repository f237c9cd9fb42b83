//! What a robot can do, worked out from its file: how far its legs reach, how fast each gait goes.
//!
//! Stands beside the pipeline: `check` prints it, and a run is planned within it.

pub mod bus_costs;
pub mod reach;
pub mod top_speed;

use crate::model::{Gait, HorseMotion, Robot};
use crate::motion::horse::HorsePlan;
pub use reach::{Reach, ReachError};
pub use top_speed::TopSpeed;

/// What a horse can do.
#[derive(Debug, Clone)]
pub struct HorseCapability {
    /// Reach of each leg, in the order of [`crate::model::LEG_NAMES`].
    pub reaches: [Reach; 4],
    /// Joint angles of the sitting robot, rad.
    pub sit_pose_rad: Vec<f64>,
}

impl HorseCapability {
    /// Works out the reach and the sitting pose of `robot`.
    ///
    /// # Errors
    /// When a leg cannot stand or sit as the file says.
    pub fn of(robot: &Robot, horse: &HorseMotion) -> Result<HorseCapability, ReachError> {
        let reaches = reach::of_legs(robot, horse)?;
        let sit_pose_rad = reach::sit_pose(robot, horse, &reaches)?;
        Ok(HorseCapability { reaches, sit_pose_rad })
    }

    /// The half-excursion every leg has, m.
    pub fn half_excursion_m(&self) -> f64 {
        self.reaches.iter().map(|reach| reach.half_excursion_m).fold(f64::INFINITY, f64::min)
    }

    /// A plan to stand, in the terms of `gait`; its speed is 0.
    pub fn plan(&self, horse: &HorseMotion, gait: &Gait) -> HorsePlan {
        HorsePlan {
            settings: horse.clone(),
            neutral_in_body: self.reaches.map(|reach| reach.neutral_in_body),
            half_excursion_m: self.half_excursion_m(),
            sit_pose_rad: self.sit_pose_rad.clone(),
            gait: gait.clone(),
            speed_m_s: 0.0,
        }
    }
}
