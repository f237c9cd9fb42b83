//! Names that may be given only once.

use super::reader::Section;

/// The names of one kind seen so far.
#[derive(Default)]
pub(super) struct Unique<'a> {
    seen: Vec<(&'a str, usize)>,
}

impl<'a> Unique<'a> {
    /// Reads a section's `name`; a name seen before is a fault.
    pub(super) fn name(&mut self, section: &Section<'a>, meaning: &str) -> Option<&'a str> {
        let name = section.name("name", meaning)?;
        if let Some((_, line)) = self.seen.iter().find(|(seen, _)| *seen == name) {
            section.fault("name", format!("{meaning}, its own: line {line} has this name already"));
            return None;
        }
        self.seen.push((name, section.line("name")));
        Some(name)
    }
}
