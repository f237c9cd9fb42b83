//! Slow, full and failing disks: cycles are lost from the recording, and the loop never waits.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};

use crossbeam_channel::{Receiver, bounded};
use hippocamp::bus::{Buses, SimPorts};
use hippocamp::motion::Order;
use hippocamp::observe::{CycleRecord, CycleTimes, Facts, Observer};
use hippocamp::recording::{CHUNK_MAX, Ending, ReadError, Recorder, Recording};
use hippocamp::run::{Cycle, Operator, run_observed};
use hippocamp::signals::Status;
use hippocamp::simulation;
use hippocamp::telemetry::Outcome;
use hippocamp::telemetry::RecordingReport;

use crate::common::{Memory, horse, plan, record, recorder, run};

/// Steps a limp horse `cycles` times and records each cycle.
fn step(recorder: &mut Recorder, cycles: u32) {
    let robot = horse();
    let world = simulation::world(&robot, 1, &hw_sim::FaultScript::default()).unwrap();
    let buses = Buses::new(&robot, SimPorts::on_virtual_clock(world));
    let plan = plan(&robot);
    let mut cycle = Cycle::new(&robot, plan.motion, plan.method, plan.move_for_s, buses);
    for _ in 0..cycles {
        cycle.step(Order::Go);
        recorder.observe(&cycle.record());
    }
}

#[test]
fn a_large_chunk_ends_whatever_time_it_spans() {
    let robot = horse();
    let world = simulation::world(&robot, 1, &hw_sim::FaultScript::default()).unwrap();
    let plan = plan(&robot);
    let buses = Buses::new(&robot, SimPorts::on_virtual_clock(world));
    let mut cycle = Cycle::new(&robot, plan.motion, plan.method, plan.move_for_s, buses);
    // Joints are known from the second reply on.
    (0..3).for_each(|_| cycle.step(Order::Go));
    let memory = Memory::default();
    let mut recorder = recorder(&robot, memory.clone(), true);
    for number in 0..2500 {
        // All of them at once.
        let times = CycleTimes { number, ..CycleTimes::default() };
        let record = cycle.record();
        recorder.observe(&CycleRecord { facts: Facts { times, ..record.facts }, ..record });
    }
    assert_eq!(recorder.finish(BTreeMap::new()).error, None);
    let summary = mcap::Summary::read(&memory.0.lock().unwrap()).unwrap().unwrap();
    let sizes: Vec<u64> = summary.chunk_indexes.iter().map(|chunk| chunk.uncompressed_size).collect();
    assert!(sizes.iter().sum::<u64>() > CHUNK_MAX / 2, "{sizes:?}");
    assert!(sizes.iter().all(|size| *size < CHUNK_MAX / 3), "{sizes:?}");
}

/// A disk that accepts nothing until it is released.
struct Stuck {
    release: Receiver<()>,
    memory: Memory,
}

impl Write for Stuck {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // A closed channel releases it permanently.
        let _ = self.release.recv();
        self.memory.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Five hundred cycles, recorded on a disk that takes nothing before the last: the report and the file.
pub(crate) fn recorded_on_a_stuck_disk() -> (RecordingReport, Vec<u8>) {
    let (release, released) = bounded(0);
    let memory = Memory::default();
    let mut recorder = recorder(&horse(), Stuck { release: released, memory: memory.clone() }, false);
    // This would hang if the loop waited for the disk.
    step(&mut recorder, 500);
    drop(release);
    let report = recorder.finish(BTreeMap::from([("cycles".to_owned(), "500".to_owned())]));
    let bytes = memory.0.lock().unwrap().clone();
    (report, bytes)
}

#[test]
fn a_stuck_disk_drops_and_counts_cycles_and_the_loop_continues() {
    let (report, bytes) = recorded_on_a_stuck_disk();
    // Two seconds are kept, at 100 cycles a second.
    assert_eq!((report.records, report.dropped, report.error), (200, 300, None));
    let recording = Recording::parse(&bytes, "test").unwrap();
    assert_eq!(recording.samples.len(), 200);
    let Ending::Outcome(outcome) = recording.ending else { panic!("{:?}", recording.ending) };
    assert_eq!(outcome["dropped"], "300");
}

#[test]
fn a_disk_that_is_full_from_the_beginning_keeps_the_robot_down() {
    let report = run("", File::options().write(true).open("/dev/full").unwrap());
    assert_eq!(report.outcome, Outcome::Failed);
    assert!(report.reason.starts_with("stopped because the recording broke off: "), "{}", report.reason);
    assert!(report.reason.ends_with("(os error 28)"), "{}", report.reason);
    let recording = report.recording.unwrap();
    assert_eq!(recording.records + recording.dropped, report.cycles);
    let error = recording.error.unwrap();
    assert!(error.contains("No space left"), "{error}");
}

/// An operator that stops the run at once, for a reason that sounds like the recorder's.
struct StopsAtOnce;

impl Operator for StopsAtOnce {
    fn order(&mut self, _status: &Status) -> Order {
        Order::Stop
    }

    fn why_stopped(&self) -> (Outcome, &'static str) {
        (Outcome::Completed, "a person saw that the recording broke off")
    }
}

#[test]
fn the_error_of_a_recording_is_not_added_to_the_reason_of_an_operator() {
    let robot = horse();
    let world = simulation::world(&robot, 1, &hw_sim::FaultScript::default()).unwrap();
    let ports = SimPorts::on_virtual_clock(world);
    let mut recorder = recorder(&robot, File::options().write(true).open("/dev/full").unwrap(), true);
    let report = run_observed(&robot, &plan(&robot), ports, &mut [&mut recorder], StopsAtOnce).unwrap();
    assert_eq!(report.reason, "a person saw that the recording broke off");
    assert!(report.recording.unwrap().error.is_some());
}

/// A disk that is full after this many bytes.
struct Small {
    left: usize,
    memory: Memory,
}

impl Write for Small {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if bytes.len() > self.left {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.left -= bytes.len();
        self.memory.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_disk_that_fills_stops_the_robot_and_leaves_what_was_written_readable() {
    let memory = Memory::default();
    let whole = run("", Memory::default());
    let report = run("", Small { left: 1_000_000, memory: memory.clone() });
    assert_eq!((whole.outcome, report.outcome), (Outcome::Completed, Outcome::Failed));
    // It took its stop action: every servo has heard it.
    assert!(report.is_end_heard && report.cycles < whole.cycles, "{} cycles", report.cycles);
    let report = report.recording.unwrap();
    assert!(report.error.is_some() && report.dropped > 0);
    let recording = Recording::parse(&memory.0.lock().unwrap(), "test").unwrap();
    assert!(matches!(recording.ending, Ending::CutShort { .. }));
    // The reader finds the first of the cycles that the writer counted; the last chunk is lost.
    let found = u64::try_from(recording.samples.len()).unwrap();
    assert!(found > 0 && found <= report.records && report.records - found <= 101, "{found} of {report:?}");
}

#[test]
fn a_recording_cut_anywhere_is_readable_except_for_its_last_second() {
    let (report, bytes) = record();
    let whole = Recording::parse(bytes, "test").unwrap();
    assert_eq!(whole.samples.len() as u64, report.cycles);
    assert!(matches!(whole.ending, Ending::Outcome(_)));
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    for parts in 1..40 {
        let cut = bytes.len() * parts / 40;
        // Before the attachments are whole it is no recording yet.
        let Ok(recording) = Recording::parse(&bytes[..cut], "test") else {
            assert!(cut < 20_000, "cut at {cut}");
            continue;
        };
        let whole_until = summary
            .chunk_indexes
            .iter()
            // The first one holds schemas and no messages.
            .filter(|chunk| !chunk.message_index_offsets.is_empty())
            .filter(|chunk| chunk.chunk_start_offset + chunk.chunk_length <= cut as u64)
            .map(|chunk| chunk.message_end_time)
            .max();
        let read_until = recording.samples.last().map(|sample| sample.facts.times.began.0);
        assert_eq!(read_until, whole_until, "cut at {cut}");
        for (sample, original) in recording.samples.iter().zip(&whole.samples) {
            assert_eq!(
                (sample.facts.times, &sample.slots),
                (original.facts.times, &original.slots),
                "cut at {cut}"
            );
        }
    }
}

#[test]
fn any_file_that_is_no_recording_is_refused_with_a_message() {
    for bytes in [&b""[..], b"hello", &[0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'], &[0xFF; 4096]] {
        let error = Recording::parse(bytes, "some.mcap").unwrap_err();
        assert!(matches!(error, ReadError::NotARecording { .. }));
        assert!(error.to_string().starts_with("some.mcap: expected a recording"), "{error}");
    }
}
