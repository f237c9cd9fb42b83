//! Conditions in which a Dynamixel stops by itself: hardware errors and the bus watchdog. Source: ROBOTIS
//! e-manual, X-series, Shutdown (63), Hardware Error Status (70), Bus Watchdog (98).

use super::control::{self, is_torque_on};
use super::state::own_mut;
use super::x_series::*;
use crate::servo::{Conditions, Servo};

const ERROR_VOLTAGE: i64 = 1;
const ERROR_TEMPERATURE: i64 = 4;
const ERROR_OVERLOAD: i64 = 32;
/// Value of Bus Watchdog once it has tripped.
const WATCHDOG_TRIPPED: i64 = -1;
/// Bus Watchdog unit, ns: 20 ms.
const WATCHDOG_UNIT_NS: u64 = 20_000_000;
/// How long a motor may stand at its limit, s. The manual mentions a persistent load and gives no time: our
/// choice.
const OVERLOAD_S: f64 = 2.0;
/// Speed below which the shaft counts as standing, rad/s: the factory's Moving Threshold.
const STANDING_RAD_S: f64 = 10.0 * control::VELOCITY_UNIT_RAD_S;

/// Sets hardware errors. Errors stay until a reboot; those in the Shutdown mask also switch the torque off
/// until then.
pub(super) fn watch_hardware(
    servo: &mut Servo,
    deci_volts: i64,
    celsius: i64,
    speed_rad_s: f64,
    around: &Conditions,
) {
    let mut errors = servo.get(HARDWARE_ERROR);
    if !(servo.get(MIN_VOLTAGE)..=servo.get(MAX_VOLTAGE)).contains(&deci_volts) {
        errors |= ERROR_VOLTAGE;
    }
    if celsius > servo.get(TEMPERATURE_LIMIT) {
        errors |= ERROR_TEMPERATURE;
    }
    let motion = &mut own_mut(&mut servo.state).motion;
    let is_stalled = motion.is_at_limit && speed_rad_s.abs() < STANDING_RAD_S;
    motion.stalled_s = if is_stalled { motion.stalled_s + around.dt_s } else { 0.0 };
    if motion.stalled_s > OVERLOAD_S || around.is_overloaded {
        errors |= ERROR_OVERLOAD;
    }
    servo.registers.set(HARDWARE_ERROR, errors);
    if errors & servo.get(SHUTDOWN) != 0 {
        servo.is_shut_down = true;
        servo.registers.set(TORQUE_ENABLE, 0);
    }
}

pub(super) fn has_watchdog_tripped(servo: &Servo) -> bool {
    servo.get(BUS_WATCHDOG) == WATCHDOG_TRIPPED
}

/// Stops a servo with torque that has not heard its bus for the time in Bus Watchdog. The manual says that it
/// stops, but not how: here it holds its position, torque on, or brakes in the modes without a position. It
/// drops its goal, so that it stays there when the error is cleared.
pub(super) fn watch_bus(servo: &mut Servo, now_ns: u64) {
    let Ok(units @ 1..) = u64::try_from(servo.get(BUS_WATCHDOG)) else { return };
    if is_torque_on(servo) && now_ns.saturating_sub(servo.heard_ns) >= units * WATCHDOG_UNIT_NS {
        servo.registers.set(BUS_WATCHDOG, WATCHDOG_TRIPPED);
        servo.registers.set(PROFILE_ACCELERATION, 0);
        servo.registers.set(PROFILE_VELOCITY, 0);
        servo.registers.set(control::goal_register(servo), 0);
        control::hold(servo);
    }
}
