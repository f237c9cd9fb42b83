//! Files while they are written: beside their place, under a unique name, and moved into place only at the end.
//!
//! A new file is made with `O_EXCL`, which follows no link and replaces no file. It gets the rights and the owner
//! of the file that it will replace before anything is written to it.

use std::ffi::OsString;
use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
use std::path::{Path, PathBuf};

use tempfile::{Builder, TempPath};

use super::place::folder_of;

/// Rights of a file that replaces none, before the user's mask is applied.
const NEW_MODE: u32 = 0o666;
/// Mode bits that say who may read, write and run a file; only these are kept.
const RIGHTS: u32 = 0o777;

/// Path of a recording for `file` until it is complete.
pub(crate) fn named_part(file: &Path) -> PathBuf {
    let mut part = file.as_os_str().to_owned();
    part.push(".part");
    part.into()
}

/// Makes FILE.part for `file`.
pub(super) fn begin_named(file: &Path) -> io::Result<(File, TempPath)> {
    let part = named_part(file);
    let name: OsString = part.file_name().unwrap_or_default().to_owned();
    // Without random letters: the file gets exactly this name, or is not made.
    begin(file, Builder::new().prefix(&name).suffix("").rand_bytes(0))
}

/// Replaces the file at `file`, or makes it, once `keep` has kept the existing one; returns what `keep` returns.
///
/// # Errors
/// The cause; the file is then unchanged.
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

/// Makes the file at `file`, which must not exist.
///
/// # Errors
/// If something exists there, or it cannot be written.
pub(crate) fn write_new(file: &Path, text: &[u8]) -> io::Result<()> {
    let part = written(file, text)?;
    part.persist_noclobber(file).map_err(|error| match error.error.kind() {
        io::ErrorKind::AlreadyExists => {
            io::Error::new(error.error.kind(), "exists already; give another name")
        }
        _ => error.error,
    })?;
    sync_folder(file);
    Ok(())
}

/// Copies the file at `from` to `to`, which must not exist: its bytes, rights and owner.
///
/// # Errors
/// The same as [`write_new`].
pub(crate) fn copy_new(from: &Path, to: &Path) -> io::Result<()> {
    // Made beside `from`, the copy gets that file's rights.
    written(from, &fs::read(from)?)?.persist_noclobber(to).map_err(|error| error.error)?;
    sync_folder(to);
    Ok(())
}

/// Adds `text` to the target at `path`: a device or a pipe takes it as it comes.
///
/// # Errors
/// The system's error.
pub(super) fn append(path: &Path, text: &[u8]) -> io::Result<()> {
    open_stream(path)?.write_all(text)
}

/// Opens the device or pipe at `path` to write to it.
pub(super) fn open_stream(path: &Path) -> io::Result<File> {
    OpenOptions::new().append(true).open(path)
}

/// Renames the complete file at `part` to `file`, so that it survives a power cut.
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

/// Makes a file beside `file`, with that file's rights if it exists.
fn begin(file: &Path, name: &mut Builder<'_, '_>) -> io::Result<(File, TempPath)> {
    let replaced = fs::symlink_metadata(file).ok().filter(Metadata::is_file);
    // Only its owner can read it until it has the rights of the file it replaces.
    let mode = if replaced.is_some() { 0o600 } else { NEW_MODE };
    let part = name.permissions(Permissions::from_mode(mode)).tempfile_in(folder_of(file))?;
    if let Some(replaced) = &replaced {
        take_over(part.as_file(), replaced)?;
    }
    Ok(part.into_parts())
}

/// Gives `part` the rights of the file it will replace, and its owner and group as far as this user is allowed to.
fn take_over(part: &File, replaced: &Metadata) -> io::Result<()> {
    let mut mode = replaced.mode() & RIGHTS;
    let own = part.metadata()?;
    if (own.uid(), own.gid()) != (replaced.uid(), replaced.gid()) {
        let _ = fchown(part, Some(replaced.uid()), Some(replaced.gid()))
            .or_else(|_| fchown(part, None, Some(replaced.gid())));
        if part.metadata()?.gid() != replaced.gid() {
            // The group differs: it gets the rights that all others had.
            mode = mode & !0o070 | (mode & 0o007) << 3;
        }
    }
    // Some file systems have one mode for all their files.
    let _ = part.set_permissions(Permissions::from_mode(mode));
    Ok(())
}

/// Writes the new name to the disk too. A system that cannot do that does it by itself.
fn sync_folder(file: &Path) {
    let _ = File::open(folder_of(file)).and_then(|folder| folder.sync_all());
}
