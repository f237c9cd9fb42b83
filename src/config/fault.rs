//! A fault of a robot file, worded so that the author can fix it.
//!
//! In: place and fault, from the reader and from later checks. Out: one line for each fault.

use std::fmt;

use crate::printable::printable;

/// One fault of a robot file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// The file's name as given when it was loaded.
    pub file: String,
    /// Line, from 1; 0 if the fault concerns the file as a whole.
    pub line: usize,
    /// Column, from 1, counted in characters; only if the text is not TOML.
    pub column: Option<usize>,
    /// Path of the key, list indices from 0: `chain[1].joint[2].range_deg`. Empty if no key is concerned.
    pub key: String,
    /// The value in the file, shortened; `None` if the key is not set.
    pub value: Option<String>,
    /// What was expected and, if that does not say it already, what to do.
    pub expected: String,
}

/// One line, whatever characters the file, its name and the key contain.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut place = self.file.clone();
        if self.line > 0 {
            place += &format!(":{}", self.line);
        }
        if let Some(column) = self.column {
            place += &format!(":{column}");
        }
        let found = match (self.key.is_empty(), &self.value) {
            (true, None) => String::new(),
            (true, Some(value)) => format!(": {value}"),
            (false, None) => format!(": {} is not set", self.key),
            (false, Some(value)) => format!(": {} = {value}", self.key),
        };
        f.write_str(&printable(&format!("{place}{found}: expected {}", self.expected)))
    }
}

/// Most faults of a file that the error lists: no one fixes more at once.
pub(super) const FAULTS_TOLD: usize = 50;

/// The faults of a robot file, in the file's order; at least one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigError {
    /// The faults, the first 50 of the file if there are more.
    pub faults: Vec<Fault>,
    /// Number of further faults.
    pub more: usize,
}

impl ConfigError {
    /// An error with these faults, in the file's order.
    pub(crate) fn of(mut faults: Vec<Fault>) -> ConfigError {
        faults.sort_by_key(|fault| fault.line);
        let more = faults.len().saturating_sub(FAULTS_TOLD);
        faults.truncate(FAULTS_TOLD);
        ConfigError { faults, more }
    }

    /// The message, a line each: the faults, and their number.
    pub fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.faults.iter().map(Fault::to_string).collect();
        let count = self.faults.len() + self.more;
        let counted = if count == 1 { "1 fault".to_owned() } else { format!("{count} faults") };
        lines.push(match self.more {
            0 => format!("{counted}; nothing was started"),
            more => format!("and {more} more: {counted}; nothing was started"),
        });
        lines
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().join("\n"))
    }
}

impl std::error::Error for ConfigError {}

impl From<Fault> for ConfigError {
    fn from(fault: Fault) -> ConfigError {
        ConfigError { faults: vec![fault], more: 0 }
    }
}
