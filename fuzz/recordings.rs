//! Damaged recordings, made from good ones, for the fuzz target and for a test.

use std::borrow::Cow;
use std::io::{self, Cursor, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};

use hippocamp::bus::{Buses, SimPorts};
use hippocamp::config;
use hippocamp::html::Page;
use hippocamp::ik::Method;
use hippocamp::kinds;
use hippocamp::motion::Order;
use hippocamp::observe::Observer;
use hippocamp::plan::RunPlan;
use hippocamp::recording::{Ending, ReadError, Recorder, RunHeader, read};
use hippocamp::replay::{Judge, Replay, ReplayError};
use hippocamp::run::Cycle;
use hippocamp::simulation;
use hw_sim::FaultScript;
use mcap::records::{Record, op};

/// A sink whose content can be read.
#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("no thread panics while it holds the lock").extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A recording of the first `cycles` of a run of the robot in `file`, as the program writes it.
pub fn good(file: &Path, cycles: u32) -> Vec<u8> {
    let robot = config::load(file).expect("a shipped robot").robot;
    let motion = kinds::of(&robot).expect("a robot that can do what its file says").plan_to_rest(&robot);
    let plan = RunPlan { motion, method: Method::CcdThenFinish, move_for_s: 1.0, driver: None };
    let memory = Memory::default();
    let text = std::fs::read_to_string(file).expect("it was read before");
    let header = RunHeader::new(&robot, &plan, "robot.toml", 0);
    let recorder = Recorder::start(&robot, header, text, "memory".to_owned(), memory.clone(), true);
    let mut recorder = recorder.expect("a thread");
    let world = simulation::world(&robot, 1, &FaultScript::default()).expect("a world");
    let buses = Buses::new(&robot, SimPorts::on_virtual_clock(world));
    let mut cycle = Cycle::new(&robot, plan.motion, plan.method, plan.move_for_s, buses);
    for _ in 0..cycles {
        cycle.step(Order::Go);
        recorder.observe(&cycle.record());
    }
    let outcome = [("outcome", "completed".to_owned()), ("cycles", cycles.to_string())];
    let written = recorder.finish(outcome.into_iter().map(|(key, value)| (key.to_owned(), value)).collect());
    assert_eq!(written.error, None);
    memory.0.lock().expect("no thread panics while it holds the lock").clone()
}

/// The recording of these `bytes` with chunks that are not packed, and without sums, so that what is changed in it is
/// read.
pub fn unpacked(bytes: &[u8]) -> Vec<u8> {
    changed(bytes, |_, text| text)
}

/// The same with what `change` makes of every attachment and message, given its name or topic and its text.
pub fn changed(bytes: &[u8], mut change: impl FnMut(&str, String) -> String) -> Vec<u8> {
    let mut change = |name: &str, data: &[u8]| {
        let text = String::from_utf8(data.to_vec()).expect("all of it is text");
        Cow::Owned(change(name, text).into_bytes())
    };
    let options = mcap::WriteOptions::new().compression(None).calculate_chunk_crcs(false);
    let options = options.calculate_attachment_crcs(false).chunk_size(Some(50_000)).disable_seeking(true);
    let mut written = options.create(Cursor::new(Vec::new())).expect("memory takes it");
    let mut last = Vec::new();
    for record in mcap::read::LinearReader::new(bytes).expect("a good recording") {
        match record.expect("a good recording") {
            Record::Attachment { header, data, .. } => {
                let mcap::records::AttachmentHeader { log_time, create_time, name, media_type } = header;
                let data = change(&name, &data);
                let attachment = mcap::Attachment { log_time, create_time, name, media_type, data };
                written.attach(&attachment).expect("memory takes it");
            }
            Record::Metadata(metadata) => last.push(metadata),
            _ => {}
        }
    }
    for message in mcap::MessageStream::new(bytes).expect("a good recording") {
        let message = message.expect("a good recording");
        let data = change(&message.channel.topic, &message.data);
        written.write(&mcap::Message { data, ..message }).expect("memory takes it");
    }
    for metadata in last {
        written.write_metadata(&metadata).expect("memory takes it");
    }
    written.finish().expect("memory takes it");
    written.into_inner().into_inner()
}

/// A length in a file: of what, where it begins, and how many bytes it has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Length {
    pub of: &'static str,
    pub at: usize,
    pub bytes: usize,
}

/// Every length in the good recording `bytes`, those inside chunks that are not packed too.
pub fn lengths(bytes: &[u8]) -> Vec<Length> {
    let mut found = Vec::new();
    records_in(bytes, mcap::MAGIC.len(), bytes.len() - mcap::MAGIC.len(), false, &mut found);
    found
}

fn records_in(bytes: &[u8], from: usize, to: usize, is_in_chunk: bool, found: &mut Vec<Length>) {
    let mut at = from;
    while at < to {
        let opcode = bytes[at];
        let of = match (is_in_chunk, opcode) {
            (false, op::ATTACHMENT) => "attachment",
            (false, op::CHUNK) => "chunk",
            (false, op::METADATA) => "metadata",
            (false, op::MESSAGE_INDEX) => "message index",
            (false, op::DATA_END) => "end of the data",
            (false, _) => "other record",
            (true, op::SCHEMA) => "schema in a chunk",
            (true, op::CHANNEL) => "channel in a chunk",
            (true, _) => "message in a chunk",
        };
        found.push(Length { of, at: at + 1, bytes: 8 });
        let body = at + 9;
        let mut walk = Walk { bytes, at: body, found: &mut *found };
        match (is_in_chunk, opcode) {
            (false, op::ATTACHMENT) => {
                walk.at += 16;
                walk.text("name of an attachment");
                walk.text("kind of an attachment");
                walk.length("bytes of an attachment", 8);
            }
            (false, op::CHUNK) => {
                walk.at += 16;
                walk.length("unpacked bytes of a chunk", 8);
                walk.at += 4;
                walk.text("packing of a chunk");
                let packed = walk.length("packed bytes of a chunk", 8);
                let is_packed = bytes[walk.at..].starts_with(&[0x04, 0x22, 0x4D, 0x18]);
                let from = walk.at;
                if !is_packed {
                    records_in(bytes, from, from + packed, true, found);
                }
            }
            (false, op::METADATA) => {
                walk.text("name of metadata");
                walk.table("table of metadata");
            }
            (true, op::CHANNEL) => {
                walk.at += 4;
                walk.text("topic of a channel");
                walk.text("encoding of a channel");
                walk.length("table of a channel", 4);
            }
            _ => {}
        }
        at = body + number(bytes, at + 1, 8);
    }
}

/// Goes through a record.
struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    found: &'a mut Vec<Length>,
}

impl Walk<'_> {
    fn length(&mut self, of: &'static str, bytes: usize) -> usize {
        self.found.push(Length { of, at: self.at, bytes });
        self.at += bytes;
        number(self.bytes, self.at - bytes, bytes)
    }

    fn text(&mut self, of: &'static str) {
        self.at += self.length(of, 4);
    }

    fn table(&mut self, of: &'static str) {
        let end = self.length(of, 4);
        let end = self.at + end;
        while self.at < end {
            self.text("entry of a table");
        }
    }
}

fn number(bytes: &[u8], at: usize, count: usize) -> usize {
    bytes[at..at + count].iter().rev().fold(0, |number, byte| number << 8 | usize::from(*byte))
}

/// Writes `value` in the place of a length.
pub fn set(bytes: &mut [u8], length: Length, value: u64) {
    let little = value.to_le_bytes();
    for (place, byte) in little.iter().take(length.bytes).enumerate() {
        if let Some(there) = bytes.get_mut(length.at + place) {
            *there = *byte;
        }
    }
}

/// Lengths that are worth a try, beside those a little off.
pub const LONG: [u64; 10] =
    [0, 1 << 20, 1 << 25, 1 << 30, (1 << 31) - 1, 1 << 32, 1 << 62, 1 << 63, u64::MAX - 8, u64::MAX];

/// The characters of JSON messages.
const JSON: &[u8] = b"0123456789-.eE,:[]{}\" tfn";

/// The good recording `good` after the edits of `script`, each a few bytes of it: a length set, bytes written over, cut
/// out or doubled.
pub fn edited(good: &[u8], lengths: &[Length], mut script: &[u8]) -> Vec<u8> {
    let mut bytes = good.to_vec();
    let mut next = |count: usize| -> Option<usize> {
        let (taken, rest) = script.split_at_checked(count)?;
        script = rest;
        Some(number(taken, 0, count))
    };
    while let (Some(kind), Some(place), Some(value)) = (next(1), next(3), next(2)) {
        if bytes.is_empty() {
            break;
        }
        let at = place % bytes.len();
        let end = (at + value).min(bytes.len());
        match kind % 8 {
            0 | 1 => {
                let length = lengths[place % lengths.len()];
                set(&mut bytes, length, LONG[value % LONG.len()]);
            }
            2 => {
                let length = lengths[place % lengths.len()];
                if length.at + length.bytes <= bytes.len() {
                    let before = u64::try_from(number(&bytes, length.at, length.bytes)).unwrap_or(0);
                    let off = u64::try_from(value % 64).unwrap_or(0).wrapping_sub(32);
                    set(&mut bytes, length, before.wrapping_add(off));
                }
            }
            3 | 4 => bytes[at] = value.to_le_bytes()[0],
            5 => bytes[at] = JSON[value % JSON.len()],
            6 => drop(bytes.drain(at..end)),
            _ => {
                let twice = bytes[at..end].to_vec();
                bytes.splice(at..at, twice);
            }
        }
    }
    bytes
}

/// The result of a look at a file.
#[derive(Debug)]
pub enum Found {
    NoRecording(ReadError),
    NotToBeRun(ReplayError),
    /// The verdict, the end of the recording, and the length of the page in bytes.
    Judged(Box<Replay>, Ending, usize),
}

/// Does to `bytes` what 'replay --html' does.
pub fn look(bytes: &[u8]) -> Found {
    let (run, mut cycles) = match read(bytes, "edited.mcap") {
        Ok(opened) => opened,
        Err(error) => return Found::NoRecording(error),
    };
    let mut judge = match Judge::new(&run.robot, &run.header) {
        Ok(judge) => judge,
        Err(error) => return Found::NotToBeRun(error),
    };
    let mut page = Page::new(&run.robot);
    loop {
        match cycles.next(&run.robot) {
            Ok(Some(sample)) => {
                judge.look(&sample);
                page.look(&sample);
            }
            Ok(None) => break,
            Err(error) => return Found::NoRecording(error),
        }
    }
    let ending = cycles.ending();
    let page = page.end(&run.header, &ending).len();
    Found::Judged(Box::new(judge.end(&ending)), ending, page)
}
