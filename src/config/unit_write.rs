//! Writes unit files: completely or not at all, and never over the previous one.
//!
//! The new text goes into a file beside the old one and onto the disk before it takes the old one's name. So there
//! is a complete unit file under that name at every moment, whatever happens. It gets the permissions of the old
//! one.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::unit::{Unit, VERSION};
use crate::output;

/// Most old unit files kept.
const BACKUPS_MAX: u32 = 100_000;

/// Writes `unit` to `path`. A file already there stays beside it, with the next free number at the end of its name:
/// `horse.unit.toml.1`, then `.2`, and so on. Returns that name, if there was one.
///
/// # Errors
/// The reason why it could not be written; the file at `path` is then unchanged.
pub fn write_unit(path: &Path, unit: &Unit) -> io::Result<Option<PathBuf>> {
    output::replace(&real(path), text_of(unit)?.as_bytes(), keep_old)
}

/// The same, but drops the file already there: for a later step of a task whose first step was kept with
/// [`write_unit`].
///
/// # Errors
/// As [`write_unit`].
pub fn rewrite_unit(path: &Path, unit: &Unit) -> io::Result<()> {
    output::replace(&real(path), text_of(unit)?.as_bytes(), |_| Ok(()))
}

fn text_of(unit: &Unit) -> io::Result<String> {
    let text = toml::to_string(unit).map_err(io::Error::other)?;
    Ok(format!("version = {VERSION}\n{text}"))
}

/// Resolves a link, so that it keeps pointing to the same file.
fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// Gives the file at `path` a second name, the next free one.
fn keep_old(path: &Path) -> io::Result<Option<PathBuf>> {
    if !path.try_exists()? {
        return Ok(None);
    }
    for number in 1..BACKUPS_MAX {
        let backup = with_end(path, &format!(".{number}"));
        if backup.try_exists()? {
            continue;
        }
        match fs::hard_link(path, &backup) {
            Ok(()) => return Ok(Some(backup)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            // Some file systems do not support second names (the boot partition of a Raspberry Pi, for one).
            Err(_) => {
                output::copy_new(path, &backup)?;
                return Ok(Some(backup));
            }
        }
    }
    Err(io::Error::other("there are too many old unit files beside it; remove some"))
}

fn with_end(path: &Path, end: &str) -> PathBuf {
    let mut name: OsString = path.as_os_str().to_owned();
    name.push(end);
    name.into()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<String> = names.map(|name| name.into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn unit(robot_file: &str) -> Unit {
        Unit { robot_file: robot_file.to_owned(), ..Unit::default() }
    }

    #[test]
    fn every_write_keeps_the_one_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.unit.toml");
        assert_eq!(write_unit(&path, &unit("first")).unwrap(), None);
        let old = fs::canonicalize(folder.path()).unwrap().join("a.unit.toml.1");
        assert_eq!(write_unit(&path, &unit("second")).unwrap(), Some(old.clone()));
        assert_eq!(write_unit(&path, &unit("third")).unwrap(), Some(old.with_extension("2")));
        rewrite_unit(&path, &unit("fourth")).unwrap();
        assert_eq!(names(folder.path()), ["a.unit.toml", "a.unit.toml.1", "a.unit.toml.2"]);
        let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(
            [text("a.unit.toml.1"), text("a.unit.toml.2"), text("a.unit.toml")],
            ["first", "second", "fourth"].map(|robot_file| text_of(&unit(robot_file)).unwrap())
        );
    }

    #[test]
    fn the_new_file_has_the_rights_of_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.unit.toml");
        let mode = |name: &str| fs::metadata(folder.path().join(name)).unwrap().permissions().mode() & 0o777;
        write_unit(&path, &unit("first")).unwrap();
        for private in [0o600, 0o640, 0o604] {
            fs::set_permissions(&path, fs::Permissions::from_mode(private)).unwrap();
            write_unit(&path, &unit("second")).unwrap();
            assert_eq!(mode("a.unit.toml"), private);
            rewrite_unit(&path, &unit("third")).unwrap();
            assert_eq!(mode("a.unit.toml"), private);
        }
        let old = ["a.unit.toml.1", "a.unit.toml.2", "a.unit.toml.3"].map(mode);
        assert_eq!(old, [0o600, 0o640, 0o604], "nor do the old ones change");
    }

    #[test]
    fn the_new_file_has_the_owner_of_the_old_one() {
        use std::os::unix::fs::{MetadataExt, chown};
        if !rustix::process::geteuid().is_root() {
            eprintln!("left out: only root gives files away");
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.unit.toml");
        write_unit(&path, &unit("first")).unwrap();
        chown(&path, Some(12_345), Some(54_321)).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        write_unit(&path, &unit("second")).unwrap();
        let found = fs::metadata(&path).unwrap();
        assert_eq!((found.uid(), found.gid(), found.mode() & 0o777), (12_345, 54_321, 0o640));
    }

    #[test]
    fn a_folder_in_the_way_is_an_error_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        assert!(write_unit(&folder.path().join("absent/a.unit.toml"), &unit("a")).is_err());
        fs::create_dir(folder.path().join("a.unit.toml")).unwrap();
        assert!(write_unit(&folder.path().join("a.unit.toml"), &unit("a")).is_err());
        let left = names(folder.path());
        assert!(left.iter().all(|name| !name.ends_with(".part")), "{left:?}");
    }
}
