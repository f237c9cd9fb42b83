//! `[safety]`: limits that hold whatever the motion asks; every key has a default.

use super::number::Limits;
use super::reader::Section;
use crate::model::{SafetySettings, ServoModel};

/// Share of no-load speed that leaves a servo torque to follow with.
const RATE_SHARE: f64 = 0.7;
/// Above what the built-in gaits ask of a small robot, below what a jump in the goal would.
const ACCELERATION_MAX_DEG_S2: f64 = 10_000.0;
/// A quarter turn in three seconds: slow enough to step back from.
const SLOW_RATE_DEG_S: f64 = 30.0;
/// All of the stall torque.
const TORQUE_SHARE: f64 = 1.0;
/// Long enough for a limp robot to settle into the grip.
const TORQUE_RAMP_S: f64 = 1.0;
/// Ten cycles at 100 Hz: a few lost replies pass unnoticed.
const COAST_S: f64 = 0.1;
/// Time for a plug to be put back.
const HOLD_S: f64 = 2.0;
/// Twice what a healthy servo lags in a trot.
const TRACKING_ERROR_MAX_DEG: f64 = 20.0;
/// Rides out the shock of a footfall and the dip of a supply.
const FAULT_DELAY_S: f64 = 0.5;

/// The robot stops by itself this far below the heat at which the first servo would let go.
const TEMPERATURE_MARGIN_C: f64 = 5.0;

/// Reads `[safety]`; `models` are the servo models in use.
///
/// The heat limit defaults to a little below the lowest of the models' own, the voltage limit to the highest of their
/// minima. Without servos neither limits anything: infinity and 0 V.
pub(super) fn read(file: &Section<'_>, models: &[&ServoModel]) -> Option<SafetySettings> {
    file.section_or_empty("safety", "the safety limits", |section| read_settings(section, models))
}

fn read_settings(section: &Section<'_>, models: &[&ServoModel]) -> Option<SafetySettings> {
    let share = Limits::AboveToMost(0.0, 1.0);
    let rate_share = section.number_or("rate_share", "a share of the no-load speed", share, RATE_SHARE);
    let acceleration = section.number_or(
        "acceleration_max_deg_s2",
        "the largest joint acceleration in degrees/s^2",
        Limits::Positive,
        ACCELERATION_MAX_DEG_S2,
    );
    let slow_rate = section.number_or(
        "slow_rate_deg_s",
        "the joint speed of start-up and sitting in degrees/s",
        Limits::Positive,
        SLOW_RATE_DEG_S,
    );
    let torque_share = section.number_or("torque_share", "a share of the stall torque", share, TORQUE_SHARE);
    let delay = |key, meaning, default| section.number_or(key, meaning, Limits::NotNegative, default);
    let torque_ramp_s = delay("torque_ramp_s", "the time of the torque's rise in s", TORQUE_RAMP_S);
    let coast_s = delay("coast_s", "how long an unheard servo is borne, in s", COAST_S);
    let hold_s = delay("hold_s", "how long a hold lasts before the stop action, in s", HOLD_S);
    let fault_delay_s = delay("fault_delay_s", "how long a fault is borne, in s", FAULT_DELAY_S);
    let tracking_error = section.number_or(
        "tracking_error_max_deg",
        "the largest difference between goal and measurement in degrees",
        Limits::Positive,
        TRACKING_ERROR_MAX_DEG,
    );
    Some(SafetySettings {
        temperature_c: read_temperature(section, models)?,
        voltage_v: read_voltage(section, models)?,
        rate_share: rate_share?,
        acceleration_rad_s2: acceleration?.to_radians(),
        slow_rate_rad_s: slow_rate?.to_radians(),
        torque_share: torque_share?,
        torque_ramp_s: torque_ramp_s?,
        coast_s: coast_s?,
        hold_s: hold_s?,
        tracking_error_rad: tracking_error?.to_radians(),
        fault_delay_s: fault_delay_s?,
    })
}

/// A servo shuts itself off at its own limit, so a higher one would never act.
fn read_temperature(section: &Section<'_>, models: &[&ServoModel]) -> Option<f64> {
    let lowest = models.iter().map(|model| f64::from(model.temperature_max_c)).fold(f64::INFINITY, f64::min);
    let limits = if models.is_empty() { Limits::Positive } else { Limits::AboveToMost(0.0, lowest) };
    let meaning = "the highest servo temperature in degrees C, not above the servos' own limit";
    section.number_or("temperature_max_c", meaning, limits, lowest - TEMPERATURE_MARGIN_C)
}

/// One voltage limit watches all servos, so it must lie within what each of them allows.
fn read_voltage(section: &Section<'_>, models: &[&ServoModel]) -> Option<f64> {
    let highest = |a: &&&ServoModel, b: &&&ServoModel| a.voltage_min_v.total_cmp(&b.voltage_min_v);
    let lowest = |a: &&&ServoModel, b: &&&ServoModel| a.voltage_max_v.total_cmp(&b.voltage_max_v);
    let meaning = "the lowest supply voltage in V, within what the servos allow";
    let (Some(most), Some(least)) = (models.iter().max_by(highest), models.iter().min_by(lowest)) else {
        return section.number_or("voltage_min_v", meaning, Limits::NotNegative, 0.0);
    };
    if most.voltage_min_v >= least.voltage_max_v {
        section.fault(
            "voltage_min_v",
            format!(
                "servos that one voltage limit can watch: {} needs {} V or more, {} takes {} V or less",
                most.name, most.voltage_min_v, least.name, least.voltage_max_v
            ),
        );
        return None;
    }
    let limits = Limits::FromToBelow(most.voltage_min_v, least.voltage_max_v);
    section.number_or("voltage_min_v", meaning, limits, most.voltage_min_v)
}
