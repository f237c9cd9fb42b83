//! Dynamixel Protocol 2.0 and X-series servos. Source: ROBOTIS e-manual, Protocol 2.0 and X-series pages.
//!
//! A request goes from `packet` through `answer` (instructions; `group` has those for many servos at once) to
//! `table` (reading and writing, and reasons to refuse), `rules` (allowed values, and the effects of a write)
//! and `power` (reboot, factory reset, backup). Every motor step `control` drives the motor along the
//! trajectory from `profile`, and `protection` checks for conditions that must stop it. `x_series` is the control table,
//! `models` has the models, and `spec` hands all of it to the rest of the simulator.

mod answer;
mod control;
mod group;
mod models;
mod packet;
mod power;
mod profile;
mod protection;
mod rules;
mod spec;
mod state;
mod table;
mod x_series;

pub(crate) use spec::SPEC;
use state::State;
