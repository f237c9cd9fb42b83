//! Controller for servo-driven horse-like quadrupeds and octopus-arm rigs.

pub mod bus;
pub mod capability;
pub mod config;
pub mod counts;
pub mod estimate;
pub mod ik;
pub mod model;
pub mod motion;
pub mod safety;
pub mod signals;
pub mod telemetry;
pub mod units;
