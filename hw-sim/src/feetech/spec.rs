//! Hands the behaviour of Feetech servos to the rest of the simulator.

use super::packet::Decoder;
use super::sts::{BAUD, GOAL_POSITION, ID, MAX_TORQUE, RETURN_DELAY, TORQUE_LIMIT};
use super::{State, answer, control, models};
use crate::decoder::{LineDecoder, Received};
use crate::model::Protocol;
use crate::servo::ProtocolSpec;

/// Feetech FT-SCS.
pub(crate) static SPEC: ProtocolSpec = ProtocolSpec {
    protocol: Protocol::Feetech,
    name: "feetech",
    models: models::models,
    // FF FF id length.
    first_data_byte: 4,
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
    understands_packets: |_| true,
    drive: |servo, speed_rad_s, _| control::drive(servo, speed_rad_s),
    observe: control::observe,
    is_torque_on: control::is_torque_on,
    // About 4 answers in 10 are garbled (servolab).
    drowned_twin_share: 0.6,
    decoder: || Box::new(Decoder::default()),
    answer: |packet, servos, hears, now_ns| match packet {
        Received::Request(request) => answer::answer(request, servos, hears, now_ns),
        Received::BadChecksum { .. } => Vec::new(),
    },
};

impl LineDecoder for Decoder {
    fn reset(&mut self) {
        Decoder::reset(self);
    }

    fn push(&mut self, byte: u8) -> Option<Received> {
        Decoder::push(self, byte).map(Received::Request)
    }
}
