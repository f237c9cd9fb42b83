//! Dynamixel Protocol 2.0 and X-series servos. Source: ROBOTIS e-manual, Protocol 2.0 and X-series pages.
//!
//! A request goes from `packet` through `answer` (instructions; `group` has those for many servos at once) to
//! `table` (reading and writing, and what stands against it), `rules` (which numbers fit, and what follows from one
//! written) and `power` (reboot, factory reset, backup). Every motor step `control` turns the motor along the way
//! `profile` has laid, and `protection` looks for what must stop it.

pub(crate) mod answer;
pub(crate) mod control;
mod group;
pub(crate) mod packet;
pub(crate) mod power;
mod profile;
mod protection;
mod rules;
mod state;
mod table;

pub(crate) use state::State;
