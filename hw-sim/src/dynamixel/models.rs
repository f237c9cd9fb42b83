//! Dynamixel models. Performance: ROBOTIS e-manual model pages (stall torque, current and no-load speed at the stated
//! voltage). Inertias are guesses from gear ratio and motor size, so that a bare shaft comes to rest without ringing.

use super::x_series::{
    INDIRECT, INDIRECT_XL330, TABLE, XL330_M288, XL430_W250, XM430_W210, XM430_W350, indirect_registers,
};
use crate::model::{Model, Protocol};
use crate::registers::{Change, changed};

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
