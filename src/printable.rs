//! Makes text from other sources safe for a terminal.
//!
//! Names, file names and texts of servos can hold characters that a terminal obeys instead of showing: an escape
//! that clears the screen, a newline that begins a line which the program never wrote, a mark that reverses the
//! order of letters. Each is shown as its code, `\u001b`, as TOML and JSON write it.

use std::borrow::Cow;
use std::fmt::Write as _;

/// True for a character that a terminal obeys or hides: control characters, and those of Unicode that only format,
/// including those that reverse the order of letters (general categories Cc and Cf, line and paragraph separator).
/// Visible signs of Arabic and other scripts in category Cf stay unchanged.
pub(crate) fn is_unprintable(c: char) -> bool {
    c.is_control()
        || matches!(
            c,
            '\u{ad}'
                | '\u{61c}'
                | '\u{180e}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{feff}'
                | '\u{fff9}'..='\u{fffb}'
                | '\u{1d173}'..='\u{1d17a}'
                | '\u{e0000}'..='\u{e007f}'
        )
}

/// `text` with each unprintable character replaced by its code; a newline counts as one.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_unprintable) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match c {
            '\n' => shown.push_str("\\n"),
            '\r' => shown.push_str("\\r"),
            '\t' => shown.push_str("\\t"),
            c if is_unprintable(c) => {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    // Writing to a string cannot fail.
                    let _ = write!(shown, "\\u{unit:04x}");
                }
            }
            c => shown.push(c),
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_shown_as_codes() {
        for (text, shown) in [
            ("left_hind.hip = 1.5 °, größer, 馬", "left_hind.hip = 1.5 °, größer, 馬"),
            ("\u{1b}[2J\u{7}\0", "\\u001b[2J\\u0007\\u0000"),
            ("a\nb\r\tc", "a\\nb\\r\\tc"),
            ("\u{7f}\u{9b}31m", "\\u007f\\u009b31m"),
            ("\u{202e}gnp.exe\u{2066}\u{200b}", "\\u202egnp.exe\\u2066\\u200b"),
            ("\u{e0041}", "\\udb40\\udc41"),
        ] {
            assert_eq!(printable(text), shown);
            assert_eq!(printable(&printable(text)), shown, "once is enough");
        }
    }

    #[test]
    fn json_escapes_control_characters_and_keeps_its_meaning() {
        let text = "\u{9b}\u{202e}\u{e0041}\u{7f}";
        let json = serde_json::to_string(text).unwrap();
        let shown = printable(&json);
        assert!(shown.is_ascii() && shown.len() > json.len(), "{shown}");
        assert_eq!(serde_json::from_str::<String>(&shown).unwrap(), text);
    }
}
