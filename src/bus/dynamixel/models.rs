//! Dynamixel models that a robot file may name, and the registers that the loop uses. Sources: ROBOTIS e-manual pages
//! and control tables of each X-series model.

use std::f64::consts::TAU;

use super::table;
use crate::bus::table::{named, rpm};
use crate::model::servo_model::Register;
use crate::model::{OVERLOAD_ALARM, Protocol, Registers, ServoModel};

/// The register of this name.
const fn x(name: &str) -> Register {
    named(table::TABLE, name)
}

/// Dynamixel X-series (e-manual control tables of XL330-M288, XL430-W250, XM430-W210, XM430-W350).
/// Goal PWM (100) serves as the torque limit: every model has it in position mode.
pub(in crate::bus) static DYNAMIXEL_X: Registers = Registers {
    is_big_endian: false,
    has_sync_read: true,
    model_number: x("model_number"),
    firmware: (x("firmware_version"), None),
    // Operating Mode 3 is position control; in mode 16 this register would drive the motor directly.
    expected: &[(x("operating_mode"), 3)],
    return_delay: Some(x("return_delay_time")),
    preparation: &[
        (x("torque_enable"), 0),
        (x("bus_watchdog"), 0),
        // Profile Acceleration and Profile Velocity: 0 is no limit.
        (x("profile_acceleration"), 0),
        (x("profile_velocity"), 0),
    ],
    torque_enable: x("torque_enable"),
    // The servo adds Homing Offset to a count that has already wrapped: the offset does not move the seam.
    set_middle: &[],
    bus_watchdog: Some(x("bus_watchdog")),
    torque_limit: x("goal_pwm"),
    goal_position: x("goal_position"),
    present_position: x("present_position"),
    present_speed: x("present_velocity"),
    present_load: x("present_current"),
    load_is_drive: false,
    present_voltage: x("present_input_voltage"),
    present_temperature: x("present_temperature"),
    // Hardware Error Status.
    alarm_status: x("hardware_error_status"),
    alarm_names: &[
        (0x01, "input voltage"),
        (0x04, "overheating"),
        (0x08, "encoder"),
        (0x10, "electrical shock"),
        (OVERLOAD_ALARM, "overload"),
    ],
    tells_alarms: false,
    feedback_address: 126,
    feedback_bytes: 21,
};

/// Gain share from a Dynamixel's Position P Gain: P / 128 steps of PWM per count, where 885 steps are full
/// drive (e-manual, Position PID Gain, and PWM Limit).
const fn dynamixel_gain(p_gain: f64) -> f64 {
    p_gain / 128.0 / 885.0 * 4096.0 / TAU
}

/// Dynamixel speed unit: 0.229 rpm.
const DYNAMIXEL_SPEED_UNIT: f64 = rpm(0.229);

const fn dynamixel_x(name: &'static str, model_number: u16, source: &'static str) -> ServoModel {
    ServoModel {
        name,
        protocol: Protocol::Dynamixel,
        model_number,
        stall_torque_nm: 0.0,
        stall_current_a: 0.0,
        position_gain_share_rad: dynamixel_gain(800.0),
        no_load_speed_rad_s: 0.0,
        nominal_voltage_v: 12.0,
        voltage_min_v: 10.0,
        voltage_max_v: 14.8,
        temperature_max_c: 80,
        baud_max: 4_500_000,
        counts_per_turn: 4096.0,
        count_range: (0, 4095),
        speed_unit_rad_s: DYNAMIXEL_SPEED_UNIT,
        load_unit_share: 0.001,
        torque_limit_full: 885,
        registers: &DYNAMIXEL_X,
        source,
    }
}

/// Every Dynamixel that a robot file may name.
pub(super) static MODELS: &[ServoModel] = &[
    ServoModel {
        stall_torque_nm: 0.52,
        stall_current_a: 1.47,
        position_gain_share_rad: dynamixel_gain(400.0),
        no_load_speed_rad_s: rpm(103.0),
        nominal_voltage_v: 5.0,
        voltage_min_v: 3.7,
        voltage_max_v: 6.0,
        temperature_max_c: 70,
        baud_max: 4_000_000,
        // Present Current, 1 mA per unit; stall current 1.47 A at 5 V.
        load_unit_share: 0.001 / 1.47,
        ..dynamixel_x("XL330-M288", 1200, "ROBOTIS e-manual, XL330-M288-T")
    },
    ServoModel {
        stall_torque_nm: 1.4,
        stall_current_a: 1.3,
        position_gain_share_rad: dynamixel_gain(640.0),
        no_load_speed_rad_s: rpm(57.0),
        nominal_voltage_v: 11.1,
        voltage_min_v: 6.5,
        voltage_max_v: 12.0,
        temperature_max_c: 72,
        // This model has Present Load instead of Present Current: 0.1 % per unit.
        ..dynamixel_x("XL430-W250", 1060, "ROBOTIS e-manual, XL430-W250-T")
    },
    ServoModel {
        stall_torque_nm: 3.0,
        stall_current_a: 2.3,
        no_load_speed_rad_s: rpm(77.0),
        // Present Current, 2.69 mA per unit; stall current 2.3 A at 12 V.
        load_unit_share: 0.002_69 / 2.3,
        ..dynamixel_x("XM430-W210", 1030, "ROBOTIS e-manual, XM430-W210")
    },
    ServoModel {
        stall_torque_nm: 4.1,
        stall_current_a: 2.3,
        no_load_speed_rad_s: rpm(46.0),
        load_unit_share: 0.002_69 / 2.3,
        ..dynamixel_x("XM430-W350", 1020, "ROBOTIS e-manual, XM430-W350")
    },
];
