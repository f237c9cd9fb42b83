//! Where other programs find the buses: a folder with a link for each, kept by one `hippocamp sim` at a time.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use rustix::fs::{FlockOperation, flock};
use rustix::process::getuid;

use super::super::BadInput;

/// A folder for links, taken until dropped.
#[derive(Debug)]
pub(super) struct Links {
    folder: PathBuf,
    /// Locked, so that a second program with the same folder does not steal the first one's links.
    _lock: File,
    /// Made here, and to be removed again.
    is_own: bool,
}

impl Links {
    /// Takes `folder`, or else one that is named after the robot file in the user's folder for running programs, for
    /// links of these `names`.
    ///
    /// # Errors
    /// Bad input if it cannot be made, is in use, or has something else of such a name in it.
    pub(super) fn take<'n>(
        folder: Option<&Path>,
        robot_file: &Path,
        names: impl Iterator<Item = &'n str>,
    ) -> Result<Links> {
        let folder = folder.map_or_else(|| default_folder(robot_file), Path::to_owned);
        let is_own = !folder.exists();
        let bad =
            |error| BadInput(format!("--link {}: {error}; expected a folder to write to", folder.display()));
        fs::create_dir_all(&folder).map_err(bad)?;
        let lock = File::open(&folder).map_err(bad)?;
        flock(&lock, FlockOperation::NonBlockingLockExclusive).map_err(|_| {
            BadInput(format!(
                "{} is in use by another hippocamp sim: end that one, or give this one a folder of its own with \
                 --link",
                folder.display()
            ))
        })?;
        // A link to a terminal that is gone was left behind by a program that was killed.
        let is_in_the_way = |path: &PathBuf| {
            path.symlink_metadata().is_ok()
                && !fs::read_link(path).is_ok_and(|target| target.starts_with("/dev/pts"))
        };
        // A link is made under the second name, and then has the first.
        let mut names = names.flat_map(|name| [folder.join(name), folder.join(format!("{name}.new"))]);
        if let Some(taken) = names.find(is_in_the_way) {
            return Err(BadInput(format!(
                "{} is there already, and no link of hippocamp sim's: move it away, or give another folder with --link",
                taken.display()
            ))
            .into());
        }
        let folder = folder.canonicalize().with_context(|| folder.display().to_string())?;
        Ok(Links { folder, _lock: lock, is_own })
    }

    /// Where it is.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        if self.is_own {
            // Stays if somebody has put something of theirs there.
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

/// `$XDG_RUNTIME_DIR/hippocamp/ROBOT`, or `hippocamp-USER/ROBOT` among the temporary files where that is not set.
fn default_folder(robot_file: &Path) -> PathBuf {
    let running = match std::env::var_os("XDG_RUNTIME_DIR").filter(|folder| !folder.is_empty()) {
        Some(folder) => Path::new(&folder).join("hippocamp"),
        None => std::env::temp_dir().join(format!("hippocamp-{}", getuid().as_raw())),
    };
    running.join(robot_file.file_stem().unwrap_or_default())
}
