//! Feetech FT-SCS for the rest of the program.

use super::models::{FEETECH_SCS, FEETECH_STS, MODELS, SCS_COUNTS_PER_TURN};
use super::{Decoder, FRAME_BYTES, PACKET_BYTES_MAX, read, request, sync_read, sync_write, table, write};
use crate::bus::ask::PING;
use crate::bus::protocols::{IdentifyRequest, ProtocolSpec};
use crate::bus::table::{Identity, Offset, Series, Target, Want, count};
use crate::model::{Firmware, Protocol};

/// Bytes up to the id: firmware, byte order, model and id.
const BRIEF: u8 = 6;
/// Bytes up to the phase.
const WHOLE: u8 = 19;
/// Address of the phase, and its bit for the fine unit of speed.
const PHASE_ADDRESS: usize = 18;
const FINE_SPEED: u8 = 4;
/// The byte order of SCS: the high byte first.
const HIGH_BYTE_FIRST: u8 = 1;

/// Feetech FT-SCS.
pub(in crate::bus) static SPEC: ProtocolSpec = ProtocolSpec {
    protocol: Protocol::Feetech,
    name: "feetech",
    title: "Feetech FT-SCS",

    models: MODELS,
    other_models: &[(521, "STS3036"), (11272, "SM8512BL")],
    series: &[&STS, &SCS],
    // Wiki, memory-sts, address 6.
    rates: &[1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400],
    likely_rates: &[1_000_000, 500_000, 115_200, 57_600, 38_400, 76_800, 128_000, 250_000],
    factory_rate: 1_000_000,

    request_frame_bytes: FRAME_BYTES,
    status_frame_bytes: FRAME_BYTES,
    word_bytes: 1,
    packet_bytes_max: PACKET_BYTES_MAX,
    request,
    read,
    write,
    sync_write,
    sync_read,
    fast_read: None,
    decoder: |parameters_max, _| Box::new(Decoder::new(parameters_max)),

    ping_bytes: 0,
    asked_bytes,
    may_be_echoed_ping,
    // Only alarms: they come with a valid answer.
    alarms_and_refusal: |error| (error, 0),
    refusal: |_| "Feetech servos refuse nothing",

    // Not a ping: a servo with a voltage alarm answers a ping with the bytes of the request, as an echo would.
    identify: IdentifyRequest::Read { brief: BRIEF, whole: WHOLE },
    identity,
    reset_parameters: &[],
    library: None,
};

/// STS and SMS.
pub(in crate::bus) static STS: Series = Series {
    name: "Feetech STS",
    protocol: Protocol::Feetech,
    registers: &FEETECH_STS,
    counts_per_turn: 4096.0,
    table: |_| table::STS.to_vec(),
    current_unit_a: |_| Some(0.0065),
    setup: &[
        count("status_return_level", 1),
        count("min_position_limit", 0),
        count("max_position_limit", 4095),
        count("max_torque", 1000),
        // Speed unit, position beyond one turn: the controller needs speeds in single steps, and a position within
        // one turn that is the same after every power-on. The bits of drive and feedback direction stay as the maker
        // set them: changing only one would drive the servo away from its goal.
        Target { name: "phase", want: Want::Bits { of: 4 | 16, set: 4 }, is_for_new: false },
        count("angle_resolution", 1),
        Target { is_for_new: true, ..count("homing_offset", 0) },
        // Position control.
        count("operating_mode", 0),
    ],
    // Wiki, memory-sts, register 31.
    offset: Some(Offset { sign: -1, largest: 2047 }),
    torque_ceiling: "max_torque",
};

/// SCS: 10 bit, words with the high byte first.
pub(in crate::bus) static SCS: Series = Series {
    name: "Feetech SCS",
    protocol: Protocol::Feetech,
    registers: &FEETECH_SCS,
    counts_per_turn: SCS_COUNTS_PER_TURN,
    table: |_| table::SCS.to_vec(),
    current_unit_a: |_| None,
    setup: &[
        count("status_return_level", 1),
        count("min_position_limit", 0),
        count("max_position_limit", 1023),
        count("max_torque", 1000),
    ],
    offset: None,
    torque_ceiling: "max_torque",
};

/// The first registers.
fn identity(data: &[u8]) -> Option<Identity> {
    let &[major, minor, byte_order, a, b, _, ..] = data else { return None };
    let is_scs = byte_order == HIGH_BYTE_FIRST;
    let phase = data.get(PHASE_ADDRESS);
    Some(Identity {
        series: if is_scs { &SCS } else { &STS },
        model_number: if is_scs { u16::from_be_bytes([a, b]) } else { u16::from_le_bytes([a, b]) },
        firmware: Firmware { major, minor: Some(minor) },
        is_speed_fine: phase.is_none_or(|phase| phase & FINE_SPEED != 0),
    })
}

/// A read request has two parameters, address and count, and the reply has its alarms in the place of the request's
/// instruction. So the reply to a read of two bytes can equal its request bit for bit, and could not be told from an
/// adapter's echo of an unanswered request. Asked for a third byte, the reply is longer.
fn asked_bytes(bytes: u16) -> u16 {
    if bytes == 2 { 3 } else { bytes }
}

/// 1 in the place of the instruction, and no data.
///
/// A servo with only the voltage alarm answers a ping with the very bytes of the request. If they counted as an
/// answer, an adapter that echoes would seem to have servos; so they never count, and a caller that gets no answer
/// to a ping must read a register instead, whose reply cannot be confused ([`asked_bytes`]).
fn may_be_echoed_ping(error: u8, data: &[u8]) -> bool {
    error == PING && data.is_empty()
}
