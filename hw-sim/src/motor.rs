//! The DC motor and its heat. In: duty, speed, supply. Out: torque, current, temperature. Knows no registers.

use crate::model::Model;

/// Temperature of a servo that has not moved yet, °C.
pub(crate) const REST_TEMPERATURE_C: f64 = 30.0;
/// Final temperature rise of a servo held at stall, K. Estimate: makers give limits of 70 to 80 °C and advise
/// against more than a fifth of stall torque for long.
const STALL_HEATING_K: f64 = 120.0;
/// Time constant of warming, s. Estimate for a case of some 60 g.
const HEATING_TIME_S: f64 = 300.0;

/// What the servo's controller asks of the bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Drive {
    /// Bridge open: no current, so no torque and no back-EMF.
    Off,
    /// Share of the supply on the motor, -1..=1. At 0 the motor is shorted and brakes.
    Duty(f64),
}

/// The state of a motor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motor {
    /// Share of the supply applied, -1..=1.
    pub(crate) duty: f64,
    /// Torque before gearbox friction, N m.
    pub(crate) torque_nm: f64,
    /// Winding and case temperature, °C.
    pub(crate) temperature_c: f64,
}

impl Motor {
    pub(crate) fn at_rest() -> Motor {
        Motor { duty: 0.0, torque_nm: 0.0, temperature_c: REST_TEMPERATURE_C }
    }

    /// Torque of this step, N m: the straight line from stall torque to no-load speed. Duty scales it with the
    /// supply, while the back-EMF term depends on speed alone.
    pub(crate) fn torque(&mut self, model: &Model, drive: Drive, supply_v: f64, speed_rad_s: f64) -> f64 {
        (self.duty, self.torque_nm) = match drive {
            Drive::Off => (0.0, 0.0),
            Drive::Duty(duty) => {
                let pushing = model.stall_torque_nm * supply_v / model.nominal_voltage_v * duty;
                (duty, pushing - model.back_emf_nm_s() * speed_rad_s)
            }
        };
        self.torque_nm
    }

    /// Winding current, A, with the sign of the torque.
    pub(crate) fn current_a(&self, model: &Model) -> f64 {
        self.torque_nm / model.stall_torque_nm * model.stall_current_a
    }

    /// Supply current, A: the bridge converts the duty's share of the voltage into the winding's current. Negative
    /// while the motor brakes into the supply.
    pub(crate) fn supply_current_a(&self, model: &Model) -> f64 {
        self.duty * self.current_a(model)
    }

    /// First-order warming with the square of the load.
    pub(crate) fn warm(&mut self, model: &Model, dt_s: f64) {
        let load = self.torque_nm / model.stall_torque_nm;
        let goal = REST_TEMPERATURE_C + STALL_HEATING_K * load * load;
        self.temperature_c += (goal - self.temperature_c) * dt_s / HEATING_TIME_S;
    }
}
