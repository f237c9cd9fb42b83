//! The target of an output, and what is already there.

use std::ffi::OsString;
use std::fs::{self, File, Metadata};
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use rustix::fs::{Access, access};
use tempfile::TempPath;

use super::part;

/// Why an output is refused. Nothing was written.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {why}")]
pub(crate) struct OutputError {
    pub(super) what: String,
    pub(super) why: String,
}

/// How an output is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WriteMode {
    /// Completely and at once; it replaces any file but a robot, unit, fault or script file.
    Whole,
    /// Piece by piece in FILE.part, which becomes FILE once it is complete.
    Recording,
    /// In place of the command's own unit file, which is read, changed and written.
    UnitFile,
    /// Only to a path where nothing exists yet.
    New,
}

/// Identity of a file, whatever its name; for one that does not exist, its folder and name.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Id {
    File(u64, u64),
    Name(u64, u64, OsString),
}

impl Id {
    pub(super) fn of(found: &Metadata) -> Id {
        Id::File(found.dev(), found.ino())
    }

    fn of_name(path: &Path) -> io::Result<Id> {
        let folder = fs::metadata(folder_of(path))?;
        let name = path.file_name().unwrap_or_default().to_owned();
        Ok(Id::Name(folder.dev(), folder.ino(), name))
    }
}

/// The target of one output.
#[derive(Debug)]
pub(crate) struct Place {
    named: PathBuf,
    /// The file that is written or replaced, links followed; `None` for a device, a pipe, or the target of standard
    /// output, which are written to as they are.
    file: Option<PathBuf>,
}

impl Place {
    /// The target at `path`, and the files that are written there.
    pub(super) fn find(path: &Path, writing: WriteMode) -> Result<(Place, Vec<Id>), String> {
        let Some(found) = look(path)? else {
            let mut ids = vec![Id::of_name(path).map_err(|error| error.to_string())?];
            ids.extend(part_id(path, writing)?);
            return Ok((Place { named: path.to_owned(), file: Some(path.to_owned()) }, ids));
        };
        if writing == WriteMode::New {
            return Err("exists already; give another name".to_owned());
        }
        let id = Id::of(&found);
        if is_stream(&found, &id) {
            return Ok((Place { named: path.to_owned(), file: None }, vec![id]));
        }
        // A link still points to the same file afterwards.
        let real = fs::canonicalize(path).map_err(|error| error.to_string())?;
        let is_toml = |path: &Path| path.extension().is_some_and(|extension| extension == "toml");
        if writing != WriteMode::UnitFile && (is_toml(path) || is_toml(&real)) {
            return Err("exists already, and no command overwrites .toml files".to_owned());
        }
        access(&real, Access::WRITE_OK).map_err(|error| {
            format!("{}; allow it to be written, or name another file", io::Error::from(error))
        })?;
        check_folder(&real)?;
        let mut ids = vec![id];
        ids.extend(part_id(&real, writing)?);
        Ok((Place { named: path.to_owned(), file: Some(real) }, ids))
    }

    /// The path as the user gave it.
    pub(crate) fn path(&self) -> &Path {
        &self.named
    }

    /// True for a device, a pipe, and the target of standard output.
    pub(crate) fn is_stream(&self) -> bool {
        self.file.is_none()
    }

    /// Writes `text` there, completely or not at all.
    ///
    /// # Errors
    /// The cause; the old content is then still there.
    pub(crate) fn write(&self, text: &[u8]) -> io::Result<()> {
        match &self.file {
            Some(file) => part::replace(file, text, |_| Ok(())),
            None => part::append(&self.named, text),
        }
    }

    /// Begins a recording as FILE.part, or writes to the existing target if that is not a file.
    ///
    /// # Errors
    /// The cause, for example that FILE.part exists.
    pub(crate) fn begin_recording(&self) -> io::Result<(File, Option<TempPath>)> {
        match &self.file {
            Some(file) => {
                let (opened, mut part) = part::begin_named(file)?;
                // A recording that is cut short can be read up to the cut.
                part.disable_cleanup(true);
                Ok((opened, Some(part)))
            }
            None => Ok((part::open_stream(&self.named)?, None)),
        }
    }

    /// Moves the complete recording at `part`, which was begun here, to its place.
    ///
    /// # Errors
    /// The cause; the recording is still at `part`.
    pub(crate) fn end_recording(&self, part: TempPath) -> io::Result<()> {
        match &self.file {
            Some(file) => part::put(part, file),
            None => Ok(()),
        }
    }

    /// A file without a name, needed only until the output is complete.
    ///
    /// # Errors
    /// The cause.
    pub(crate) fn nameless(&self) -> io::Result<File> {
        match &self.file {
            Some(file) => tempfile::tempfile_in(folder_of(file)),
            None => tempfile::tempfile(),
        }
    }
}

/// The part file of a recording, `None` for other outputs; an error if something already exists there.
fn part_id(file: &Path, writing: WriteMode) -> Result<Option<Id>, String> {
    if writing != WriteMode::Recording {
        return Ok(None);
    }
    let part = part::named_part(file);
    if fs::symlink_metadata(&part).is_ok() {
        let part = part.display();
        return Err(format!(
            "{part} exists, and a recording has that name until it is complete. If a run left it, 'hippocamp \
             replay {part}' reads it; then move it away or delete it, or name another file"
        ));
    }
    Id::of_name(&part).map(Some).map_err(|error| error.to_string())
}

/// The file at `path`, links followed; `None` if a file could be made there.
fn look(path: &Path) -> Result<Option<Metadata>, String> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err("is a folder; expected a file".to_owned()),
        Ok(found) if found.file_type().is_block_device() => {
            Err("is a disk; expected a file in a folder".to_owned())
        }
        Ok(found) => Ok(Some(found)),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error.to_string()),
        Err(_) if fs::symlink_metadata(path).is_ok() => {
            Err("is a link to nothing; delete it, or name another file".to_owned())
        }
        Err(_) => {
            check_folder(path)?;
            Ok(None)
        }
    }
}

fn check_folder(path: &Path) -> Result<(), String> {
    let folder = folder_of(path);
    if path.file_name().is_none() || !folder.is_dir() {
        return Err("expected a file in a folder that exists".to_owned());
    }
    access(folder, Access::WRITE_OK | Access::EXEC_OK)
        .map_err(|error| format!("the folder {}: {}", folder.display(), io::Error::from(error)))
}

/// The folder that `path` is in.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// True for a device, a pipe, and the file that standard output or error already goes to.
#[allow(clippy::disallowed_methods, reason = "checks where the streams go, and writes nothing")]
fn is_stream(found: &Metadata, id: &Id) -> bool {
    let is_own = |stream: BorrowedFd<'_>| {
        let stream = stream.try_clone_to_owned().and_then(|stream| File::from(stream).metadata());
        stream.is_ok_and(|stream| Id::of(&stream) == *id)
    };
    !found.is_file() || is_own(io::stdout().as_fd()) || is_own(io::stderr().as_fd())
}
