//! Reads values of a robot or unit file by key, checks them, and notes every fault instead of stopping at the first.
//!
//! In: a parsed TOML document. Out: `Some` checked value, or `None` and a noted fault. The caller reads sections
//! through closures ([`Section::section`], [`Section::list`]); at the end of each closure the reader reports the
//! keys that the closure did not ask for. The module knows nothing of robots.
//!
//! `words`, `numbers` and `tables` read values of these kinds.

mod numbers;
mod tables;
mod words;

use std::cell::{Cell, RefCell};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::ConfigError;
use super::faults::Faults;
use super::keys::Keys;
use super::nearest::nearest;
use super::source::Source;

/// State that all sections of one file share.
pub(super) struct File {
    source: Source,
    faults: RefCell<Faults>,
    /// Every key that was asked for, set or not.
    keys: RefCell<Keys>,
}

impl File {
    /// A file without faults so far.
    pub(super) fn new(source: Source) -> File {
        File { source, faults: RefCell::default(), keys: RefCell::default() }
    }

    /// Reads the whole document.
    pub(super) fn read<'a, T>(
        &'a self,
        document: &'a DeTable<'a>,
        read: impl FnOnce(&Section<'a>) -> T,
    ) -> T {
        Section::new(self, String::new(), Some(document)).read(read)
    }

    /// Every key that was asked for.
    pub(super) fn keys(&self) -> Keys {
        self.keys.borrow().clone()
    }

    /// The source, and the noted faults, if there are any.
    pub(super) fn finish(self) -> (Source, Option<ConfigError>) {
        (self.source, self.faults.into_inner().finish())
    }
}

/// Keys that had another name once, which files may still use; and their name of today.
const OLD_KEYS: [(&str, &str); 6] = [
    ("bob_mm", "vertical_oscillation_mm"),
    ("bobs_per_stride", "vertical_oscillations_per_stride"),
    ("bob_highest_at", "vertical_oscillation_highest_at"),
    ("lags", "phase_offsets"),
    ("fore_hind_lag", "fore_hind_phase_offset"),
    ("left_right_lag", "left_right_phase_offset"),
];

/// One table of the file while it is read.
pub(super) struct Section<'a> {
    file: &'a File,
    path: String,
    entries: Option<&'a DeTable<'a>>,
    known: RefCell<Vec<&'static str>>,
    is_open: Cell<bool>,
}

impl<'a> Section<'a> {
    fn new(file: &'a File, path: String, entries: Option<&'a DeTable<'a>>) -> Section<'a> {
        Section { file, path, entries, known: RefCell::default(), is_open: Cell::new(false) }
    }

    fn read<T>(self, read: impl FnOnce(&Section<'a>) -> T) -> T {
        let result = read(&self);
        if !self.is_open.get() {
            self.refuse_unknown_keys();
        }
        result
    }

    /// Accepts unknown keys: for a section of unknown kind, whose keys are unknown too.
    pub(super) fn allow_unknown_keys(&self) {
        self.is_open.set(true);
    }

    fn refuse_unknown_keys(&self) {
        let known = self.known.borrow();
        for key in self.entries.into_iter().flat_map(DeTable::keys).map(|key| key.get_ref().as_ref()) {
            if known.contains(&key) {
                continue;
            }
            let source = &self.file.source;
            let line = source.line_of_unknown(&self.path, key);
            self.file.faults.borrow_mut().note(line, || {
                let advice = match nearest(key, known.iter().copied()) {
                    Some(near) => format!("a known key here; did you mean {near}?"),
                    None => format!("a known key here; known are {}", known.join(", ")),
                };
                source.fault_at_unknown(&self.path, key, advice)
            });
        }
    }

    /// Full path of a key of this section, or of one nested deeper, such as `joint[2].link_mm`.
    /// A key goes by the name that the file uses, which may be an old one.
    fn path(&self, key: &str) -> String {
        let end = key.find(['.', '[']).unwrap_or(key.len());
        let now = &key[..end];
        let is_set = self.entries.is_some_and(|entries| entries.contains_key(now));
        let name = self.older(now).filter(|_| !is_set).unwrap_or(now);
        let dot = if self.path.is_empty() { "" } else { "." };
        format!("{}{dot}{name}{}", self.path, &key[end..])
    }

    /// Notes a fault at a key of this section, or at one nested deeper.
    pub(super) fn fault(&self, key: &str, expected: impl Into<String>) {
        self.note(&self.path(key), expected);
    }

    /// Notes the expected value of a key and its default, in words; `None` if it must be set.
    fn describe(&self, key: &str, expected: &str, default: Option<String>) {
        self.file.keys.borrow_mut().note(&self.path(key), expected, default);
    }

    /// Describes in words the default of a key if that is computed; and the meaning of a key that is read only if
    /// it is set.
    pub(super) fn describe_default(&self, key: &str, meaning: &str, default: &str) {
        self.describe(key, meaning, Some(default.to_owned()));
    }

    fn note(&self, path: &str, expected: impl Into<String>) {
        let source = &self.file.source;
        self.file.faults.borrow_mut().note(source.nearest_line(path), || source.fault(path, expected));
    }

    /// Line of a key of this section; 0 if it is not set.
    pub(super) fn line(&self, key: &str) -> usize {
        self.file.source.line(&self.path(key)).unwrap_or(0)
    }

    /// True if the key is set.
    pub(super) fn has(&self, key: &'static str) -> bool {
        self.optional(key).is_some()
    }

    fn optional(&self, key: &'static str) -> Option<&'a DeValue<'a>> {
        self.know(key);
        let entries = self.entries?;
        let (found, older) = (entries.get(key), self.older(key));
        if let Some(old) = older
            && self.know(old)
            && found.is_some()
        {
            self.fault(old, format!("either {old}, an old name, or {key}, not both"));
        }
        found.or_else(|| entries.get(older?)).map(Spanned::get_ref)
    }

    /// The old name of the key `now`, if the file uses it.
    fn older(&self, now: &str) -> Option<&'static str> {
        let old = OLD_KEYS.iter().find(|(_, known)| *known == now)?.0;
        self.entries?.contains_key(old).then_some(old)
    }

    /// Makes `key` a known one; true if it was not.
    fn know(&self, key: &'static str) -> bool {
        let mut known = self.known.borrow_mut();
        let is_new = !known.contains(&key);
        if is_new {
            known.push(key);
        }
        is_new
    }

    fn required(&self, key: &'static str, expected: &str) -> Option<&'a DeValue<'a>> {
        let value = self.optional(key);
        if value.is_none() {
            self.fault(key, expected);
        }
        value
    }
}
