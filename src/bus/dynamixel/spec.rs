//! Dynamixel Protocol 2.0 for the rest of the program.

use super::fast_read::BLOCK_FRAME_BYTES;
use super::models::{DYNAMIXEL_X, MODELS};
use super::{
    Decoder, FAST_HEAD_BYTES, REQUEST_FRAME_BYTES, STATUS_FRAME_BYTES, fast_sync_read, library, read,
    request, sync_read, sync_write, table, write,
};
use crate::bus::protocols::{FastRead, IdentifyRequest, ProtocolSpec};
use crate::bus::table::{Identity, Offset, Series, Target, count};
use crate::model::{Firmware, Protocol};

/// Alert bit of the error byte: the hardware error register is not zero; the data are still valid.
const ALERT: u8 = 0x80;
/// Factory Reset: all except id and line rate (e-manual, Protocol 2.0).
const RESET_KEEPS_ID_AND_BAUD: u8 = 0x02;

/// Dynamixel Protocol 2.0.
pub(in crate::bus) static SPEC: ProtocolSpec = ProtocolSpec {
    protocol: Protocol::Dynamixel,
    name: "dynamixel",
    title: "Dynamixel Protocol 2.0",

    models: MODELS,
    other_models: &[(1190, "XL330-M077"), (1090, "2XL430-W250")],
    series: &[&X],
    // E-manual, Baud Rate (8).
    rates: &[9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000],
    likely_rates: &[57_600, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000, 115_200, 9_600],
    factory_rate: 57_600,

    request_frame_bytes: REQUEST_FRAME_BYTES,
    status_frame_bytes: STATUS_FRAME_BYTES,
    word_bytes: 2,
    // The length field counts the bytes after it. 252 servos with 8 bytes each are far from that.
    packet_bytes_max: 65_535,
    request,
    read,
    write,
    sync_write,
    sync_read,
    fast_read: Some(FastRead {
        request: fast_sync_read,
        head_bytes: FAST_HEAD_BYTES,
        block_frame_bytes: BLOCK_FRAME_BYTES,
        since: "XL330: version 46 or later",
    }),
    decoder: |parameters_max, servos| Box::new(Decoder::new(parameters_max, servos)),

    // Model number and firmware version.
    ping_bytes: 3,
    asked_bytes: |bytes| bytes,
    // Status packets have an instruction of their own.
    may_be_echoed_ping: |_, _| false,
    alarms_and_refusal: |error| (error & ALERT, error & !ALERT),
    refusal,

    identify: IdentifyRequest::Ping,
    identity,
    reset_parameters: &[RESET_KEEPS_ID_AND_BAUD],
    library: Some(library::open),
};

/// The X series.
pub(in crate::bus) static X: Series = Series {
    name: "Dynamixel X",
    protocol: Protocol::Dynamixel,
    registers: &DYNAMIXEL_X,
    counts_per_turn: 4096.0,
    table: table::table,
    current_unit_a: table::current_unit_a,
    setup: &[
        count("drive_mode", 0),
        // Position control.
        count("operating_mode", 3),
        // No secondary id.
        count("secondary_id", 255),
        Target { is_for_new: true, ..count("homing_offset", 0) },
        // Full drive of the motor: the controller limits torque by the register that this one limits.
        count("pwm_limit", 885),
        count("max_position_limit", 4095),
        count("min_position_limit", 0),
        // Without torque after power-on.
        count("startup_configuration", 0),
    ],
    // E-manual, Homing Offset.
    offset: Some(Offset { sign: 1, largest: 1024 }),
    torque_ceiling: "pwm_limit",
};

/// The answer to a ping.
fn identity(data: &[u8]) -> Option<Identity> {
    let &[low, high, firmware] = data else { return None };
    Some(Identity {
        series: &X,
        model_number: u16::from_le_bytes([low, high]),
        firmware: Firmware { major: firmware, minor: None },
        is_speed_fine: true,
    })
}

/// Meaning and cure of an error number (ROBOTIS e-manual, `dxl/protocol2`, status packet).
fn refusal(error: u8) -> &'static str {
    match error {
        1 => "the servo could not carry it out now; restart it and try again",
        2 => "the servo does not know the instruction; update its firmware",
        3 => "the request arrived damaged; check the bus for loose plugs and long cables",
        4 => "the value is out of the register's range, or its bus watchdog has tripped; restart it",
        5 => "the length does not match the register; check that the robot file names the right servo model",
        6 => "the value is beyond a limit set in the servo; look at its limits with 'hippocamp servo read'",
        7 => {
            "the register cannot be accessed like this now; torque must be off to change settings, and its \
             firmware must know the register"
        }
        _ => "a number the manual does not list; update its firmware",
    }
}
