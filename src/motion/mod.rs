//! The generator: the stage that makes the targets, with a folder for each kind of robot.
//!
//! Input: the length of the last cycle, the feedback ([`State`]), and the operator's order. Output:
//! [`Targets`]. It knows nothing about servos, and stands still while safety holds the robot.

pub mod curves;
pub mod figure;
pub mod horse;
mod jog;
pub mod legged;
mod legged_motion;
mod pose_change;
mod rise;
pub mod tentacle;
mod torque_phase;

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use crate::model::Robot;
pub use crate::signals::{Activity, Command, GaitChoice, Order, Place, Posture, Stroke, StrokeCommand};
use crate::signals::{State, Targets};
pub use jog::Jog;
pub use rise::FailedRise;

/// Time constant with which redundant joints go to their neutral posture, s.
const POSTURE_TIME_S: f64 = 0.1;

/// Share of the way to their neutral posture that redundant joints move in a cycle of `dt_s`.
pub fn posture_pull(dt_s: f64) -> f64 {
    1.0 - (-dt_s / POSTURE_TIME_S).exp()
}

/// The planned motion of a robot, and the data it needs: the plan of any kind of motion.
#[derive(Debug, Clone)]
pub struct Plan(Arc<dyn Planned>);

impl<P: Planned + 'static> From<P> for Plan {
    fn from(plan: P) -> Plan {
        Plan(Arc::new(plan))
    }
}

impl Plan {
    /// The plan to go in this gait at this share of its top speed; the same plan for a kind without gaits.
    pub fn at_share(self, gait: GaitChoice, speed_share: f64) -> Plan {
        self.0.at_share(gait, speed_share).unwrap_or(self)
    }

    /// Name of the gait and speed, m/s, that it asks for; `None` for a kind without gaits.
    pub fn gait(&self) -> Option<(&str, f64)> {
        match self.0.intent() {
            Intent::Drive { gait, command } => Some((gait, command.speed_m_s)),
            Intent::Perform(_) | Intent::Take { .. } => None,
        }
    }
}

impl Deref for Plan {
    type Target = dyn Planned;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

/// The motion of a plan while the operator only orders it to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Intent<'a> {
    /// It goes in a gait.
    Drive {
        /// Name of the gait.
        gait: &'a str,
        /// Gait, speed and posture.
        command: Command,
    },
    /// It performs strokes.
    Perform(StrokeCommand),
    /// It takes a pose.
    Take {
        /// Name of the pose.
        pose: &'a str,
    },
}

/// The plan of one kind of motion.
pub trait Planned: fmt::Debug + Send + Sync {
    /// The pose in which a robot with this plan sits, or its arms park, rad.
    fn resting_pose_rad(&self) -> &[f64];

    /// What it does while the operator only orders it to go.
    fn intent(&self) -> Intent<'_>;

    /// Words for a robot that has done as planned.
    fn done(&self) -> &'static str;

    /// The generator of a limp robot that, once ordered, follows this plan for `move_for_s`.
    fn generator(&self, robot: &Robot, move_for_s: f64) -> Box<dyn Generate>;

    /// The plan to go in this gait at this share of its top speed; `None` for a kind without gaits.
    fn at_share(&self, _gait: GaitChoice, _speed_share: f64) -> Option<Plan> {
        None
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

    /// How it failed to rise, if it did.
    fn failed_rise(&self) -> Option<FailedRise> {
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
        Generator(plan.into().generator(robot, move_for_s))
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
