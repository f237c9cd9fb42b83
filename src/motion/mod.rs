//! The generator: the stage that makes the targets, with a folder for each kind of robot.
//!
//! Input: the length of the last cycle, the feedback ([`State`]), and the operator's order. Output:
//! [`Targets`]. It knows nothing about servos, and stands still while safety holds the robot.

pub mod curves;
pub mod figure;
pub mod horse;
mod jog;
pub mod legged;
mod pose_change;
pub mod tentacle;
mod torque_phase;

use std::fmt;
use std::ops::{Deref, DerefMut};

use crate::model::Robot;
pub use crate::signals::{Activity, Command, GaitChoice, Order, Posture, Stroke, StrokeCommand};
use crate::signals::{State, Targets};
use figure::{FigureGenerator, FigurePlan, PoseMotion};
use horse::{Drive, HorseGenerator, HorsePlan};
pub use jog::Jog;
use tentacle::{TentacleGenerator, TentaclePlan};

/// Time constant with which redundant joints go to their neutral posture, s.
const POSTURE_TIME_S: f64 = 0.1;

/// Share of the way to their neutral posture that redundant joints move in a cycle of `dt_s`.
pub fn posture_pull(dt_s: f64) -> f64 {
    1.0 - (-dt_s / POSTURE_TIME_S).exp()
}

/// The planned motion of a robot, and the data it needs; one variant for each kind of motion.
#[derive(Debug, Clone)]
pub enum Plan {
    /// Plan for a horse.
    Horse(Box<HorsePlan>),
    /// Plan for a robot with arms.
    Tentacle(Box<TentaclePlan>),
    /// Plan for a figure.
    Figure(Box<FigurePlan>),
}

impl From<HorsePlan> for Plan {
    fn from(plan: HorsePlan) -> Plan {
        Plan::Horse(Box::new(plan))
    }
}

impl From<TentaclePlan> for Plan {
    fn from(plan: TentaclePlan) -> Plan {
        Plan::Tentacle(Box::new(plan))
    }
}

impl From<FigurePlan> for Plan {
    fn from(plan: FigurePlan) -> Plan {
        Plan::Figure(Box::new(plan))
    }
}

impl Plan {
    /// The pose in which a robot with this plan sits, or its arms park, rad.
    pub fn resting_pose_rad(&self) -> &[f64] {
        match self {
            Plan::Horse(plan) => &plan.sit_pose_rad,
            Plan::Tentacle(plan) => &plan.park_pose_rad,
            Plan::Figure(plan) => &plan.sit_pose_rad,
        }
    }

    /// Name of the gait and speed, m/s, that it asks for; `None` for a kind without gaits.
    pub fn gait(&self) -> Option<(&str, f64)> {
        match self {
            Plan::Horse(plan) => Some((plan.gait_name(plan.command.gait), plan.command.speed_m_s)),
            Plan::Tentacle(_) | Plan::Figure(_) => None,
        }
    }

    /// Words for a robot that has done as planned.
    pub fn done(&self) -> &'static str {
        match self {
            Plan::Horse(_) => "walked for the time asked",
            Plan::Tentacle(_) => "moved for the time asked",
            Plan::Figure(_) => "stood for the time asked",
        }
    }

    /// The plan to go in this gait at this share of its top speed; the same plan for a kind without gaits.
    pub fn at_share(self, gait: GaitChoice, speed_share: f64) -> Plan {
        match self {
            Plan::Horse(plan) => plan.at_share(gait, speed_share).into(),
            other => other,
        }
    }
}

/// A generator of one kind of motion.
pub trait Generate: fmt::Debug + Send {
    /// Advances motion time by `dt_s` (unless held) and writes the present targets.
    fn step(&mut self, dt_s: f64, state: &State, order: Order, targets: &mut Targets);

    /// Restarts from the last goals with torque on, like a robot that has just been given torque; it forgets
    /// its earlier motion.
    fn restart(&mut self, state: &State);

    /// The robot's activity.
    fn activity(&self) -> Activity;

    /// True if the robot lets go of its joints as planned, or has done so.
    fn is_letting_go(&self) -> bool {
        false
    }

    /// Planned present speed of the trunk, m/s; 0 for a robot that does not walk.
    fn speed_m_s(&self) -> f64 {
        0.0
    }

    /// Name of the arms' stroke; `None` at rest, and for a robot without strokes.
    fn stroke(&self) -> Option<&'static str> {
        None
    }

    /// Present or next pose, index into [`crate::model::FigureMotion::poses`]; `None` for a robot without poses.
    fn pose(&self) -> Option<usize> {
        None
    }

    /// The walker on its feet, if the robot goes by gaits.
    fn drive(&self) -> Option<&horse::Drive> {
        None
    }

    /// The joint that turns by itself, if that is all that moves.
    fn jog(&self) -> Option<&Jog> {
        None
    }
}

/// Makes the targets of one robot.
#[derive(Debug)]
pub struct Generator(Box<dyn Generate>);

impl Generator {
    /// A limp robot that, once ordered, follows the command of `plan` for `move_for_s`.
    pub fn new(robot: &Robot, plan: impl Into<Plan>, move_for_s: f64) -> Generator {
        Generator(match plan.into() {
            Plan::Horse(plan) => Box::new(HorseGenerator::new(robot, Drive::standing(*plan), move_for_s)),
            Plan::Tentacle(plan) => Box::new(TentacleGenerator::new(robot, *plan, move_for_s)),
            Plan::Figure(plan) => {
                Box::new(FigureGenerator::new(robot, PoseMotion::standing(robot, *plan), move_for_s))
            }
        })
    }
}

impl From<Jog> for Generator {
    fn from(jog: Jog) -> Generator {
        Generator(Box::new(jog))
    }
}

impl Deref for Generator {
    type Target = dyn Generate;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

impl DerefMut for Generator {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut *self.0
    }
}
