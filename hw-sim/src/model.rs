//! A servo model as a value: performance, counts, control table. The models that come with the crate are in the
//! folders of the protocols.
//!
//! The makers do not publish inertia and friction: the values are measurements by others, or estimates, and are marked
//! so. No maker states a dead time. STS3250's data sheet gives 1 ms as the longest period of its position loop: here a
//! goal takes effect at the next motor step, which has the same length.

use std::f64::consts::TAU;

use crate::registers::{IndirectBlock, Register};

/// The protocol of a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// ROBOTIS Dynamixel Protocol 2.0.
    Dynamixel,
    /// Feetech FT-SCS.
    Feetech,
}

/// Encoder counts in one turn of the shaft, for every model with a magnetic encoder.
pub(crate) const COUNTS_PER_TURN: i64 = 4096;
/// The same as a factor, counts/rad.
pub(crate) const COUNTS_PER_RAD: f64 = 4096.0 / TAU;

/// Measured on the STS3215 (kscalelabs/sysid, STS_3215_12V_20250317, model M4: 0.30), and used for all models.
const HOLDING_SHARE: f64 = 0.30;

/// One servo model.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Its name, for people.
    pub name: String,
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
    /// One unit of its current registers, A; `None` if it has none.
    pub current_unit_a: Option<f64>,
    /// Its control table, by address: every register with its value as shipped and its range.
    pub registers: Vec<Register>,
    /// True for Feetech's SCS series: a potentiometer, 10 bit, the high byte first.
    pub is_scs: bool,
    /// Its indirect addressing (Dynamixel).
    pub indirect: &'static [IndirectBlock],
}

/// Degrees in rad.
pub(crate) const fn degrees(value: f64) -> f64 {
    value * TAU / 360.0
}

const fn rpm(value: f64) -> f64 {
    value * TAU / 60.0
}

impl Model {
    /// A model with a magnetic encoder, and guesses for what its maker does not publish. Backlash: ROBOTIS states 0.25
    /// degrees for the XM430.
    pub(crate) fn new(
        name: &str,
        protocol: Protocol,
        nominal_voltage_v: f64,
        (stall_torque_nm, stall_current_a): (f64, f64),
        no_load_rpm: f64,
        reflected_inertia_kg_m2: f64,
        registers: Vec<Register>,
    ) -> Model {
        Model {
            name: name.to_owned(),
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
            current_unit_a: None,
            registers,
            is_scs: false,
            indirect: &[],
        }
    }

    /// Counts of the position registers in a radian of the shaft.
    pub(crate) fn counts_per_rad(&self) -> f64 {
        self.counts_per_turn / TAU
    }

    /// Torque lost for each unit of speed, N m s/rad.
    pub(crate) fn back_emf_nm_s(&self) -> f64 {
        self.stall_torque_nm / self.no_load_speed_rad_s
    }

    /// Supply below which it stops; it restarts when the supply is higher again, V. This is the limit of its
    /// processor. No maker states it: estimate for a 3.3 V processor behind a regulator.
    pub(crate) fn brown_out_v(&self) -> f64 {
        3.0
    }

    /// Largest value of the register at this address; 0 if the model lacks it.
    pub(crate) fn largest(&self, address: u16) -> i64 {
        let register = self.registers.iter().find(|register| register.address == address);
        register.map_or(0, |register| register.max)
    }
}
