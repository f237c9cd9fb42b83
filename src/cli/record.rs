//! The file of a recording: beside its place until it is whole, so that an earlier recording stays until there is
//! another.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::{BadInput, part_of};

/// A recording's file, from before the run until after it.
#[derive(Debug)]
pub(super) struct RecordingFile {
    place: PathBuf,
    /// Where it is written; none for a device, a pipe or a link, which is written to as it is.
    part: Option<PathBuf>,
}

impl RecordingFile {
    /// Begins the recording that is to be at `place`: one that could not be written is better known before the robot
    /// has walked.
    pub(super) fn create(place: &Path) -> Result<(RecordingFile, File), BadInput> {
        let part = part_of(place);
        let written = part.as_deref().unwrap_or(place);
        let file = File::create(written)
            .map_err(|error| BadInput(format!("the recording {}: {error}", written.display())))?;
        Ok((RecordingFile { place: place.to_owned(), part }, file))
    }

    /// Where it is as long as it is written.
    pub(super) fn written(&self) -> &Path {
        self.part.as_deref().unwrap_or(&self.place)
    }

    /// Puts the whole recording in its place, where it outlasts a cut of power; returns where that is.
    pub(super) fn keep(&self) -> io::Result<&Path> {
        if let Some(part) = &self.part {
            File::open(part)?.sync_data()?;
            fs::rename(part, &self.place)?;
            if let Some(folder) = self.place.parent().filter(|folder| !folder.as_os_str().is_empty()) {
                // The new name; not every file system can.
                let _ = File::open(folder).and_then(|folder| folder.sync_all());
            }
        }
        Ok(&self.place)
    }

    /// Takes away a recording of nothing.
    pub(super) fn discard(&self) {
        if let Some(part) = &self.part {
            let _ = fs::remove_file(part);
        }
    }
}
