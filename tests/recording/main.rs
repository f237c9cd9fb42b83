//! Recordings: what is in them, what happens to them when the disk does not behave, and replays of them.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
mod contents;
mod disk;
mod ends;
mod page;
mod replays;
mod schema;
