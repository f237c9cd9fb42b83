//! Hands the behaviour of Dynamixel servos to the rest of the simulator.

use super::packet::Decoder;
use super::x_series::{BAUD, GOAL_POSITION, GOAL_PWM, ID, PROTOCOL_TYPE, RETURN_DELAY};
use super::{State, answer, control, models, power};
use crate::decoder::{LineDecoder, Received};
use crate::model::Protocol;
use crate::servo::ProtocolSpec;

/// Dynamixel Protocol 2.0.
pub(crate) static SPEC: ProtocolSpec = ProtocolSpec {
    protocol: Protocol::Dynamixel,
    name: "dynamixel",
    models: models::models,
    // FF FF FD 00 id length length.
    first_data_byte: 7,
    // ROBOTIS e-manual, Baud Rate (8).
    bauds: &[
        (0, 9_600),
        (1, 57_600),
        (2, 115_200),
        (3, 1_000_000),
        (4, 2_000_000),
        (5, 3_000_000),
        (6, 4_000_000),
        (7, 4_500_000),
    ],
    id_max: 252,
    // ROBOTIS states none; 0.4 s were measured on an XC330 (ROBOTIS-GIT/emanual issue 1698).
    start_ns: 400_000_000,
    id: ID,
    baud: BAUD,
    return_delay: |_| Some(RETURN_DELAY),
    goal_position: GOAL_POSITION,
    torque_limit: |_| GOAL_PWM,
    state: |_| Box::new(State::default()),
    power_on: power::power_on,
    forget: power::forget,
    // A servo set to another protocol understands nothing at any rate.
    understands_packets: |servo| servo.get(PROTOCOL_TYPE) == 2,
    drive: control::drive,
    observe: control::observe,
    is_torque_on: control::is_torque_on,
    drowned_twin_share: 0.0,
    decoder: || Box::new(Decoder::default()),
    answer: answer::answer,
};

impl LineDecoder for Decoder {
    fn reset(&mut self) {
        Decoder::reset(self);
    }

    fn push(&mut self, byte: u8) -> Option<Received> {
        Decoder::push(self, byte)
    }
}
