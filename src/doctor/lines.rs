//! The findings, one line each.

use serde::Serialize;

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// As it should be.
    Ok,
    /// The robot works, but not as well as it could, or not for long.
    Warning,
    /// The robot does not work.
    Fault,
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Line {
    /// How bad it is.
    pub verdict: Verdict,
    /// Its subject: a file, the machine, a bus, a servo with its joint.
    pub about: String,
    /// What was found.
    pub found: String,
    /// What to do; `None` if all is well.
    pub cure: Option<String>,
}

/// The lines so far, reported as they come.
pub struct Lines<'t> {
    all: Vec<Line>,
    tell: &'t mut dyn FnMut(&Line),
}

impl std::fmt::Debug for Lines<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lines").field("all", &self.all).finish_non_exhaustive()
    }
}

impl<'t> Lines<'t> {
    /// No lines yet; `tell` gets each new one.
    pub fn new(tell: &'t mut dyn FnMut(&Line)) -> Lines<'t> {
        Lines { all: Vec::new(), tell }
    }

    /// Adds a line: all is well.
    pub fn ok(&mut self, about: &str, found: impl Into<String>) {
        self.add(Verdict::Ok, about, found.into(), None);
    }

    /// Adds a warning.
    pub fn warning(&mut self, about: &str, found: impl Into<String>, cure: impl Into<String>) {
        self.add(Verdict::Warning, about, found.into(), Some(cure.into()));
    }

    /// Adds a fault.
    pub fn fault(&mut self, about: &str, found: impl Into<String>, cure: impl Into<String>) {
        self.add(Verdict::Fault, about, found.into(), Some(cure.into()));
    }

    fn add(&mut self, verdict: Verdict, about: &str, found: String, cure: Option<String>) {
        let line = Line { verdict, about: about.to_owned(), found, cure };
        (self.tell)(&line);
        self.all.push(line);
    }

    /// Number of lines.
    pub(super) fn count(&self) -> usize {
        self.all.len()
    }

    /// All of them.
    pub fn into_all(self) -> Vec<Line> {
        self.all
    }
}
