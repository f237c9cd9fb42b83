//! A folder with a link for each bus, where other programs find it; one `hippocamp sim` at a time holds it.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use rustix::fs::{FlockOperation, flock};
use rustix::process::getuid;

use super::super::BadInput;

/// A folder for links, reserved until dropped.
#[derive(Debug)]
pub(super) struct Links {
    folder: PathBuf,
    /// Locked, so that a second program with the same folder does not steal the first one's links.
    _lock: File,
    /// True if this program made the folder, and must remove it.
    is_own: bool,
}

impl Links {
    /// Reserves `folder` for links of these `names`; without `folder`, one named after the robot file in the user's
    /// folder for running programs.
    ///
    /// # Errors
    /// Bad input if the folder cannot be made, is in use, or has another file of such a name in it.
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
        // A killed program leaves links to terminals that are gone.
        let is_in_the_way = |path: &PathBuf| {
            path.symlink_metadata().is_ok()
                && !fs::read_link(path).is_ok_and(|target| target.starts_with("/dev/pts"))
        };
        // A link is made under the second name, and then renamed to the first.
        let mut names = names.flat_map(|name| [folder.join(name), folder.join(format!("{name}.new"))]);
        if let Some(taken) = names.find(is_in_the_way) {
            return Err(BadInput(format!(
                "{} exists already and is not a link of hippocamp sim: move it away, or give another folder with \
                 --link",
                taken.display()
            ))
            .into());
        }
        let folder = folder.canonicalize().with_context(|| folder.display().to_string())?;
        Ok(Links { folder, _lock: lock, is_own })
    }

    /// Its path.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        if self.is_own {
            // Fails, and keeps the folder, if it contains other files.
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

/// `$XDG_RUNTIME_DIR/hippocamp/ROBOT`, or `hippocamp-USER/ROBOT` among the temporary files if that is not set.
fn default_folder(robot_file: &Path) -> PathBuf {
    let running = match std::env::var_os("XDG_RUNTIME_DIR").filter(|folder| !folder.is_empty()) {
        Some(folder) => Path::new(&folder).join("hippocamp"),
        None => std::env::temp_dir().join(format!("hippocamp-{}", getuid().as_raw())),
    };
    running.join(robot_file.file_stem().unwrap_or_default())
}
