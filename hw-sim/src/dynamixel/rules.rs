//! Values that a register accepts, and the effects of a write. Source: ROBOTIS e-manual, X-series.

use super::control::{self, leave_turns_out, present_counts};
use super::protection;
use super::table::Refusal;
use super::x_series::*;
use crate::registers::Register;
use crate::servo::Servo;

/// Drive Mode: a goal switches the torque on.
const TORQUE_ON_BY_GOAL: i64 = 8;
/// Bits of Drive Mode these models have: reverse, time-based profile, torque on by goal update.
const DRIVE_MODE_BITS: i64 = 1 | control::TIME_BASED | TORQUE_ON_BY_GOAL;
/// Highest value of the profile registers when they are times.
const TIME_MAX: i64 = 32_737;
/// Protocol Type: Dynamixel 2.0. Apart from 1, Protocol 1.0, all other types are for remote controls.
const PROTOCOL_2: i64 = 2;

/// Checks whether the host may write this number now. A servo refuses a value outside the range of the
/// control table (error 4) or outside a limit register (6). After the bus watchdog has tripped it refuses
/// goals until the host has written 0 to the watchdog (4). Two points are our reading: the watchdog then
/// takes no other number, and the error with which a servo that has shut down refuses torque, which no manual
/// gives.
pub(super) fn check(servo: &Servo, register: &Register, value: i64) -> Result<(), Refusal> {
    let has_tripped = protection::has_watchdog_tripped(servo);
    let fits = match register.address {
        GOAL_PWM | GOAL_CURRENT | GOAL_VELOCITY | GOAL_POSITION if has_tripped => false,
        BUS_WATCHDOG if has_tripped => value == 0,
        DRIVE_MODE => value & !DRIVE_MODE_BITS == 0,
        OPERATING_MODE => control::has_mode(servo, value),
        PROFILE_ACCELERATION | PROFILE_VELOCITY if servo.get(DRIVE_MODE) & control::TIME_BASED != 0 => {
            (0..=TIME_MAX).contains(&value)
        }
        PROTOCOL_TYPE if register.max > PROTOCOL_2 => matches!(value, PROTOCOL_2 | 20..=22),
        _ => (register.min..=register.max).contains(&value),
    };
    if !fits {
        return Err(Refusal::DataRange);
    }
    let limit = match register.address {
        GOAL_PWM => PWM_LIMIT,
        GOAL_CURRENT => CURRENT_LIMIT,
        GOAL_VELOCITY => VELOCITY_LIMIT,
        GOAL_POSITION if servo.get(OPERATING_MODE) == control::MODE_POSITION => {
            let limits = servo.get(MIN_POSITION)..=servo.get(MAX_POSITION);
            return if limits.contains(&value) { Ok(()) } else { Err(Refusal::DataLimit) };
        }
        TORQUE_ENABLE if value == 1 && servo.is_shut_down => return Err(Refusal::ResultFail),
        _ => return Ok(()),
    };
    if value.abs() <= servo.get(limit) { Ok(()) } else { Err(Refusal::DataLimit) }
}

/// Applies checked changes. A profile written together with a goal holds for that goal.
pub(super) fn apply(servo: &mut Servo, changes: &[(u16, i64)], now_ns: u64) {
    let mut is_new_goal = false;
    for &(address, value) in changes {
        if address == control::goal_register(servo) {
            is_new_goal = true;
            let by_goal = servo.get(DRIVE_MODE) & TORQUE_ON_BY_GOAL != 0;
            if by_goal && !control::is_torque_on(servo) && !servo.is_shut_down {
                servo.registers.set(TORQUE_ENABLE, 1);
                torque_on(servo, now_ns);
            }
        }
        let before = servo.get(address);
        servo.registers.set(address, value);
        if address == GOAL_POSITION {
            servo.note_goal(value);
        }
        if value != before {
            changed(servo, address, now_ns);
        }
    }
    if is_new_goal {
        control::head_for_goal(servo, now_ns);
    }
}

/// Carries out the effects of a new number in the register at `address`.
fn changed(servo: &mut Servo, address: u16, now_ns: u64) {
    match address {
        TORQUE_ENABLE if control::is_torque_on(servo) => torque_on(servo, now_ns),
        OPERATING_MODE => {
            for gain in GAINS {
                servo.registers.reset(gain..gain + 1);
            }
            reset_goals(servo);
            servo.registers.set(PROFILE_ACCELERATION, 0);
            servo.registers.set(PROFILE_VELOCITY, 0);
            if servo.get(OPERATING_MODE) == control::MODE_POSITION {
                leave_turns_out(servo);
            }
            servo.registers.set(PRESENT_POSITION, present_counts(servo));
        }
        PWM_LIMIT => reset_goal(servo, GOAL_PWM, PWM_LIMIT),
        CURRENT_LIMIT => reset_goal(servo, GOAL_CURRENT, CURRENT_LIMIT),
        VELOCITY_LIMIT => reset_goal(servo, GOAL_VELOCITY, VELOCITY_LIMIT),
        DRIVE_MODE => leave_turns_out(servo),
        HOMING_OFFSET => servo.registers.set(PRESENT_POSITION, present_counts(servo)),
        _ => {}
    }
}

/// In the position modes the shaft holds its position until a goal comes; in the others it follows its goal
/// at once.
fn torque_on(servo: &mut Servo, now_ns: u64) {
    if servo.get(OPERATING_MODE) == control::MODE_POSITION {
        leave_turns_out(servo);
    }
    control::hold(servo);
    control::head_for_goal(servo, now_ns);
}

/// Resets all goals that have a limit register.
pub(super) fn reset_goals(servo: &mut Servo) {
    for (goal, limit) in
        [(GOAL_PWM, PWM_LIMIT), (GOAL_CURRENT, CURRENT_LIMIT), (GOAL_VELOCITY, VELOCITY_LIMIT)]
    {
        reset_goal(servo, goal, limit);
    }
}

/// Sets a goal to its limit, but the goal of velocity mode to 0 (our reading: no motor should start just
/// because it gets torque).
/// torque).
fn reset_goal(servo: &mut Servo, goal: u16, limit: u16) {
    let is_to_stand = goal == GOAL_VELOCITY && servo.get(OPERATING_MODE) == control::MODE_VELOCITY;
    servo.registers.set(goal, if is_to_stand { 0 } else { servo.get(limit) });
}
