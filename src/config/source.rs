//! The place of each key in a robot file.
//!
//! In: the file's text and its parsed document. Out: line and value text of any key path, for faults found while
//! reading and for later checks (reach, loop rate). Time and memory are a small multiple of the file's size,
//! whatever the file contains.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::fault::Fault;
use crate::printable::printable;

/// Longest piece of a file that a fault quotes, characters.
const PIECE_SHOWN: usize = 60;
/// Bytes searched for that piece: leading blanks of its lines are not shown.
const PIECE_LOOKED_AT: usize = 4096;

/// The offsets at which the lines of a text begin.
#[derive(Debug, Clone)]
pub(super) struct Lines(Vec<usize>);

impl Lines {
    pub(super) fn of(text: &str) -> Lines {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Lines(std::iter::once(0).chain(ends.map(|(end, _)| end + 1)).collect())
    }

    /// Line of a byte, from 1.
    pub(super) fn line_of(&self, byte: usize) -> usize {
        self.0.partition_point(|begin| *begin <= byte)
    }

    /// Column of a byte of `text` in its line, from 1, in characters.
    pub(super) fn column_of(&self, text: &str, byte: usize) -> usize {
        let begin = self.0[self.line_of(byte) - 1];
        1 + text[begin..].char_indices().take_while(|(at, _)| begin + at < byte).count()
    }
}

/// The span of one value, in bytes, and of the values inside it.
#[derive(Debug, Clone)]
struct Place {
    /// Start of its key, or of the value if it has no key.
    start: usize,
    span: Range<usize>,
    inside: Nested,
}

#[derive(Debug, Clone)]
enum Nested {
    Nothing,
    Table(BTreeMap<String, Place>),
    List(Vec<Place>),
}

/// A file's name, its text and the place of every key in it.
#[derive(Debug, Clone)]
pub(super) struct Source {
    file: String,
    text: String,
    lines: Lines,
    top: Nested,
}

impl Source {
    /// Notes the place of everything in `document`, parsed from `text`.
    pub(super) fn new(file: &str, text: &str, document: &DeTable<'_>) -> Source {
        Source { file: file.to_owned(), text: text.to_owned(), lines: Lines::of(text), top: table(document) }
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// A fault at a key; if the key is not set, at the section that lacks it.
    pub(super) fn fault(&self, key: &str, expected: impl Into<String>) -> Fault {
        self.fault_in(self.nearest_line(key), key.to_owned(), self.find(key), expected.into())
    }

    /// A fault at an unknown key of the section at the path `section`.
    pub(super) fn fault_at_unknown(&self, section: &str, key: &str, expected: String) -> Fault {
        let line = self.line_of_unknown(section, key);
        self.fault_in(line, join(section, key), self.unknown(section, key), expected)
    }

    fn fault_in(&self, line: usize, key: String, place: Option<&Place>, expected: String) -> Fault {
        let value = place.map(|place| shown(&self.text, place.span.clone()));
        Fault { file: self.file.clone(), line, column: None, key, value, expected }
    }

    /// The line of an unknown key.
    pub(super) fn line_of_unknown(&self, section: &str, key: &str) -> usize {
        self.unknown(section, key).map_or(1, |place| self.line_of(place))
    }

    /// The line a key stands on, if it is set.
    pub(super) fn line(&self, key: &str) -> Option<usize> {
        self.find(key).map(|place| self.line_of(place))
    }

    /// The line of a key, or of the innermost section around it that is set.
    pub(super) fn nearest_line(&self, key: &str) -> usize {
        self.way(key).last().map_or(1, |place| self.line_of(place))
    }

    fn line_of(&self, place: &Place) -> usize {
        self.lines.line_of(place.start)
    }

    fn unknown(&self, section: &str, key: &str) -> Option<&Place> {
        let inside = if section.is_empty() { &self.top } else { &self.find(section)?.inside };
        if let Nested::Table(keys) = inside { keys.get(key) } else { None }
    }

    fn find(&self, key: &str) -> Option<&Place> {
        self.way(key).nth(pieces(key).count() - 1)
    }

    /// The places along a path of known keys, as far as they are set.
    fn way(&self, key: &str) -> impl Iterator<Item = &Place> {
        pieces(key).scan(Some(&self.top), |inside, piece| {
            let place = match inside.take()? {
                Nested::Table(keys) => keys.get(piece)?,
                Nested::List(items) => items.get(piece.parse::<usize>().ok()?)?,
                Nested::Nothing => return None,
            };
            *inside = Some(&place.inside);
            Some(place)
        })
    }
}

/// `chain[1].name` in pieces: `chain`, `1`, `name`.
fn pieces(path: &str) -> impl Iterator<Item = &str> {
    path.split(['.', '[']).map(|piece| piece.trim_end_matches(']'))
}

fn table(table: &DeTable<'_>) -> Nested {
    let entries = table.iter();
    Nested::Table(
        entries.map(|(key, value)| (key.get_ref().to_string(), place(key.span().start, value))).collect(),
    )
}

fn place(start: usize, value: &Spanned<DeValue<'_>>) -> Place {
    let inside = match value.get_ref() {
        DeValue::Table(inner) => table(inner),
        DeValue::Array(items) => {
            Nested::List(items.iter().map(|item| place(item.span().start, item)).collect())
        }
        _ => Nested::Nothing,
    };
    Place { start, span: value.span(), inside }
}

/// Path of a key in a section, shortened if needed; the top of the file is the section "".
fn join(section: &str, key: &str) -> String {
    let is_bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    let key = shortened(key.chars());
    let key = if is_bare { key } else { format!("\"{}\"", printable(&key)) };
    if section.is_empty() { key } else { format!("{section}.{key}") }
}

/// Path of one element of a list, index from 0.
pub(super) fn element(list: &str, index: usize) -> String {
    format!("{list}[{index}]")
}

/// A piece of the file on one line, shortened.
fn shown(text: &str, span: Range<usize>) -> String {
    let piece = text.as_bytes().get(span).unwrap_or_default();
    let piece: Cow<'_, str> = String::from_utf8_lossy(&piece[..piece.len().min(PIECE_LOOKED_AT)]);
    let line = piece.lines().map(str::trim).collect::<Vec<_>>().join(" ");
    shortened(line.chars())
}

fn shortened(characters: impl Iterator<Item = char>) -> String {
    let mut characters = characters.peekable();
    let mut shown: String = characters.by_ref().take(PIECE_SHOWN).collect();
    if characters.peek().is_some() {
        shown += "...";
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "a = 1\n[b]\nc = [1,\n  [2, 3]]\n\"d.e[\" = 4\n[[f]]\ng = 5\n[[f]]\ng = 'grün' # x\n";

    #[test]
    fn every_key_is_found_by_its_path_and_a_missing_one_at_its_section() {
        let (document, _) = DeTable::parse_recoverable(TEXT);
        let source = Source::new("x.toml", TEXT, document.get_ref());
        for (key, line, value) in [
            ("a", 1, Some("1")),
            ("b.c", 3, Some("[1, [2, 3]]")),
            ("b.c[1][0]", 4, Some("2")),
            ("f[1].g", 9, Some("'grün'")),
            ("f[1].h", 8, None),
            ("b.x.y", 2, None),
            ("x", 1, None),
            ("f[7].g", 6, None),
            ("f[x", 6, None),
            ("a.b", 1, None),
        ] {
            let fault = source.fault(key, "");
            assert_eq!((fault.line, fault.value.as_deref()), (line, value), "{key}");
            assert_eq!(source.line(key), value.map(|_| line), "{key}");
        }
        let fault = source.fault_at_unknown("b", "d.e[", String::new());
        assert_eq!((fault.line, fault.key.as_str(), fault.value.as_deref()), (5, "b.\"d.e[\"", Some("4")));
    }

    #[test]
    fn columns_count_characters() {
        let lines = Lines::of(TEXT);
        let at = TEXT.find('#').unwrap();
        assert_eq!((lines.line_of(at), lines.column_of(TEXT, at)), (9, 12));
        assert_eq!((lines.line_of(TEXT.len()), lines.column_of(TEXT, TEXT.len())), (10, 1));
    }

    #[test]
    fn long_pieces_and_keys_are_shortened() {
        let long = "ü".repeat(10_000);
        assert_eq!(shown(&long, 0..long.len()).chars().count(), PIECE_SHOWN + 3);
        assert_eq!(join("a", &"k".repeat(61)), format!("a.{}...", "k".repeat(60)));
        assert_eq!(join("", &"k".repeat(60)), "k".repeat(60));
        assert_eq!(join("", "\u{1b}[2J\n"), "\"\\u001b[2J\\n\"");
    }
}
