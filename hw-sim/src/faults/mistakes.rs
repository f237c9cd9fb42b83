//! What is wrong with a fault script: every mistake counted, as many kept as are told.

use std::fmt;

/// Most mistakes of a script that are told one by one: nobody mends more at once.
const TOLD: usize = 50;

/// One thing wrong with a fault script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// Line, from 1.
    pub line: usize,
    /// Path of the key, places of the list from 0: `fault[1].kind`. Empty where the text is not TOML.
    pub key: String,
    /// The value as it stands there; none where the key is not set.
    pub value: Option<String>,
    /// What was expected.
    pub expected: String,
}

/// What is wrong with a fault script, in its order; at least one mistake.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct FaultError {
    /// What the script is called.
    pub file_name: String,
    /// The mistakes, the first 50 of the script if there are more.
    pub mistakes: Vec<Mistake>,
    /// How many more there are.
    pub more: usize,
}

/// The mistakes found so far.
#[derive(Debug, Default)]
pub(super) struct Mistakes {
    kept: Vec<Mistake>,
    count: usize,
}

impl Mistakes {
    /// Notes a mistake in this line; it is only made where it is one of the first.
    pub(super) fn note(&mut self, line: usize, make: impl FnOnce() -> Mistake) {
        self.count += 1;
        // Of two in one line the one noted first stands first.
        let place = self.kept.partition_point(|kept| kept.line <= line);
        if place < TOLD {
            self.kept.truncate(TOLD - 1);
            self.kept.insert(place, make());
        }
    }

    /// Notes one that is made already.
    pub(super) fn push(&mut self, mistake: Mistake) {
        self.note(mistake.line, || mistake);
    }

    /// What is wrong with the script called `file_name`; none if nothing is.
    pub(super) fn finish(self, file_name: &str) -> Option<FaultError> {
        let more = self.count - self.kept.len();
        let error = FaultError { file_name: file_name.to_owned(), mistakes: self.kept, more };
        (self.count > 0).then_some(error)
    }
}

impl FaultError {
    /// How many mistakes there are.
    pub fn count(&self) -> usize {
        self.mistakes.len() + self.more
    }

    /// What it says, a line each. What is in the script is in it as it stands there.
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
