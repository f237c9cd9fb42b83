//! The generator: who makes the targets, and the hand-over from one to the next.
//!
//! Comes in: how long the last cycle was, what flows back ([`State`]), and the operator's order.
//! Goes out: [`Targets`]. It knows nothing of servos, and stands still while safety holds the robot.

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

/// Time constant with which joints to spare go to their neutral posture, s.
const POSTURE_TIME_S: f64 = 0.1;

/// Share of the way to their neutral posture that joints to spare go in a cycle of `dt_s`.
pub fn posture_pull(dt_s: f64) -> f64 {
    1.0 - (-dt_s / POSTURE_TIME_S).exp()
}

/// What a robot is to do, and what that takes to know of it; one variant a kind of motion.
#[derive(Debug, Clone)]
pub enum Plan {
    /// A horse's.
    Horse(Box<HorsePlan>),
    /// That of a rig of arms.
    Tentacle(Box<TentaclePlan>),
    /// A figure's.
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

/// Makes the targets of one robot; one variant a kind of motion.
#[derive(Debug, Clone)]
pub enum Generator {
    /// A horse that stands up, walks and stops.
    Horse(Box<HorseGenerator>),
    /// Arms that wake, move by strokes and are parked.
    Tentacle(Box<TentacleGenerator>),
    /// A figure that stands up, takes poses and stops.
    Figure(Box<FigureGenerator>),
    /// One joint that turns to an angle, all others limp.
    Jog(Jog),
}

impl Generator {
    /// A limp robot that will follow the command of `plan` for `move_for_s` once ordered to.
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

    /// Advances motion time by `dt_s` (unless held) and writes the targets for now.
    pub fn step(&mut self, dt_s: f64, state: &State, order: Order, targets: &mut Targets) {
        match self {
            Generator::Horse(horse) => horse.step(dt_s, state, order, targets),
            Generator::Tentacle(arms) => arms.step(dt_s, state, order, targets),
            Generator::Figure(figure) => figure.step(dt_s, state, order, targets),
            Generator::Jog(jog) => jog.step(dt_s, state, order, targets),
        }
    }

    /// Begins anew from the last goals with torque on, as a robot does that has just been given torque; what it did
    /// before is forgotten.
    pub fn begin_anew(&mut self, state: &State) {
        match self {
            Generator::Horse(horse) => horse.begin_anew(state),
            Generator::Tentacle(arms) => arms.begin_anew(state),
            Generator::Figure(figure) => figure.begin_anew(state),
            Generator::Jog(_) => {}
        }
    }

    /// True where the robot lets go of its joints, as it was to, or has.
    pub fn is_letting_go(&self) -> bool {
        match self {
            Generator::Horse(horse) => horse.is_letting_go(),
            Generator::Figure(figure) => figure.is_letting_go(),
            Generator::Tentacle(_) | Generator::Jog(_) => false,
        }
    }

    /// What the robot is doing.
    pub fn activity(&self) -> Activity {
        match self {
            Generator::Horse(horse) => horse.activity(),
            Generator::Tentacle(arms) => arms.activity(),
            Generator::Figure(figure) => figure.activity(),
            Generator::Jog(jog) => jog.activity(),
        }
    }

    /// Speed of the trunk the plan has now, m/s; 0 for all but a horse.
    pub fn speed_m_s(&self) -> f64 {
        match self {
            Generator::Horse(horse) => horse.drive().rates().speed_m_s,
            Generator::Tentacle(_) | Generator::Figure(_) | Generator::Jog(_) => 0.0,
        }
    }

    /// Name of the stroke its arms do; none for a horse, and at rest.
    pub fn stroke(&self) -> Option<&'static str> {
        match self {
            Generator::Tentacle(arms) => arms.stroke().map(Stroke::name),
            Generator::Horse(_) | Generator::Figure(_) | Generator::Jog(_) => None,
        }
    }

    /// The pose a figure on its feet is in or on the way to, index into [`crate::model::FigureMotion::poses`].
    pub fn pose(&self) -> Option<usize> {
        match self {
            Generator::Figure(figure) => Some(figure.drive().pose()),
            Generator::Horse(_) | Generator::Tentacle(_) | Generator::Jog(_) => None,
        }
    }

    /// The horse on its feet, if it is one.
    pub fn drive(&self) -> Option<&horse::Drive> {
        match self {
            Generator::Horse(horse) => Some(horse.drive()),
            Generator::Tentacle(_) | Generator::Figure(_) | Generator::Jog(_) => None,
        }
    }
}
