//! Servo models as data. Performance: ROBOTIS e-manual model pages (stall torque, current and no-load speed at the
//! stated voltage); Feetech wiki product pages ST-3215-C001, ST-3215-C018, ST-3250-C001. The makers do not publish
//! inertia and friction: the values are measurements by others, or estimates, and are marked so.

use std::f64::consts::TAU;

use crate::config::Protocol;
use crate::registers::{Change, Register, dynamixel_x, feetech_scs, feetech_sts};

/// Encoder counts in one turn of the shaft, for every model with a magnetic encoder.
pub(crate) const COUNTS_PER_TURN: i64 = 4096;

/// One servo model.
#[derive(Debug)]
pub struct Model {
    /// Name in configurations.
    pub name: &'static str,
    /// Its protocol.
    pub protocol: Protocol,
    /// Supply voltage of the figures below, V.
    pub nominal_voltage_v: f64,
    /// Torque at standstill and full duty, N m.
    pub stall_torque_nm: f64,
    /// Speed at full duty without load, rad/s.
    pub no_load_speed_rad_s: f64,
    /// Winding current at stall, A.
    pub stall_current_a: f64,
    /// Inertia of rotor and gears at the shaft, kg m² (estimate).
    pub reflected_inertia_kg_m2: f64,
    /// Coulomb friction of the gearbox, N m (where not measured, estimate: 0.02 of stall torque).
    pub friction_nm: f64,
    /// Share of the external torque that the gearbox at rest holds by itself.
    pub holding_share: f64,
    /// Free play of the shaft, rad.
    pub backlash_rad: f64,
    /// Counts of the position registers in one turn of the shaft.
    pub counts_per_turn: f64,
    /// True for Feetech's SCS series: a potentiometer, 10 bit, the high byte first.
    pub(crate) is_scs: bool,
    pub(crate) table: &'static [Register],
    pub(crate) changes: &'static [Change],
}

/// The same as a factor, counts/rad.
pub(crate) const COUNTS_PER_RAD: f64 = 4096.0 / TAU;

const fn degrees(value: f64) -> f64 {
    value * TAU / 360.0
}

const fn rpm(value: f64) -> f64 {
    value * TAU / 60.0
}

const fn model(
    name: &'static str,
    protocol: Protocol,
    nominal_voltage_v: f64,
    (stall_torque_nm, stall_current_a): (f64, f64),
    no_load_rpm: f64,
    reflected_inertia_kg_m2: f64,
    changes: &'static [Change],
) -> Model {
    let table = match protocol {
        Protocol::Dynamixel => dynamixel_x::TABLE,
        Protocol::Feetech => feetech_sts::TABLE,
    };
    Model {
        name,
        protocol,
        nominal_voltage_v,
        stall_torque_nm,
        no_load_speed_rad_s: rpm(no_load_rpm),
        stall_current_a,
        reflected_inertia_kg_m2,
        friction_nm: 0.02 * stall_torque_nm,
        holding_share: HOLDING_SHARE,
        backlash_rad: degrees(0.25),
        counts_per_turn: 4096.0,
        is_scs: false,
        table,
        changes,
    }
}

use Protocol::{Dynamixel, Feetech};

/// Measured on the STS3215 (kscalelabs/sysid, STS_3215_12V_20250317, model M4: 0.30), and used for all models.
const HOLDING_SHARE: f64 = 0.30;

/// An STS3215. Friction: Rhoban/bam, params/feetech_sts3215_7_4V (0.052 N m), and kscalelabs/sysid,
/// STS_3215_12V_20250317 (0.053). Inertia: the same two (0.028 and 0.027 kg m²). Backlash: about 1 degree
/// (TheRobotStudio/SO-ARM100#134). With the gain of its position loop these give an error of 2.4 degrees under 1.5
/// kg at 10 cm and 45 degrees; 1.8 to 2.6 were measured (same source).
const fn sts3215(model: Model) -> Model {
    Model { friction_nm: 0.052, backlash_rad: degrees(1.0), ..model }
}

/// All models. Dynamixel inertias are guesses from gear ratio and motor size, so that a bare shaft comes to rest
/// without ringing. The STS3215 stall current at 12 V and the STS3250's are estimates too. Backlash: ROBOTIS states
/// 0.25 degrees for the XM430, used here for the XL series too; STS3250: data sheet, at most 0.5; SCS0009:
/// estimate.
///
/// No maker states a dead time. STS3250's data sheet gives 1 ms as the longest period of its position loop: here a
/// goal takes effect at the next motor step, which has the same length.
pub static MODELS: [Model; 8] = [
    model("XL330-M288", Dynamixel, 5.0, (0.52, 1.47), 103.0, 0.001, dynamixel_x::XL330_M288),
    model("XL430-W250", Dynamixel, 11.1, (1.4, 1.3), 57.0, 0.003, dynamixel_x::XL430_W250),
    model("XM430-W210", Dynamixel, 12.0, (3.0, 2.3), 77.0, 0.0036, dynamixel_x::XM430_W210),
    model("XM430-W350", Dynamixel, 12.0, (4.1, 2.3), 46.0, 0.01, dynamixel_x::XM430_W350),
    sts3215(model("STS3215-7V4", Feetech, 6.0, (1.91, 2.0), 42.0, 0.028, feetech_sts::STS3215_7V4)),
    sts3215(model("STS3215-12V", Feetech, 12.0, (2.94, 2.7), 45.0, 0.027, feetech_sts::STS3215_12V)),
    Model {
        backlash_rad: degrees(0.5),
        ..model("STS3250", Feetech, 12.0, (4.90, 4.0), 75.0, 0.02, feetech_sts::STS3250)
    },
    Model {
        // 300 degrees are 1024 counts.
        counts_per_turn: 1024.0 / 300.0 * 360.0,
        is_scs: true,
        table: feetech_scs::TABLE,
        backlash_rad: degrees(0.5),
        ..model("SCS0009", Feetech, 6.0, (0.226, 1.0), 100.0, 0.0001, &[])
    },
];

impl Model {
    /// The model of this name.
    pub(crate) fn named(name: &str) -> Option<&'static Model> {
        MODELS.iter().find(|model| model.name == name)
    }

    /// Counts of the position registers in a radian of the shaft.
    pub(crate) fn counts_per_rad(&self) -> f64 {
        self.counts_per_turn / TAU
    }

    /// Torque lost for each unit of speed, N m s/rad.
    pub(crate) fn back_emf_nm_s(&self) -> f64 {
        self.stall_torque_nm / self.no_load_speed_rad_s
    }

    /// Time from power-on or a restart until it hears and answers, ns. Feetech wiki, ft-scs 4.12: about 1800 ms.
    /// ROBOTIS states none; 0.4 s were measured on an XC330 (ROBOTIS-GIT/emanual issue 1698).
    pub(crate) fn start_ns(&self) -> u64 {
        match self.protocol {
            Protocol::Dynamixel => 400_000_000,
            Protocol::Feetech => 1_800_000_000,
        }
    }

    /// Supply below which it stops; it restarts when the supply is higher again, V. This is the limit of its
    /// processor. No maker states it: estimate for a 3.3 V processor behind a regulator.
    pub(crate) fn brown_out_v(&self) -> f64 {
        3.0
    }

    /// Code of the fastest line rate it knows.
    pub(crate) fn highest_baud_code(&self) -> i64 {
        let address = match self.protocol {
            Protocol::Dynamixel => dynamixel_x::BAUD,
            Protocol::Feetech => feetech_sts::BAUD,
        };
        self.registers()
            .iter()
            .find(|register| register.address == address)
            .map_or(0, |register| register.max)
    }

    /// The model's control table: its family's, with the model's own changes.
    pub(crate) fn registers(&self) -> Vec<Register> {
        let mut table = self.table.to_vec();
        for change in self.changes {
            match *change {
                Change::Absent(address) => table.retain(|register| register.address != address),
                Change::Add(register) => table.push(register),
                Change::Range(address, default, min, max) => {
                    for register in table.iter_mut().filter(|register| register.address == address) {
                        (register.default, register.min, register.max) = (default, min, max);
                    }
                }
            }
        }
        if self.protocol == Protocol::Dynamixel {
            table.extend(dynamixel_x::indirect_registers(self.name));
        }
        table.sort_by_key(|register| register.address);
        table
    }
}
