//! `hippocamp sim`, the real program: typed commands, and programs by others on its terminals.

#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(
    clippy::explicit_write,
    reason = "macros would be captured, and a test that is left out should say so"
)]

mod console;
mod foreign_servos;
mod python_clients;
#[path = "../rig/mod.rs"]
mod rig;
mod running;
mod rust_clients;
