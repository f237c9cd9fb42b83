//! Recordings from other programs, or damaged ones: `replay` ends with a message and in little memory, whatever
//! they contain.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[allow(unreachable_pub, dead_code, reason = "the fuzz target uses it too")]
#[path = "../fuzz/recordings.rs"]
mod recordings;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::ops::Range;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use hippocamp::recording::{CHUNK_MAX, Ending, RECORD_MAX};
use mcap::records::{MessageHeader, op};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use recordings::{Found, LONG, Length, changed, edited, good, lengths, look, set, unpacked};
use rustix::process::{Resource, Rlimit, setrlimit};

/// Memory that this process, and a replay that it starts, may take at most, KiB: more than any recording needs.
const ROOM_KIB: u64 = 300 << 10;

/// A figure's recording of a few cycles, not packed.
fn figure() -> &'static [u8] {
    static GOOD: OnceLock<Vec<u8>> = OnceLock::new();
    GOOD.get_or_init(|| {
        // An allocation of a claimed length ends the test here.
        let bytes = Some(ROOM_KIB << 10);
        setrlimit(Resource::Data, Rlimit { current: bytes, maximum: bytes }).unwrap();
        unpacked(&good(Path::new("config/figure.toml"), 4))
    })
}

/// Exit code of `hippocamp replay` of a file with these bytes in `kib` KiB of memory, and all that was said.
fn replayed(name: &str, bytes: &[u8], kib: u64) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), bytes).unwrap();
    replayed_file(folder.path(), name, kib)
}

fn replayed_file(folder: &Path, name: &str, kib: u64) -> (Option<i32>, String) {
    let mut shell = Command::new("sh");
    shell.args(["-c", "ulimit -v $0 && exec \"$@\"", &kib.to_string(), env!("CARGO_BIN_EXE_hippocamp")]);
    let done = shell.args(["replay", name]).current_dir(folder).output().unwrap();
    let said = [done.stdout, done.stderr].concat();
    (done.status.code(), String::from_utf8(said).unwrap())
}

#[test]
fn the_recording_that_the_others_derive_from_is_good() {
    assert!(matches!(look(figure()), Found::Judged(replay, Ending::Outcome(_), _) if replay.agrees()));
}

#[test]
fn no_length_in_a_file_is_trusted() {
    let lengths = lengths(figure());
    let mut of: Vec<&str> = lengths.iter().map(|length| length.of).collect();
    of.sort_unstable();
    of.dedup();
    assert!(of.len() >= 20, "{of:?}");
    for of in of {
        let all: Vec<Length> = lengths.iter().filter(|length| length.of == of).copied().collect();
        // The first, and one with good cycles before it.
        for length in [all[0], all[all.len() - 1]] {
            for value in LONG {
                let mut bytes = figure().to_vec();
                set(&mut bytes, length, value);
                let is_long = bytes != figure() && value > 1 << 33 && length.bytes == 8;
                match look(&bytes) {
                    Found::NoRecording(error) => {
                        assert!(error.to_string().starts_with("edited.mcap: "), "{error}")
                    }
                    Found::NotToBeRun(error) => panic!("{length:?} = {value}: {error}"),
                    // Nothing behind the outcome is read.
                    Found::Judged(_, Ending::Outcome(_), _)
                        if of == "end of the data" || of == "other record" => {}
                    Found::Judged(_, ending, _) => {
                        let is_cut = matches!(ending, Ending::CutShort { .. });
                        assert!(is_cut || !is_long, "{length:?} = {value}: {ending:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn thousands_of_damaged_recordings_do_no_harm() {
    let lengths = lengths(figure());
    let packed = good(Path::new("config/figure.toml"), 4);
    let packed_lengths = recordings::lengths(&packed);
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut counts = [0; 4];
    for round in 0..2000 {
        let mut script = vec![0; if round % 2 == 0 { 6 } else { 30 }];
        random.fill_bytes(&mut script);
        let bytes = match round % 8 {
            0 => edited(&packed, &packed_lengths, &script),
            _ => edited(figure(), &lengths, &script),
        };
        let place = match look(&bytes) {
            Found::NoRecording(_) => 0,
            Found::NotToBeRun(_) => 1,
            Found::Judged(_, Ending::CutShort { .. }, _) => 2,
            Found::Judged(..) => 3,
        };
        counts[place] += 1;
    }
    let [not_read, _, cut_short, whole] = counts;
    assert!(not_read > 100 && cut_short > 100 && whole > 100, "{counts:?}");
}

/// A text or a record's body behind its length.
fn counted(length: u64, bytes: usize, body: &[u8]) -> Vec<u8> {
    [&length.to_le_bytes()[..bytes], body].concat()
}

fn record(opcode: u8, length: u64, body: &[u8]) -> Vec<u8> {
    [vec![opcode], counted(length, 8, body)].concat()
}

fn count(bytes: &[u8]) -> u64 {
    u64::try_from(bytes.len()).unwrap()
}

fn channel(id: u16, topic: &str) -> Vec<u8> {
    let topic = counted(count(topic.as_bytes()), 4, topic.as_bytes());
    let body = [&id.to_le_bytes()[..], &[0; 2], &topic, &counted(4, 4, b"json"), &[0; 4]].concat();
    record(op::CHANNEL, count(&body), &body)
}

/// The record of a chunk of `records`, packed or not, that claims these lengths and this checksum.
fn chunk(records: &[u8], is_packed: bool, unpacked: Option<u64>, packed: Option<u64>) -> Vec<u8> {
    let inside = if is_packed {
        // A frame of lz4: blocks that are not packed, and its end.
        let blocks = records.chunks(1 << 16).flat_map(|block| {
            let length = u32::try_from(block.len()).unwrap() | 1 << 31;
            [&length.to_le_bytes()[..], block].concat()
        });
        [0x04, 0x22, 0x4D, 0x18, 0x60, 0x40, 0x82].into_iter().chain(blocks).chain([0; 4]).collect()
    } else {
        records.to_vec()
    };
    let packing: &[u8] = if is_packed { b"lz4" } else { b"" };
    let body = [
        &[0; 16][..],
        &unpacked.unwrap_or(count(records)).to_le_bytes(),
        // No sum.
        &[0; 4],
        &counted(count(packing), 4, packing),
        &packed.unwrap_or(count(&inside)).to_le_bytes(),
        &inside,
    ];
    let body = body.concat();
    record(op::CHUNK, count(&body), &body)
}

/// A good recording up to its outcome, which is left out.
fn beginning() -> &'static [u8] {
    let outcome = lengths(figure()).into_iter().find(|length| length.of == "metadata").unwrap();
    &figure()[..outcome.at - 1]
}

#[test]
fn an_impossible_length_is_reported_with_file_and_place_and_the_cycles_before_it_are_judged() {
    let channel_of = |topic: u64, table: u64| {
        let body =
            [vec![0; 4], counted(topic, 4, b"/a"), counted(4, 4, b"json"), counted(table, 4, b"")].concat();
        record(op::CHANNEL, u64::try_from(body.len()).unwrap(), &body)
    };
    for long in [1 << 62, u64::MAX] {
        let mut damaged = vec![
            ("chunk", record(op::CHUNK, long, b"")),
            ("message", record(op::MESSAGE, long, &[0; 22])),
            ("channel", record(op::CHANNEL, long, &[0; 22])),
            ("attachment", record(op::ATTACHMENT, long, &[0; 40])),
            ("metadata", record(op::METADATA, long, &[0; 40])),
            ("schema", record(op::SCHEMA, long, &[0; 40])),
            ("some other record", record(0x80, long, &[0; 40])),
            ("topic", channel_of(u64::from(u32::MAX), 0)),
            ("table", channel_of(2, u64::from(u32::MAX))),
        ];
        for is_packed in [false, true] {
            damaged.extend([
                ("message in a chunk", chunk(&record(op::MESSAGE, long, &[0; 22]), is_packed, None, None)),
                (
                    "long message in a chunk",
                    chunk(&record(op::MESSAGE, 30 << 20, &[0; 22]), is_packed, None, None),
                ),
                ("record in a chunk", chunk(&record(0x80, long, &[0; 22]), is_packed, None, None)),
                ("topic in a chunk", chunk(&channel_of(u64::from(u32::MAX), 0), is_packed, None, None)),
                ("unpacked bytes", chunk(&channel_of(2, 0), is_packed, Some(long), None)),
                ("packed bytes", chunk(&channel_of(2, 0), is_packed, None, Some(long))),
            ]);
        }
        for (of, bytes) in damaged {
            let at = beginning().len();
            let (code, said) = replayed("damaged.mcap", &[beginning(), &bytes].concat(), ROOM_KIB);
            assert_eq!(code, Some(4), "{of} of {long}: {said}");
            for words in ["CUT SHORT: damaged.mcap", "4 cycles recorded", "4 cycles run again", "byte"] {
                assert!(said.contains(words), "{of} of {long}: no '{words}' in {said}");
            }
            let places = [at, at + bytes.len()].map(|place| format!("byte {place}: "));
            assert!(places.iter().any(|place| said.contains(place)), "{of}: not {places:?} in {said}");
        }
    }
}

#[test]
fn a_file_with_an_impossible_length_before_the_first_cycle_is_no_recording() {
    let magic = &figure()[..mcap::MAGIC.len()];
    let text = |length: u64| counted(length, 4, b"robot.toml");
    let attachment = |length: u64, name: u64, data: u64| {
        let body =
            [&[0; 16][..], &text(name), &counted(0, 4, b""), &counted(data, 8, &[7; 20]), &[0; 4]].concat();
        record(op::ATTACHMENT, if length == 0 { u64::try_from(body.len()).unwrap() } else { length }, &body)
    };
    let most = u64::from(u32::MAX);
    for (of, bytes) in [
        ("attachment", attachment(1 << 62, 10, 20)),
        ("name", attachment(0, most, 20)),
        ("data", attachment(0, 10, 1 << 62)),
        ("all data", attachment(0, 10, u64::MAX)),
        ("a byte too much", attachment(0, 10, 21)),
        // Too short for what is behind its data: mcap's own reader panics here.
        ("no room for the sum", record(op::ATTACHMENT, 40, &attachment(0, 10, 20)[9..49])),
        ("chunk", record(op::CHUNK, u64::MAX, b"")),
    ] {
        let (code, said) = replayed("damaged.mcap", &[magic, &bytes].concat(), ROOM_KIB);
        assert_eq!(code, Some(2), "{of}: {said}");
        assert!(
            said.contains("damaged.mcap: expected a recording of 'hippocamp run --record'"),
            "{of}: {said}"
        );
    }
}

/// A file of `cycles` cycles of arms, packed; their numbers begin with 1, so that no controller is run on them.
fn long_recording(cycles: u32) -> Vec<u8> {
    let one = good(Path::new("config/tentacle.toml"), 1);
    let mut written = mcap::Writer::with_options(
        mcap::write::NoSeek::new(Vec::new()),
        mcap::WriteOptions::new().compression(Some(mcap::Compression::Lz4)).disable_seeking(true),
    )
    .unwrap();
    let summary = mcap::Summary::read(&one).unwrap().unwrap();
    for index in &summary.attachment_indexes {
        written.attach(&mcap::read::attachment(&one, index).unwrap()).unwrap();
    }
    let messages: Vec<_> = mcap::MessageStream::new(&one).unwrap().map(Result::unwrap).collect();
    for cycle in 1..=cycles {
        for message in &messages {
            let text = String::from_utf8(message.data.to_vec()).unwrap();
            let text = text.replace("\"cycle\":0", &format!("\"cycle\":{cycle}"));
            let channel =
                written.add_channel(0, &message.channel.topic, "json", &Default::default()).unwrap();
            let header = MessageHeader { channel_id: channel, sequence: cycle, log_time: 0, publish_time: 0 };
            written.write_to_known_channel(&header, text.as_bytes()).unwrap();
        }
    }
    written.finish().unwrap();
    written.into_inner().into_inner()
}

#[test]
fn a_long_recording_takes_no_more_memory_than_a_short_one() {
    /// In memory these cycles take more than this.
    const KIB: u64 = 50 << 10;
    let bytes = long_recording(5000);
    assert!(bytes.len() < 10 << 20, "{} bytes", bytes.len());
    let (code, said) = replayed("long.mcap", &bytes, KIB);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("5000 cycles recorded") && said.contains("1 cycles that were dropped"), "{said}");
}

#[test]
fn the_largest_records_that_are_read_take_little_memory_however_they_are_filled() {
    let stamp = r#""sec":0,"nsec":0"#;
    let states = format!(
        r#"{{"header":{{"stamp":{{{stamp}}},"frame_id":""}},"position":[],"velocity":[],"effort":[],"name":["#
    );
    let feet = format!(r#"{{"timestamp":{{{stamp}}},"feet":["#);
    let servos = format!(r#"{{"timestamp":{{{stamp}}},"servos":["#);
    // Many short things grow most when they are decoded.
    let mut motion = String::new();
    changed(&good(Path::new("config/figure.toml"), 1), |of, text| {
        if of == "/motion" {
            motion.clone_from(&text);
        }
        text
    });
    let motion = format!("{},\"a\":[", motion.trim_end_matches('}'));
    let topics = [
        ("/joint_states", states.as_str(), r#""a""#),
        ("/joint_goals", &states, r#""a""#),
        ("/feet", &feet, r#"{"chain":""}"#),
        ("/servos", &servos, r#"{"joint":"","result":"missing"}"#),
        ("/motion", &motion, "0"),
    ];
    let mut records = Vec::new();
    for (id, (topic, before, each)) in (1_u16..).zip(topics) {
        records.extend(channel(id, topic));
        let room = usize::try_from(RECORD_MAX).unwrap() - 22 - before.len() - each.len() - 2;
        let text = [before, &format!("{each},").repeat(room / (each.len() + 1)), each, "]}"].concat();
        let body = [&id.to_le_bytes()[..], &[0; 20], text.as_bytes()].concat();
        records.extend(record(op::MESSAGE, count(&body), &body));
    }
    // And the chunk as large as it may be.
    let rest = usize::try_from(CHUNK_MAX).unwrap() - records.len() - (4 << 10);
    records.extend(record(0x80, u64::try_from(rest).unwrap(), &vec![0; rest]));
    let first = lengths(figure()).into_iter().find(|length| length.of == "chunk").unwrap();
    let attachments = &figure()[..first.at - 1];
    let (code, said) =
        replayed("full.mcap", &[attachments, &chunk(&records, true, None, None)].concat(), ROOM_KIB);
    // All of that is decoded, and is no whole cycle.
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("0 cycles recorded") && said.contains("ends without an outcome"), "{said}");
    // More in any of them is not read.
    let body = vec![0; usize::try_from(RECORD_MAX).unwrap() + 1];
    let record = record(op::MESSAGE, count(&body), &body);
    let chunk = chunk(&[&records[..], &[0; 4 << 10]].concat(), false, None, None);
    for (bytes, most) in [(record, RECORD_MAX), (chunk, CHUNK_MAX)] {
        let (code, said) = replayed("more.mcap", &[beginning(), &bytes].concat(), ROOM_KIB);
        assert_eq!(code, Some(4), "{said}");
        assert!(said.contains(&format!("at most {most} are read")), "{said}");
    }
}

#[test]
fn a_file_of_six_gib_is_read_up_to_the_end_of_its_data() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.mcap");
    let grown_to = |bytes: &[u8], gib: u64| {
        fs::write(&path, bytes).unwrap();
        File::options().write(true).open(&path).unwrap().set_len(gib << 30).unwrap();
        replayed_file(folder.path(), "large.mcap", ROOM_KIB)
    };
    let (code, said) = grown_to(figure(), 6);
    assert_eq!(code, Some(0), "{said}");
    let (code, said) = grown_to(beginning(), 6);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("zeros, where a record should begin"), "{said}");
    // Somebody's large attachment.
    let mut foreign = [beginning(), &record(op::ATTACHMENT, (1 << 30) - 9, b"")].concat();
    foreign[beginning().len() + 1..][..8].copy_from_slice(&(1_u64 << 30).to_le_bytes());
    let (code, said) = grown_to(&foreign, 1);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("the file ends in the middle of a record"), "{said}");
}

/// The refusal of a robot's recording in which every `from` in `name` is replaced by `to`; `None` if the recording
/// is judged.
fn after_change(file: &str, name: &str, from: &str, to: &str) -> Option<String> {
    let mut is_found = false;
    let bytes = changed(&good(Path::new(file), 2), |of, text| {
        is_found |= of == name && text.contains(from);
        if of == name { text.replace(from, to) } else { text }
    });
    assert!(is_found, "{name} of {file} has no {from}");
    match look(&bytes) {
        Found::NoRecording(error) => Some(error.to_string()),
        Found::NotToBeRun(error) => Some(error.to_string()),
        Found::Judged(..) => None,
    }
}

#[test]
fn contents_that_no_run_has_are_refused() {
    let (figure, horse) = ("config/figure.toml", "config/horse.toml");
    let drive = r#""order":"drive","command":{"choice":"gait","gait":99,"speed_m_s":0,"yaw_rate_rad_s":0,"rise_m":0,
                "pitch_rad":0,"roll_rad":0,"sway_m":0}"#;
    for (file, name, from, to, says) in [
        // It would run for hours.
        (figure, "run.json", r#""ccd-then-finish""#, r#"{"ccd":{"sweeps":4000000000}}"#, "4000000000 sweeps"),
        (figure, "run.json", r#""pose": "stand""#, r#""pose": "fly""#, "a pose of an unknown name, fly"),
        (figure, "/motion", r#""order":"go""#, r#""order":"take","pose":99"#, "the robot file does not have"),
        (horse, "/motion", r#""order":"go""#, drive, "the robot file does not have"),
        (
            horse,
            "run.json",
            "{\n    \"gait\": \"stand\"",
            "{\"gait\": {\"gait\":99}",
            "its robot.toml does not have",
        ),
        (
            figure,
            "robot.toml",
            "loop_rate_hz",
            "loop_rate_hx",
            "edited.mcap: the robot file inside the recording",
        ),
    ] {
        let said = after_change(file, name, from, to);
        assert!(said.as_ref().is_some_and(|said| said.contains(says)), "{name} with {to}: {said:?}");
    }
}

/// The first number behind each key of a JSON text, by key: where it is.
fn numbers(text: &str) -> BTreeMap<&str, Range<usize>> {
    let mut found = BTreeMap::new();
    for (colon, _) in text.match_indices("\":") {
        let key = text[..colon].rsplit('"').next().unwrap();
        let from = colon + 2 + text[colon + 2..].chars().take_while(|letter| *letter == '[').count();
        let length = text[from..].chars().take_while(|letter| "-+.eE0123456789".contains(*letter)).count();
        if length > 0 {
            found.entry(key).or_insert(from..from + length);
        }
    }
    found
}

#[test]
fn numbers_that_no_run_has_do_no_harm() {
    const EXTREMES: [&str; 7] =
        ["-1", "255", "2147483647", "-2147483648", "18446744073709551615", "1e308", "-1e-308"];
    let bytes = good(Path::new("config/figure.toml"), 3);
    let mut texts = BTreeMap::new();
    changed(&bytes, |of, text| {
        if !["/tf", "/scene", "robot.toml"].contains(&of) {
            texts.insert(of.to_owned(), text.clone());
        }
        text
    });
    let mut count = 0;
    for (topic, text) in &texts {
        for key in numbers(text).keys() {
            for extreme in EXTREMES {
                // In the second of three cycles.
                let mut cycle = 0;
                let edited = changed(&bytes, |of, text| {
                    cycle += u32::from(of == topic);
                    match numbers(&text).get(key) {
                        Some(place) if of == topic && (cycle == 2 || !of.starts_with('/')) => {
                            format!("{}{extreme}{}", &text[..place.start], &text[place.end..])
                        }
                        _ => text,
                    }
                });
                look(&edited);
                count += 1;
            }
        }
    }
    assert!(count > 200, "{count}");
}
