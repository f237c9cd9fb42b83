//! What a Feetech STS does with its registers: position control, feedback, alarms.
//! Source: Feetech wiki, memory-sts. Position (0) and PWM (2) modes turn the motor; the speed and step modes
//! (1, 3), acceleration, running speed and overload protection are not simulated yet.

use std::f64::consts::TAU;

use crate::convert::round_to_i64;
use crate::model::{COUNTS_PER_RAD, COUNTS_PER_TURN};
use crate::motor::Drive;
use crate::registers::feetech_sts::*;
use crate::servo::{Servo, Surroundings};

const ALARM_VOLTAGE: i64 = 1;
const ALARM_TEMPERATURE: i64 = 4;
/// Torque switch: damping output.
const DAMPING: i64 = 2;
/// Torque switch: take the present position for 2048.
const CALIBRATE: i64 = 128;
/// Phase: speed in steps of 1 count/s, or else of 50.
const PHASE_FINE_SPEED: i64 = 4;
/// Phase: position counts on past one turn, or else wraps.
const PHASE_FULL_ANGLE: i64 = 16;
/// Shortest move that counts as one, count/s.
const MOVING_COUNTS_S: f64 = 50.0;

pub(crate) fn power_on(servo: &mut Servo, id: u8, baud_code: i64, delay_units: i64) {
    servo.registers.set(ID, i64::from(id));
    servo.registers.set(BAUD, baud_code);
    servo.registers.set(RETURN_DELAY, delay_units);
    servo.registers.set(TORQUE_LIMIT, servo.get(MAX_TORQUE));
    servo.registers.set(PRESENT_POSITION, present_counts(servo));
}

/// What a restart leaves: everything in RAM as shipped.
pub(crate) fn forget(servo: &mut Servo) {
    servo.registers.reset(TORQUE_SWITCH..u16::MAX);
    servo.registers.set(TORQUE_LIMIT, servo.get(MAX_TORQUE));
    servo.registers.set(PRESENT_POSITION, present_counts(servo));
}

pub(crate) fn is_torque_on(servo: &Servo) -> bool {
    matches!(servo.get(TORQUE_SWITCH), 1 | DAMPING)
}

pub(crate) fn is_position_mode(servo: &Servo) -> bool {
    servo.get(MODE) == 0
}

/// Position is what the encoder sees, less the offset (the opposite sign to Dynamixel's).
fn present_counts(servo: &Servo) -> i64 {
    let counts = servo.encoder_counts - servo.get(OFFSET);
    if servo.get(PHASE) & PHASE_FULL_ANGLE == 0 { counts.rem_euclid(COUNTS_PER_TURN) } else { counts }
}

/// Side effects of a write to the register at `address`.
pub(crate) fn written(servo: &mut Servo, address: u16) {
    match address {
        TORQUE_SWITCH if servo.get(TORQUE_SWITCH) == CALIBRATE => {
            let offset = (servo.encoder_counts - 2048).rem_euclid(COUNTS_PER_TURN);
            let nearest = if offset > 2047 { offset - COUNTS_PER_TURN } else { offset };
            servo.registers.set(OFFSET, nearest);
            servo.registers.set(TORQUE_SWITCH, 0);
        }
        // Only 0, 1, 2 and 128 mean anything.
        TORQUE_SWITCH if servo.get(TORQUE_SWITCH) > DAMPING => servo.registers.set(TORQUE_SWITCH, 0),
        GOAL_POSITION => servo.registers.set(GOAL_READ_BACK, servo.get(GOAL_POSITION)),
        _ => return,
    }
    servo.registers.set(PRESENT_POSITION, present_counts(servo));
}

pub(crate) fn drive(servo: &Servo) -> Drive {
    let limit = servo.value(TORQUE_LIMIT) / 1000.0;
    match (servo.get(TORQUE_SWITCH), servo.get(MODE)) {
        (1, 0) => Drive::Duty(position_duty(servo).clamp(-limit, limit)),
        (1, 2) => Drive::Duty((servo.value(GOAL_PWM) / 1000.0).clamp(-limit, limit)),
        (1 | DAMPING, _) => Drive::Duty(0.0),
        _ => Drive::Off,
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts have 16 bits")]
fn position_duty(servo: &Servo) -> f64 {
    let error = servo.get(GOAL_POSITION) - present_counts(servo);
    if (-servo.get(DEAD_BAND_NEGATIVE)..=servo.get(DEAD_BAND_POSITIVE)).contains(&error) {
        return 0.0;
    }
    let gain = servo.model.position_gain_nm_per_rad * servo.value(POSITION_P) / FACTORY_P as f64;
    gain * error as f64 / COUNTS_PER_RAD / servo.model.stall_torque_nm
}

pub(crate) fn observe(servo: &mut Servo, speed_rad_s: f64, around: &Surroundings) {
    let speed_counts = speed_rad_s * 4096.0 / TAU;
    let unit = if servo.get(PHASE) & PHASE_FINE_SPEED == 0 { 50.0 } else { 1.0 };
    let current = round_to_i64(servo.motor.current_a(servo.model) / 0.0065);
    let deci_volts = round_to_i64(around.supply_v * 10.0);
    let celsius = round_to_i64(servo.motor.temperature_c);
    let duty = round_to_i64(servo.motor.duty * 1000.0);
    let mut alarms = 0;
    if !(servo.get(MIN_VOLTAGE)..=servo.get(MAX_VOLTAGE)).contains(&deci_volts) {
        alarms |= ALARM_VOLTAGE;
    }
    if celsius > servo.get(MAX_TEMPERATURE) {
        alarms |= ALARM_TEMPERATURE;
    }
    if alarms & servo.get(UNLOAD_MASK) != 0 {
        servo.registers.set(TORQUE_SWITCH, 0);
    }
    let is_moving = is_torque_on(servo) && speed_counts.abs() > MOVING_COUNTS_S;
    let registers = &mut servo.registers;
    registers.set(PRESENT_SPEED, round_to_i64(speed_counts / unit));
    registers.set(PRESENT_LOAD, duty);
    registers.set(PRESENT_VOLTAGE, deci_volts);
    registers.set(PRESENT_TEMPERATURE, celsius);
    registers.set(STATUS, alarms);
    registers.set(MOVING, i64::from(is_moving));
    registers.set(PRESENT_CURRENT, current);
    servo.registers.set(PRESENT_POSITION, present_counts(servo));
}
