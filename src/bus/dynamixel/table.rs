//! Dynamixel X series. Source: ROBOTIS e-manual, control tables of XL330-M288, XL430-W250, XM430-W210 and XM430-W350.

use std::borrow::Cow;

use crate::bus::table::{
    Access, CELSIUS, DEGREES, DELAY, RPM, RegisterInfo, Scale, UNSIGNED, VOLTS, entry, fixed, setting,
    volatile,
};
use crate::model::servo_model::Encoding::TwosComplement;

const POSITION: Scale = Scale::Linear(360.0 / 4096.0, DEGREES);
const VELOCITY: Scale = Scale::Linear(0.229, RPM);
/// 214.577 rev/min^2.
const ACCELERATION: Scale = Scale::Linear(214.577 * 360.0 / 3600.0, "deg/s2");
/// Full duty is 885.
const PWM: Scale = Scale::Linear(100.0 / 885.0, "%");
const PLAIN: Scale = Scale::Plain;
/// 256 turns either way.
const TURNS_256: i64 = 1_048_575;

const MODES: &str =
    "0 current, 1 velocity, 3 position, 4 extended position, 5 current-based position, 16 PWM";
const ERRORS: &str = "bits: 1 input voltage, 4 overheating, 8 encoder, 16 electrical shock, 32 overload";

/// Models with a load register in place of current: XL430-W250 and 2XL430-W250.
const WITHOUT_CURRENT: [u16; 2] = [1060, 1090];
/// XL330-M288 and -M077.
const XL330: [u16; 2] = [1200, 1190];

/// The registers of every model, with small differences ([`table`]).
pub(super) static TABLE: &[RegisterInfo] = &[
    fixed((0, 2, UNSIGNED), "model_number", PLAIN, ""),
    fixed((2, 4, UNSIGNED), "model_information", PLAIN, ""),
    fixed((6, 1, UNSIGNED), "firmware_version", PLAIN, ""),
    setting((7, 1, UNSIGNED), "id", PLAIN, (0, 252), ""),
    setting((8, 1, UNSIGNED), "baud_rate", Scale::Baud, (0, 7), ""),
    setting((9, 1, UNSIGNED), "return_delay_time", DELAY, (0, 254), ""),
    setting(
        (10, 1, UNSIGNED),
        "drive_mode",
        PLAIN,
        (0, 13),
        "bits: 1 reverse, 4 time-based profile, 8 goal gives torque",
    ),
    setting((11, 1, UNSIGNED), "operating_mode", PLAIN, (0, 16), MODES),
    setting((12, 1, UNSIGNED), "secondary_id", PLAIN, (0, 255), "253 and above: none"),
    setting((13, 1, UNSIGNED), "protocol_type", PLAIN, (1, 22), ""),
    setting(
        (20, 4, TwosComplement),
        "homing_offset",
        POSITION,
        (-1_044_479, 1_044_479),
        "added to the encoder's value",
    ),
    setting((24, 4, UNSIGNED), "moving_threshold", VELOCITY, (0, 1023), ""),
    setting((31, 1, UNSIGNED), "temperature_limit", CELSIUS, (0, 100), ""),
    setting((32, 2, UNSIGNED), "max_voltage_limit", VOLTS, (31, 160), ""),
    setting((34, 2, UNSIGNED), "min_voltage_limit", VOLTS, (31, 160), ""),
    setting((36, 2, UNSIGNED), "pwm_limit", PWM, (0, 885), ""),
    setting((38, 2, UNSIGNED), "current_limit", Scale::Current, (0, 1750), ""),
    setting((44, 4, UNSIGNED), "velocity_limit", VELOCITY, (0, 2047), ""),
    setting((48, 4, UNSIGNED), "max_position_limit", POSITION, (0, 4095), "in position mode"),
    setting((52, 4, UNSIGNED), "min_position_limit", POSITION, (0, 4095), "in position mode"),
    setting(
        (60, 1, UNSIGNED),
        "startup_configuration",
        PLAIN,
        (0, 3),
        "bits: 1 torque on, 2 RAM from its backup",
    ),
    setting((62, 1, UNSIGNED), "pwm_slope", Scale::Linear(1.977, "mV/ms"), (1, 255), ""),
    setting((63, 1, UNSIGNED), "shutdown", PLAIN, (0, 255), ERRORS),
    volatile((64, 1, UNSIGNED), "torque_enable", PLAIN, (0, 1), ""),
    volatile((65, 1, UNSIGNED), "led", PLAIN, (0, 1), ""),
    volatile(
        (68, 1, UNSIGNED),
        "status_return_level",
        PLAIN,
        (0, 2),
        "answers: 0 pings, 1 also reads, 2 everything",
    ),
    fixed((69, 1, UNSIGNED), "registered_instruction", PLAIN, ""),
    fixed((70, 1, UNSIGNED), "hardware_error_status", PLAIN, ERRORS),
    volatile((76, 2, UNSIGNED), "velocity_i_gain", PLAIN, (0, 16383), ""),
    volatile((78, 2, UNSIGNED), "velocity_p_gain", PLAIN, (0, 16383), ""),
    volatile((80, 2, UNSIGNED), "position_d_gain", PLAIN, (0, 16383), ""),
    volatile((82, 2, UNSIGNED), "position_i_gain", PLAIN, (0, 16383), ""),
    volatile((84, 2, UNSIGNED), "position_p_gain", PLAIN, (0, 16383), ""),
    volatile((88, 2, UNSIGNED), "feedforward_2nd_gain", PLAIN, (0, 16383), ""),
    volatile((90, 2, UNSIGNED), "feedforward_1st_gain", PLAIN, (0, 16383), ""),
    volatile(
        (98, 1, TwosComplement),
        "bus_watchdog",
        Scale::Linear(20.0, "ms"),
        (0, 127),
        "0: off; below it: tripped",
    ),
    volatile((100, 2, TwosComplement), "goal_pwm", PWM, (-885, 885), ""),
    volatile((102, 2, TwosComplement), "goal_current", Scale::Current, (-1750, 1750), ""),
    volatile((104, 4, TwosComplement), "goal_velocity", VELOCITY, (-2047, 2047), ""),
    volatile(
        (108, 4, UNSIGNED),
        "profile_acceleration",
        ACCELERATION,
        (0, 32767),
        "with a time-based profile a count is 1 ms",
    ),
    volatile(
        (112, 4, UNSIGNED),
        "profile_velocity",
        VELOCITY,
        (0, 32767),
        "with a time-based profile a count is 1 ms",
    ),
    volatile((116, 4, TwosComplement), "goal_position", POSITION, (-TURNS_256, TURNS_256), ""),
    fixed((120, 2, UNSIGNED), "realtime_tick", Scale::Linear(1.0, "ms"), ""),
    fixed((122, 1, UNSIGNED), "moving", PLAIN, ""),
    fixed((123, 1, UNSIGNED), "moving_status", PLAIN, ""),
    fixed((124, 2, TwosComplement), "present_pwm", PWM, ""),
    fixed((126, 2, TwosComplement), "present_current", Scale::Current, ""),
    fixed((128, 4, TwosComplement), "present_velocity", VELOCITY, ""),
    fixed((132, 4, TwosComplement), "present_position", POSITION, ""),
    fixed((136, 4, TwosComplement), "velocity_trajectory", VELOCITY, ""),
    fixed((140, 4, TwosComplement), "position_trajectory", POSITION, ""),
    fixed((144, 2, UNSIGNED), "present_input_voltage", VOLTS, ""),
    fixed((146, 1, UNSIGNED), "present_temperature", CELSIUS, ""),
    fixed((147, 1, UNSIGNED), "backup_ready", PLAIN, ""),
];

/// One count of a current register, A; `None` if the model does not measure current.
pub(super) fn current_unit_a(model_number: u16) -> Option<f64> {
    match model_number {
        of if XL330.contains(&of) => Some(0.001),
        of if WITHOUT_CURRENT.contains(&of) => None,
        // XM430s and all unknown models.
        _ => Some(0.002_69),
    }
}

/// The registers of a model, including indirect addressing.
pub(super) fn table(model_number: u16) -> Vec<RegisterInfo> {
    let is_xl330 = XL330.contains(&model_number);
    let has_current = !WITHOUT_CURRENT.contains(&model_number);
    let mut table = Vec::new();
    for register in TABLE {
        match &*register.name {
            "current_limit" | "goal_current" if !has_current => {}
            "present_current" if !has_current => table.push(RegisterInfo {
                name: "present_load".into(),
                scale: Scale::Linear(0.1, "%"),
                ..register.clone()
            }),
            "pwm_slope" if !is_xl330 => {}
            _ => table.push(register.clone()),
        }
    }
    // First address register, first data byte, pairs.
    let rows: &[(u16, u16, u16)] =
        if is_xl330 { &[(168, 208, 20)] } else { &[(168, 224, 28), (578, 634, 28)] };
    let mut before = 0;
    for &(address, data, count) in rows {
        let name = |what: &str, n: u16| Cow::Owned(format!("indirect_{what}_{}", before + n + 1));
        table.extend((0..count).map(|n| RegisterInfo {
            name: name("address", n),
            ..entry((address + 2 * n, 2, UNSIGNED), "", Access::Volatile, PLAIN, (64, 661), "")
        }));
        table.extend((0..count).map(|n| RegisterInfo {
            name: name("data", n),
            ..entry((data + n, 1, UNSIGNED), "", Access::Volatile, PLAIN, (0, 255), "")
        }));
        before += count;
    }
    table
}
