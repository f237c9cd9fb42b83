//! Writes samples to the MCAP file: which messages, and when a chunk ends.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Write;
use std::time::Duration;

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use serde::Serialize;

use super::header::RunHeader;
use super::messages::{Buses, Feet, Imu, JointState, Loop, Motion, PoseInFrame, Servos, Stamp, TrueBody};
use super::sample::Sample;
use super::scene;
use super::topics::{self, TOPICS, Topic};
use crate::model::Robot;
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
        self.put(topics::JOINT_STATES, cycle, at, |robot| JointState::measured(robot, sample, stamp))?;
        self.put(topics::JOINT_GOALS, cycle, at, |robot| JointState::goals(robot, sample, stamp))?;
        self.put(topics::SERVOS, cycle, at, |robot| Servos::of(robot, sample, stamp))?;
        self.put(topics::FEET, cycle, at, |robot| Feet::of(robot, sample, stamp))?;
        if self.robot.imu.is_some() {
            self.put(topics::IMU, cycle, at, |_| Imu::of(sample, stamp))?;
        }
        self.put(topics::TRUNK, cycle, at, |_| PoseInFrame::of(sample, stamp))?;
        self.put(topics::MOTION, cycle, at, |robot| Motion::of(robot, sample, stamp))?;
        self.put(topics::BUSES, cycle, at, |robot| Buses::of(robot, sample, stamp))?;
        self.put(topics::LOOP, cycle, at, |_| Loop::of(sample, stamp))?;
        self.put(topics::TRANSFORMS, cycle, at, |robot| {
            let (place, turn) = sample.trunk_in_world(robot);
            scene::transforms(place, turn, stamp)
        })?;
        if let Some(truth) = &sample.facts.truth {
            self.put(topics::TRUE_BODY, cycle, at, |_| TrueBody::new(truth, stamp))?;
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
