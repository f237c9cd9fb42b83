//! The real program on serial devices, in real time: pseudo-terminals with simulated servos behind them. Most of each test
//! is waiting, so all of them stand in one program and wait side by side.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../rig/mod.rs"]
mod rig;

mod bench;
mod boxed;
mod doctor;
mod guard;
mod out_of_the_box;
mod replug;
mod scan;
mod servo;
mod setup;
