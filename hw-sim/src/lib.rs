//! Simulated servo buses that speak the same bytes as real ones.
//!
//! In: bytes the host sends, and the passing of virtual time. Out: the bytes that reach the host, each at the
//! time it would on a real line, and the ground truth of every shaft and register for tests.
//! Never: a real clock, a wait, a global, or a call to the controller's code. The codecs here are written
//! from the makers' manuals alone, so that they are a second opinion on the controller's own.
//!
//! A [`World`] holds every bus of a robot. Down from there: `bus` (one line and its servos), `wire` (when
//! each byte crosses, and what two talkers do to each other), `dynamixel` and `feetech` (packets, and what a
//! servo answers), `registers` (control tables as data), `servo` and `motor` (what turns the shaft),
//! [`body`] (where joint torque meets joint motion), [`faults`] (what goes wrong, and when).

pub mod body;
mod bus;
mod config;
mod convert;
mod dynamixel;
mod error;
pub mod faults;
mod feetech;
mod model;
mod motor;
pub mod registers;
mod reply;
mod servo;
mod wire;
mod world;

pub use config::{BusConfig, Protocol, ServoConfig};
pub use error::{BuildError, Unplugged};
pub use faults::{FaultError, FaultScript};
pub use model::{MODELS, Model};
pub use wire::WireStatistics;
pub use world::{Shaft, World};
