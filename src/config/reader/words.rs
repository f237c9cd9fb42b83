//! Reads texts, dates, names, words out of a list, and flags.

use toml::de::DeValue;
use toml::value::{Date, Datetime};

use super::Section;
use crate::config::nearest::did_you_mean_quoted;
use crate::printable::{is_unprintable, printable};

/// Longest text, characters: longer than any path of a device.
const TEXT_LONGEST: usize = 4096;
/// Longest name, letters.
const NAME_LONGEST: usize = 64;

impl<'a> Section<'a> {
    /// A text that is not blank.
    pub(in crate::config) fn text(&self, key: &'static str, meaning: &str) -> Option<&'a str> {
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
            self.fault(key, format!("{expected}, of printable characters: {code} controls a terminal"));
            return None;
        }
        if text.chars().count() > TEXT_LONGEST {
            self.fault(key, format!("{expected}, of at most {TEXT_LONGEST} characters"));
            return None;
        }
        Some(text)
    }

    /// A text that is not blank; `Some(None)` if it is not set.
    pub(in crate::config) fn text_if_set(&self, key: &'static str, meaning: &str) -> Option<Option<&'a str>> {
        self.describe(key, &format!("{meaning}, a text in quotes"), Some("none".to_owned()));
        if self.has(key) { self.text(key, meaning).map(Some) } else { Some(None) }
    }

    /// A date without a time; `Some(None)` if it is not set.
    pub(in crate::config) fn date_if_set(&self, key: &'static str, meaning: &str) -> Option<Option<Date>> {
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
    pub(in crate::config) fn name(&self, key: &'static str, meaning: &str) -> Option<&'a str> {
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
    pub(in crate::config) fn choice<T: Clone>(
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
            let advice = text.map(|text| did_you_mean_quoted(text, options.iter().map(|(word, _)| *word)));
            self.fault(key, expected + &advice.unwrap_or_default());
        }
        found.map(|(_, value)| value.clone())
    }

    /// A name out of `names`, returned as its index there. If one of the names is itself faulty (`None`), a name
    /// that is not found is no fault.
    pub(in crate::config) fn reference(
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
    pub(in crate::config) fn flag_or(&self, key: &'static str, meaning: &str, default: bool) -> Option<bool> {
        self.describe(key, &format!("{meaning}: true or false"), Some(default.to_string()));
        let Some(value) = self.optional(key) else { return Some(default) };
        if value.as_bool().is_none() {
            self.fault(key, format!("{meaning}: true or false"));
        }
        value.as_bool()
    }
}
