//! Where in a robot file each key stands.
//!
//! Comes in: the file's text and its parsed document. Goes out: line and value text of any key path, for
//! faults found while reading and for checks made long after (reach, loop rate).

use std::collections::BTreeMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::fault::Fault;

/// Longest piece of a file repeated in a fault, characters.
const VALUE_SHOWN: usize = 60;

/// Line and text of one value.
#[derive(Debug, Clone)]
struct Place {
    line: usize,
    text: String,
}

/// A file's name and the place of every key in it.
#[derive(Debug, Clone)]
pub(super) struct Source {
    file: String,
    places: BTreeMap<String, Place>,
}

impl Source {
    /// Notes where everything in `document`, parsed from `text`, stands.
    pub(super) fn new(file: &str, text: &str, document: &DeTable<'_>) -> Source {
        let mut source = Source { file: file.to_owned(), places: BTreeMap::new() };
        source.add_table(text, "", document);
        source
    }

    /// A fault at a key; where the key is not set, at the section that lacks it.
    pub(super) fn fault(&self, key: &str, expected: impl Into<String>) -> Fault {
        let place = self.places.get(key);
        let mut section = key;
        let mut line = place.map(|place| place.line);
        while line.is_none() && !section.is_empty() {
            section = parent(section);
            line = self.places.get(section).map(|place| place.line);
        }
        Fault {
            file: self.file.clone(),
            line: line.unwrap_or(1),
            column: None,
            key: key.to_owned(),
            value: place.map(|place| place.text.clone()),
            expected: expected.into(),
        }
    }

    /// The line a key stands on, if it is set.
    pub(super) fn line(&self, key: &str) -> Option<usize> {
        self.places.get(key).map(|place| place.line)
    }

    fn add_table(&mut self, text: &str, path: &str, table: &DeTable<'_>) {
        for (key, value) in table {
            self.add(text, join(path, key.get_ref()), key.span().start, value);
        }
    }

    fn add(&mut self, text: &str, path: String, start: usize, value: &Spanned<DeValue<'_>>) {
        match value.get_ref() {
            DeValue::Table(table) => self.add_table(text, &path, table),
            DeValue::Array(items) => {
                for (index, item) in items.iter().enumerate() {
                    self.add(text, element(&path, index), item.span().start, item);
                }
            }
            _ => {}
        }
        let place = Place { line: line_of(text, start), text: shown(text, value.span()) };
        self.places.insert(path, place);
    }
}

/// Path of a key in a section; the top of the file is the section "".
pub(super) fn join(section: &str, key: &str) -> String {
    let is_bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    let key = if is_bare { key.to_owned() } else { format!("{key:?}") };
    if section.is_empty() { key } else { format!("{section}.{key}") }
}

/// Path of one place in a list, counted from 0.
pub(super) fn element(list: &str, index: usize) -> String {
    format!("{list}[{index}]")
}

/// The section or list that holds a key.
fn parent(path: &str) -> &str {
    path.rfind(['.', '[']).map_or("", |end| &path[..end])
}

/// Line of a byte, from 1.
pub(super) fn line_of(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|b| *b == b'\n').count()
}

/// Column of a byte in its line, from 1, in characters.
pub(super) fn column_of(text: &str, byte: usize) -> usize {
    text.char_indices()
        .take_while(|(at, _)| *at < byte)
        .fold(1, |column, (_, c)| if c == '\n' { 1 } else { column + 1 })
}

/// A piece of the file on one line, shortened.
pub(super) fn shown(text: &str, span: Range<usize>) -> String {
    let piece = text.get(span).unwrap_or_default();
    let line = piece.lines().map(str::trim).collect::<Vec<_>>().join(" ");
    if line.chars().count() <= VALUE_SHOWN {
        return line;
    }
    line.chars().take(VALUE_SHOWN).chain("...".chars()).collect()
}
