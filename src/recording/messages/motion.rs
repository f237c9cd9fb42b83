//! `/motion`: what was ordered, what the robot does, and what safety permits.

use serde::{Deserialize, Serialize};

use super::super::orders::{self, OrderFields};
use super::super::sample::Sample;
use super::super::topics;
use super::{Stamp, joint_named};
use crate::model::Robot;
use crate::motion::Activity;
use crate::signals::{self, Aim, OutageCause, Permission};

/// `hippocamp.Motion`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Time of the message.
    pub timestamp: Stamp,
    /// The operator's order.
    #[serde(flatten)]
    pub order: OrderFields,
    /// The robot's activity.
    pub activity: Activity,
    /// The generator's aim.
    pub aim: Aim,
    /// Planned speed, m/s.
    pub speed_m_s: f64,
    /// Permission of safety from now on.
    pub permission: Permission,
    /// True if motion time stood still in this cycle.
    pub is_held: bool,
    /// Joints whose goal safety changed.
    pub interventions: u32,
    /// The joint that was taken out of service in this cycle, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outage: Option<Outage>,
}

/// A joint that the robot continues without: see [`crate::signals::Outage`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outage {
    /// Name of the joint.
    pub joint: String,
    /// True if the joint did not follow its goal.
    pub is_jam: bool,
    /// Causes of the servo's alarm, one bit each; 0 if the servo did not report them.
    pub alarms: u8,
}

impl Motion {
    /// The message of `sample` at `timestamp`.
    pub(in crate::recording) fn of(robot: &Robot, sample: &Sample, timestamp: Stamp) -> Motion {
        Motion {
            timestamp,
            order: sample.facts.order.into(),
            activity: sample.facts.activity,
            aim: sample.targets.aim(),
            speed_m_s: sample.facts.speed_m_s,
            permission: sample.state.permission,
            is_held: sample.facts.is_held,
            interventions: sample.facts.interventions,
            outage: sample.state.outage.map(|outage| Outage {
                joint: robot.joints[outage.joint].name.clone(),
                is_jam: outage.cause == OutageCause::Jam,
                alarms: match outage.cause {
                    OutageCause::Alarm(causes) => causes,
                    OutageCause::Jam => 0,
                },
            }),
        }
    }

    /// Puts what the message holds into `sample`.
    pub(in crate::recording) fn read_into(self, robot: &Robot, sample: &mut Sample) -> Result<(), String> {
        let topic = topics::MOTION.name;
        let facts = &mut sample.facts;
        facts.order = self.order.try_into().map_err(|error| format!("a message of {topic}: {error}"))?;
        if !orders::is_of(facts.order, robot) {
            return Err(format!(
                "a message of {topic}: an order for something that the robot file does not have"
            ));
        }
        facts.activity = self.activity;
        facts.speed_m_s = self.speed_m_s;
        facts.interventions = self.interventions;
        facts.is_held = self.is_held;
        *sample.targets.recorded_mut().0 = self.aim;
        sample.state.permission = self.permission;
        sample.state.outage = match &self.outage {
            None => None,
            Some(outage) => {
                let cause = if outage.is_jam { OutageCause::Jam } else { OutageCause::Alarm(outage.alarms) };
                Some(signals::Outage { joint: joint_named(robot, &outage.joint)?, cause })
            }
        };
        Ok(())
    }
}
