//! Controller for servo-driven horse-like quadrupeds, octopus arms and human figures.
//!
//! A robot file becomes a [`model::Robot`]; [`kinds`] works out what it can do; and
//! [`run::run`] repeats one [`cycle`] at the robot's rate:
//!
//! ```text
//! reflex    state                 -> who is in charge; in a fall, a pose
//! motion    order, state          -> foot or tip targets, or a pose
//! balance   targets, state        -> feet moved against a fall
//! ik        targets               -> joint angles, and the residual
//! standing  targets, state        -> joint angles corrected for the sag of loaded joints
//! yielding  joint angles, state   -> the same; the angles of an overloaded arm
//! safety    joint angles, state   -> a command: move, hold, limp
//! counts    command               -> goals in servo counts
//! bus       goals                 -> one slot per servo: a reply, or the reason why there is none
//! imu       bytes                 -> the trunk's attitude and turn rates, and their age
//! estimate  slots, reading        -> state
//! observe   all of the above      -> report, recording, status line
//! ```
//!
//! Units inside: radians, metres, seconds, `f64`; right-handed frames, x forward, y left, z up.

pub mod balance;
pub mod bus;
pub mod calibration;
pub mod cli;
pub mod config;
pub mod counts;
pub mod cycle;
pub mod doctor;
pub mod estimate;
pub mod html;
pub mod ik;
pub mod imu;
mod input;
pub mod jog;
pub mod kinds;
pub mod model;
pub mod monitor;
pub mod motion;
pub mod observe;
pub mod operator;
mod output;
pub mod plan;
pub mod platform;
pub mod plot;
mod printable;
pub mod random;
pub mod recording;
pub mod reflex;
pub mod replay;
pub mod run;
pub mod safety;
pub mod service;
pub mod signals;
pub mod simulation;
pub mod standing;
pub mod stopwatch;
pub mod telemetry;
pub mod trial;
pub mod units;
pub mod urdf;
pub mod yielding;
