//! What is wrong with a robot file, said so that its writer can mend it.
//!
//! Comes in: where and what, from the reader and from later checks. Goes out: one line a fault.

use std::fmt;

use crate::printable::printable;

/// One thing wrong with a robot file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// The file, as it was named when it was loaded.
    pub file: String,
    /// Line, from 1; 0 where the fault is the file as a whole.
    pub line: usize,
    /// Column, from 1, counted in characters; only where the text is not TOML at all.
    pub column: Option<usize>,
    /// Path of the key, list places counted from 0: `chain[1].joint[2].range_deg`. Empty where no key is meant.
    pub key: String,
    /// The value as it stands in the file, shortened; none where the key is not set.
    pub value: Option<String>,
    /// What was expected and, where that does not say it already, what to do.
    pub expected: String,
}

/// One line, whatever characters the file, its name and the key are made of.
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

/// Most faults of a file that are told one by one: nobody mends more at once.
pub(super) const FAULTS_TOLD: usize = 50;

/// What is wrong with a robot file, in the file's order; at least one fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigError {
    /// The faults, the first 50 of the file if there are more.
    pub faults: Vec<Fault>,
    /// How many more there are.
    pub more: usize,
}

impl ConfigError {
    /// These faults, in the file's order.
    pub(crate) fn of(mut faults: Vec<Fault>) -> ConfigError {
        faults.sort_by_key(|fault| fault.line);
        let more = faults.len().saturating_sub(FAULTS_TOLD);
        faults.truncate(FAULTS_TOLD);
        ConfigError { faults, more }
    }

    /// What it says, a line each: the faults, and how many there are.
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
