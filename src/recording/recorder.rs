//! The loop's side of a recording, and the thread behind it.
//!
//! Samples circulate: the loop takes an empty one, fills it and hands it over; the thread writes it and hands
//! it back. If there is no empty one, the loop drops and counts the cycle, or waits if time is virtual.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, TryRecvError, bounded, tick};

use super::header::RunHeader;
use super::sample::Sample;
use super::writer::RecordingWriter;
use crate::model::Robot;
use crate::observe::{CycleRecord, End, Observer, RecordingReport};
use crate::stopwatch::Stage;

/// How long the loop can run while the disk does nothing, s.
const BUFFERED_S: f64 = 2.0;
/// Fewest samples in circulation.
const SAMPLES_MIN: usize = 16;
/// How often the thread looks for samples.
const LOOK: Duration = Duration::from_millis(20);
/// Why a run without its recording ends; the cause of the break is known once the recording is finished.
const LOST: &str = "the recording broke off";
/// How long the end of the run waits for the disk.
const FINISH_PATIENCE: Duration = Duration::from_secs(10);

/// Takes one record a cycle; never waits for a disk unless asked to. If the recording breaks off, it asks that the run
/// stops; if the disk is only slow, the recording misses cycles and the robot continues.
#[derive(Debug)]
pub struct Recorder {
    file: String,
    /// True if waiting costs the loop nothing.
    waits: bool,
    empty: Receiver<Box<Sample>>,
    filled: Sender<Handed>,
    finished: Receiver<Written>,
    dropped: u64,
    is_lost: Arc<AtomicBool>,
}

/// Sets its flag when dropped, whatever drops it: then nothing is written any more.
struct SetOnDrop(Arc<AtomicBool>);

impl Drop for SetOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[derive(Debug)]
enum Handed {
    Sample(Box<Sample>),
    End(BTreeMap<String, String>),
}

#[derive(Debug)]
struct Written {
    records: u64,
    lost: u64,
    error: Option<String>,
}

impl Recorder {
    /// Begins a recording of `robot`, whose file's text is `robot_text`, into `sink`, on a separate thread.
    /// The report calls it `file`. With `waits`, no cycle is ever dropped for a slow sink.
    ///
    /// Errors of the sink show in [`Recorder::is_lost`] at once; [`Recorder::finish`] reports them.
    ///
    /// # Errors
    /// If the system cannot start a thread.
    pub fn start(
        robot: &Robot,
        header: RunHeader,
        robot_text: String,
        file: String,
        sink: impl Write + Send + 'static,
        waits: bool,
    ) -> std::io::Result<Recorder> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 2000")]
        let count = ((robot.rate_hz * BUFFERED_S) as usize).max(SAMPLES_MIN);
        let (give_back, empty) = bounded(count);
        // Room for all samples and the end: handing over never blocks.
        let (filled, handed) = bounded(count + 1);
        let (tell, finished) = bounded(1);
        for _ in 0..count {
            let _ = give_back.send(Box::new(Sample::new(robot)));
        }
        let robot = robot.clone();
        let is_lost = Arc::new(AtomicBool::new(false));
        let loss = SetOnDrop(Arc::clone(&is_lost));
        std::thread::Builder::new().name("recording".to_owned()).spawn(move || {
            let written = if waits {
                write_all(&robot, &header, &robot_text, sink, loss, handed.iter(), &give_back)
            } else {
                let beat = tick(LOOK);
                let handed = std::iter::from_fn(|| next_by_looking(&handed, &beat));
                write_all(&robot, &header, &robot_text, sink, loss, handed, &give_back)
            };
            let _ = tell.send(written);
        })?;
        Ok(Recorder { file, waits, empty, filled, finished, dropped: 0, is_lost })
    }

    /// True once nothing more is written: the sink failed, or its thread is gone. A slow sink only
    /// drops cycles; it is not lost.
    pub fn is_lost(&self) -> bool {
        self.is_lost.load(Ordering::Relaxed)
    }

    /// Ends the recording with the outcome of the run. Call it after the robot has stopped, since it waits for the
    /// disk.
    pub fn finish(&mut self, mut outcome: BTreeMap<String, String>) -> RecordingReport {
        outcome.insert("dropped".to_owned(), self.dropped.to_string());
        let _ = self.filled.try_send(Handed::End(outcome));
        let written = self.finished.recv_timeout(FINISH_PATIENCE).unwrap_or_else(|error| Written {
            records: 0,
            lost: 0,
            error: Some(if error.is_timeout() {
                format!("the disk did not take the recording within {} s", FINISH_PATIENCE.as_secs())
            } else {
                "the recording thread panicked: this is a defect of the program, please report it".to_owned()
            }),
        });
        RecordingReport {
            file: self.file.clone(),
            records: written.records,
            dropped: self.dropped + written.lost,
            error: written.error,
        }
    }
}

impl Observer for Recorder {
    fn observe(&mut self, cycle: &CycleRecord<'_>) {
        let sample = if self.waits { self.empty.recv().ok() } else { self.empty.try_recv().ok() };
        let handed = sample.is_some_and(|mut sample| {
            sample.copy_from(cycle);
            self.filled.try_send(Handed::Sample(sample)).is_ok()
        });
        self.dropped += u64::from(!handed);
    }

    fn stage(&self) -> Stage {
        Stage::Recording
    }

    /// A run that was to be recorded has lost its purpose without its recording.
    fn objection(&self) -> Option<&'static str> {
        self.is_lost().then_some(LOST)
    }

    fn end(&mut self, end: &mut End, has_stopped_run: bool) {
        let entries = [
            ("outcome", end.outcome.name().to_owned()),
            ("reason", end.reason.clone()),
            ("duration_s", end.duration.as_secs_f64().to_string()),
            ("cycles", end.cycles.to_string()),
            ("late_cycles", end.late_cycles.to_string()),
        ];
        let report = self.finish(entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect());
        if has_stopped_run && let Some(error) = &report.error {
            end.reason = format!("{}: {error}", end.reason);
        }
        end.recording = Some(report);
    }
}

/// The next item handed over. It is polled at each `beat` instead of awaited: waking a waiting thread would
/// cost the loop more than the rest of a recording.
fn next_by_looking(handed: &Receiver<Handed>, beat: &Receiver<Instant>) -> Option<Handed> {
    loop {
        match handed.try_recv() {
            Ok(next) => return Some(next),
            Err(TryRecvError::Disconnected) => return None,
            Err(TryRecvError::Empty) => beat.recv().map(drop).ok()?,
        }
    }
}

/// Body of the thread: writes what it gets until the end. After an error, which drops its `loss`, it only returns
/// samples.
fn write_all(
    robot: &Robot,
    header: &RunHeader,
    robot_text: &str,
    sink: impl Write,
    loss: SetOnDrop,
    handed: impl Iterator<Item = Handed>,
    give_back: &Sender<Box<Sample>>,
) -> Written {
    let mut written = Written { records: 0, lost: 0, error: None };
    let mut writer = RecordingWriter::new(robot.clone(), header, robot_text, sink)
        // A writer that fails drops the loss with it.
        .map(|writer| (writer, loss))
        .map_err(|error| written.error = Some(describe(&error)))
        .ok();
    for handed in handed {
        match handed {
            Handed::Sample(sample) => {
                match writer.as_mut().map(|(writer, _)| writer.write(&sample)) {
                    Some(Ok(())) => written.records += 1,
                    Some(Err(error)) => {
                        written.error = Some(describe(&error));
                        written.lost += 1;
                        writer = None;
                    }
                    None => written.lost += 1,
                }
                let _ = give_back.send(sample);
            }
            Handed::End(outcome) => {
                if let Some(Err(error)) = writer.take().map(|(writer, _)| writer.finish(outcome)) {
                    written.error = Some(describe(&error));
                }
                break;
            }
        }
    }
    written
}

/// The error with its causes: MCAP's own text omits the system's.
pub(super) fn describe(error: &mcap::McapError) -> String {
    let causes = std::iter::successors(std::error::Error::source(error), |cause| cause.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}
