//! Controller for servo-driven horse-like quadrupeds and octopus-arm rigs.

pub mod bus;
pub mod capability;
pub mod cli;
pub mod config;
pub mod counts;
pub mod cycle;
pub mod estimate;
pub mod html;
pub mod ik;
pub mod model;
pub mod motion;
pub mod recording;
pub mod replay;
pub mod run;
pub mod safety;
pub mod signals;
pub mod simulation;
pub mod telemetry;
pub mod units;
pub mod urdf;
