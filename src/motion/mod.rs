//! The generator: the stage that makes the targets, with one variant for each kind of motion.
//!
//! Input: the length of the last cycle, the feedback ([`State`]), and the operator's order. Output:
//! [`Targets`]. It knows nothing about servos, and stands still while safety holds the robot.

pub mod curves;
mod ends;
pub mod figure;
pub mod horse;
mod jog;
pub mod legged;
mod pose_change;
pub mod tentacle;

use crate::model::Robot;
pub use crate::signals::{Activity, Command, GaitChoice, Order, Posture, Stroke, StrokeCommand};
use crate::signals::{State, Targets};
use figure::{FigureGenerator, FigurePlan, Poise};
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

    /// The plan to go in this gait at this share of its top speed; the same plan for a kind without gaits.
    pub fn at_share(self, gait: GaitChoice, speed_share: f64) -> Plan {
        match self {
            Plan::Horse(plan) => plan.at_share(gait, speed_share).into(),
            other => other,
        }
    }
}

/// Makes the targets of one robot; one variant for each kind of motion.
#[derive(Debug, Clone)]
pub enum Generator {
    /// A horse that stands up, walks and stops.
    Horse(Box<HorseGenerator>),
    /// Arms that wake, move by strokes and park.
    Tentacle(Box<TentacleGenerator>),
    /// A figure that stands up, takes poses and stops.
    Figure(Box<FigureGenerator>),
    /// One joint that turns to an angle, all others limp.
    Jog(Jog),
}

impl Generator {
    /// A limp robot that, once ordered, follows the command of `plan` for `move_for_s`.
    pub fn new(robot: &Robot, plan: impl Into<Plan>, move_for_s: f64) -> Generator {
        match plan.into() {
            Plan::Horse(plan) => {
                Generator::Horse(Box::new(HorseGenerator::new(robot, Drive::standing(*plan), move_for_s)))
            }
            Plan::Tentacle(plan) => {
                Generator::Tentacle(Box::new(TentacleGenerator::new(robot, *plan, move_for_s)))
            }
            Plan::Figure(plan) => {
                let poise = Poise::standing(robot, *plan);
                Generator::Figure(Box::new(FigureGenerator::new(robot, poise, move_for_s)))
            }
        }
    }

    /// Advances motion time by `dt_s` (unless held) and writes the present targets.
    pub fn step(&mut self, dt_s: f64, state: &State, order: Order, targets: &mut Targets) {
        match self {
            Generator::Horse(horse) => horse.step(dt_s, state, order, targets),
            Generator::Tentacle(arms) => arms.step(dt_s, state, order, targets),
            Generator::Figure(figure) => figure.step(dt_s, state, order, targets),
            Generator::Jog(jog) => jog.step(dt_s, state, order, targets),
        }
    }

    /// Restarts from the last goals with torque on, like a robot that has just been given torque; it forgets
    /// its earlier motion.
    pub fn begin_anew(&mut self, state: &State) {
        match self {
            Generator::Horse(horse) => horse.begin_anew(state),
            Generator::Tentacle(arms) => arms.begin_anew(state),
            Generator::Figure(figure) => figure.begin_anew(state),
            Generator::Jog(_) => {}
        }
    }

    /// True if the robot lets go of its joints as planned, or has done so.
    pub fn is_letting_go(&self) -> bool {
        match self {
            Generator::Horse(horse) => horse.is_letting_go(),
            Generator::Figure(figure) => figure.is_letting_go(),
            Generator::Tentacle(_) | Generator::Jog(_) => false,
        }
    }

    /// The robot's activity.
    pub fn activity(&self) -> Activity {
        match self {
            Generator::Horse(horse) => horse.activity(),
            Generator::Tentacle(arms) => arms.activity(),
            Generator::Figure(figure) => figure.activity(),
            Generator::Jog(jog) => jog.activity(),
        }
    }

    /// Planned present speed of the trunk, m/s; 0 for all but a horse.
    pub fn speed_m_s(&self) -> f64 {
        match self {
            Generator::Horse(horse) => horse.drive().rates().speed_m_s,
            Generator::Tentacle(_) | Generator::Figure(_) | Generator::Jog(_) => 0.0,
        }
    }

    /// Name of the arms' stroke; `None` for a horse, and at rest.
    pub fn stroke(&self) -> Option<&'static str> {
        match self {
            Generator::Tentacle(arms) => arms.stroke().map(Stroke::name),
            Generator::Horse(_) | Generator::Figure(_) | Generator::Jog(_) => None,
        }
    }

    /// Present or next pose of a figure on its feet, index into [`crate::model::FigureMotion::poses`].
    pub fn pose(&self) -> Option<usize> {
        match self {
            Generator::Figure(figure) => Some(figure.drive().pose()),
            Generator::Horse(_) | Generator::Tentacle(_) | Generator::Jog(_) => None,
        }
    }

    /// The joint that turns by itself, if that is all that moves.
    pub fn jog(&self) -> Option<&Jog> {
        match self {
            Generator::Jog(jog) => Some(jog),
            Generator::Horse(_) | Generator::Tentacle(_) | Generator::Figure(_) => None,
        }
    }

    /// The horse on its feet, if the robot is a horse.
    pub fn drive(&self) -> Option<&horse::Drive> {
        match self {
            Generator::Horse(horse) => Some(horse.drive()),
            Generator::Tentacle(_) | Generator::Figure(_) | Generator::Jog(_) => None,
        }
    }
}
