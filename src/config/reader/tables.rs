//! Reads tables, and lists of tables.

use toml::de::DeValue;

use super::Section;
use crate::config::source::element;

impl<'a> Section<'a> {
    /// Reads a table of this section.
    pub(in crate::config) fn section<T>(
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
    pub(in crate::config) fn section_or_empty<T>(
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
    pub(in crate::config) fn list<T>(
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
            self.fault(key, format!("{meaning}, a list of at most {most} tables; there are {}", items.len()));
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
