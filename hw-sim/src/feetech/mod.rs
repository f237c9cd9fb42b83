//! Feetech FT-SCS servos. Source: Feetech wiki, reference, protocol ft-scs, memory-sts and memory-scscl.
//!
//! `packet` is the bytes, `answer` who talks after a request and `instruction` what one servo does with it, `memory`
//! what may be written where and what of it is kept, `control` the motor and the feedback, `profile` the way to a goal,
//! `protection` the alarms.

pub(crate) mod answer;
pub(crate) mod control;
mod instruction;
mod memory;
pub(crate) mod packet;
mod profile;
mod protection;

use crate::registers::{RegisterFile, feetech_scs, feetech_sts};
use crate::servo::Servo;
use profile::Profile;
use protection::Protection;

/// What a servo knows beside its registers.
#[derive(Debug)]
pub(crate) struct State {
    /// The registers whose EPROM part it starts with.
    stored: RegisterFile,
    /// What parameter recovery brings back.
    backup: RegisterFile,
    run: Run,
}

/// What it forgets when it starts anew.
#[derive(Debug, Default)]
struct Run {
    /// What an asynchronous write left: address and data.
    pending: Option<(u8, Vec<u8>)>,
    profile: Profile,
    /// How far it was to go when the goal came, counts.
    way: f64,
    /// Where step mode is to end, counts.
    step_goal: i64,
    /// A goal was written and has not been reached.
    is_under_way: bool,
    /// How long the shaft has stood still, s.
    still_s: f64,
    /// Position error of the step before, counts.
    last_error: f64,
    /// Drive that speed mode has found to hold the speed, share of the supply.
    speed_drive: f64,
    /// Drive that the loop asks for before any limit, share of the supply.
    demand: f64,
    protection: Protection,
}

impl State {
    /// As shipped.
    pub(crate) fn new(registers: &RegisterFile) -> State {
        State { stored: registers.clone(), backup: registers.clone(), run: Run::default() }
    }
}

/// Where a series has what both have.
struct Series {
    lock: u16,
    holding_torque: u16,
    protection_time: u16,
    overload_torque: u16,
}

static STS: Series = Series {
    lock: feetech_sts::LOCK,
    holding_torque: feetech_sts::HOLDING_TORQUE,
    protection_time: feetech_sts::PROTECTION_TIME,
    overload_torque: feetech_sts::OVERLOAD_TORQUE,
};

static SCS: Series = Series {
    lock: feetech_scs::LOCK,
    holding_torque: feetech_scs::HOLDING_TORQUE,
    protection_time: feetech_scs::PROTECTION_TIME,
    overload_torque: feetech_scs::OVERLOAD_TORQUE,
};

fn series(servo: &Servo) -> &'static Series {
    if servo.model.is_scs { &SCS } else { &STS }
}
