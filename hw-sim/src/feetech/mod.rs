//! Feetech FT-SCS servos. Source: Feetech wiki, reference, protocol ft-scs, memory-sts and memory-scscl.
//!
//! `packet` has the bytes, `answer` decides which servos answer a request, `instruction` carries it out on one
//! servo, `memory` holds what may be written and what is kept, `control` has the motor and the feedback, `profile`
//! the trajectory to a goal, `protection` the alarms. `sts` and `scs` are the control tables, `models` has the models, and
//! `spec` hands all of it to the rest of the simulator.

mod answer;
mod control;
mod instruction;
mod memory;
mod models;
mod packet;
mod profile;
mod protection;
mod scs;
mod spec;
mod sts;

use crate::registers::RegisterFile;
use crate::servo::{self, Servo};
use profile::Profile;
use protection::Protection;
pub(crate) use spec::SPEC;

/// The state of a servo besides its registers.
#[derive(Debug)]
pub(crate) struct State {
    /// The registers whose EPROM part it starts with.
    stored: RegisterFile,
    /// The registers that parameter recovery restores.
    backup: RegisterFile,
    run: Run,
}

/// State that a restart loses.
#[derive(Debug, Default)]
struct Run {
    /// A pending asynchronous write: address and data.
    pending: Option<(u8, Vec<u8>)>,
    profile: Profile,
    /// Distance to the goal when the goal came, counts.
    way: f64,
    /// Goal of step mode, and of a servo that has had none since its power came on, counts.
    own_goal: i64,
    /// True once a host has written a goal since its power came on.
    has_goal: bool,
    /// True from the write of a goal to the next tick of the control loop.
    is_woken: bool,
    /// A goal was written and has not been reached.
    is_under_way: bool,
    /// How long the shaft has stood still, s.
    still_s: f64,
    /// Position error of the previous step, counts.
    last_error: f64,
    /// Drive with which speed mode holds the speed, share of the supply.
    speed_drive: f64,
    /// Drive that the loop asks for before any limit, share of the supply.
    demand: f64,
    protection: Protection,
}

impl State {
    /// A servo as shipped.
    pub(crate) fn new(registers: &RegisterFile) -> State {
        State { stored: registers.clone(), backup: registers.clone(), run: Run::default() }
    }
}

/// The state of a servo of this protocol.
fn own(state: &servo::State) -> &State {
    state.downcast_ref().expect("a servo has the state of its kind")
}

/// The same, to change it.
fn own_mut(state: &mut servo::State) -> &mut State {
    state.downcast_mut().expect("a servo has the state of its kind")
}

/// Addresses that differ between the series, for registers that both have.
struct Series {
    lock: u16,
    holding_torque: u16,
    protection_time: u16,
    overload_torque: u16,
}

static STS: Series = Series {
    lock: sts::LOCK,
    holding_torque: sts::HOLDING_TORQUE,
    protection_time: sts::PROTECTION_TIME,
    overload_torque: sts::OVERLOAD_TORQUE,
};

static SCS: Series = Series {
    lock: scs::LOCK,
    holding_torque: scs::HOLDING_TORQUE,
    protection_time: scs::PROTECTION_TIME,
    overload_torque: scs::OVERLOAD_TORQUE,
};

fn series(servo: &Servo) -> &'static Series {
    if servo.model.is_scs { &SCS } else { &STS }
}
