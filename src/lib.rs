//! Controller for servo-driven horse-like quadrupeds and octopus-arm rigs.

pub mod bus;
pub mod config;
pub mod model;
pub mod units;
