//! The keys that a file may have; the reader itself provides them: it notes every key it asks for.

use super::reader::File;
use super::source::Source;
use super::{ConfigError, parse, read_robot};
use toml::de::DeTable;

/// One key of the schema.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// Its path, with `[]` for a list index: `chain[].joint[].range_deg`.
    pub path: String,
    /// Its meaning and its allowed values, in words.
    pub expected: String,
    /// Its default, in words; `None` if it must be set.
    pub default: Option<String>,
}

/// Keys in the order in which they were first asked for.
#[derive(Debug, Clone, Default)]
pub(super) struct Keys(Vec<Key>);

impl Keys {
    /// Notes a key. The first description of a key holds.
    pub(super) fn note(&mut self, path: &str, expected: &str, default: Option<String>) {
        let path = without_places(path);
        match self.0.iter_mut().find(|key| key.path == path) {
            None => self.0.push(Key { path, expected: expected.to_owned(), default }),
            Some(key) if key.expected.is_empty() => key.expected = expected.to_owned(),
            Some(_) => {}
        }
    }
}

/// Every key that reading the robot file `text` asks for, set or not, in that order. Keys of parts that `text`
/// lacks (a gait, another kind of motion) are not among them; limits that depend on other values are those of
/// `text`.
///
/// # Errors
/// Every fault of the text.
pub fn robot_file_keys(text: &str) -> Result<Vec<Key>, ConfigError> {
    parse(text, "robot file")?;
    let (document, _) = DeTable::parse_recoverable(text);
    let document = document.get_ref();
    let file = File::new(Source::new("robot file", text, document));
    file.read(document, read_robot);
    Ok(file.keys().0)
}

/// `chain[0].joint[12].name` becomes `chain[].joint[].name`.
fn without_places(path: &str) -> String {
    let mut pieces = path.split('[');
    let first = pieces.next().unwrap_or_default().to_owned();
    pieces.fold(first, |path, piece| match piece.split_once(']') {
        Some((_, rest)) => path + "[]" + rest,
        None => path + "[" + piece,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn list_indices_are_left_out() {
        assert_eq!(without_places("chain[0].joint[12].range_deg[1]"), "chain[].joint[].range_deg[]");
        assert_eq!(without_places("name"), "name");
    }

    #[test]
    fn the_first_description_of_a_key_holds() {
        let mut keys = Keys::default();
        keys.note("a[0].b", "", Some("what fits".to_owned()));
        keys.note("a[1].b", "a number", Some("7".to_owned()));
        keys.note("a[2].b", "a text", None);
        let expected =
            Key { path: "a[].b".into(), expected: "a number".into(), default: Some("what fits".into()) };
        assert_eq!(keys.0, [expected]);
    }
}
