//! Feetech models. Performance: Feetech wiki product pages ST-3215-C001, ST-3215-C018, ST-3250-C001. The STS3215 stall
//! current at 12 V and the STS3250's are estimates. Backlash: STS3250: data sheet, at most 0.5 degrees; SCS0009:
//! estimate.

use super::{scs, sts};
use crate::model::{Model, Protocol, degrees};
use crate::registers::{Change, Register, changed};

/// Unit of current of the STS series, A.
const CURRENT_UNIT_A: f64 = 0.0065;

/// 6 to 7.4 V servo: the voltage limit as seen in servos.
static STS3215_7V4: &[Change] = &[Change::Range(sts::MAX_VOLTAGE, 80, 0, 254)];
/// The table without changes.
static STS3215_12V: &[Change] = &[];
/// Model number 2825.
static STS3250: &[Change] = &[Change::Range(sts::MODEL_NUMBER, 2825, 0, 0)];

fn model(
    name: &str,
    nominal_voltage_v: f64,
    stall: (f64, f64),
    no_load_rpm: f64,
    inertia_kg_m2: f64,
    (table, changes): (&[Register], &[Change]),
) -> Model {
    let registers = changed(table, changes);
    let protocol = Protocol::Feetech;
    let model = Model::new(name, protocol, nominal_voltage_v, stall, no_load_rpm, inertia_kg_m2, registers);
    Model { current_unit_a: Some(CURRENT_UNIT_A), ..model }
}

/// An STS3215. Friction: Rhoban/bam, params/feetech_sts3215_7_4V (0.052 N m), and kscalelabs/sysid,
/// STS_3215_12V_20250317 (0.053). Inertia: the same two (0.028 and 0.027 kg m²). Backlash: about 1 degree
/// (TheRobotStudio/SO-ARM100#134). With the gain of its position loop these give an error of 2.4 degrees under 1.5
/// kg at 10 cm and 45 degrees; 1.8 to 2.6 were measured (same source).
fn sts3215(model: Model) -> Model {
    Model { friction_nm: 0.052, backlash_rad: degrees(1.0), ..model }
}

/// All models.
pub(super) fn models() -> Vec<Model> {
    let sts = |changes| (sts::TABLE, changes);
    vec![
        sts3215(model("STS3215-7V4", 6.0, (1.91, 2.0), 42.0, 0.028, sts(STS3215_7V4))),
        sts3215(model("STS3215-12V", 12.0, (2.94, 2.7), 45.0, 0.027, sts(STS3215_12V))),
        Model { backlash_rad: degrees(0.5), ..model("STS3250", 12.0, (4.90, 4.0), 75.0, 0.02, sts(STS3250)) },
        Model {
            // 300 degrees are 1024 counts.
            counts_per_turn: 1024.0 / 300.0 * 360.0,
            is_scs: true,
            current_unit_a: None,
            backlash_rad: degrees(0.5),
            ..model("SCS0009", 6.0, (0.226, 1.0), 100.0, 0.0001, (scs::TABLE, &[]))
        },
    ]
}
