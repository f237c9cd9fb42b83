//! Reads a recording back: the data for a replay, cycle by cycle, in memory that does not grow with the file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use mcap::records::Record;

use super::decode::{Messages, UNREAD, sample};
use super::header::RunHeader;
use super::records::{RECORD_MAX, Records};
use super::sample::Sample;
use super::topics::TOPICS;
use super::writer::{OUTCOME_METADATA, ROBOT_ATTACHMENT, RUN_ATTACHMENT};
use crate::config::{self, ConfigError};
use crate::model::Robot;

/// Why a file is not a recording of this program.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It cannot be read.
    #[error("{file} could not be read")]
    Io {
        /// The file.
        file: String,
        /// The cause.
        source: std::io::Error,
    },
    /// It is not an MCAP file, or not one of ours.
    #[error("{file}: expected a recording of 'hippocamp run --record': {reason}")]
    NotARecording {
        /// The file.
        file: String,
        /// The contents found instead.
        reason: String,
    },
    /// The robot file inside is invalid.
    #[error("{file}: the robot file inside the recording is not valid")]
    Robot {
        /// The file.
        file: String,
        /// Its faults.
        source: ConfigError,
    },
}

/// How the recording ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// The recording ends with the run, and notes this outcome.
    Outcome(BTreeMap<String, String>),
    /// The recording ends early: the recorder had no time to end it, or the file was damaged since.
    CutShort {
        /// The place and cause of the cut.
        reason: String,
    },
}

impl Ending {
    /// Number of cycles that the run noted, dropped ones included. 0 if it noted none.
    pub fn cycles(&self) -> u64 {
        let noted = match self {
            Ending::Outcome(outcome) => outcome.get("cycles").and_then(|cycles| cycles.parse().ok()),
            Ending::CutShort { .. } => None,
        };
        noted.unwrap_or(0)
    }
}

/// The recorded run.
#[derive(Debug)]
pub struct RecordedRun {
    /// The task of the run.
    pub header: RunHeader,
    /// Text of the robot file.
    pub robot_text: String,
    /// The robot, with its servos as mounted.
    pub robot: Robot,
}

/// The cycles of a recording, read one after the other.
pub struct Cycles<R> {
    file: String,
    records: Records<R>,
    /// The topic of each channel, for channels that this program knows.
    topics: BTreeMap<u16, &'static str>,
    /// The messages of the cycle under assembly, and their sequence number.
    messages: Messages,
    sequence: Option<u32>,
    /// Number of the last complete cycle.
    last: Option<u64>,
    outcome: Option<BTreeMap<String, String>>,
    damage: Option<String>,
    is_over: bool,
}

/// Opens the recording at `path`.
///
/// # Errors
/// If there is no such file, or it is not a recording.
pub fn open(path: &Path) -> Result<(RecordedRun, Cycles<BufReader<File>>), ReadError> {
    let file = path.display().to_string();
    match File::open(path) {
        Ok(opened) => read(BufReader::new(opened), &file),
        Err(source) => Err(ReadError::Io { file, source }),
    }
}

/// Like [`open`], from the bytes that `from` gives, of a file called `file`.
///
/// # Errors
/// If they are not a recording.
pub fn read<R: Read>(from: R, file: &str) -> Result<(RecordedRun, Cycles<R>), ReadError> {
    let not_a_recording = |reason: String| ReadError::NotARecording { file: file.to_owned(), reason };
    let records = Records::of(from).map_err(not_a_recording)?;
    let mut cycles = Cycles {
        file: file.to_owned(),
        records,
        topics: BTreeMap::new(),
        messages: Messages::new(),
        sequence: None,
        last: None,
        outcome: None,
        damage: None,
        is_over: false,
    };
    let (robot_text, run_text) = cycles.attachments().map_err(not_a_recording)?;
    let header: RunHeader = serde_json::from_str(&run_text)
        .map_err(|error| not_a_recording(format!("its attachment {RUN_ATTACHMENT}: {error}")))?;
    header.check().map_err(|why| not_a_recording(format!("its attachment {RUN_ATTACHMENT}: {why}")))?;
    let mut robot = config::parse(&robot_text, &header.robot_file)
        .map_err(|source| ReadError::Robot { file: file.to_owned(), source })?
        .robot;
    header.apply_to(&mut robot);
    Ok((RecordedRun { header, robot_text, robot }, cycles))
}

impl<R: Read> Cycles<R> {
    /// The texts of the robot file and of `run.json`, which come before all cycles.
    fn attachments(&mut self) -> Result<(String, String), String> {
        let mut texts: BTreeMap<String, String> = BTreeMap::new();
        loop {
            if let (Some(robot), Some(run)) = (texts.get(ROBOT_ATTACHMENT), texts.get(RUN_ATTACHMENT)) {
                return Ok((robot.clone(), run.clone()));
            }
            let is_there = self.records.advance()?;
            match is_there.then(|| self.records.record()).transpose()? {
                Some(Record::Attachment { header, data, .. })
                    if [ROBOT_ATTACHMENT, RUN_ATTACHMENT].contains(&header.name.as_str()) =>
                {
                    let text = String::from_utf8(data.into_owned());
                    let text = text.map_err(|_| format!("its attachment {} is not text", header.name))?;
                    texts.insert(header.name, text);
                }
                None | Some(Record::Message { .. }) => {
                    let missing =
                        [ROBOT_ATTACHMENT, RUN_ATTACHMENT].iter().find(|name| !texts.contains_key(**name));
                    let missing = missing.copied().unwrap_or_default();
                    return Err(format!(
                        "it has no attachment {missing} of at most {RECORD_MAX} bytes before its first message"
                    ));
                }
                Some(Record::Channel(channel)) => self.learn_topic(channel.id, &channel.topic),
                Some(_) => {}
            }
        }
    }

    fn learn_topic(&mut self, channel: u16, topic: &str) {
        let known = TOPICS.iter().find(|known| known.name == topic);
        match known {
            Some(known) => self.topics.insert(channel, known.name),
            None => self.topics.remove(&channel),
        };
    }

    /// The next complete cycle of the recorded `robot`; `None` at the end. Cycle numbers rise.
    ///
    /// # Errors
    /// If the data are not a recording of this program. Damage is not an error: see [`Cycles::ending`].
    pub fn next(&mut self, robot: &Robot) -> Result<Option<Sample>, ReadError> {
        loop {
            let whole = self.next_messages();
            if whole.is_empty() && self.is_over {
                return Ok(None);
            }
            let found = sample(robot, &whole).and_then(|found| self.in_order(found));
            let found =
                found.map_err(|reason| ReadError::NotARecording { file: self.file.clone(), reason })?;
            // The last cycle of a cut recording may lack topics.
            if found.is_some() {
                return Ok(found);
            }
        }
    }

    fn in_order(&mut self, found: Option<Sample>) -> Result<Option<Sample>, String> {
        let Some(sample) = found else { return Ok(None) };
        let (number, before) = (sample.facts.times.number, self.last.replace(sample.facts.times.number));
        match before.filter(|before| *before >= number) {
            Some(before) => Err(format!("its cycle {number} comes after cycle {before}")),
            None => Ok(Some(sample)),
        }
    }

    /// The messages of the next cycle; at the end the remaining messages, then none.
    fn next_messages(&mut self) -> Messages {
        while !self.is_over {
            match self.take_record() {
                Ok(Some(whole)) => return whole,
                Ok(None) => {}
                Err(reason) => {
                    self.damage = Some(reason);
                    self.is_over = true;
                }
            }
        }
        std::mem::take(&mut self.messages)
    }

    /// Reads one record. If it begins another cycle, returns the messages of the cycle before.
    fn take_record(&mut self) -> Result<Option<Messages>, String> {
        if !self.records.advance()? {
            self.is_over = true;
            return Ok(None);
        }
        let mut whole = None;
        match self.records.record()? {
            Record::Message { header, data } => {
                let Some(topic) = self.topics.get(&header.channel_id) else { return Ok(None) };
                if self.sequence.replace(header.sequence) != Some(header.sequence) {
                    whole = Some(std::mem::take(&mut self.messages)).filter(|messages| !messages.is_empty());
                }
                if !UNREAD.contains(topic) {
                    self.messages.insert(topic, data.into_owned());
                }
            }
            Record::Channel(channel) => self.learn_topic(channel.id, &channel.topic),
            Record::Metadata(metadata) if metadata.name == OUTCOME_METADATA => {
                self.outcome = Some(metadata.metadata);
            }
            _ => {}
        }
        Ok(whole)
    }

    /// The ending; valid after the last cycle.
    pub fn ending(&self) -> Ending {
        match (&self.damage, &self.outcome) {
            (Some(reason), _) => Ending::CutShort { reason: reason.clone() },
            (None, Some(outcome)) => Ending::Outcome(outcome.clone()),
            (None, None) => Ending::CutShort { reason: "it ends without an outcome".to_owned() },
        }
    }
}

/// A whole recording in memory: for a short one.
#[derive(Debug)]
pub struct Recording {
    /// The task of the run.
    pub header: RunHeader,
    /// Text of the robot file.
    pub robot_text: String,
    /// The robot, with its servos as mounted.
    pub robot: Robot,
    /// Complete cycles; their numbers rise.
    pub samples: Vec<Sample>,
    /// The ending.
    pub ending: Ending,
}

impl Recording {
    /// Reads the recording at `path`, up to its last complete chunk if it was cut short.
    ///
    /// # Errors
    /// If there is no such file, or it is not a recording.
    pub fn read(path: &Path) -> Result<Recording, ReadError> {
        let (run, cycles) = open(path)?;
        Recording::of(run, cycles)
    }

    /// Like [`Recording::read`], from the `bytes` of a file called `file`.
    ///
    /// # Errors
    /// If they are not a recording.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Recording, ReadError> {
        let (run, cycles) = read(bytes, file)?;
        Recording::of(run, cycles)
    }

    fn of<R: Read>(run: RecordedRun, mut cycles: Cycles<R>) -> Result<Recording, ReadError> {
        let mut samples = Vec::new();
        while let Some(sample) = cycles.next(&run.robot)? {
            samples.push(sample);
        }
        let RecordedRun { header, robot_text, robot } = run;
        Ok(Recording { header, robot_text, robot, samples, ending: cycles.ending() })
    }
}
