//! Panics on demand for tests of how this program ends. Not in a release build.
//!
//! `HIPPOCAMP_PANIC=loop:N` makes the loop panic in cycle N; `HIPPOCAMP_PANIC=recording:BYTES` makes the thread
//! that writes the recording panic, after this many bytes. Each message gives its time on the system's monotonic
//! clock.

use std::fs::File;
use std::io::{self, Write};

use crate::motion::Order;
use crate::observe::Outcome;
use crate::platform::monotonic;
use crate::run::Operator;
use crate::signals::Status;

/// The count in `HIPPOCAMP_PANIC` for `place`, if it names `place`.
fn wanted(place: &str) -> Option<u64> {
    let text = std::env::var("HIPPOCAMP_PANIC").ok()?;
    let (of, count) = text.split_once(':')?;
    (of == place).then_some(count)?.parse().ok()
}

fn panic_now() {
    panic!("a panic that a test wants, at {} ns", monotonic().as_nanos());
}

/// An operator that panics in the chosen cycle.
pub(super) struct Loop<O> {
    operator: O,
    left: Option<u64>,
}

impl<O> Loop<O> {
    pub(super) fn new(operator: O) -> Loop<O> {
        Loop { operator, left: wanted("loop") }
    }
}

impl<O: Operator> Operator for Loop<O> {
    fn hear(&mut self, note: &str) {
        self.operator.hear(note);
    }

    fn order(&mut self, status: &Status) -> Order {
        self.left = self.left.map(|left| left.wrapping_sub(1));
        if self.left == Some(0) {
            panic_now();
        }
        self.operator.order(status)
    }

    fn why_stopped(&self) -> (Outcome, &'static str) {
        self.operator.why_stopped()
    }

    fn loop_ended(&mut self) {
        self.operator.loop_ended();
    }
}

/// Counts the bytes of a recording, and panics at the chosen one.
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
