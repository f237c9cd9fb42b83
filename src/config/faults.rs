//! The faults of a file while it is read: counts all, and keeps the first ones for the error.

use super::fault::{ConfigError, FAULTS_TOLD, Fault};

/// The first of all faults noted so far, in the file's order.
#[derive(Debug, Default)]
pub(super) struct Faults {
    kept: Vec<Fault>,
    count: usize,
}

impl Faults {
    /// Notes a fault in this line; calls `make` only if the fault is among the first.
    pub(super) fn note(&mut self, line: usize, make: impl FnOnce() -> Fault) {
        self.count += 1;
        // If a line has two faults, the one noted first stands first.
        let place = self.kept.partition_point(|kept| kept.line <= line);
        if place < FAULTS_TOLD {
            self.kept.truncate(FAULTS_TOLD - 1);
            self.kept.insert(place, make());
        }
    }

    /// The noted faults, if there are any.
    pub(super) fn finish(self) -> Option<ConfigError> {
        let more = self.count - self.kept.len();
        (self.count > 0).then_some(ConfigError { faults: self.kept, more })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(line: usize, key: &str) -> Fault {
        let (file, expected) = ("f".to_owned(), String::new());
        Fault { file, line, column: None, key: key.to_owned(), value: None, expected }
    }

    #[test]
    fn the_first_faults_are_kept_in_file_order_and_the_others_counted() {
        let mut faults = Faults::default();
        for line in (1..=FAULTS_TOLD + 10).rev() {
            faults.note(line, || fault(line, "first"));
            faults.note(line, || fault(line, "second"));
        }
        let error = faults.finish().unwrap();
        assert_eq!((error.faults.len(), error.more), (FAULTS_TOLD, FAULTS_TOLD + 20));
        for (place, fault) in error.faults.iter().enumerate() {
            assert_eq!((fault.line, fault.key == "first"), (1 + place / 2, place % 2 == 0), "{place}");
        }
        assert!(error.to_string().ends_with("and 70 more: 120 faults; nothing was started"), "{error}");
        assert_eq!(Faults::default().finish(), None);
    }

    #[test]
    fn a_fault_that_would_not_be_reported_is_not_built() {
        let mut faults = Faults::default();
        (0..FAULTS_TOLD).for_each(|line| faults.note(line, || fault(line, "")));
        faults.note(FAULTS_TOLD, || panic!("made for nothing"));
    }
}
