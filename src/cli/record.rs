//! A recording of a run, and its file: beside its final place until it is complete, so that an earlier recording stays until
//! the new one replaces it.

use std::fs::File;
use std::io::{self, Read, Write};
use std::os::unix::fs::FileExt;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};
use tempfile::TempPath;

use super::{BadInput, RunArguments};
use crate::config::RobotFile;
use crate::output::Place;
use crate::plan::RunPlan;
use crate::recording::{Recorder, RunHeader};

/// A recording's file, from before the run until after it.
#[derive(Debug)]
pub(super) struct RecordingFile {
    /// Its name now.
    name: String,
    /// Final place; `None` for a recording that serves only to make a page: it has no name and is deleted
    /// afterwards.
    place: Option<Place>,
    /// The unfinished file that will be moved there; `None` for a device or a pipe, which is written to directly.
    part: Option<TempPath>,
    file: File,
}

impl RecordingFile {
    /// Begins the recording that should end up at `place`. Fails before the robot walks if the file cannot be
    /// written.
    pub(super) fn begin(place: Place) -> Result<(RecordingFile, File), BadInput> {
        let path = place.path().display().to_string();
        let bad = |error: io::Error| BadInput(format!("the recording {path}: {error}"));
        let (file, part) = place.begin_recording().map_err(bad)?;
        let sink = file.try_clone().map_err(bad)?;
        let name = part.as_ref().map_or_else(|| path.clone(), |part| part.display().to_string());
        Ok((RecordingFile { name, place: Some(place), part, file }, sink))
    }

    /// Begins a recording that serves only to make the page at `page`.
    pub(super) fn for_page(page: &Place) -> Result<(RecordingFile, File), BadInput> {
        let path = page.path().display().to_string();
        let bad = |error: io::Error| BadInput(format!("the recording for the page {path}: {error}"));
        let file = page.nameless().map_err(bad)?;
        let sink = file.try_clone().map_err(bad)?;
        Ok((RecordingFile { name: format!("behind {path}"), place: None, part: None, file }, sink))
    }

    /// Its name: that of its final place once it is there.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Moves the complete recording to its final place, so that it survives a power cut.
    pub(super) fn keep(&mut self) -> io::Result<()> {
        if let (Some(place), Some(part)) = (&self.place, self.part.take()) {
            place.end_recording(part)?;
            self.name = place.path().display().to_string();
        }
        Ok(())
    }

    /// Deletes an empty recording.
    pub(super) fn discard(self) {
        if let Some(part) = self.part {
            let _ = part.close();
        }
    }

    /// The recording, read from its start.
    pub(super) fn read_back(&self) -> impl Read {
        io::BufReader::new(ReadBack { file: &self.file, offset: 0 })
    }
}

/// Records into `sink`, which is the file called `name`.
pub(super) fn recorder_into(
    sink: impl Write + Send + 'static,
    name: &str,
    file: &RobotFile,
    plan: &RunPlan,
    options: &RunArguments,
) -> Result<Recorder> {
    // A recording that outgrows a limit of the system breaks off; it must not kill the controller.
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())
        .context("signals could not be caught")?;
    // A virtual run is the same at any time of day, and so is its recording.
    let started = if options.unit.is_virtual { UNIX_EPOCH } else { SystemTime::now() };
    let started_ns = started.duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    let header = RunHeader::new(
        &file.robot,
        plan,
        &options.robot.display().to_string(),
        u64::try_from(started_ns).unwrap_or_default(),
    );
    Recorder::start(
        &file.robot,
        header,
        file.text().to_owned(),
        name.to_owned(),
        sink,
        options.unit.is_virtual,
    )
    .context("the recording could not be started")
}

/// Reads a file whose end another thread may still be writing.
struct ReadBack<'f> {
    file: &'f File,
    offset: u64,
}

impl Read for ReadBack<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read_at(into, self.offset)?;
        self.offset += u64::try_from(count).unwrap_or(0);
        Ok(count)
    }
}
