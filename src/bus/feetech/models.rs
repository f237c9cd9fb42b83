//! Feetech models that a robot file may name, and the registers that the loop uses. Sources: Feetech's wiki
//! (`parameter/memory-sts.md`, `parameter/memory-scscl.md` and the product pages of ST-3215-C001, ST-3215-C018,
//! ST-3250-C001); spotpear.com's guide of the SC09.

use std::f64::consts::TAU;

use super::table;
use crate::bus::table::{named, rpm};
use crate::model::servo_model::Register;
use crate::model::{OVERLOAD_ALARM, Protocol, Registers, ServoModel};

/// The register of this name of the STS series.
const fn sts(name: &str) -> Register {
    named(table::STS, name)
}

/// The register of this name of the SCS series.
const fn scs(name: &str) -> Register {
    named(table::SCS, name)
}

/// Feetech STS (wiki `parameter/memory-sts.md`).
pub(in crate::bus) static FEETECH_STS: Registers = Registers {
    is_big_endian: false,
    has_sync_read: true,
    model_number: sts("model_number"),
    firmware: (sts("firmware_major"), Some(sts("firmware_minor"))),
    // Mode 0 is position control.
    expected: &[(sts("operating_mode"), 0)],
    // Register 7 is reserved on STS.
    return_delay: None,
    preparation: &[
        (sts("torque_enable"), 0),
        // Acceleration: 0 is the largest.
        (sts("acceleration"), 0),
    ],
    torque_enable: sts("torque_enable"),
    // Unlock the settings; torque enable 128 makes the present position 2048; lock again.
    set_middle: &[(sts("lock"), 0), (sts("torque_enable"), 128), (sts("lock"), 1)],
    bus_watchdog: None,
    torque_limit: sts("torque_limit"),
    goal_position: sts("goal_position"),
    present_position: sts("present_position"),
    present_speed: sts("present_velocity"),
    present_load: sts("present_load"),
    load_is_drive: true,
    present_voltage: sts("present_input_voltage"),
    present_temperature: sts("present_temperature"),
    alarm_status: sts("hardware_error_status"),
    alarm_names: &[
        (0x01, "voltage"),
        (0x02, "encoder"),
        (0x04, "overheating"),
        (0x08, "overcurrent"),
        (OVERLOAD_ALARM, "overload"),
    ],
    tells_alarms: true,
    feedback_address: 56,
    feedback_bytes: 8,
};

/// Feetech SCS (wiki `parameter/memory-scscl.md`): 10 bit, high byte first, no sync read.
///
/// It has no torque limit in RAM: Max Torque (16), an EPROM register, serves instead. It acts at once, and
/// the servo does not keep values written to it while the lock (48) is closed.
pub(in crate::bus) static FEETECH_SCS: Registers = Registers {
    is_big_endian: true,
    has_sync_read: false,
    model_number: scs("model_number"),
    firmware: (scs("firmware_major"), Some(scs("firmware_minor"))),
    // END (byte order): 1 means high byte first.
    expected: &[(scs("byte_order"), 1)],
    // Register 7 is undefined.
    return_delay: None,
    preparation: &[
        (scs("torque_enable"), 0),
        (scs("lock"), 1),
        // Running time and speed: 0 and 0 mean as fast as possible.
        (scs("goal_time"), 0),
        (scs("goal_velocity"), 0),
    ],
    torque_enable: scs("torque_enable"),
    // The middle of a potentiometer is fixed.
    set_middle: &[],
    bus_watchdog: None,
    torque_limit: scs("max_torque"),
    goal_position: scs("goal_position"),
    present_position: scs("present_position"),
    present_speed: scs("present_velocity"),
    present_load: scs("present_load"),
    load_is_drive: true,
    present_voltage: scs("present_input_voltage"),
    present_temperature: scs("present_temperature"),
    alarm_status: scs("hardware_error_status"),
    alarm_names: &[(0x01, "voltage"), (0x04, "overheating"), (OVERLOAD_ALARM, "overload")],
    tells_alarms: true,
    feedback_address: 56,
    feedback_bytes: 8,
};

/// SCS0009: 1024 counts are 300 degrees.
pub(super) const SCS_COUNTS_PER_TURN: f64 = 1024.0 / 300.0 * 360.0;

/// Tenths of a percent per count: a quarter of P, which is 32 as shipped (Feetech wiki, `parameter/memory-sts.md`).
/// An STS3215 measured 5.28 (kscalelabs/sysid, STS_3215_12V_20250317), where this constant is 5.21.
const STS_GAIN: f64 = 0.25 * 32.0 * 0.001 * 4096.0 / TAU;
/// Estimate, 1.5 % per count: the servo's register table gives no factors.
const SCS_GAIN: f64 = 15.0 * 0.001 * SCS_COUNTS_PER_TURN / TAU;

/// Feetech speed unit with phase bit 2 set, as shipped for STS: 1 step/s.
const STS_SPEED_UNIT: f64 = TAU / 4096.0;

const fn feetech_sts(name: &'static str, model_number: u16, source: &'static str) -> ServoModel {
    ServoModel {
        name,
        protocol: Protocol::Feetech,
        model_number,
        stall_torque_nm: 0.0,
        stall_current_a: 0.0,
        position_gain_share_rad: STS_GAIN,
        no_load_speed_rad_s: 0.0,
        nominal_voltage_v: 12.0,
        voltage_min_v: 9.0,
        voltage_max_v: 12.6,
        temperature_max_c: 70,
        baud_max: 1_000_000,
        counts_per_turn: 4096.0,
        count_range: (0, 4095),
        speed_unit_rad_s: STS_SPEED_UNIT,
        load_unit_share: 0.001,
        torque_limit_full: 1000,
        registers: &FEETECH_STS,
        source,
    }
}

/// Every Feetech servo that a robot file may name.
pub(super) static MODELS: &[ServoModel] = &[
    ServoModel {
        stall_torque_nm: 1.91,
        stall_current_a: 2.0,
        no_load_speed_rad_s: rpm(42.0),
        nominal_voltage_v: 6.0,
        voltage_min_v: 4.5,
        voltage_max_v: 7.4,
        ..feetech_sts("STS3215-7V4", 777, "Feetech wiki, ST-3215-C001 official specs, at 6 V")
    },
    ServoModel {
        stall_torque_nm: 2.94,
        // Estimates, for this and the next model: the maker gives no figure.
        stall_current_a: 2.7,
        no_load_speed_rad_s: rpm(45.0),
        ..feetech_sts("STS3215-12V", 777, "Feetech wiki, ST-3215-C018, at 12 V")
    },
    ServoModel {
        stall_torque_nm: 4.90,
        stall_current_a: 4.0,
        no_load_speed_rad_s: rpm(75.0),
        ..feetech_sts("STS3250", 2825, "Feetech wiki, ST-3250-C001, at 12 V")
    },
    ServoModel {
        stall_torque_nm: 0.226,
        stall_current_a: 1.0,
        position_gain_share_rad: SCS_GAIN,
        no_load_speed_rad_s: rpm(100.0),
        nominal_voltage_v: 6.0,
        voltage_min_v: 4.8,
        voltage_max_v: 8.4,
        // 300 degrees are 1024 counts; as shipped the servo accepts goals of 20 to 1003.
        counts_per_turn: SCS_COUNTS_PER_TURN,
        count_range: (20, 1003),
        speed_unit_rad_s: TAU / SCS_COUNTS_PER_TURN,
        registers: &FEETECH_SCS,
        ..feetech_sts("SCS0009", 1284, "spotpear.com, SC09 guide, at 6 V; model number: lerobot")
    },
];
