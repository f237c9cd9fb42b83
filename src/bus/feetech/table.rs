//! Feetech STS and SCS. Source: Feetech wiki, `parameter/memory-sts.md` and `parameter/memory-scscl.md`.

use crate::bus::table::{
    CELSIUS, DEGREES, DELAY, RPM, RegisterInfo, Scale, UNSIGNED, VOLTS, fixed, setting, volatile,
};
use crate::model::servo_model::Encoding::SignMagnitude;

const PLAIN: Scale = Scale::Plain;
const PERCENT: Scale = Scale::Linear(1.0, "%");
const PERMILLE: Scale = Scale::Linear(0.1, "%");
/// Protection times count 10 ms.
const TEN_MS: Scale = Scale::Linear(10.0, "ms");
const STS_POSITION: Scale = Scale::Linear(360.0 / 4096.0, DEGREES);
/// SCS0009: 300 degrees are 1024 counts.
const SCS_POSITION: Scale = Scale::Linear(300.0 / 1024.0, DEGREES);
/// Counts a second.
const SCS_SPEED: Scale = Scale::Linear(300.0 / 1024.0 / 6.0, RPM);
/// 100 counts/s^2.
const ACCELERATION: Scale = Scale::Linear(100.0 * 360.0 / 4096.0, "deg/s2");

const MODES: &str = "0 position, 1 speed, 2 PWM, 3 step";
const ALARMS: &str = "bits: 1 voltage, 2 encoder, 4 temperature, 8 current, 32 overload";
const LEVEL: &str = "answers: 0 pings and reads, 1 everything";
const LOCK: &str = "0: written settings are kept, 1: they are lost at power-off";
const TORQUE: &str = "0 off, 1 on, 2 damping";

/// STS and SMS.
pub(super) static STS: &[RegisterInfo] = &[
    fixed((0, 1, UNSIGNED), "firmware_major", PLAIN, ""),
    fixed((1, 1, UNSIGNED), "firmware_minor", PLAIN, ""),
    fixed((2, 1, UNSIGNED), "byte_order", PLAIN, "0: low byte first, 1: high byte first"),
    fixed((3, 2, UNSIGNED), "model_number", PLAIN, ""),
    setting((5, 1, UNSIGNED), "id", PLAIN, (0, 252), ""),
    setting((6, 1, UNSIGNED), "baud_rate", Scale::Baud, (0, 7), ""),
    // Reserved in the wiki on STS; other programs use it as on SMS.
    setting((7, 1, UNSIGNED), "return_delay_time", DELAY, (0, 254), ""),
    setting((8, 1, UNSIGNED), "status_return_level", PLAIN, (0, 1), LEVEL),
    setting((9, 2, UNSIGNED), "min_position_limit", STS_POSITION, (0, 4095), "both limits 0: many turns"),
    setting((11, 2, UNSIGNED), "max_position_limit", STS_POSITION, (0, 4095), ""),
    setting((13, 1, UNSIGNED), "temperature_limit", CELSIUS, (0, 100), ""),
    setting((14, 1, UNSIGNED), "max_voltage_limit", VOLTS, (0, 254), ""),
    setting((15, 1, UNSIGNED), "min_voltage_limit", VOLTS, (0, 254), ""),
    setting((16, 2, UNSIGNED), "max_torque", PERMILLE, (0, 1000), "the torque limit after power-on"),
    setting(
        (18, 1, UNSIGNED),
        "phase",
        PLAIN,
        (0, 254),
        "bits: 1 reverse, 4 fine speed unit, 16 position beyond one turn",
    ),
    setting((19, 1, UNSIGNED), "unload_condition", PLAIN, (0, 254), ALARMS),
    setting((20, 1, UNSIGNED), "led_alarm_condition", PLAIN, (0, 254), ALARMS),
    setting((21, 1, UNSIGNED), "position_p_gain", PLAIN, (0, 254), ""),
    setting((22, 1, UNSIGNED), "position_d_gain", PLAIN, (0, 254), ""),
    setting((23, 1, UNSIGNED), "position_i_gain", PLAIN, (0, 254), ""),
    setting((24, 1, UNSIGNED), "minimum_startup_torque", PERMILLE, (0, 254), ""),
    setting((25, 1, UNSIGNED), "integral_limit", PLAIN, (0, 254), "0: none"),
    setting((26, 1, UNSIGNED), "positive_dead_band", STS_POSITION, (0, 16), ""),
    setting((27, 1, UNSIGNED), "negative_dead_band", STS_POSITION, (0, 16), ""),
    setting((28, 2, UNSIGNED), "protection_current", Scale::Current, (0, 2047), ""),
    setting((30, 1, UNSIGNED), "angle_resolution", PLAIN, (1, 128), ""),
    setting(
        (31, 2, SignMagnitude(11)),
        "homing_offset",
        STS_POSITION,
        (-2047, 2047),
        "subtracted from the encoder's value",
    ),
    setting((33, 1, UNSIGNED), "operating_mode", PLAIN, (0, 3), MODES),
    setting((34, 1, UNSIGNED), "holding_torque", PERCENT, (0, 254), "torque that remains after an overload"),
    setting((35, 1, UNSIGNED), "protection_time", TEN_MS, (0, 254), ""),
    setting((36, 1, UNSIGNED), "overload_torque", PERCENT, (0, 254), ""),
    setting((37, 1, UNSIGNED), "velocity_p_gain", PLAIN, (0, 254), ""),
    setting((38, 1, UNSIGNED), "overcurrent_time", TEN_MS, (0, 254), ""),
    setting((39, 1, UNSIGNED), "velocity_i_gain", PLAIN, (0, 254), ""),
    volatile((40, 1, UNSIGNED), "torque_enable", PLAIN, (0, 2), TORQUE),
    volatile((41, 1, UNSIGNED), "acceleration", ACCELERATION, (0, 254), "0: the highest"),
    volatile((42, 2, SignMagnitude(15)), "goal_position", STS_POSITION, (-32_767, 32_767), ""),
    volatile((44, 2, SignMagnitude(10)), "goal_pwm", PERMILLE, (-1000, 1000), ""),
    volatile((46, 2, SignMagnitude(15)), "goal_velocity", Scale::PhasedSpeed, (-32_767, 32_767), ""),
    volatile((48, 2, UNSIGNED), "torque_limit", PERMILLE, (0, 1000), ""),
    volatile((55, 1, UNSIGNED), "lock", PLAIN, (0, 1), LOCK),
    fixed((56, 2, SignMagnitude(15)), "present_position", STS_POSITION, ""),
    fixed((58, 2, SignMagnitude(15)), "present_velocity", Scale::PhasedSpeed, ""),
    fixed((60, 2, SignMagnitude(10)), "present_load", PERMILLE, ""),
    fixed((62, 1, UNSIGNED), "present_input_voltage", VOLTS, ""),
    fixed((63, 1, UNSIGNED), "present_temperature", CELSIUS, ""),
    fixed((64, 1, UNSIGNED), "registered_instruction", PLAIN, ""),
    fixed((65, 1, UNSIGNED), "hardware_error_status", PLAIN, ALARMS),
    fixed((66, 1, UNSIGNED), "moving", PLAIN, ""),
    fixed((67, 2, SignMagnitude(15)), "goal_position_read_back", STS_POSITION, ""),
    fixed((69, 2, SignMagnitude(15)), "present_current", Scale::Current, ""),
    fixed((80, 1, UNSIGNED), "factory_80", PLAIN, "moving threshold"),
    fixed((81, 1, UNSIGNED), "factory_81", PLAIN, "dead time, ms"),
    fixed((82, 1, UNSIGNED), "factory_82", PLAIN, "speed unit"),
    fixed((83, 1, UNSIGNED), "factory_83", PLAIN, "lowest speed"),
    fixed((84, 1, UNSIGNED), "factory_84", PLAIN, "highest speed"),
    fixed((85, 1, UNSIGNED), "factory_85", PLAIN, "acceleration limit"),
    fixed((86, 1, UNSIGNED), "factory_86", PLAIN, "acceleration multiplier"),
];

/// SCS, words high byte first.
pub(super) static SCS: &[RegisterInfo] = &[
    fixed((0, 1, UNSIGNED), "firmware_major", PLAIN, ""),
    fixed((1, 1, UNSIGNED), "firmware_minor", PLAIN, ""),
    fixed((2, 1, UNSIGNED), "byte_order", PLAIN, "0: low byte first, 1: high byte first"),
    fixed((3, 2, UNSIGNED), "model_number", PLAIN, ""),
    setting((5, 1, UNSIGNED), "id", PLAIN, (0, 252), ""),
    setting((6, 1, UNSIGNED), "baud_rate", Scale::Baud, (0, 7), ""),
    setting((7, 1, UNSIGNED), "return_delay_time", DELAY, (0, 254), ""),
    setting((8, 1, UNSIGNED), "status_return_level", PLAIN, (0, 1), LEVEL),
    setting(
        (9, 2, UNSIGNED),
        "min_position_limit",
        SCS_POSITION,
        (0, 1023),
        "both limits 0: turns as a motor",
    ),
    setting((11, 2, UNSIGNED), "max_position_limit", SCS_POSITION, (0, 1023), ""),
    setting((13, 1, UNSIGNED), "temperature_limit", CELSIUS, (0, 100), ""),
    setting((14, 1, UNSIGNED), "max_voltage_limit", VOLTS, (0, 254), ""),
    setting((15, 1, UNSIGNED), "min_voltage_limit", VOLTS, (0, 254), ""),
    setting((16, 2, UNSIGNED), "max_torque", PERMILLE, (0, 1000), ""),
    setting((18, 1, UNSIGNED), "phase", PLAIN, (0, 254), ""),
    setting((19, 1, UNSIGNED), "unload_condition", PLAIN, (0, 254), ALARMS),
    setting((20, 1, UNSIGNED), "led_alarm_condition", PLAIN, (0, 254), ALARMS),
    setting((21, 1, UNSIGNED), "position_p_gain", PLAIN, (0, 254), ""),
    setting((22, 1, UNSIGNED), "position_d_gain", PLAIN, (0, 254), ""),
    setting((23, 1, UNSIGNED), "position_i_gain", PLAIN, (0, 254), ""),
    setting((24, 2, UNSIGNED), "minimum_startup_torque", PERMILLE, (0, 1000), ""),
    setting((26, 1, UNSIGNED), "positive_dead_band", SCS_POSITION, (0, 16), ""),
    setting((27, 1, UNSIGNED), "negative_dead_band", SCS_POSITION, (0, 16), ""),
    setting((37, 1, UNSIGNED), "holding_torque", PERCENT, (0, 254), "torque that remains after an overload"),
    setting((38, 1, UNSIGNED), "protection_time", TEN_MS, (0, 254), ""),
    setting((39, 1, UNSIGNED), "overload_torque", PERCENT, (0, 254), ""),
    volatile((40, 1, UNSIGNED), "torque_enable", PLAIN, (0, 2), TORQUE),
    volatile((42, 2, UNSIGNED), "goal_position", SCS_POSITION, (0, 1023), ""),
    volatile(
        (44, 2, UNSIGNED),
        "goal_time",
        Scale::Linear(1.0, "ms"),
        (0, 9999),
        "as a motor: PWM, sign in bit 10",
    ),
    volatile((46, 2, UNSIGNED), "goal_velocity", SCS_SPEED, (0, 1000), ""),
    volatile((48, 1, UNSIGNED), "lock", PLAIN, (0, 1), LOCK),
    fixed((56, 2, UNSIGNED), "present_position", SCS_POSITION, ""),
    fixed((58, 2, SignMagnitude(15)), "present_velocity", SCS_SPEED, ""),
    fixed((60, 2, SignMagnitude(10)), "present_load", PERMILLE, ""),
    fixed((62, 1, UNSIGNED), "present_input_voltage", VOLTS, ""),
    fixed((63, 1, UNSIGNED), "present_temperature", CELSIUS, ""),
    fixed((64, 1, UNSIGNED), "registered_instruction", PLAIN, ""),
    fixed((65, 1, UNSIGNED), "hardware_error_status", PLAIN, ALARMS),
    fixed((66, 1, UNSIGNED), "moving", PLAIN, ""),
];
