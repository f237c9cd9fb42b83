//! Turns the messages of one cycle into its sample.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::de::DeserializeOwned;

use super::messages::{self, SlotResult};
use super::orders;
use super::sample::Sample;
use super::topics;
use crate::bus::{ServoGoal, Slot};
use crate::model::Robot;
use crate::observe::BusFacts;
use crate::signals::{FootTarget, ImuReading, Outage, OutageCause};
use crate::units::Time;

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
    let times: Option<messages::Loop> = read(cycle, topics::LOOP)?;
    let motion: Option<messages::Motion> = read(cycle, topics::MOTION)?;
    let states: Option<messages::JointState<'_>> = read(cycle, topics::JOINT_STATES)?;
    let goals: Option<messages::JointState<'_>> = read(cycle, topics::JOINT_GOALS)?;
    let servos: Option<messages::Servos<'_>> = read(cycle, topics::SERVOS)?;
    let feet: Option<messages::Feet<'_>> = read(cycle, topics::FEET)?;
    let trunk: Option<messages::PoseInFrame<'_>> = read(cycle, topics::TRUNK)?;
    let buses: Option<messages::Buses<'_>> = read(cycle, topics::BUSES)?;
    // A recording of a robot without these parts does not have the topics.
    let imu: Option<messages::Imu> = read(cycle, topics::IMU)?;
    let truth: Option<messages::TrueBody> = read(cycle, topics::TRUE_BODY)?;
    let (Some(times), Some(motion), Some(states), Some(goals)) = (times, motion, states, goals) else {
        return Ok(None);
    };
    let (Some(servos), Some(feet), Some(trunk), Some(buses)) = (servos, feet, trunk, buses) else {
        return Ok(None);
    };
    let mut sample = Sample::new(robot);
    sample.facts.times.number = times.cycle;
    sample.facts.times.began = Time(times.began_ns);
    sample.facts.times.gap = Duration::from_nanos(times.gap_ns);
    sample.facts.times.work = Duration::from_nanos(times.work_ns);
    sample.facts.times.exchange = Duration::from_nanos(times.exchange_ns);
    sample.facts.times.late = Duration::from_nanos(times.late_ns);
    sample.facts.order =
        motion.order.try_into().map_err(|error| format!("a message of {}: {error}", topics::MOTION.name))?;
    if !orders::is_of(sample.facts.order, robot) {
        let topic = topics::MOTION.name;
        return Err(format!("a message of {topic}: an order to do what the robot file does not have"));
    }
    sample.facts.activity = motion.activity;
    sample.facts.speed_m_s = motion.speed_m_s;
    sample.facts.interventions = motion.interventions;
    sample.facts.is_held = motion.is_held;
    sample.state.permission = motion.permission;
    sample.state.outage = match &motion.outage {
        None => None,
        Some(outage) => {
            let cause = if outage.is_jam { OutageCause::Jam } else { OutageCause::Alarm(outage.alarms) };
            Some(Outage { joint: joint_named(robot, &outage.joint)?, cause })
        }
    };
    sample.targets.aim = motion.aim;
    sample.targets.trunk_in_world = trunk.pose.position.into();
    sample.targets.trunk_turn = trunk.pose.orientation.into();
    if let Some(imu) = imu {
        sample.facts.imu = ImuReading {
            is_known: imu.is_known,
            age_s: imu.age_s,
            rate_rad_s: imu.rate_rad_s.into(),
            specific_force_m_s2: imu.specific_force_m_s2.into(),
            roll_rad: imu.roll_rad,
            pitch_rad: imu.pitch_rad,
            yaw_rad: imu.yaw_rad,
            implausible: imu.implausible,
        };
        sample.state.body.is_known = imu.is_acted_on;
    }
    sample.facts.truth = truth.map(Into::into);
    read_joints(robot, &states, &goals, &mut sample)?;
    read_servos(robot, &servos, &mut sample)?;
    read_feet(robot, &feet, &mut sample)?;
    for (sample, bus) in sample.buses.iter_mut().zip(&buses.buses) {
        *sample = BusFacts {
            exchange: Duration::from_nanos(bus.exchange_ns),
            missing: bus.missing,
            corrupt: bus.corrupt,
            is_gone: bus.is_gone,
            ..BusFacts::default()
        };
    }
    Ok(Some(sample))
}

fn read_joints(
    robot: &Robot,
    states: &messages::JointState<'_>,
    goals: &messages::JointState<'_>,
    sample: &mut Sample,
) -> Result<(), String> {
    let measured = states.name.iter().zip(&states.position).zip(&states.velocity).zip(&states.effort);
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
    for (name, position) in goals.name.iter().zip(&goals.position) {
        sample.state.goal_rad[joint_named(robot, name)?] = *position;
    }
    Ok(())
}

fn read_servos(robot: &Robot, servos: &messages::Servos<'_>, sample: &mut Sample) -> Result<(), String> {
    for servo in &servos.servos {
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
            (SlotResult::Told, _) => {
                Slot::Told(servo.told.ok_or_else(|| format!("an answer of {} holds nothing", servo.joint))?)
            }
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

fn read_feet(robot: &Robot, feet: &messages::Feet<'_>, sample: &mut Sample) -> Result<(), String> {
    for foot in &feet.feet {
        let index = robot
            .chains
            .iter()
            .position(|chain| chain.name == foot.chain)
            .ok_or_else(|| format!("the robot has no chain {}", foot.chain))?;
        sample.joints.residual_m[index] = foot.residual_m.unwrap_or(f64::INFINITY);
        if let Some(target) = foot.target_in_body {
            sample.targets.tips_in_body[index] = target.into();
        }
        if let Some(plan) = foot.plan {
            sample.targets.feet.push(FootTarget {
                chain: index,
                in_world: plan.in_world.into(),
                excursion_m: plan.excursion_m,
                plane_way_m: plan.plane_way_m,
                is_swing: plan.is_swing,
                load_share: f64::from(u8::from(!plan.is_swing)),
                swing_acceleration_m_s2: plan.swing_acceleration_m_s2,
            });
        }
    }
    Ok(())
}

fn joint_named(robot: &Robot, name: &str) -> Result<usize, String> {
    let found = robot.joints.iter().position(|joint| joint.name == name);
    found.ok_or_else(|| format!("the robot has no joint {name}"))
}
