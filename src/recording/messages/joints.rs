//! `/joint_states` and `/joint_goals`: joints by name, in SI units.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::super::sample::Sample;
use super::super::scene::BODY;
use super::{Header, Stamp, joint_named};
use crate::bus::ServoGoal;
use crate::model::Robot;

/// `sensor_msgs/JointState`: all arrays have the same length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointState<'a> {
    /// Time and frame.
    pub header: Header<'a>,
    /// Names of the joints.
    pub name: Vec<Cow<'a, str>>,
    /// Angles, rad.
    pub position: Vec<f64>,
    /// Velocities, rad/s; empty for goals.
    pub velocity: Vec<f64>,
    /// Torques, N m: the load as the servo estimates it, or the torque limit of a goal.
    pub effort: Vec<f64>,
}

impl<'a> JointState<'a> {
    /// The measured joints of `sample` that were heard at least once.
    pub(in crate::recording) fn measured(robot: &'a Robot, sample: &Sample, stamp: Stamp) -> JointState<'a> {
        let mut message = JointState::empty(stamp);
        for (joint, state) in robot.joints.iter().zip(&sample.state.joints) {
            if let (Some(servo), true) = (&joint.servo, state.is_known) {
                message.name.push(joint.name.as_str().into());
                message.position.push(state.position_rad);
                message.velocity.push(state.speed_rad_s);
                message.effort.push(state.load_share * servo.model.stall_torque_nm);
            }
        }
        message
    }

    /// The goals of the joints of `sample` that have torque.
    pub(in crate::recording) fn goals(robot: &'a Robot, sample: &Sample, stamp: Stamp) -> JointState<'a> {
        let mut message = JointState::empty(stamp);
        for ((joint, goal), goal_rad) in robot.joints.iter().zip(&sample.goals).zip(&sample.state.goal_rad) {
            if let (Some(servo), ServoGoal::Move { torque_limit, .. }) = (&joint.servo, goal) {
                message.name.push(joint.name.as_str().into());
                message.position.push(*goal_rad);
                let share = f64::from(*torque_limit) / f64::from(servo.model.torque_limit_full);
                message.effort.push(share * servo.model.stall_torque_nm);
            }
        }
        message
    }

    fn empty(stamp: Stamp) -> JointState<'a> {
        JointState {
            header: Header { stamp, frame_id: BODY.into() },
            name: Vec::new(),
            position: Vec::new(),
            velocity: Vec::new(),
            effort: Vec::new(),
        }
    }

    /// Puts measured joints into `sample`.
    pub(in crate::recording) fn measured_into(
        &self,
        robot: &Robot,
        sample: &mut Sample,
    ) -> Result<(), String> {
        let measured = self.name.iter().zip(&self.position).zip(&self.velocity).zip(&self.effort);
        for (((name, position), velocity), effort) in measured {
            let index = joint_named(robot, name)?;
            let state = &mut sample.state.joints[index];
            state.is_known = true;
            state.position_rad = *position;
            state.speed_rad_s = *velocity;
            if let Some(servo) = &robot.joints[index].servo {
                state.load_share = effort / servo.model.stall_torque_nm;
            }
        }
        Ok(())
    }

    /// Puts goals into `sample`.
    pub(in crate::recording) fn goals_into(&self, robot: &Robot, sample: &mut Sample) -> Result<(), String> {
        for (name, position) in self.name.iter().zip(&self.position) {
            sample.state.goal_rad[joint_named(robot, name)?] = *position;
        }
        Ok(())
    }
}
