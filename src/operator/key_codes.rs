//! Converts bytes of a terminal to keys (ECMA-48 control sequences, which every terminal sends for its arrows).

/// A key that was pressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// Arrow up.
    Up,
    /// Arrow down.
    Down,
    /// Arrow to the left.
    Left,
    /// Arrow to the right.
    Right,
    /// Escape by itself.
    Escape,
    /// A character of ASCII; letters in lower case, whatever Shift and Caps Lock say.
    Character(char),
    /// No key: the terminal is gone.
    Gone,
}

/// Position of the decoder in a sequence of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Place {
    #[default]
    Between,
    /// After an escape, which is either the Escape key or the start of another key's sequence.
    Escape,
    /// In a control sequence, whose last byte tells the key.
    Sequence,
    /// Before the last byte of the short form that some terminals use.
    Short,
}

/// Assembles keys from bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Decoder {
    place: Place,
}

impl Decoder {
    /// The keys that `byte` completes, in their order.
    pub fn push(&mut self, byte: u8) -> [Option<Key>; 2] {
        let place = std::mem::take(&mut self.place);
        match (place, byte) {
            (Place::Between, 0x1b) => self.place = Place::Escape,
            (Place::Between, _) => return [character(byte), None],
            (Place::Escape, b'[') => self.place = Place::Sequence,
            (Place::Escape, b'O') => self.place = Place::Short,
            // No key has such a sequence: it was Escape, followed by another key.
            (Place::Escape, _) => {
                let [after, _] = self.push(byte);
                return [Some(Key::Escape), after];
            }
            (Place::Sequence | Place::Short, 0x1b) => self.place = Place::Escape,
            (Place::Sequence, 0x20..=0x3f) => self.place = Place::Sequence,
            (Place::Sequence | Place::Short, _) => return [arrow(byte), None],
        }
        [None, None]
    }

    /// True in the middle of a sequence: if then nothing comes, the caller must call [`Decoder::pause`].
    pub fn is_waiting(&self) -> bool {
        self.place != Place::Between
    }

    /// Call if nothing came for a while: a lone escape was the Escape key.
    pub fn pause(&mut self) -> Option<Key> {
        (std::mem::take(&mut self.place) == Place::Escape).then_some(Key::Escape)
    }
}

fn character(byte: u8) -> Option<Key> {
    byte.is_ascii().then(|| Key::Character(char::from(byte.to_ascii_lowercase())))
}

fn arrow(last: u8) -> Option<Key> {
    match last {
        b'A' => Some(Key::Up),
        b'B' => Some(Key::Down),
        b'C' => Some(Key::Right),
        b'D' => Some(Key::Left),
        _ => None,
    }
}

#[cfg(test)]
impl Key {
    /// The key that tests write as `character`; arrows are `^v<>`.
    pub(crate) fn of(character: char) -> Key {
        match character {
            '^' => Key::Up,
            'v' => Key::Down,
            '<' => Key::Left,
            '>' => Key::Right,
            other => Key::Character(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(bytes: &[u8]) -> Vec<Key> {
        let mut decoder = Decoder::default();
        let mut found: Vec<Key> = bytes.iter().flat_map(|byte| decoder.push(*byte)).flatten().collect();
        found.extend(decoder.pause());
        found
    }

    #[test]
    fn arrow_keys_in_both_forms_are_no_escape() {
        let arrows = [Key::Up, Key::Down, Key::Right, Key::Left];
        assert_eq!(keys(b"\x1b[A\x1b[B\x1b[C\x1b[D"), arrows);
        assert_eq!(keys(b"\x1bOA\x1bOB\x1bOC\x1bOD"), arrows);
        // With Shift or Ctrl held.
        assert_eq!(keys(b"\x1b[1;5A"), [Key::Up]);
    }

    #[test]
    fn an_escape_is_never_lost() {
        let stop = Key::Character(' ');
        assert_eq!(keys(b"\x1b"), [Key::Escape]);
        assert_eq!(keys(b"\x1b\x1b"), [Key::Escape, Key::Escape]);
        assert_eq!(keys(b"\x1b "), [Key::Escape, stop]);
        assert_eq!(keys(b"\x1b[\x1b"), [Key::Escape]);
        assert_eq!(keys(b"\x1b\x1b[A"), [Key::Escape, Key::Up]);
    }

    #[test]
    fn other_keys_are_not_taken_for_letters() {
        // Delete, F5, F1, Home: none of their bytes counts as a key.
        assert_eq!(keys(b"\x1b[3~\x1b[15~\x1bOP\x1b[H"), []);
        // Letters beyond ASCII.
        assert_eq!(keys("ä".as_bytes()), []);
        assert_eq!(keys(b"xX"), [Key::Character('x'); 2]);
    }
}
