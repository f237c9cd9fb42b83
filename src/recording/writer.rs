//! Writes samples to the MCAP file: the contents of each message, and when a chunk ends.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Write;
use std::time::Duration;

use glam::DVec3;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use serde::Serialize;

use super::header::RunHeader;
use super::messages::{self, Stamp};
use super::sample::Sample;
use super::scene;
use super::topics::{self, TOPICS, Topic};
use crate::bus::{ServoGoal, Slot};
use crate::model::{Chain, Robot};
use crate::signals::{Aim, OutageCause, Targets};
use crate::units::Time;

/// Longest chunk: data written longer ago than this survive whatever happens.
const CHUNK: Duration = Duration::from_secs(1);
/// A chunk ends sooner if its messages reach this many bytes: readers hold one chunk in memory.
const CHUNK_BYTES: usize = 8 << 20;
/// Most scene messages a second.
const SCENE_HZ: f64 = 50.0;

/// Names of the attachments.
pub(super) const ROBOT_ATTACHMENT: &str = "robot.toml";
pub(super) const RUN_ATTACHMENT: &str = "run.json";
/// Name of the metadata record.
pub(super) const OUTCOME_METADATA: &str = "outcome";

/// A recording that is being written.
pub(super) struct RecordingWriter<W: Write> {
    robot: Robot,
    started_unix_ns: u64,
    /// Chunks are built in memory and written whole, so that a cut leaves complete chunks behind.
    mcap: Writer<NoSeek<W>>,
    /// Channel of each topic, in the order of [`TOPICS`].
    channels: Vec<u16>,
    chunk_began: Time,
    chunk_bytes: usize,
    scene_every: u64,
    json: Vec<u8>,
}

impl<W: Write> RecordingWriter<W> {
    /// Begins a recording with all data that do not change.
    pub(super) fn new(
        robot: Robot,
        header: &RunHeader,
        robot_text: &str,
        sink: W,
    ) -> Result<RecordingWriter<W>, McapError> {
        let mut mcap = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(None)
            .disable_seeking(true)
            .library(concat!("hippocamp ", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(sink))?;
        let mut attach = |name: &str, media_type: &str, text: &str| {
            mcap.attach(&Attachment {
                log_time: header.started_unix_ns,
                create_time: header.started_unix_ns,
                name: name.to_owned(),
                media_type: media_type.to_owned(),
                data: Cow::Borrowed(text.as_bytes()),
            })
        };
        attach(ROBOT_ATTACHMENT, "application/toml", robot_text)?;
        let header_text = serde_json::to_string_pretty(header).map_err(std::io::Error::from)?;
        attach(RUN_ATTACHMENT, "application/json", &header_text)?;
        let mut channels = Vec::new();
        for topic in TOPICS {
            let schema = mcap.add_schema(topic.schema_name, "jsonschema", topic.schema.as_bytes())?;
            channels.push(mcap.add_channel(schema, topic.name, "json", &BTreeMap::new())?);
        }
        mcap.flush()?;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "1 to 20: at most 1000 Hz"
        )]
        let scene_every = (robot.rate_hz / SCENE_HZ).ceil().max(1.0) as u64;
        Ok(RecordingWriter {
            robot,
            started_unix_ns: header.started_unix_ns,
            mcap,
            channels,
            chunk_began: Time(0),
            chunk_bytes: 0,
            scene_every,
            json: Vec::new(),
        })
    }

    /// Writes one cycle; first ends the present chunk if it spans a second or is large.
    pub(super) fn write(&mut self, sample: &Sample) -> Result<(), McapError> {
        if sample.facts.times.began.since(self.chunk_began) >= CHUNK || self.chunk_bytes >= CHUNK_BYTES {
            self.mcap.flush()?;
            (self.chunk_began, self.chunk_bytes) = (sample.facts.times.began, 0);
        }
        let at = Time(self.started_unix_ns.saturating_add(sample.facts.times.began.0));
        let stamp = Stamp::from(at);
        let cycle = sample.facts.times.number;
        self.put(topics::JOINT_STATES, cycle, at, |robot| joint_states(robot, sample, stamp))?;
        self.put(topics::JOINT_GOALS, cycle, at, |robot| joint_goals(robot, sample, stamp))?;
        self.put(topics::SERVOS, cycle, at, |robot| servos(robot, sample, stamp))?;
        self.put(topics::FEET, cycle, at, |robot| feet(robot, sample, stamp))?;
        if self.robot.imu.is_some() {
            self.put(topics::IMU, cycle, at, |_| imu(sample, stamp))?;
        }
        self.put(topics::TRUNK, cycle, at, |_| messages::PoseInFrame {
            timestamp: stamp,
            frame_id: scene::WORLD.into(),
            pose: messages::Pose::turned(sample.targets.trunk_in_world, sample.targets.trunk_turn),
        })?;
        self.put(topics::MOTION, cycle, at, |robot| motion(robot, sample, stamp))?;
        self.put(topics::BUSES, cycle, at, |robot| buses(robot, sample, stamp))?;
        self.put(topics::LOOP, cycle, at, |_| loop_times(sample, stamp))?;
        self.put(topics::TRANSFORMS, cycle, at, |robot| {
            let (place, turn) = sample.trunk_in_world(robot);
            scene::transforms(place, turn, stamp)
        })?;
        if let Some(truth) = &sample.facts.truth {
            self.put(topics::TRUE_BODY, cycle, at, |_| messages::TrueBody::new(truth, stamp))?;
        }
        if cycle.is_multiple_of(self.scene_every) {
            self.put(topics::SCENE, cycle, at, |robot| scene::scene(robot, sample, stamp))?;
        }
        Ok(())
    }

    /// Ends the recording with the outcome of the run, and returns the sink.
    pub(super) fn finish(mut self, outcome: BTreeMap<String, String>) -> Result<W, McapError> {
        self.mcap.write_metadata(&Metadata { name: OUTCOME_METADATA.to_owned(), metadata: outcome })?;
        self.mcap.finish()?;
        let mut sink = self.mcap.into_inner().into_inner();
        sink.flush()?;
        Ok(sink)
    }

    fn put<'s, M: Serialize>(
        &'s mut self,
        topic: Topic,
        cycle: u64,
        at: Time,
        message: impl FnOnce(&'s Robot) -> M,
    ) -> Result<(), McapError> {
        let channel = TOPICS.iter().zip(&self.channels).find(|(of, _)| of.name == topic.name);
        let Some((_, channel)) = channel else { return Ok(()) };
        self.json.clear();
        serde_json::to_writer(&mut self.json, &message(&self.robot)).map_err(std::io::Error::from)?;
        self.chunk_bytes += self.json.len();
        let header = MessageHeader {
            channel_id: *channel,
            // The sequence wraps after 2^32 cycles; the loop's own message has the whole number.
            sequence: u32::try_from(cycle & u64::from(u32::MAX)).unwrap_or_default(),
            log_time: at.0,
            publish_time: at.0,
        };
        self.mcap.write_to_known_channel(&header, &self.json)
    }
}

fn joint_states<'r>(robot: &'r Robot, sample: &Sample, stamp: Stamp) -> messages::JointState<'r> {
    let mut message = empty_joint_state(stamp);
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

fn joint_goals<'r>(robot: &'r Robot, sample: &Sample, stamp: Stamp) -> messages::JointState<'r> {
    let mut message = empty_joint_state(stamp);
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

fn empty_joint_state(stamp: Stamp) -> messages::JointState<'static> {
    messages::JointState {
        header: messages::Header { stamp, frame_id: scene::BODY.into() },
        name: Vec::new(),
        position: Vec::new(),
        velocity: Vec::new(),
        effort: Vec::new(),
    }
}

fn servos<'r>(robot: &'r Robot, sample: &Sample, timestamp: Stamp) -> messages::Servos<'r> {
    let all = robot.joints.iter().zip(&sample.goals).zip(&sample.slots).zip(&sample.state.joints);
    let servos = all.filter(|(((joint, _), _), _)| joint.servo.is_some());
    let servos = servos.map(|(((joint, goal), slot), state)| {
        let (result, reply, told) = match *slot {
            Slot::Fresh(reply) if state.is_implausible => {
                (messages::SlotResult::Implausible, Some(reply), None)
            }
            Slot::Fresh(reply) => (messages::SlotResult::Fresh, Some(reply), None),
            Slot::Told(told) => (messages::SlotResult::Told, None, Some(told)),
            Slot::Missing => (messages::SlotResult::Missing, None, None),
            Slot::Corrupt => (messages::SlotResult::Corrupt, None, None),
        };
        let registers = match *goal {
            ServoGoal::Limp | ServoGoal::Keep => None,
            ServoGoal::Move { position, torque_limit } => {
                Some(messages::GoalRegisters { position, torque_limit })
            }
        };
        let is_kept = *goal == ServoGoal::Keep;
        messages::Servo { joint: joint.name.as_str().into(), goal: registers, is_kept, result, reply, told }
    });
    messages::Servos { timestamp, servos: servos.collect() }
}

/// True if the generator set a target for the tip of chain number `chain`.
fn is_aimed(targets: &Targets, chain: usize) -> bool {
    match targets.aim {
        Aim::Tips | Aim::Arms => true,
        Aim::Soles => targets.feet.iter().any(|foot| foot.chain == chain),
        Aim::Limp | Aim::Pose | Aim::Joint(_) => false,
    }
}

fn feet<'r>(robot: &'r Robot, sample: &Sample, timestamp: Stamp) -> messages::Feet<'r> {
    let targets = &sample.targets;
    let in_world = |place: DVec3| targets.trunk_in_world + targets.trunk_turn * place;
    let is_placed = !targets.feet.is_empty();
    let foot = |(index, chain): (usize, &'r Chain)| {
        let target = is_aimed(targets, index).then_some(targets.tips_in_body[index]);
        let joints = &sample.state.joints[chain.joints.clone()];
        let measured = joints
            .iter()
            .all(|joint| joint.is_known)
            .then(|| robot.tip_in_body(chain, joints.iter().map(|joint| joint.position_rad)));
        let in_world = |place: Option<DVec3>| finite(place.filter(|_| is_placed).map(in_world));
        let residual_m = sample.joints.residual_m[index];
        messages::Foot {
            chain: chain.name.as_str().into(),
            target_in_body: finite(target),
            target_in_world: in_world(target),
            measured_in_body: finite(measured),
            measured_in_world: in_world(measured),
            residual_m: residual_m.is_finite().then_some(residual_m),
            plan: sample.targets.feet.iter().find(|foot| foot.chain == index).map(|foot| {
                messages::FootPlan {
                    in_world: foot.in_world.into(),
                    excursion_m: foot.excursion_m,
                    plane_way_m: foot.plane_way_m,
                    is_swing: foot.is_swing,
                    swing_acceleration_m_s2: foot.swing_acceleration_m_s2,
                }
            }),
        }
    };
    messages::Feet { timestamp, feet: robot.chains.iter().enumerate().map(foot).collect() }
}

/// JSON has no infinity.
fn finite(place: Option<DVec3>) -> Option<messages::Vector3> {
    place.filter(|place| place.is_finite()).map(messages::Vector3::from)
}

fn imu(sample: &Sample, timestamp: Stamp) -> messages::Imu {
    let reading = &sample.facts.imu;
    messages::Imu {
        timestamp,
        is_known: reading.is_known,
        is_acted_on: sample.state.body.is_known,
        age_s: reading.age_s,
        roll_rad: reading.roll_rad,
        pitch_rad: reading.pitch_rad,
        yaw_rad: reading.yaw_rad,
        rate_rad_s: reading.rate_rad_s.into(),
        specific_force_m_s2: reading.specific_force_m_s2.into(),
        implausible: reading.implausible,
    }
}

fn motion(robot: &Robot, sample: &Sample, timestamp: Stamp) -> messages::Motion {
    messages::Motion {
        timestamp,
        order: sample.facts.order.into(),
        activity: sample.facts.activity,
        aim: sample.targets.aim,
        speed_m_s: sample.facts.speed_m_s,
        permission: sample.state.permission,
        is_held: sample.facts.is_held,
        interventions: sample.facts.interventions,
        outage: sample.state.outage.map(|outage| messages::Outage {
            joint: robot.joints[outage.joint].name.clone(),
            is_jam: outage.cause == OutageCause::Jam,
            alarms: match outage.cause {
                OutageCause::Alarm(causes) => causes,
                OutageCause::Jam => 0,
            },
        }),
    }
}

fn buses<'r>(robot: &'r Robot, sample: &Sample, timestamp: Stamp) -> messages::Buses<'r> {
    let buses = robot.buses.iter().zip(&sample.buses).map(|(bus, sample)| messages::Bus {
        name: bus.name.as_str().into(),
        exchange_ns: nanoseconds(sample.exchange),
        missing: sample.missing,
        corrupt: sample.corrupt,
        is_gone: sample.is_gone,
    });
    messages::Buses { timestamp, buses: buses.collect() }
}

fn loop_times(sample: &Sample, timestamp: Stamp) -> messages::Loop {
    messages::Loop {
        timestamp,
        cycle: sample.facts.times.number,
        began_ns: sample.facts.times.began.0,
        gap_ns: nanoseconds(sample.facts.times.gap),
        late_ns: nanoseconds(sample.facts.times.late),
        work_ns: nanoseconds(sample.facts.times.work),
        exchange_ns: nanoseconds(sample.facts.times.exchange),
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
