//! Turns the messages of one cycle into its sample.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;

use super::messages::{Buses, Feet, Imu, JointState, Loop, Motion, PoseInFrame, Servos, TrueBody};
use super::sample::Sample;
use super::topics;
use crate::model::Robot;

/// One cycle's messages by topic.
pub(super) type Messages = BTreeMap<&'static str, Vec<u8>>;

/// Topics that are only for display.
pub(super) const UNREAD: [&str; 2] = [topics::TRANSFORMS.name, topics::SCENE.name];

/// The sample of a cycle's messages; `None` if a message is missing.
pub(super) fn sample(robot: &Robot, cycle: &Messages) -> Result<Option<Sample>, String> {
    fn read<M: DeserializeOwned>(cycle: &Messages, topic: topics::Topic) -> Result<Option<M>, String> {
        let Some(data) = cycle.get(topic.name) else { return Ok(None) };
        serde_json::from_slice(data)
            .map(Some)
            .map_err(|error| format!("a message of {}: {error}", topic.name))
    }
    let times: Option<Loop> = read(cycle, topics::LOOP)?;
    let motion: Option<Motion> = read(cycle, topics::MOTION)?;
    let states: Option<JointState<'_>> = read(cycle, topics::JOINT_STATES)?;
    let goals: Option<JointState<'_>> = read(cycle, topics::JOINT_GOALS)?;
    let servos: Option<Servos<'_>> = read(cycle, topics::SERVOS)?;
    let feet: Option<Feet<'_>> = read(cycle, topics::FEET)?;
    let trunk: Option<PoseInFrame<'_>> = read(cycle, topics::TRUNK)?;
    let buses: Option<Buses<'_>> = read(cycle, topics::BUSES)?;
    // A recording of a robot without these parts does not have the topics.
    let imu: Option<Imu> = read(cycle, topics::IMU)?;
    let truth: Option<TrueBody> = read(cycle, topics::TRUE_BODY)?;
    let (Some(times), Some(motion), Some(states), Some(goals)) = (times, motion, states, goals) else {
        return Ok(None);
    };
    let (Some(servos), Some(feet), Some(trunk), Some(buses)) = (servos, feet, trunk, buses) else {
        return Ok(None);
    };
    let mut sample = Sample::new(robot);
    times.read_into(&mut sample);
    motion.read_into(robot, &mut sample)?;
    trunk.read_into(&mut sample);
    if let Some(imu) = imu {
        imu.read_into(&mut sample);
    }
    sample.facts.truth = truth.map(Into::into);
    states.measured_into(robot, &mut sample)?;
    goals.goals_into(robot, &mut sample)?;
    servos.read_into(robot, &mut sample)?;
    feet.read_into(robot, &mut sample)?;
    buses.read_into(&mut sample);
    Ok(Some(sample))
}
