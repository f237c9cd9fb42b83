//! The commands for servos and for a robot that is being built, on simulated servos behind pseudo-terminals: the real program
//! on serial devices. All of it waits for most of the time, so it is one program, whose tests wait side by side.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod bench;
mod boxed;
mod doctor;
mod out_of_the_box;
#[path = "../rig/mod.rs"]
mod rig;
mod scan;
mod servo;
mod setup;
