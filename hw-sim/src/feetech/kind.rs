//! Hands the behaviour of Feetech servos to the rest of the simulator.

use super::packet::{Decoder, Request};
use super::sts::{BAUD, GOAL_POSITION, ID, MAX_TORQUE, RETURN_DELAY, TORQUE_LIMIT};
use super::{State, answer, control, models};
use crate::model::Protocol;
use crate::reply::Slot;
use crate::servo::{Ear, Kind, Packet, Servo};

/// Feetech FT-SCS.
pub(crate) static KIND: Kind = Kind {
    protocol: Protocol::Feetech,
    name: "feetech",
    models: models::models,
    // FF FF id length.
    first_said: 4,
    // Feetech wiki, memory-sts, address 6.
    bauds: &[
        (0, 1_000_000),
        (1, 500_000),
        (2, 250_000),
        (3, 128_000),
        (4, 115_200),
        (5, 76_800),
        (6, 57_600),
        (7, 38_400),
    ],
    id_max: 253,
    // Feetech wiki, ft-scs 4.12: about 1800 ms.
    start_ns: 1_800_000_000,
    id: ID,
    baud: BAUD,
    // "No function" in the STS series, by Feetech's table.
    return_delay: |model| model.is_scs.then_some(RETURN_DELAY),
    goal_position: GOAL_POSITION,
    torque_limit: |model| if model.is_scs { MAX_TORQUE } else { TORQUE_LIMIT },
    state: |registers| Box::new(State::new(registers)),
    power_on: control::power_on,
    forget: control::forget,
    is_understanding: |_| true,
    drive: |servo, speed_rad_s, _| control::drive(servo, speed_rad_s),
    observe: control::observe,
    is_torque_on: control::is_torque_on,
    // About 4 answers in 10 are garbled (servolab).
    drowned_twin_share: 0.6,
    ear: || Box::new(Line::default()),
};

#[derive(Debug, Default)]
struct Line {
    decoder: Decoder,
    heard: Option<Request>,
}

impl Ear for Line {
    fn reset(&mut self) {
        self.decoder.reset();
    }

    fn push(&mut self, byte: u8) -> bool {
        self.heard = self.decoder.push(byte);
        self.heard.is_some()
    }

    fn request(&self) -> Option<Packet<'_>> {
        self.heard.as_ref().map(|of| (of.id, of.instruction, of.parameters.as_slice()))
    }

    fn answer(&self, servos: &mut [Servo], hears: &[bool], now_ns: u64) -> Vec<Slot> {
        self.heard.as_ref().map_or(Vec::new(), |request| answer::answer(request, servos, hears, now_ns))
    }
}
