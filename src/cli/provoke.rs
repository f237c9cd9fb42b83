//! Panics that tests ask for, to see how this program ends. Not in a release build.
//!
//! `HIPPOCAMP_PANIC=loop:N` has the loop panic in cycle N; `HIPPOCAMP_PANIC=recording:BYTES` the thread that writes
//! the recording, after so many bytes. Each says when, on the system's monotonic clock.

use std::fs::File;
use std::io::{self, Write};

use crate::platform::monotonic;

/// What `HIPPOCAMP_PANIC` says of `place`.
fn wanted(place: &str) -> Option<u64> {
    let text = std::env::var("HIPPOCAMP_PANIC").ok()?;
    let (of, count) = text.split_once(':')?;
    (of == place).then_some(count)?.parse().ok()
}

fn panic_now() {
    panic!("a panic that a test wants, at {} ns", monotonic().as_nanos());
}

/// Counts the cycles of the loop.
pub(super) struct Loop(Option<u64>);

impl Loop {
    pub(super) fn new() -> Loop {
        Loop(wanted("loop"))
    }

    pub(super) fn count(&mut self) {
        self.0 = self.0.map(|left| left.wrapping_sub(1));
        if self.0 == Some(0) {
            panic_now();
        }
    }
}

/// Counts the bytes of a recording.
pub(super) struct Sink {
    file: File,
    left: Option<u64>,
}

impl Sink {
    pub(super) fn new(file: File) -> Sink {
        Sink { file, left: wanted("recording") }
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.file.write(bytes)?;
        if let Some(left) = &mut self.left {
            *left = left.saturating_sub(u64::try_from(count).unwrap_or(u64::MAX));
            if *left == 0 {
                panic_now();
            }
        }
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
