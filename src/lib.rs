//! Controller for servo-driven horse-like quadrupeds and octopus-arm rigs.

pub mod bus;
pub mod capability;
pub mod cli;
pub mod config;
pub mod counts;
pub mod cycle;
pub mod estimate;
pub mod ik;
pub mod jog;
pub mod model;
pub mod motion;
pub mod run;
pub mod safety;
pub mod signals;
pub mod simulation;
pub mod telemetry;
pub mod units;
