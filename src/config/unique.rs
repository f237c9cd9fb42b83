//! Names that may occur only once.

use std::collections::BTreeMap;

use super::reader::Section;

/// The names of one kind seen so far.
#[derive(Default)]
pub(super) struct Unique<'a> {
    seen: BTreeMap<&'a str, usize>,
}

impl<'a> Unique<'a> {
    /// Reads a section's `name`; a name seen before is a fault.
    pub(super) fn name(&mut self, section: &Section<'a>, meaning: &str) -> Option<&'a str> {
        let name = section.name("name", meaning)?;
        if let Some(line) = self.seen.get(name) {
            section.fault("name", format!("{meaning}, its own: line {line} has this name already"));
            return None;
        }
        self.seen.insert(name, section.line("name"));
        Some(name)
    }
}
