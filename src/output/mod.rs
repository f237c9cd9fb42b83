//! Every file that a command writes goes through here, so that no output replaces a file that is needed.
//!
//! Takes the files that a command reads, and the paths it should write to. Returns a [`Place`] for each, or an
//! error, before the command has done anything; later the files are either complete or not there at all.
//!
//! A path is refused if the command reads the file there, if another output of the command goes there, if a
//! recording finds FILE.part there already, or if no file can be made there. Files are compared by device and inode
//! number, so links and other spellings of a name are found. Any other file is replaced.

mod part;
mod place;

use std::fs;
use std::path::{Path, PathBuf};

pub(crate) use part::{copy_new, named_part, replace, write_new};
use place::Id;
pub(crate) use place::{OutputError, Place, WriteMode};

/// The files of one command.
#[derive(Debug)]
pub(crate) struct Outputs {
    inputs: Vec<(PathBuf, Id)>,
    /// Each output: the option with its path, and the file it occupies.
    claimed: Vec<(String, Id)>,
}

impl Outputs {
    /// The outputs of a command that reads `inputs`. A missing input is left to the code that reads it.
    pub(crate) fn of_reading<P: AsRef<Path>>(inputs: impl IntoIterator<Item = P>) -> Outputs {
        let known = |path: P| {
            let found = fs::metadata(path.as_ref()).ok()?;
            Some((path.as_ref().to_owned(), Id::of(&found)))
        };
        Outputs { inputs: inputs.into_iter().filter_map(known).collect(), claimed: Vec::new() }
    }

    /// The place for the file at `path`, which `option` names. Writes nothing.
    ///
    /// # Errors
    /// The reason why the path is refused.
    pub(crate) fn claim(
        &mut self,
        option: &str,
        path: &Path,
        writing: WriteMode,
    ) -> Result<Place, OutputError> {
        let refused = |why: String| OutputError { what: format!("{option} {}", path.display()), why };
        let (place, ids) = Place::find(path, writing).map_err(refused)?;
        for id in &ids {
            if let Some((input, _)) = self.inputs.iter().find(|(_, input)| input == id) {
                return Err(refused(format!(
                    "this command reads that file ({}): name another to write to",
                    input.display()
                )));
            }
            if let Some((other, _)) = self.claimed.iter().find(|(_, claimed)| claimed == id) {
                return Err(refused(format!(
                    "{other} is also written there: expected a file of its own for each"
                )));
            }
        }
        self.claimed.extend(ids.into_iter().map(|id| (format!("{option} {}", path.display()), id)));
        Ok(place)
    }
}
