//! Reads values of a robot or unit file by key, checks them, and notes every fault instead of stopping at the first.
//!
//! In: a parsed TOML document. Out: `Some` checked value, or `None` and a noted fault. The caller reads sections
//! through closures ([`Section::section`], [`Section::list`]); at the end of each closure the reader reports the
//! keys that the closure did not ask for. The module knows nothing of robots.

use std::cell::{Cell, RefCell};
use std::ops::RangeInclusive;

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml::value::{Date, Datetime};

use super::ConfigError;
use super::faults::Faults;
use super::keys::Keys;
use super::nearest::nearest;
use super::number::{LARGEST, Limits, real, whole};
use super::source::{Source, element};
use crate::printable::{is_unprintable, printable};

/// Longest text, characters: longer than any path of a device.
const TEXT_LONGEST: usize = 4096;
/// Longest name, letters.
const NAME_LONGEST: usize = 64;

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

    /// A text that is not blank.
    pub(super) fn text(&self, key: &'static str, meaning: &str) -> Option<&'a str> {
        let expected = format!("{meaning}, a text in quotes");
        self.describe(key, &expected, None);
        let text = self.required(key, &expected)?.as_str().filter(|text| !text.trim().is_empty());
        let Some(text) = text else {
            self.fault(key, expected);
            return None;
        };
        // The text is printed, and must not control the terminal.
        if let Some(bad) = text.chars().find(|c| is_unprintable(*c)) {
            let code = printable(bad.encode_utf8(&mut [0; 4])).into_owned();
            self.fault(
                key,
                format!("{expected}, of characters that are shown: {code} only steers a terminal"),
            );
            return None;
        }
        if text.chars().count() > TEXT_LONGEST {
            self.fault(key, format!("{expected}, of at most {TEXT_LONGEST} characters"));
            return None;
        }
        Some(text)
    }

    /// A text that is not blank; `Some(None)` if it is not set.
    pub(super) fn text_if_set(&self, key: &'static str, meaning: &str) -> Option<Option<&'a str>> {
        self.describe(key, &format!("{meaning}, a text in quotes"), Some("none".to_owned()));
        if self.has(key) { self.text(key, meaning).map(Some) } else { Some(None) }
    }

    /// A date without a time; `Some(None)` if it is not set.
    pub(super) fn date_if_set(&self, key: &'static str, meaning: &str) -> Option<Option<Date>> {
        self.describe(key, &format!("{meaning}, a date without quotes"), Some("none".to_owned()));
        let Some(value) = self.optional(key) else { return Some(None) };
        match value {
            DeValue::Datetime(Datetime { date: Some(date), time: None, offset: None }) => Some(Some(*date)),
            _ => {
                self.fault(key, format!("{meaning}, year, month and day without quotes: 2026-01-31"));
                None
            }
        }
    }

    /// A name that other keys may refer to: letters, digits, `_` and `-`.
    pub(super) fn name(&self, key: &'static str, meaning: &str) -> Option<&'a str> {
        let text = self.text(key, meaning)?;
        if text.len() <= NAME_LONGEST
            && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
        {
            return Some(text);
        }
        let made_of = "made of the letters a to z, digits, _ and -";
        self.fault(key, format!("{meaning}, {made_of}, at most {NAME_LONGEST} of them"));
        None
    }

    /// One of a list of words; returns its meaning.
    pub(super) fn choice<T: Clone>(
        &self,
        key: &'static str,
        meaning: &str,
        options: &[(&str, T)],
    ) -> Option<T> {
        let words: Vec<String> = options.iter().map(|(word, _)| format!("\"{word}\"")).collect();
        let expected = match words.as_slice() {
            [] => format!("{meaning}; there is none"),
            [only] => format!("{meaning}: {only}"),
            _ => format!("{meaning}: one of {}", words.join(", ")),
        };
        self.describe(key, &expected, None);
        let text = self.required(key, &expected)?.as_str();
        let found = options.iter().find(|(word, _)| Some(*word) == text);
        if found.is_none() {
            let near = text.and_then(|text| nearest(text, options.iter().map(|(word, _)| *word)));
            let advice = near.map(|near| format!("; did you mean \"{near}\"?")).unwrap_or_default();
            self.fault(key, expected + &advice);
        }
        found.map(|(_, value)| value.clone())
    }

    /// A name out of `names`, returned as its index there. If one of the names is itself faulty (`None`), a name
    /// that is not found is no fault.
    pub(super) fn reference(
        &self,
        key: &'static str,
        meaning: &str,
        names: &[Option<&str>],
    ) -> Option<usize> {
        self.describe(key, meaning, None);
        let options: Vec<(&str, usize)> =
            names.iter().enumerate().filter_map(|(place, name)| Some(((*name)?, place))).collect();
        if options.len() == names.len() {
            return self.choice(key, meaning, &options);
        }
        let text = self.text(key, meaning)?;
        options.iter().find(|(name, _)| *name == text).map(|(_, place)| *place)
    }

    /// True or false; `default` if it is not set.
    pub(super) fn flag_or(&self, key: &'static str, meaning: &str, default: bool) -> Option<bool> {
        self.describe(key, &format!("{meaning}: true or false"), Some(default.to_string()));
        let Some(value) = self.optional(key) else { return Some(default) };
        if value.as_bool().is_none() {
            self.fault(key, format!("{meaning}: true or false"));
        }
        value.as_bool()
    }

    /// A whole number.
    pub(super) fn integer(
        &self,
        key: &'static str,
        meaning: &str,
        range: RangeInclusive<u32>,
    ) -> Option<u32> {
        let expected = format!("{meaning}, a whole number from {} to {}", range.start(), range.end());
        self.describe(key, &expected, None);
        let value = whole(self.required(key, &expected)?).filter(|value| range.contains(value));
        if value.is_none() {
            self.fault(key, expected);
        }
        value
    }

    /// A whole number; `default` if it is not set.
    pub(super) fn integer_or(
        &self,
        key: &'static str,
        meaning: &str,
        range: RangeInclusive<u32>,
        default: u32,
    ) -> Option<u32> {
        let expected = format!("{meaning}, a whole number from {} to {}", range.start(), range.end());
        self.describe(key, &expected, Some(default.to_string()));
        if self.has(key) { self.integer(key, meaning, range) } else { Some(default) }
    }

    /// A finite number within limits.
    pub(super) fn number(&self, key: &'static str, meaning: &str, limits: Limits) -> Option<f64> {
        let expected = format!("{meaning}, {}", limits.words());
        self.describe(key, &expected, None);
        let value = self.required(key, &expected)?;
        self.limited(&self.path(key), value, meaning, limits)
    }

    /// A finite number within limits; `default` if it is not set.
    pub(super) fn number_or(
        &self,
        key: &'static str,
        meaning: &str,
        limits: Limits,
        default: f64,
    ) -> Option<f64> {
        self.describe(key, &format!("{meaning}, {}", limits.words()), Some(default.to_string()));
        if self.has(key) { self.number(key, meaning, limits) } else { Some(default) }
    }

    /// A list of exactly `N` numbers, each within limits.
    pub(super) fn numbers<const N: usize>(
        &self,
        key: &'static str,
        meaning: &str,
        limits: Limits,
    ) -> Option<[f64; N]> {
        let expected = format!("{meaning}, a list of {N} numbers");
        self.describe(key, &expected, None);
        let value = self.required(key, &expected)?;
        self.row(&self.path(key), value, meaning, limits)
    }

    /// The list of exactly `N` numbers at `path`.
    fn row<const N: usize>(
        &self,
        path: &str,
        value: &DeValue<'_>,
        meaning: &str,
        limits: Limits,
    ) -> Option<[f64; N]> {
        let Some(items) = value.as_array().filter(|items| items.len() == N) else {
            self.note(path, format!("{meaning}, a list of {N} numbers"));
            return None;
        };
        let mut values = [None; N];
        for (index, (value, item)) in values.iter_mut().zip(items.iter()).enumerate() {
            *value = self.limited(&element(path, index), item.get_ref(), meaning, limits);
        }
        let good = values.iter().all(Option::is_some);
        good.then(|| values.map(Option::unwrap_or_default))
    }

    /// A list of `count` finite numbers; of any length if the count is unknown.
    pub(super) fn number_list(
        &self,
        key: &'static str,
        meaning: &str,
        count: Option<usize>,
    ) -> Option<Vec<f64>> {
        let words = count.map_or_else(|| "numbers".to_owned(), |count| format!("{count} numbers"));
        let expected = format!("{meaning}, a list of {words}");
        self.describe(key, &format!("{meaning}, a list of numbers"), None);
        let items = self.required(key, &expected)?.as_array();
        let Some(items) = items.filter(|items| count.is_none_or(|count| items.len() == count)) else {
            self.fault(key, expected);
            return None;
        };
        let path = self.path(key);
        let values = items.iter().enumerate().map(|(place, item)| {
            self.limited(&element(&path, place), item.get_ref(), meaning, Limits::ANGLE)
        });
        let values: Vec<Option<f64>> = values.collect();
        values.into_iter().collect()
    }

    /// Three numbers along x, y, z.
    pub(super) fn vector(&self, key: &'static str, meaning: &str) -> Option<DVec3> {
        self.numbers(key, &format!("{meaning} along x, y, z"), Limits::PLACE).map(DVec3::from_array)
    }

    /// Three numbers; `default` if they are not set.
    pub(super) fn vector_or(&self, key: &'static str, meaning: &str, default: DVec3) -> Option<DVec3> {
        let expected = format!("{meaning} along x, y, z, a list of 3 numbers");
        self.describe(key, &expected, Some(format!("{:?}", default.to_array())));
        if self.has(key) { self.vector(key, meaning) } else { Some(default) }
    }

    /// A list of vectors (three numbers along x, y, z each); its length must lie in `range`.
    pub(super) fn vectors(
        &self,
        key: &'static str,
        meaning: &str,
        range: std::ops::RangeInclusive<usize>,
    ) -> Option<Vec<DVec3>> {
        let (least, most) = (range.start(), range.end());
        let expected = format!("{meaning} along x, y, z, a list of {least} to {most} lists of 3 numbers");
        self.describe(key, &expected, None);
        let value = self.required(key, &expected)?;
        let Some(items) = value.as_array().filter(|items| range.contains(&items.len())) else {
            self.fault(key, expected);
            return None;
        };
        let path = self.path(key);
        let row = |(index, item): (usize, &toml::Spanned<DeValue<'_>>)| {
            self.row(&element(&path, index), item.get_ref(), meaning, Limits::PLACE).map(DVec3::from_array)
        };
        // Reads all of them, so that all faults are reported.
        let rows: Vec<Option<DVec3>> = items.iter().enumerate().map(row).collect();
        rows.into_iter().collect()
    }

    fn limited(&self, path: &str, value: &DeValue<'_>, meaning: &str, limits: Limits) -> Option<f64> {
        let number = real(value);
        let good = number.filter(|number| number.abs() <= LARGEST && limits.contains(*number));
        if good.is_none() {
            let finite = match number {
                Some(number) if number.is_nan() || number.abs() > LARGEST => {
                    format!(", finite and at most {LARGEST:e} in size")
                }
                _ => String::new(),
            };
            self.note(path, format!("{meaning}, {}{finite}", limits.words()));
        }
        good
    }

    /// Reads a table of this section.
    pub(super) fn section<T>(
        &self,
        key: &'static str,
        meaning: &str,
        read: impl FnOnce(&Section<'a>) -> Option<T>,
    ) -> Option<T> {
        let expected = format!("{meaning}, a table");
        self.describe(key, &expected, None);
        let value = self.required(key, &expected)?;
        self.enter(&self.path(key), value, meaning, read)
    }

    /// Reads a table of this section as [`Section::section`] does; if it is not set, as if it were empty.
    pub(super) fn section_or_empty<T>(
        &self,
        key: &'static str,
        meaning: &str,
        read: impl FnOnce(&Section<'a>) -> Option<T>,
    ) -> Option<T> {
        self.describe(key, &format!("{meaning}, a table"), Some("the defaults of its keys".to_owned()));
        if self.has(key) {
            return self.section(key, meaning, read);
        }
        Section::new(self.file, self.path(key), None).read(read)
    }

    /// Reads a list of at most `most` tables; an empty list if it is not set, `None` in place of each faulty one.
    pub(super) fn list<T>(
        &self,
        key: &'static str,
        meaning: &str,
        most: usize,
        mut read: impl FnMut(&Section<'a>) -> Option<T>,
    ) -> Vec<Option<T>> {
        self.describe(key, &format!("{meaning}, a list of at most {most} tables"), Some("none".to_owned()));
        let Some(value) = self.optional(key) else { return Vec::new() };
        let path = self.path(key);
        let Some(items) = value.as_array() else {
            self.fault(key, format!("{meaning}, a list of tables: write [[{}]]", list_header(&path)));
            return vec![None];
        };
        if items.len() > most {
            self.fault(key, format!("{meaning}, a list of at most {most} tables; these are {}", items.len()));
            return vec![None];
        }
        let items = items.iter().enumerate();
        items.map(|(i, item)| self.enter(&element(&path, i), item.get_ref(), meaning, &mut read)).collect()
    }

    fn enter<T>(
        &self,
        path: &str,
        value: &'a DeValue<'a>,
        meaning: &str,
        read: impl FnOnce(&Section<'a>) -> Option<T>,
    ) -> Option<T> {
        match value.as_table() {
            Some(entries) => Section::new(self.file, path.to_owned(), Some(entries)).read(read),
            None => {
                self.note(path, format!("{meaning}, a table"));
                None
            }
        }
    }
}

/// A path without its list indices, as written in a header.
fn list_header(path: &str) -> String {
    path.split('.').map(|key| key.split('[').next().unwrap_or(key)).collect::<Vec<_>>().join(".")
}
