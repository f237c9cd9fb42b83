//! How a servo protects itself: alarms, unloading, holding torque. Source: Feetech wiki, memory-sts, addresses 13
//! to 20, 28, 34 to 38 and 65. Measured on an STS3215 (kscalelabs/sysid, STS_3215_12V_20250317): the 80 % are of
//! the drive that the position loop asks for, and the drive then falls to the holding torque.

use super::sts::*;
use super::{own, own_mut, series};
use crate::convert::round_to_i64;
use crate::servo::{Conditions, Servo};

const VOLTAGE: i64 = 1;
const TEMPERATURE: i64 = 4;
const CURRENT: i64 = 8;
const OVERLOAD: i64 = 32;
/// Unit of the protection times, s.
const TIME_UNIT_S: f64 = 0.01;
/// Largest allowed protection current, in units of 6.5 mA.
const PROTECTION_CURRENT_MAX: i64 = 500;

/// Conditions, and how long each has lasted.
#[derive(Debug, Default)]
pub(super) struct Protection {
    /// Time with more drive than the overload torque, s.
    loaded_s: f64,
    /// The drive at which the overload began; `None` while there is no overload.
    overload: Option<f64>,
    /// Time with more current than the protection current, s.
    current_s: f64,
    /// True once overcurrent has lasted too long: the torque stays off until the host switches it off.
    is_overcurrent: bool,
}

impl Protection {
    /// Called when the host has switched the torque off.
    pub(super) fn let_go(&mut self) {
        *self = Protection::default();
    }
}

/// The largest drive that the protection allows, share of the supply.
pub(super) fn drive_limit(servo: &Servo) -> f64 {
    match own(&servo.state).run.protection.overload {
        Some(_) => servo.value(series(servo).holding_torque) / 100.0 * max_torque(servo),
        None => 1.0,
    }
}

fn max_torque(servo: &Servo) -> f64 {
    servo.value(MAX_TORQUE) / 1000.0
}

/// Raises the present alarms, and unloads if the mask says so.
pub(super) fn watch(servo: &mut Servo, deci_volts: i64, current: i64, turns: bool, around: &Conditions) {
    let mask = servo.get(UNLOAD_MASK);
    let mut alarms = 0;
    // Both limits 0: the servo measures no voltage (memory-scscl).
    let (lowest, highest) = (servo.get(MIN_VOLTAGE), servo.get(MAX_VOLTAGE));
    if !(lowest..=highest).contains(&deci_volts) && (lowest, highest) != (0, 0) {
        alarms |= VOLTAGE;
    }
    if round_to_i64(servo.motor.temperature_c) > servo.get(MAX_TEMPERATURE) {
        alarms |= TEMPERATURE;
    }
    if is_overcurrent(servo, current, around.dt_s) {
        alarms |= CURRENT;
    }
    let mut unloads = alarms & mask;
    if is_overloaded(servo, mask & OVERLOAD != 0, turns, around) {
        alarms |= OVERLOAD;
        // On overload the torque falls to the holding torque, not to zero.
        unloads &= !OVERLOAD;
    }
    if unloads != 0 {
        servo.registers.set(TORQUE_SWITCH, 0);
    }
    servo.registers.set(STATUS, alarms);
}

fn is_overcurrent(servo: &mut Servo, current: i64, dt_s: f64) -> bool {
    if servo.registers.at(PROTECTION_CURRENT).is_none() {
        return false;
    }
    let most = servo.get(PROTECTION_CURRENT).min(PROTECTION_CURRENT_MAX);
    let longest_s = servo.value(OVERCURRENT_TIME) * TIME_UNIT_S;
    let protection = &mut own_mut(&mut servo.state).run.protection;
    protection.current_s = if current.abs() > most { protection.current_s + dt_s } else { 0.0 };
    protection.is_overcurrent |= protection.current_s > longest_s;
    protection.is_overcurrent
}

/// True while there is an overload. A shaft that turns is not overloaded, however hard it is driven: speed mode may
/// run for hours. Overload ends when the loop asks for less than the holding torque or for the other direction, or
/// when the host switches the torque off. Both rules are our reading; the wiki is silent.
fn is_overloaded(servo: &mut Servo, is_enabled: bool, turns: bool, around: &Conditions) -> bool {
    let series = series(servo);
    let (threshold, holding) = (servo.value(series.overload_torque), servo.value(series.holding_torque));
    let longest_s = servo.value(series.protection_time) * TIME_UNIT_S;
    let (drive, most) = (servo.motor.duty, max_torque(servo));
    let demand = own(&servo.state).run.demand;
    let protection = &mut own_mut(&mut servo.state).run.protection;
    let is_loaded = drive.abs() > threshold / 100.0 * most && !turns;
    protection.loaded_s = if is_loaded { protection.loaded_s + around.dt_s } else { 0.0 };
    if around.is_overloaded {
        protection.overload.get_or_insert(demand);
        return true;
    }
    if protection.loaded_s > longest_s && is_enabled {
        protection.overload.get_or_insert(demand);
    }
    let is_over = |began: f64| demand * began <= 0.0 || demand.abs() < holding / 100.0 * most;
    if protection.overload.is_some_and(is_over) {
        protection.overload = None;
    }
    protection.overload.is_some() || protection.loaded_s > longest_s
}
