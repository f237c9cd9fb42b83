//! Dynamixel Protocol 2.0 and X-series servos. Source: ROBOTIS e-manual, Protocol 2.0 and X-series pages.
//!
//! A request goes from `packet` through `answer` (instructions; `group` has those for many servos at once) to
//! `table` (reading and writing, and reasons to refuse), `rules` (allowed values, and the effects of a write)
//! and `power` (reboot, factory reset, backup). Every motor step `control` drives the motor along the
//! trajectory from `profile`, and `protection` checks for conditions that must stop it.

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
