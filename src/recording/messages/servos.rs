//! `/servos`: goal and reply of each servo in its own counts, and how the reply came.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::super::sample::Sample;
use super::{Stamp, joint_named};
use crate::bus::{ServoGoal, Slot};
use crate::model::Robot;
use crate::signals::{Feedback, ServoAnswer};

/// `hippocamp.Servos`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Servos<'a> {
    /// Time of the message.
    pub timestamp: Stamp,
    /// The servo of each joint that has one.
    pub servos: Vec<Servo<'a>>,
}

/// One servo in one exchange, in the servo's own units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Servo<'a> {
    /// Name of the joint that the servo turns.
    pub joint: Cow<'a, str>,
    /// The goal sent to it; left out if it was sent none or was made limp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal: Option<GoalRegisters>,
    /// True if nothing was sent to it, so that it keeps its last goal.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_kept: bool,
    /// Whether and how its reply arrived.
    pub result: SlotResult,
    /// The reply, if it was good, in the servo's own counts and units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reply: Option<Feedback>,
    /// The answer, if it was asked a question instead of feedback.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub told: Option<ServoAnswer>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde wants a reference")]
fn is_false(is_it: &bool) -> bool {
    !is_it
}

/// Goal registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct GoalRegisters {
    /// Goal position, counts.
    pub position: i32,
    /// Torque limit, the register's unit.
    pub torque_limit: u16,
}

/// Whether and how a reply arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SlotResult {
    /// In time and complete.
    Fresh,
    /// In time and complete, but dropped, since no servo can have measured these values.
    Implausible,
    /// In time and complete: an answer to a question, not feedback.
    Told,
    /// No reply.
    Missing,
    /// A damaged reply.
    Corrupt,
}

impl<'a> Servos<'a> {
    /// The message of `sample` at `timestamp`.
    pub(in crate::recording) fn of(robot: &'a Robot, sample: &Sample, timestamp: Stamp) -> Servos<'a> {
        let all = robot.joints.iter().zip(&sample.goals).zip(&sample.slots).zip(&sample.state.joints);
        let servos = all.filter(|(((joint, _), _), _)| joint.servo.is_some());
        let servos = servos.map(|(((joint, goal), slot), state)| {
            let (result, reply, told) = match *slot {
                Slot::Fresh(reply) if state.is_implausible => (SlotResult::Implausible, Some(reply), None),
                Slot::Fresh(reply) => (SlotResult::Fresh, Some(reply), None),
                Slot::Answered(told) => (SlotResult::Told, None, Some(told)),
                Slot::Missing => (SlotResult::Missing, None, None),
                Slot::Corrupt => (SlotResult::Corrupt, None, None),
            };
            let registers = match *goal {
                ServoGoal::Limp | ServoGoal::Keep => None,
                ServoGoal::Move { position, torque_limit } => Some(GoalRegisters { position, torque_limit }),
            };
            let is_kept = *goal == ServoGoal::Keep;
            Servo { joint: joint.name.as_str().into(), goal: registers, is_kept, result, reply, told }
        });
        Servos { timestamp, servos: servos.collect() }
    }

    /// Puts what the message holds into `sample`.
    pub(in crate::recording) fn read_into(&self, robot: &Robot, sample: &mut Sample) -> Result<(), String> {
        for servo in &self.servos {
            let index = joint_named(robot, &servo.joint)?;
            if let Some(goal) = servo.goal {
                sample.goals[index] =
                    ServoGoal::Move { position: goal.position, torque_limit: goal.torque_limit };
            }
            if servo.is_kept {
                sample.goals[index] = ServoGoal::Keep;
            }
            sample.state.joints[index].is_implausible = servo.result == SlotResult::Implausible;
            sample.slots[index] = match (servo.result, servo.reply) {
                (SlotResult::Told, _) => Slot::Answered(
                    servo.told.ok_or_else(|| format!("an answer of {} holds nothing", servo.joint))?,
                ),
                (SlotResult::Fresh | SlotResult::Implausible, Some(reply)) => Slot::Fresh(reply),
                (SlotResult::Fresh | SlotResult::Implausible, None) => {
                    return Err(format!("a fresh reply of {} holds nothing", servo.joint));
                }
                (SlotResult::Corrupt, _) => Slot::Corrupt,
                (SlotResult::Missing, _) => Slot::Missing,
            };
        }
        Ok(())
    }
}
