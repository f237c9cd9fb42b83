//! Files while they are written: beside their place, under a name that no other file has, and only then in it.
//!
//! A new file is made with `O_EXCL`, which follows no link and takes no file over. It has the rights and the owner of the
//! file it will replace before anything is written to it.

use std::ffi::OsString;
use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
use std::path::{Path, PathBuf};

use tempfile::{Builder, TempPath};

use super::place::folder_of;

/// Rights of a file that replaces none, less what the user's mask takes away.
const NEW_MODE: u32 = 0o666;
/// The bits of a mode that say who may read, write and run a file; only these are kept.
const RIGHTS: u32 = 0o777;

/// Where a recording that is to be at `file` is until it is whole.
pub(crate) fn named_part(file: &Path) -> PathBuf {
    let mut part = file.as_os_str().to_owned();
    part.push(".part");
    part.into()
}

/// Makes FILE.part for `file`.
pub(super) fn begin_named(file: &Path) -> io::Result<(File, TempPath)> {
    let part = named_part(file);
    let name: OsString = part.file_name().unwrap_or_default().to_owned();
    // Without random letters: it has this name, or is not made.
    begin(file, Builder::new().prefix(&name).suffix("").rand_bytes(0))
}

/// Replaces the file at `file`, or makes it, once `keep` has kept the one that is there; returns what that returns.
///
/// # Errors
/// Why not; the file is as it was then.
pub(crate) fn replace<K>(
    file: &Path,
    text: &[u8],
    keep: impl FnOnce(&Path) -> io::Result<K>,
) -> io::Result<K> {
    let part = written(file, text)?;
    let kept = keep(file)?;
    put(part, file)?;
    Ok(kept)
}

/// Makes the file at `file`, where nothing is.
///
/// # Errors
/// When there is something, or it cannot be written.
pub(crate) fn write_new(file: &Path, text: &[u8]) -> io::Result<()> {
    let part = written(file, text)?;
    part.persist_noclobber(file).map_err(|error| match error.error.kind() {
        io::ErrorKind::AlreadyExists => {
            io::Error::new(error.error.kind(), "is there already; give another name")
        }
        _ => error.error,
    })?;
    sync_folder(file);
    Ok(())
}

/// Copies the file at `from` to `to`, where nothing is: its bytes, rights and owner.
///
/// # Errors
/// As [`write_new`].
pub(crate) fn copy_new(from: &Path, to: &Path) -> io::Result<()> {
    // Beside `from` it gets the rights of that one.
    written(from, &fs::read(from)?)?.persist_noclobber(to).map_err(|error| error.error)?;
    sync_folder(to);
    Ok(())
}

/// Adds `text` to what is at `path`: a device or a pipe takes it as it comes.
///
/// # Errors
/// What the system says.
pub(super) fn append(path: &Path, text: &[u8]) -> io::Result<()> {
    open_stream(path)?.write_all(text)
}

/// Opens the device or pipe at `path` to write to it.
pub(super) fn open_stream(path: &Path) -> io::Result<File> {
    OpenOptions::new().append(true).open(path)
}

/// Gives the whole file at `part` the name `file`, so that it outlasts a cut of power.
pub(super) fn put(part: TempPath, file: &Path) -> io::Result<()> {
    File::open(&part)?.sync_all()?;
    part.persist(file).map_err(|error| error.error)?;
    sync_folder(file);
    Ok(())
}

fn written(file: &Path, text: &[u8]) -> io::Result<TempPath> {
    let (mut opened, part) = begin(file, Builder::new().prefix(".hippocamp-").suffix(".part"))?;
    opened.write_all(text)?;
    opened.sync_all()?;
    Ok(part)
}

/// Makes a file beside `file`, with the rights of that one, if there is one.
fn begin(file: &Path, name: &mut Builder<'_, '_>) -> io::Result<(File, TempPath)> {
    let replaced = fs::symlink_metadata(file).ok().filter(Metadata::is_file);
    // Nobody but its owner reads it before its rights are those of the one it replaces.
    let mode = if replaced.is_some() { 0o600 } else { NEW_MODE };
    let part = name.permissions(Permissions::from_mode(mode)).tempfile_in(folder_of(file))?;
    if let Some(replaced) = &replaced {
        take_over(part.as_file(), replaced)?;
    }
    Ok(part.into_parts())
}

/// Gives `part` the rights of the file it will replace, and its owner and group as far as this user may.
fn take_over(part: &File, replaced: &Metadata) -> io::Result<()> {
    let mut mode = replaced.mode() & RIGHTS;
    let own = part.metadata()?;
    if (own.uid(), own.gid()) != (replaced.uid(), replaced.gid()) {
        let _ = fchown(part, Some(replaced.uid()), Some(replaced.gid()))
            .or_else(|_| fchown(part, None, Some(replaced.gid())));
        if part.metadata()?.gid() != replaced.gid() {
            // The group is another one: it gets the rights that all others had.
            mode = mode & !0o070 | (mode & 0o007) << 3;
        }
    }
    // Some file systems have one mode for all their files.
    let _ = part.set_permissions(Permissions::from_mode(mode));
    Ok(())
}

/// Brings the new name onto the disk too. Where a system cannot do that, it does it by itself.
fn sync_folder(file: &Path) {
    let _ = File::open(folder_of(file)).and_then(|folder| folder.sync_all());
}
