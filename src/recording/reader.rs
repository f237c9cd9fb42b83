//! A recording read back: what a replay needs, sample by sample.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use mcap::read::{ChunkFlattener, Options};
use mcap::records::Record;
use serde::de::DeserializeOwned;

use super::header::RunHeader;
use super::messages::{self, SlotResult};
use super::sample::{BusSample, Sample};
use super::topics;
use super::writer::{OUTCOME_METADATA, ROBOT_ATTACHMENT, RUN_ATTACHMENT};
use crate::bus::{ServoGoal, Slot};
use crate::config::{self, ConfigError};
use crate::model::Robot;
use crate::signals::{FootTarget, ImuReading, Outage, OutageCause};
use crate::units::Time;

/// Why a file is no recording of this program.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It cannot be read at all.
    #[error("{file} could not be read")]
    Io {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// It is no MCAP file, or not one of ours.
    #[error("{file}: expected a recording of 'hippocamp run --record': {reason}")]
    NotARecording {
        /// The file.
        file: String,
        /// What was found.
        reason: String,
    },
    /// The robot file inside is not good.
    #[error("the robot file inside the recording is not good")]
    Robot(#[from] ConfigError),
}

/// How the recording ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// With the run: what was noted of it.
    Outcome(BTreeMap<String, String>),
    /// In the middle: the recorder had no time to end it.
    CutShort {
        /// Where reading ended.
        reason: String,
    },
}

/// A recording in memory.
#[derive(Debug)]
pub struct Recording {
    /// What the run was asked to do.
    pub header: RunHeader,
    /// Text of the robot file.
    pub robot_text: String,
    /// The robot, as its servos were mounted.
    pub robot: Robot,
    /// Cycles that are whole, their numbers rising.
    pub samples: Vec<Sample>,
    /// How it ends.
    pub ending: Ending,
}

impl Recording {
    /// Reads the recording at `path`, up to its last whole chunk if it was cut short.
    ///
    /// # Errors
    /// When there is no such file or it is no recording.
    pub fn read(path: &Path) -> Result<Recording, ReadError> {
        let file = path.display().to_string();
        match std::fs::read(path) {
            Ok(bytes) => Recording::parse(&bytes, &file),
            Err(source) => Err(ReadError::Io { file, source }),
        }
    }

    /// The same from the `bytes` of a file called `file`.
    ///
    /// # Errors
    /// When they are no recording.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Recording, ReadError> {
        let not_a_recording = |reason: String| ReadError::NotARecording { file: file.to_owned(), reason };
        let contents = Contents::of(bytes).map_err(not_a_recording)?;
        let text = |name: &str| {
            let data =
                contents.attachments.get(name).ok_or_else(|| format!("it has no attachment {name}"))?;
            String::from_utf8(data.to_vec()).map_err(|_| format!("its attachment {name} is no text"))
        };
        let header: RunHeader = text(RUN_ATTACHMENT)
            .and_then(|text| {
                serde_json::from_str(&text)
                    .map_err(|error| format!("its attachment {RUN_ATTACHMENT}: {error}"))
            })
            .map_err(not_a_recording)?;
        if header.version != RunHeader::VERSION {
            return Err(not_a_recording(format!(
                "its layout is version {}, this program reads version {}",
                header.version,
                RunHeader::VERSION
            )));
        }
        let robot_text = text(ROBOT_ATTACHMENT).map_err(not_a_recording)?;
        let mut robot = config::parse(&robot_text, &header.robot_file)?.robot;
        header.apply_to(&mut robot);
        let mut samples = Vec::with_capacity(contents.cycles.len());
        for cycle in &contents.cycles {
            // The last cycle of a recording that was cut short may lack topics.
            let Some(sample) = sample(&robot, cycle).map_err(not_a_recording)? else { continue };
            let last: Option<&Sample> = samples.last();
            if let Some(last) = last.filter(|last| last.times.number >= sample.times.number) {
                let (cycle, before) = (sample.times.number, last.times.number);
                return Err(not_a_recording(format!("its cycle {cycle} comes after cycle {before}")));
            }
            samples.push(sample);
        }
        let ending = match (contents.outcome, contents.error) {
            (Some(outcome), _) => Ending::Outcome(outcome),
            (None, Some(reason)) => Ending::CutShort { reason },
            (None, None) => Ending::CutShort { reason: "it has no outcome".to_owned() },
        };
        Ok(Recording { header, robot_text, robot, samples, ending })
    }

    /// True if it was told what the robot truly did. What the robot knew of its trunk itself is not in it.
    pub fn has_truth(&self) -> bool {
        self.samples.iter().any(|sample| sample.truth.is_some())
    }

    /// How many cycles the run had, as far as the recording tells; those that were dropped count.
    pub fn cycles_of_run(&self) -> u64 {
        let recorded = self.samples.last().map_or(0, |sample| sample.times.number.saturating_add(1));
        let noted = match &self.ending {
            Ending::Outcome(outcome) => outcome.get("cycles").and_then(|cycles| cycles.parse().ok()),
            Ending::CutShort { .. } => None,
        };
        recorded.max(noted.unwrap_or(0))
    }
}

/// One cycle's messages by topic.
type Messages = BTreeMap<String, Vec<u8>>;

#[derive(Default)]
struct Contents<'a> {
    attachments: BTreeMap<String, Cow<'a, [u8]>>,
    cycles: Vec<Messages>,
    outcome: Option<BTreeMap<String, String>>,
    error: Option<String>,
}

impl<'a> Contents<'a> {
    /// All there is up to the first thing that is broken. An error if not even the beginning is good.
    fn of(bytes: &'a [u8]) -> Result<Contents<'a>, String> {
        let options = Options::IgnoreEndMagic | Options::ValidateChunkCrcs;
        let records = ChunkFlattener::new_with_options(bytes, options).map_err(|error| error.to_string())?;
        let mut contents = Contents::default();
        let mut topics = BTreeMap::new();
        let mut sequence = None;
        for record in records {
            match record {
                Ok(Record::Attachment { header, data, .. }) => {
                    contents.attachments.insert(header.name, data);
                }
                Ok(Record::Channel(channel)) => {
                    topics.insert(channel.id, channel.topic);
                }
                Ok(Record::Message { header, data }) => {
                    if sequence != Some(header.sequence) {
                        sequence = Some(header.sequence);
                        contents.cycles.push(Messages::new());
                    }
                    if let (Some(topic), Some(cycle)) =
                        (topics.get(&header.channel_id), contents.cycles.last_mut())
                    {
                        cycle.insert(topic.clone(), data.into_owned());
                    }
                }
                Ok(Record::Metadata(metadata)) if metadata.name == OUTCOME_METADATA => {
                    contents.outcome = Some(metadata.metadata);
                }
                Ok(Record::DataEnd(_)) => break,
                Ok(_) => {}
                Err(error) if contents.attachments.is_empty() => return Err(error.to_string()),
                Err(error) => {
                    contents.error = Some(error.to_string());
                    break;
                }
            }
        }
        Ok(contents)
    }
}

/// The sample of a cycle's messages; none if one is missing.
fn sample(robot: &Robot, cycle: &Messages) -> Result<Option<Sample>, String> {
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
    // Not in a recording of a robot that has none.
    let imu: Option<messages::Imu> = read(cycle, topics::IMU)?;
    let truth: Option<messages::TrueBody> = read(cycle, topics::TRUE_BODY)?;
    let (Some(times), Some(motion), Some(states), Some(goals)) = (times, motion, states, goals) else {
        return Ok(None);
    };
    let (Some(servos), Some(feet), Some(trunk), Some(buses)) = (servos, feet, trunk, buses) else {
        return Ok(None);
    };
    let mut sample = Sample::new(robot);
    sample.times.number = times.cycle;
    sample.times.began = Time(times.began_ns);
    sample.times.gap = Duration::from_nanos(times.gap_ns);
    sample.times.work = Duration::from_nanos(times.work_ns);
    sample.times.exchange = Duration::from_nanos(times.exchange_ns);
    sample.late = Duration::from_nanos(times.late_ns);
    sample.order =
        motion.order.try_into().map_err(|error| format!("a message of {}: {error}", topics::MOTION.name))?;
    sample.activity = motion.activity;
    sample.speed_m_s = motion.speed_m_s;
    sample.interventions = motion.interventions;
    sample.is_held = motion.is_held;
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
        sample.imu = ImuReading {
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
    sample.truth = truth.map(Into::into);
    read_joints(robot, &states, &goals, &mut sample)?;
    read_servos(robot, &servos, &mut sample)?;
    read_feet(robot, &feet, &mut sample)?;
    for (sample, bus) in sample.buses.iter_mut().zip(&buses.buses) {
        *sample = BusSample {
            exchange: Duration::from_nanos(bus.exchange_ns),
            missing: bus.missing,
            corrupt: bus.corrupt,
            is_gone: bus.is_gone,
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
