//! Recordings: their content, faults of the disk, and replays.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
mod contents;
mod disk;
mod ends;
mod page;
mod replays;
mod schema;
