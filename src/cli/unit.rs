//! Finds the unit file of the built robot.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::config::{self, UnitFile, default_unit_path};

/// Path of the unit file: the one that the user named, or else the one beside the robot file, if it exists.
pub(super) fn path(robot_file: &Path, named: Option<&Path>) -> Option<PathBuf> {
    let beside = || Some(default_unit_path(robot_file)).filter(|beside| beside.exists());
    named.map(Path::to_owned).or_else(beside)
}

/// Loads the unit file at that path, if there is one.
pub(super) fn find(robot_file: &Path, named: Option<&Path>) -> Result<Option<UnitFile>> {
    Ok(path(robot_file, named).map(|path| config::load_unit(&path)).transpose()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT_FILE: &str = "config/horse-dynamixel.toml";

    #[test]
    fn a_named_unit_file_must_be_there_and_one_beside_the_robot_file_need_not() {
        assert!(find(Path::new(ROBOT_FILE), None).unwrap().is_none());
        let error = find(Path::new(ROBOT_FILE), Some(Path::new("absent.unit.toml"))).unwrap_err();
        assert!(error.is::<config::ConfigError>());
        assert!(error.to_string().contains("absent.unit.toml: expected a unit file"), "{error}");
        let folder = tempfile::tempdir().unwrap();
        let text = "version = 1\nrobot_file = \"horse.toml\"\n";
        std::fs::write(folder.path().join("horse.unit.toml"), text).unwrap();
        let found = find(&folder.path().join("horse.toml"), None).unwrap();
        assert_eq!(found.unwrap().unit.robot_file, "horse.toml");
    }
}
