//! Dynamixel models. Performance: ROBOTIS e-manual model pages (stall torque, current and no-load speed at the stated
//! voltage). Inertias are guesses from gear ratio and motor size, so that a bare shaft comes to rest without ringing.

use super::x_series::*;
use crate::model::{Model, Protocol};
use crate::registers::Change::{self, Absent, Add, Range};
use crate::registers::{changed, rw};

/// The base of this table: no changes.
static XM430_W210: &[Change] = &[];

/// Other model number and speed.
static XM430_W350: &[Change] = &[
    Range(MODEL_NUMBER, 1020, 0, 0),
    Range(VELOCITY_LIMIT, 200, 0, 1023),
    Range(GOAL_VELOCITY, 200, -1023, 1023),
];

/// Load in place of current, and no current registers.
static XL430_W250: &[Change] = &[
    Range(MODEL_NUMBER, 1060, 0, 0),
    Range(TEMPERATURE_LIMIT, 72, 0, 100),
    Range(MAX_VOLTAGE, 140, 60, 140),
    Range(MIN_VOLTAGE, 60, 60, 140),
    Absent(CURRENT_LIMIT),
    Absent(GOAL_CURRENT),
    Range(VELOCITY_LIMIT, 265, 0, 1023),
    Range(GOAL_VELOCITY, 265, -1023, 1023),
    Range(VELOCITY_I, 1000, 0, 16383),
    Range(POSITION_D, 4000, 0, 16383),
    Range(POSITION_P, 640, 0, 16383),
];

/// Current in units of 1 mA, and one more register.
static XL330_M288: &[Change] = &[
    Range(MODEL_NUMBER, 1200, 0, 0),
    // For older firmware, sources disagree on where indirect data begin.
    Range(FIRMWARE, 52, 0, 0),
    Range(BAUD, 1, 0, 6),
    Range(PROTOCOL_TYPE, 2, 2, 22),
    Range(TEMPERATURE_LIMIT, 70, 0, 100),
    Range(MAX_VOLTAGE, 70, 31, 70),
    Range(MIN_VOLTAGE, 35, 31, 70),
    Range(CURRENT_LIMIT, 1750, 0, 1750),
    Range(GOAL_CURRENT, 1750, -1750, 1750),
    Range(VELOCITY_LIMIT, 445, 0, 2047),
    Range(GOAL_VELOCITY, 445, -2047, 2047),
    Add(rw(PWM_SLOPE, 1, "PWM Slope", (140, 1, 255))),
    Range(SHUTDOWN, 53, 0, 255),
    Range(VELOCITY_I, 1600, 0, 16383),
    Range(VELOCITY_P, 180, 0, 16383),
    Range(POSITION_P, 400, 0, 16383),
];

fn model(
    name: &str,
    nominal_voltage_v: f64,
    stall: (f64, f64),
    no_load_rpm: f64,
    inertia_kg_m2: f64,
    changes: &[Change],
) -> Model {
    let (protocol, indirect) = (Protocol::Dynamixel, INDIRECT);
    let registers = changed(&[TABLE, &indirect_registers(indirect)].concat(), changes);
    let model = Model::new(name, protocol, nominal_voltage_v, stall, no_load_rpm, inertia_kg_m2, registers);
    Model { current_unit_a: Some(0.002_69), indirect, ..model }
}

/// All models.
pub(super) fn models() -> Vec<Model> {
    let xl330 = model("XL330-M288", 5.0, (0.52, 1.47), 103.0, 0.001, &[]);
    vec![
        Model {
            current_unit_a: Some(0.001),
            indirect: INDIRECT_XL330,
            registers: changed(&[TABLE, &indirect_registers(INDIRECT_XL330)].concat(), XL330_M288),
            ..xl330
        },
        // It measures load instead of current.
        Model { current_unit_a: None, ..model("XL430-W250", 11.1, (1.4, 1.3), 57.0, 0.003, XL430_W250) },
        model("XM430-W210", 12.0, (3.0, 2.3), 77.0, 0.0036, XM430_W210),
        model("XM430-W350", 12.0, (4.1, 2.3), 46.0, 0.01, XM430_W350),
    ]
}
