//! Mistakes in a fault script: all are counted, and the first ones kept for the error message.

use std::fmt;

/// Most mistakes of a script that the error lists: no one fixes more at once.
const TOLD: usize = 50;

/// One mistake in a fault script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// Line, from 1.
    pub line: usize,
    /// Path of the key, with list indices from 0: `fault[1].kind`. Empty if the text is not TOML.
    pub key: String,
    /// The value in the script; `None` if the key is not set.
    pub value: Option<String>,
    /// What was expected.
    pub expected: String,
}

/// The mistakes in a fault script, in its order; at least one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct FaultError {
    /// Name of the script.
    pub file_name: String,
    /// The mistakes, the first 50 of the script if there are more.
    pub mistakes: Vec<Mistake>,
    /// Number of further mistakes.
    pub more: usize,
}

/// The mistakes found so far.
#[derive(Debug, Default)]
pub(super) struct Mistakes {
    kept: Vec<Mistake>,
    count: usize,
}

impl Mistakes {
    /// Notes a mistake in this line; calls `make` only if the mistake is among the first.
    pub(super) fn note(&mut self, line: usize, make: impl FnOnce() -> Mistake) {
        self.count += 1;
        // If a line has two mistakes, the one noted first stands first.
        let place = self.kept.partition_point(|kept| kept.line <= line);
        if place < TOLD {
            self.kept.truncate(TOLD - 1);
            self.kept.insert(place, make());
        }
    }

    /// Notes a mistake that is already made.
    pub(super) fn push(&mut self, mistake: Mistake) {
        self.note(mistake.line, || mistake);
    }

    /// The mistakes in the script called `file_name`; `None` if there are none.
    pub(super) fn finish(self, file_name: &str) -> Option<FaultError> {
        let more = self.count - self.kept.len();
        let error = FaultError { file_name: file_name.to_owned(), mistakes: self.kept, more };
        (self.count > 0).then_some(error)
    }
}

impl FaultError {
    /// Number of mistakes.
    pub fn count(&self) -> usize {
        self.mistakes.len() + self.more
    }

    /// The message, one line for each mistake. Text from the script appears unchanged.
    pub fn lines(&self) -> Vec<String> {
        let line = |Mistake { line, key, value, expected }: &Mistake| {
            let found = match value {
                _ if key.is_empty() => String::new(),
                Some(value) => format!(" = {value}: "),
                None => " is not set: ".to_owned(),
            };
            format!("{}:{line}: {key}{found}expected {expected}", self.file_name)
        };
        let more = (self.more > 0).then(|| format!("and {} more", self.more));
        self.mistakes.iter().map(line).chain(more).collect()
    }
}

impl fmt::Display for FaultError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().join("\n"))
    }
}
