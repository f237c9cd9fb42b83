//! Backups of each servo as delivered, in files. They also record which joints' servos have been started on.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::service::setup::{Target, is_begun};
use crate::service::{Backup, Servo};

/// Highest number of backups of one joint's servos.
const MAX: u32 = 1000;

/// The folder of a robot's backups.
pub(super) struct Backups {
    folder: PathBuf,
}

impl Backups {
    /// The folder beside a unit file: for `horse.unit.toml` it is `horse.servos`.
    pub(super) fn beside(unit: &Path) -> Backups {
        let name = unit.file_name().unwrap_or_default().to_string_lossy();
        let stem = name.strip_suffix(".toml").unwrap_or(&name);
        let stem = stem.strip_suffix(".unit").unwrap_or(stem);
        Backups { folder: unit.with_file_name(format!("{stem}.servos")) }
    }

    /// True if the set-up of `joint`'s servo was begun.
    pub(super) fn has(&self, joint: &str) -> bool {
        self.path(joint, 1).exists()
    }

    fn path(&self, joint: &str, number: u32) -> PathBuf {
        let joint = joint.replace('/', "_");
        self.folder.join(if number == 1 { format!("{joint}.toml") } else { format!("{joint}.{number}.toml") })
    }

    /// Saves `servo` as it is, unless a backup already holds its state from before `targets` were first written to
    /// it. Returns the file.
    pub(super) fn keep(&self, joint: &str, servo: &mut Servo<'_>, targets: &[Target]) -> Result<PathBuf> {
        let now = Backup::of(servo)?;
        std::fs::create_dir_all(&self.folder)
            .with_context(|| format!("{} could not be made", self.folder.display()))?;
        for number in 1..MAX {
            let path = self.path(joint, number);
            if !path.exists() {
                now.save(&path).with_context(|| format!("{} could not be written", path.display()))?;
                return Ok(path);
            }
            if Backup::load(&path).is_ok_and(|then| is_begun(&then, &now, targets)) {
                return Ok(path);
            }
        }
        anyhow::bail!("{} is full of backups of {joint}: remove some", self.folder.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_named_after_the_unit_file() {
        let folder = |unit: &str| Backups::beside(Path::new(unit)).folder;
        assert_eq!(folder("config/horse.unit.toml"), Path::new("config/horse.servos"));
        assert_eq!(folder("built.toml"), Path::new("built.servos"));
    }
}
