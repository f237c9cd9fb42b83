//! What is wrong with a robot file, said so that its writer can mend it.
//!
//! Comes in: where and what, from the reader and from later checks. Goes out: one line a fault.

use std::fmt;

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

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
        }
        if let Some(column) = self.column {
            write!(f, ":{column}")?;
        }
        match (self.key.is_empty(), &self.value) {
            (true, None) => {}
            (true, Some(value)) => write!(f, ": {value}")?,
            (false, None) => write!(f, ": {} is not set", self.key)?,
            (false, Some(value)) => write!(f, ": {} = {value}", self.key)?,
        }
        write!(f, ": expected {}", self.expected)
    }
}

/// All that is wrong with a robot file, in the file's order; at least one fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigError {
    /// The faults.
    pub faults: Vec<Fault>,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for fault in &self.faults {
            writeln!(f, "{fault}")?;
        }
        match self.faults.len() {
            1 => f.write_str("1 fault; nothing was started"),
            count => write!(f, "{count} faults; nothing was started"),
        }
    }
}

impl std::error::Error for ConfigError {}

impl From<Fault> for ConfigError {
    fn from(fault: Fault) -> ConfigError {
        ConfigError { faults: vec![fault] }
    }
}
