//! Reads files that people write: plain text files of a size that a person writes.
//!
//! Any other target of a path is refused before a byte is read: opening a serial device could disturb what is
//! connected to it, a pipe would block, and `/dev/zero` has no end.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use rustix::fs::OFlags;

/// Largest file that is read, bytes: some thousand times a robot file.
pub(crate) const BYTES_MAX: u64 = 4 << 20;

/// Why a file was not read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum InputError {
    /// The system did not allow it.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It is a folder, a device or a pipe.
    #[error("it is not a plain file")]
    NotPlain,
    /// It is larger than any such file should be.
    #[error("it is larger than {} MiB", BYTES_MAX >> 20)]
    TooLarge,
    /// It is not UTF-8 text.
    #[error("it is not UTF-8 text from line {line} on; save it in that encoding")]
    NotText {
        /// The first line that is not, from 1.
        line: usize,
    },
}

impl From<InputError> for io::Error {
    fn from(error: InputError) -> io::Error {
        match error {
            InputError::Io(error) => error,
            other => io::Error::other(other),
        }
    }
}

/// The text of the file at `path`.
///
/// # Errors
/// Why the file was not read.
pub(crate) fn read_text(path: &Path) -> Result<String, InputError> {
    // First check the path: a target that could block or be disturbed is not even opened.
    check(&std::fs::metadata(path)?)?;
    // Then check what was opened, which may have changed since: opening it must not block.
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let file = OpenOptions::new().read(true).custom_flags(flags.bits().cast_signed()).open(path)?;
    check(&file.metadata()?)?;
    text_of(file)
}

fn check(found: &std::fs::Metadata) -> Result<(), InputError> {
    match () {
        () if !found.is_file() => Err(InputError::NotPlain),
        () if found.len() > BYTES_MAX => Err(InputError::TooLarge),
        () => Ok(()),
    }
}

fn text_of(file: File) -> Result<String, InputError> {
    let mut bytes = Vec::new();
    // It may grow while it is read, and system files report no size.
    file.take(BYTES_MAX + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > BYTES_MAX {
        return Err(InputError::TooLarge);
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        InputError::NotText { line: 1 + good.iter().filter(|byte| **byte == b'\n').count() }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anything_but_a_plain_file_of_sane_size_is_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let huge = folder.path().join("huge");
        // A hole of 1 GB, which occupies no space.
        File::create(&huge).unwrap().set_len(1 << 30).unwrap();
        let full = folder.path().join("full");
        std::fs::write(&full, vec![b'#'; usize::try_from(BYTES_MAX).unwrap()]).unwrap();
        assert_eq!(read_text(&full).unwrap().len() as u64, BYTES_MAX);
        File::options().append(true).open(&full).unwrap().set_len(BYTES_MAX + 1).unwrap();
        for (path, said) in [
            (huge.as_path(), "larger than 4 MiB"),
            (&full, "larger than 4 MiB"),
            (folder.path(), "not a plain file"),
            (Path::new("/dev/zero"), "not a plain file"),
            (Path::new("/dev/tty"), "not a plain file"),
            (&folder.path().join("absent"), "No such file"),
        ] {
            let error = read_text(path).unwrap_err().to_string();
            assert!(error.contains(said), "{}: {error}", path.display());
        }
    }

    #[test]
    fn a_pipe_is_refused_without_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR).unwrap();
        assert!(matches!(read_text(&pipe), Err(InputError::NotPlain)));
        let zero = File::open("/dev/zero").unwrap();
        assert!(
            matches!(text_of(zero), Err(InputError::TooLarge)),
            "a device that came in between has an end"
        );
    }

    #[test]
    fn bytes_that_are_no_text_are_reported_by_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("latin-1");
        std::fs::write(&path, b"a = 1\nb = \"gr\xf6n\"\n").unwrap();
        assert!(matches!(read_text(&path), Err(InputError::NotText { line: 2 })));
    }
}
