//! What a Dynamixel X does with its registers: modes, feedback, hardware errors.
//! Source: ROBOTIS e-manual, X-series. Position, extended position, current-based position and PWM modes turn
//! the motor; current and velocity mode, profiles, the I and D gains, feedforward, overload detection and
//! indirect addressing are not simulated yet.

use super::packet::{Request, STATUS};
use crate::convert::round_to_i64;
use crate::model::COUNTS_PER_TURN;
use crate::motor::Drive;
use crate::registers::dynamixel_x::*;
use crate::registers::{Access, Register};
use crate::servo::{Servo, Surroundings};

const MODE_CURRENT: i64 = 0;
const MODE_VELOCITY: i64 = 1;
const MODE_POSITION: i64 = 3;
const MODE_EXTENDED: i64 = 4;
const MODE_CURRENT_POSITION: i64 = 5;
const MODE_PWM: i64 = 16;

const ERROR_VOLTAGE: i64 = 1;
const ERROR_TEMPERATURE: i64 = 4;
const ERROR_OVERLOAD: i64 = 32;
/// Drive Mode: counts grow the other way.
const REVERSE: i64 = 1;
/// Value of Goal PWM and Present PWM that is full duty.
const PWM_FULL: f64 = 885.0;
/// Value of Position P Gain that is one PWM unit a count.
const P_GAIN_ONE: f64 = 128.0;
/// Velocity unit, rad/s: 0.229 rpm.
const VELOCITY_UNIT: f64 = 0.229 * std::f64::consts::TAU / 60.0;
/// Bus Watchdog unit, ns: 20 ms.
const WATCHDOG_UNIT_NS: u64 = 20_000_000;
/// What Bus Watchdog reads once it has tripped.
const WATCHDOG_TRIPPED: i64 = -1;
/// Largest homing offset position mode honours.
const HOMING_MAX: i64 = 1024;

pub(crate) fn power_on(servo: &mut Servo, id: u8, baud_code: i64, delay_units: i64) {
    servo.registers.set(ID, i64::from(id));
    servo.registers.set(BAUD, baud_code);
    servo.registers.set(RETURN_DELAY, delay_units);
    leave_turns_out(servo);
    servo.registers.set(GOAL_POSITION, servo.get(PRESENT_POSITION));
}

/// The start from the EEPROM.
pub(crate) fn power_up(servo: &mut Servo) {
    servo.registers.reset_from(EEPROM_END);
    for (goal, limit) in
        [(GOAL_PWM, PWM_LIMIT), (GOAL_CURRENT, CURRENT_LIMIT), (GOAL_VELOCITY, VELOCITY_LIMIT)]
    {
        servo.registers.set(goal, servo.get(limit));
    }
    leave_turns_out(servo);
    servo.registers.set(GOAL_POSITION, servo.get(PRESENT_POSITION));
}

pub(crate) fn is_torque_on(servo: &Servo) -> bool {
    servo.get(TORQUE_ENABLE) == 1
}

/// 1 or -1: which way registers count.
fn direction(servo: &Servo) -> i64 {
    if servo.get(DRIVE_MODE) & REVERSE == 0 { 1 } else { -1 }
}

/// Current unit, A: 1 mA on the XL330, 2.69 mA on the XM430; `None` where the model measures load instead.
fn current_unit(servo: &Servo) -> Option<f64> {
    match servo.get(CURRENT_LIMIT) {
        _ if servo.registers.at(CURRENT_LIMIT).is_none() => None,
        _ if servo.model.name.starts_with("XL330") => Some(0.001),
        _ => Some(0.002_69),
    }
}

fn present_counts(servo: &Servo) -> i64 {
    let mut homing = servo.get(HOMING_OFFSET);
    if servo.get(OPERATING_MODE) == MODE_POSITION {
        homing = homing.clamp(-HOMING_MAX, HOMING_MAX);
    }
    direction(servo) * servo.encoder_counts - servo.turns_left_out + homing
}

/// Makes Present Position an angle within one turn again, as at power-on, at torque-on in position mode, and at
/// the change to position mode (e-manual, Operating Mode, note on Present Position).
fn leave_turns_out(servo: &mut Servo) {
    let counts = direction(servo) * servo.encoder_counts;
    servo.turns_left_out = counts - counts.rem_euclid(COUNTS_PER_TURN);
    servo.registers.set(PRESENT_POSITION, present_counts(servo));
}

/// May the host write this number now? Goals have the limit registers for a range, and none after the bus
/// watchdog has tripped, until 0 is written to it. That no other number is taken then is our reading.
pub(crate) fn accepts(servo: &Servo, register: &Register, value: i64) -> bool {
    let within = |limit: u16| value.abs() <= servo.get(limit);
    register.access == Access::ReadWrite
        && match register.address {
            GOAL_PWM | GOAL_CURRENT | GOAL_VELOCITY | GOAL_POSITION if has_watchdog_tripped(servo) => false,
            BUS_WATCHDOG if has_watchdog_tripped(servo) => value == 0,
            GOAL_PWM => within(PWM_LIMIT),
            GOAL_CURRENT => within(CURRENT_LIMIT),
            GOAL_VELOCITY => within(VELOCITY_LIMIT),
            GOAL_POSITION if servo.get(OPERATING_MODE) == MODE_POSITION => {
                (servo.get(MIN_POSITION)..=servo.get(MAX_POSITION)).contains(&value)
            }
            OPERATING_MODE => match value {
                MODE_CURRENT | MODE_CURRENT_POSITION => servo.registers.at(CURRENT_LIMIT).is_some(),
                MODE_VELOCITY | MODE_POSITION | MODE_EXTENDED | MODE_PWM => true,
                _ => false,
            },
            _ => (register.min..=register.max).contains(&value),
        }
}

/// Side effects of a write to the register at `address`, which held `before`.
pub(crate) fn written(servo: &mut Servo, address: u16, before: i64) {
    match address {
        TORQUE_ENABLE if before == 0 && is_torque_on(servo) => {
            if servo.get(OPERATING_MODE) == MODE_POSITION {
                leave_turns_out(servo);
            }
            // The shaft holds where it stands until a goal comes.
            servo.registers.set(GOAL_POSITION, servo.get(PRESENT_POSITION));
        }
        OPERATING_MODE => {
            for (goal, limit) in
                [(GOAL_PWM, PWM_LIMIT), (GOAL_CURRENT, CURRENT_LIMIT), (GOAL_VELOCITY, VELOCITY_LIMIT)]
            {
                servo.registers.set(goal, servo.get(limit));
            }
            servo.registers.set(PROFILE_ACCELERATION, 0);
            servo.registers.set(PROFILE_VELOCITY, 0);
            if servo.get(OPERATING_MODE) == MODE_POSITION {
                leave_turns_out(servo);
            }
        }
        PWM_LIMIT => servo.registers.set(GOAL_PWM, servo.get(PWM_LIMIT)),
        CURRENT_LIMIT => servo.registers.set(GOAL_CURRENT, servo.get(CURRENT_LIMIT)),
        VELOCITY_LIMIT => servo.registers.set(GOAL_VELOCITY, servo.get(VELOCITY_LIMIT)),
        DRIVE_MODE => leave_turns_out(servo),
        _ => {}
    }
}

pub(crate) fn drive(servo: &Servo, speed_rad_s: f64, supply_v: f64) -> Drive {
    if !is_torque_on(servo) {
        return Drive::Off;
    }
    let forward = if direction(servo) == 1 { 1.0 } else { -1.0 };
    let limit = servo.value(GOAL_PWM).abs() / PWM_FULL;
    match servo.get(OPERATING_MODE) {
        MODE_POSITION | MODE_EXTENDED => Drive::Duty(forward * position_duty(servo).clamp(-limit, limit)),
        MODE_CURRENT_POSITION => {
            let duty = forward * position_duty(servo).clamp(-limit, limit);
            Drive::Duty(limit_current(servo, duty, speed_rad_s, supply_v))
        }
        MODE_PWM if has_watchdog_tripped(servo) => Drive::Duty(0.0),
        MODE_PWM => Drive::Duty(forward * servo.value(GOAL_PWM) / PWM_FULL),
        _ => Drive::Duty(0.0),
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts have 32 bits at most")]
fn position_duty(servo: &Servo) -> f64 {
    let error = servo.get(GOAL_POSITION) - present_counts(servo);
    servo.value(POSITION_P) / P_GAIN_ONE * error as f64 / PWM_FULL
}

/// The nearest duty whose current stays within Goal Current.
fn limit_current(servo: &Servo, duty: f64, speed_rad_s: f64, supply_v: f64) -> f64 {
    let Some(unit) = current_unit(servo) else { return duty };
    let model = servo.model;
    let share = servo.value(GOAL_CURRENT).abs() * unit / model.stall_current_a;
    let idle = speed_rad_s / model.no_load_speed_rad_s;
    // A dead supply would make this infinite.
    let scale = model.nominal_voltage_v / supply_v.max(0.1);
    duty.clamp((idle - share) * scale, (idle + share) * scale).clamp(-1.0, 1.0)
}

pub(crate) fn observe(servo: &mut Servo, speed_rad_s: f64, around: &Surroundings) {
    let forward = if direction(servo) == 1 { 1.0 } else { -1.0 };
    let velocity = round_to_i64(forward * speed_rad_s / VELOCITY_UNIT);
    let load = match current_unit(servo) {
        Some(unit) => round_to_i64(forward * servo.motor.current_a(servo.model) / unit),
        None => round_to_i64(forward * servo.motor.torque_nm / servo.model.stall_torque_nm * 1000.0),
    };
    let deci_volts = round_to_i64(around.supply_v * 10.0);
    let celsius = round_to_i64(servo.motor.temperature_c);
    let pwm = round_to_i64(forward * servo.motor.duty * PWM_FULL);
    let milliseconds = i64::try_from(around.now_ns / 1_000_000 % 32_768).unwrap_or(0);
    let is_moving = velocity.abs() > servo.get(MOVING_THRESHOLD);
    let registers = &mut servo.registers;
    registers.set(REALTIME_TICK, milliseconds);
    registers.set(MOVING, i64::from(is_moving));
    registers.set(PRESENT_PWM, pwm);
    registers.set(PRESENT_CURRENT, load);
    registers.set(PRESENT_VELOCITY, velocity);
    registers.set(PRESENT_VOLTAGE, deci_volts);
    registers.set(PRESENT_TEMPERATURE, celsius);
    servo.registers.set(POSITION_TRAJECTORY, servo.get(GOAL_POSITION));
    servo.registers.set(PRESENT_POSITION, present_counts(servo));
    watch_hardware(servo, deci_volts, celsius, around.is_overloaded);
    watch_bus(servo, around.now_ns);
}

/// Every instruction packet a servo hears is a sign of life to it, whoever it is for.
pub(crate) fn hear(request: &Request, servos: &mut [Servo], hears: &[bool], now_ns: u64) {
    if request.instruction == STATUS {
        return;
    }
    for (servo, _) in servos.iter_mut().zip(hears).filter(|(_, hears)| **hears) {
        servo.heard_ns = now_ns;
    }
}

fn has_watchdog_tripped(servo: &Servo) -> bool {
    servo.get(BUS_WATCHDOG) == WATCHDOG_TRIPPED
}

/// Stops a servo with torque that has not heard its bus for as long as Bus Watchdog says. The manual says that
/// it stops, and not how: here it holds the place it was at, torque on, and in PWM mode its motor is shorted.
fn watch_bus(servo: &mut Servo, now_ns: u64) {
    let Ok(units @ 1..) = u64::try_from(servo.get(BUS_WATCHDOG)) else { return };
    if is_torque_on(servo) && now_ns.saturating_sub(servo.heard_ns) >= units * WATCHDOG_UNIT_NS {
        servo.registers.set(BUS_WATCHDOG, WATCHDOG_TRIPPED);
        servo.registers.set(PROFILE_ACCELERATION, 0);
        servo.registers.set(PROFILE_VELOCITY, 0);
        servo.registers.set(GOAL_POSITION, servo.get(PRESENT_POSITION));
    }
}

/// Errors stay until a reboot; those in the Shutdown mask also switch the torque off until then.
fn watch_hardware(servo: &mut Servo, deci_volts: i64, celsius: i64, is_overloaded: bool) {
    let mut errors = servo.get(HARDWARE_ERROR);
    if is_overloaded {
        errors |= ERROR_OVERLOAD;
    }
    if !(servo.get(MIN_VOLTAGE)..=servo.get(MAX_VOLTAGE)).contains(&deci_volts) {
        errors |= ERROR_VOLTAGE;
    }
    if celsius > servo.get(TEMPERATURE_LIMIT) {
        errors |= ERROR_TEMPERATURE;
    }
    servo.registers.set(HARDWARE_ERROR, errors);
    if errors & servo.get(SHUTDOWN) != 0 {
        servo.is_shut_down = true;
        servo.registers.set(TORQUE_ENABLE, 0);
    }
}
