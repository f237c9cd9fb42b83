//! Writes unit files: whole or not at all, and never over the one before.
//!
//! The new text goes into a file beside the old one and onto the disk before it takes the old one's name, so
//! that there is a whole unit file under that name at every moment, whatever happens.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::unit::{Unit, VERSION};

/// More old unit files than anybody keeps.
const BACKUPS_MAX: u32 = 100_000;

/// Writes `unit` to `path`. A file that is there already stays beside it, with the next free number at the end
/// of its name: `horse.unit.toml.1`, then `.2`, and so on. Returns that name, where there was one.
///
/// # Errors
/// Why it could not be written; the file at `path` is as it was then.
pub fn write_unit(path: &Path, unit: &Unit) -> io::Result<Option<PathBuf>> {
    let text = text_of(unit)?;
    replace(&real(path), |file| file.write_all(text.as_bytes()), keep_old)
}

/// The same, and the file that is there is given up: for the next step of a work whose first step was kept with
/// [`write_unit`].
///
/// # Errors
/// As [`write_unit`].
pub fn rewrite_unit(path: &Path, unit: &Unit) -> io::Result<()> {
    let text = text_of(unit)?;
    replace(&real(path), |file| file.write_all(text.as_bytes()), |_| Ok(None)).map(|_| ())
}

fn text_of(unit: &Unit) -> io::Result<String> {
    let text = toml::to_string(unit).map_err(io::Error::other)?;
    Ok(format!("version = {VERSION}\n{text}"))
}

/// A link goes on pointing to the file it points to.
fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// Replaces the file at `path` by what `fill` writes, once `keep` has kept it.
fn replace(
    path: &Path,
    fill: impl FnOnce(&mut File) -> io::Result<()>,
    keep: impl FnOnce(&Path) -> io::Result<Option<PathBuf>>,
) -> io::Result<Option<PathBuf>> {
    let part = with_end(path, &format!(".{}.part", std::process::id()));
    let replaced = write_synced(&part, fill).and_then(|()| keep(path)).and_then(|old| {
        fs::rename(&part, path)?;
        Ok(old)
    });
    if replaced.is_err() {
        // It would only be in the way; whether it can be taken away or not, the error is the one above.
        let _ = fs::remove_file(&part);
    }
    sync_folder(path);
    replaced
}

fn write_synced(path: &Path, fill: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let mut file = File::create(path)?;
    fill(&mut file)?;
    file.sync_all()
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
            // Some file systems know no second names (the boot partition of a Raspberry Pi, for one).
            Err(_) => {
                let old = fs::read(path)?;
                write_synced(&backup, |file| file.write_all(&old))?;
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

/// Brings the new name onto the disk too. Where a system cannot do that, it does it by itself.
fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An empty folder of this test alone.
    fn folder(test: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("hippocamp-{}-{test}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    fn names(folder: &Path) -> Vec<String> {
        let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<String> = names.map(|name| name.into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn put(path: &Path, text: &str) -> io::Result<Option<PathBuf>> {
        replace(path, |file| file.write_all(text.as_bytes()), keep_old)
    }

    #[test]
    fn every_write_keeps_the_one_before() {
        let folder = folder("keeps");
        let path = folder.join("a.unit.toml");
        assert_eq!(put(&path, "first").unwrap(), None);
        assert_eq!(put(&path, "second").unwrap(), Some(folder.join("a.unit.toml.1")));
        assert_eq!(put(&path, "third").unwrap(), Some(folder.join("a.unit.toml.2")));
        assert_eq!(names(&folder), ["a.unit.toml", "a.unit.toml.1", "a.unit.toml.2"]);
        let text = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
        assert_eq!(
            [text("a.unit.toml.1"), text("a.unit.toml.2"), text("a.unit.toml")],
            ["first", "second", "third"]
        );
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_write_that_fails_half_way_leaves_the_old_file_and_nothing_else() {
        let folder = folder("fails");
        let path = folder.join("a.unit.toml");
        put(&path, "whole").unwrap();
        let fill = |file: &mut File| {
            file.write_all(b"hal")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        };
        let result = replace(&path, fill, keep_old);
        assert_eq!(result.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(names(&folder), ["a.unit.toml"]);
        assert_eq!(fs::read_to_string(&path).unwrap(), "whole");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_folder_in_the_way_is_an_error_and_leaves_nothing() {
        let folder = folder("in-the-way");
        assert!(put(&folder.join("absent/a.unit.toml"), "text").is_err());
        fs::create_dir(folder.join("a.unit.toml")).unwrap();
        assert!(put(&folder.join("a.unit.toml"), "text").is_err());
        let left = names(&folder);
        assert!(left.iter().all(|name| !name.ends_with(".part")), "{left:?}");
        fs::remove_dir_all(folder).unwrap();
    }
}
