//! The commands for single servos, on simulated servos behind pseudo-terminals: the real program on a serial device.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod bench;
mod boxed;
mod scan;
mod servo;
mod setup;
