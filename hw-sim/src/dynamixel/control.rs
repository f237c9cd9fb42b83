//! How a Dynamixel X drives its motor, and what it measures. Source: ROBOTIS e-manual, X-series: Operating
//! Mode, gains, goals and trajectories.
//!
//! The manual gives the scale of each gain but not the units it works in. Here controllers run at 1 kHz, as
//! Realtime Tick counts. Position is in counts, its derivatives are changes per millisecond, velocity is in
//! the register's unit, and the output is in units of Goal PWM. Current-based position mode uses the
//! controller and gains of position mode, with its current limited to Goal Current, since its own gains are
//! not published. The XL330 measures its supply current; here its current is the motor's, as on the other
//! models.

use super::profile::{self, Point, Profile, Settings};
use super::protection;
use super::state::{own, own_mut};
use super::x_series::*;
use crate::convert::round_to_i64;
use crate::model::{COUNTS_PER_RAD, COUNTS_PER_TURN};
use crate::motor::Drive;
use crate::servo::{Conditions, Servo};

pub(super) const MODE_CURRENT: i64 = 0;
pub(super) const MODE_VELOCITY: i64 = 1;
pub(super) const MODE_POSITION: i64 = 3;
pub(super) const MODE_EXTENDED: i64 = 4;
pub(super) const MODE_CURRENT_POSITION: i64 = 5;
pub(super) const MODE_PWM: i64 = 16;

/// Drive Mode bit: counts grow the other way.
const REVERSE: i64 = 1;
/// Drive Mode bit: profile registers are times.
pub(super) const TIME_BASED: i64 = 4;
/// Value of Goal PWM and Present PWM at full duty.
const PWM_FULL: f64 = 885.0;
/// Values of the gain registers that mean a gain of 1.
const P_GAIN_ONE: f64 = 128.0;
const I_GAIN_ONE: f64 = 65_536.0;
const D_GAIN_ONE: f64 = 16.0;
const FEEDFORWARD_ONE: f64 = 4.0;
/// Control steps a second.
const STEPS_PER_S: f64 = 1_000.0;
/// Velocity unit, rad/s: 0.229 rpm.
pub(super) const VELOCITY_UNIT_RAD_S: f64 = 0.229 * std::f64::consts::TAU / 60.0;
/// PWM Slope unit, V per control step: 1.977 mV/ms.
const SLOPE_UNIT_V: f64 = 0.001_977;
/// Largest homing offset that position mode accepts.
const HOMING_MAX: i64 = 1024;
/// Moving Status bits.
const IN_POSITION: i64 = 1;
const PROFILE_ONGOING: i64 = 2;
const NOT_FOLLOWING: i64 = 8;
/// Distance from the goal at which a shaft has arrived, and distance from its trajectory at which it no
/// longer follows, counts. The manual calls both predefined and does not give them: our choice.
const ARRIVED_COUNTS: f64 = 20.0;
const FOLLOWING_COUNTS: f64 = 100.0;

/// The state of its motion, which resets when it gets torque.
#[derive(Debug, Default)]
pub(super) struct Motion {
    /// The trajectory to the goal; `None` while there is no torque, and in modes that need none.
    pub(super) profile: Option<Profile>,
    /// Its present point on that trajectory.
    pub(super) point: Point,
    /// Integral term of the controller, PWM units.
    integral: f64,
    /// Share of the supply on the motor in the last step, in the direction in which the registers count.
    duty: f64,
    /// True if the controller asked more of the motor in the last step than its limit.
    pub(super) is_at_limit: bool,
    /// How long it has stood at its limit without moving, s.
    pub(super) stalled_s: f64,
}

pub(crate) fn is_torque_on(servo: &Servo) -> bool {
    servo.get(TORQUE_ENABLE) == 1
}

/// Whether the model has this operating mode.
pub(super) fn has_mode(servo: &Servo, mode: i64) -> bool {
    match mode {
        MODE_CURRENT | MODE_CURRENT_POSITION => servo.registers.at(CURRENT_LIMIT).is_some(),
        _ => matches!(mode, MODE_VELOCITY | MODE_POSITION | MODE_EXTENDED | MODE_PWM),
    }
}

/// The register that holds the goal of the servo's mode.
pub(super) fn goal_register(servo: &Servo) -> u16 {
    match servo.get(OPERATING_MODE) {
        MODE_CURRENT => GOAL_CURRENT,
        MODE_VELOCITY => GOAL_VELOCITY,
        MODE_PWM => GOAL_PWM,
        _ => GOAL_POSITION,
    }
}

/// 1 or -1: the direction in which registers count.
fn direction(servo: &Servo) -> i64 {
    if servo.get(DRIVE_MODE) & REVERSE == 0 { 1 } else { -1 }
}

/// Current unit, A: 1 mA on the XL330, 2.69 mA on the XM430; `None` where the model measures load instead.
fn current_unit(servo: &Servo) -> Option<f64> {
    servo.model.current_unit_a
}

pub(super) fn present_counts(servo: &Servo) -> i64 {
    let homing = servo.get(HOMING_OFFSET);
    let is_ignored = servo.get(OPERATING_MODE) == MODE_POSITION && homing.abs() > HOMING_MAX;
    direction(servo) * servo.encoder_counts - servo.turns_left_out + if is_ignored { 0 } else { homing }
}

/// Reduces Present Position to an angle within one turn, as at power-on, at torque-on in position mode, and
/// at the change to position mode (e-manual, Operating Mode, note on Present Position).
pub(super) fn leave_turns_out(servo: &mut Servo) {
    let counts = direction(servo) * servo.encoder_counts;
    servo.turns_left_out = counts - counts.rem_euclid(COUNTS_PER_TURN);
    servo.registers.set(PRESENT_POSITION, present_counts(servo));
}

/// Drops the trajectory, and sets the goal of the position modes to the shaft's position.
#[expect(clippy::cast_precision_loss, reason = "counts have 32 bits at most")]
pub(super) fn hold(servo: &mut Servo) {
    let present = present_counts(servo);
    servo.registers.set(GOAL_POSITION, present);
    own_mut(&mut servo.state).motion = Motion { point: Point::rest(present as f64), ..Motion::default() };
}

/// Starts towards the goal, if the goal or its profile has changed.
pub(super) fn head_for_goal(servo: &mut Servo, now_ns: u64) {
    if !is_torque_on(servo) {
        return;
    }
    let settings = Settings {
        velocity: servo.get(PROFILE_VELOCITY),
        acceleration: servo.get(PROFILE_ACCELERATION),
        is_time_based: servo.get(DRIVE_MODE) & TIME_BASED != 0,
    };
    let goal_register = goal_register(servo);
    let goal = servo.get(goal_register);
    let motion = &mut own_mut(&mut servo.state).motion;
    if motion.profile.is_some_and(|profile| profile.is_for(goal, settings)) {
        return;
    }
    let start = motion.profile.map_or(motion.point, |profile| profile.at(now_ns));
    let profile = match goal_register {
        GOAL_POSITION => Profile::to_position(start, goal, settings, now_ns),
        GOAL_VELOCITY => Profile::to_velocity(start, goal, settings, now_ns),
        _ => return,
    };
    (motion.point, motion.profile) = (profile.at(now_ns), Some(profile));
}

pub(crate) fn drive(servo: &mut Servo, speed_rad_s: f64, supply_v: f64) -> Drive {
    if !is_torque_on(servo) {
        return Drive::Off;
    }
    let forward = if direction(servo) == 1 { 1.0 } else { -1.0 };
    let speed_rad_s = forward * speed_rad_s;
    let mode = servo.get(OPERATING_MODE);
    // In PWM mode the limit is PWM Limit; in the others it is Goal PWM.
    let limit = servo.value(if mode == MODE_PWM { PWM_LIMIT } else { GOAL_PWM }).abs();
    let wanted = match mode {
        MODE_PWM => servo.value(GOAL_PWM),
        MODE_VELOCITY => velocity_pwm(servo, speed_rad_s, limit),
        // No current stops a shaft; shorting the motor does.
        MODE_CURRENT if protection::has_watchdog_tripped(servo) => 0.0,
        MODE_CURRENT => {
            let amperes = servo.value(GOAL_CURRENT) * current_unit(servo).unwrap_or(0.0);
            current_pwm(servo, amperes, speed_rad_s, supply_v)
        }
        _ => position_pwm(servo, speed_rad_s, limit),
    };
    let mut given = wanted.clamp(-limit, limit);
    if mode == MODE_CURRENT_POSITION {
        let amperes = servo.value(GOAL_CURRENT).abs() * current_unit(servo).unwrap_or(0.0);
        let lowest = current_pwm(servo, -amperes, speed_rad_s, supply_v);
        given = given.clamp(lowest, current_pwm(servo, amperes, speed_rad_s, supply_v)).clamp(-limit, limit);
    }
    let is_cut = wanted.abs() >= limit || (given - wanted).abs() > 0.0;
    let duty = sloped(servo, given / PWM_FULL, supply_v);
    let motion = &mut own_mut(&mut servo.state).motion;
    (motion.duty, motion.is_at_limit) = (duty, is_cut && given.abs() > 0.0);
    Drive::Duty(forward * duty)
}

/// Position modes: PID and feedforward about the trajectory. The D term uses the shaft's true speed, since
/// differences of whole counts would only add noise.
#[expect(clippy::cast_precision_loss, reason = "counts have 32 bits at most")]
fn position_pwm(servo: &mut Servo, speed_rad_s: f64, limit: f64) -> f64 {
    let point = own(&servo.state).motion.point;
    let error = point.position - present_counts(servo) as f64;
    let error_rate = (point.velocity - speed_rad_s * COUNTS_PER_RAD) / STEPS_PER_S;
    let forward = servo.value(FEEDFORWARD_1ST) * point.velocity / STEPS_PER_S
        + servo.value(FEEDFORWARD_2ND) * point.acceleration / (STEPS_PER_S * STEPS_PER_S);
    let pwm = servo.value(POSITION_P) / P_GAIN_ONE * error
        + servo.value(POSITION_D) / D_GAIN_ONE * error_rate
        + forward / FEEDFORWARD_ONE;
    pwm + integral(servo, servo.value(POSITION_I), error, pwm, limit)
}

/// Velocity mode: PI about the trajectory.
fn velocity_pwm(servo: &mut Servo, speed_rad_s: f64, limit: f64) -> f64 {
    let wanted = own(&servo.state).motion.point.velocity / profile::VELOCITY_UNIT;
    let error = wanted - speed_rad_s / VELOCITY_UNIT_RAD_S;
    let pwm = servo.value(VELOCITY_P) / P_GAIN_ONE * error;
    pwm + integral(servo, servo.value(VELOCITY_I), error, pwm, limit)
}

/// The integral of `error`, which does not grow while the output is at its limit.
fn integral(servo: &mut Servo, gain: f64, error: f64, others: f64, limit: f64) -> f64 {
    let step = gain / I_GAIN_ONE * error;
    let sum = &mut own_mut(&mut servo.state).motion.integral;
    let output = others + *sum + step;
    if output.abs() < limit || output * step < 0.0 {
        *sum += step;
    }
    *sum
}

/// PWM that makes this current flow, PWM units, at a speed in the direction in which the registers count.
fn current_pwm(servo: &Servo, amperes: f64, speed_rad_s: f64, supply_v: f64) -> f64 {
    let model = &servo.model;
    let share = amperes / model.stall_current_a + speed_rad_s / model.no_load_speed_rad_s;
    // A dead supply would make this infinite.
    share * model.nominal_voltage_v / supply_v.max(0.1) * PWM_FULL
}

/// On the XL330 duty changes no faster than PWM Slope lets it.
fn sloped(servo: &Servo, duty: f64, supply_v: f64) -> f64 {
    if servo.registers.at(PWM_SLOPE).is_none() {
        return duty;
    }
    let most = servo.value(PWM_SLOPE) * SLOPE_UNIT_V / supply_v.max(0.1);
    duty.clamp(own(&servo.state).motion.duty - most, own(&servo.state).motion.duty + most)
}

pub(crate) fn observe(servo: &mut Servo, speed_rad_s: f64, around: &Conditions) {
    let forward = if direction(servo) == 1 { 1.0 } else { -1.0 };
    let velocity = round_to_i64(forward * speed_rad_s / VELOCITY_UNIT_RAD_S);
    let load = match current_unit(servo) {
        Some(unit) => round_to_i64(forward * servo.motor.current_a(&servo.model) / unit),
        None => round_to_i64(forward * servo.motor.torque_nm / servo.model.stall_torque_nm * 1000.0),
    };
    let deci_volts = round_to_i64(around.supply_v * 10.0);
    let celsius = round_to_i64(servo.motor.temperature_c);
    let pwm = round_to_i64(forward * servo.motor.duty * PWM_FULL);
    let started_ns = *own_mut(&mut servo.state).started_ns.get_or_insert(around.now_ns);
    let milliseconds = i64::try_from((around.now_ns - started_ns) / 1_000_000 % 32_768).unwrap_or(0);
    let is_fast = velocity.abs() > servo.get(MOVING_THRESHOLD);
    let registers = &mut servo.registers;
    registers.set(REALTIME_TICK, milliseconds);
    registers.set(PRESENT_PWM, pwm);
    registers.set(PRESENT_CURRENT, load);
    registers.set(PRESENT_VELOCITY, velocity);
    registers.set(PRESENT_VOLTAGE, deci_volts);
    registers.set(PRESENT_TEMPERATURE, celsius);
    let present = present_counts(servo);
    servo.registers.set(PRESENT_POSITION, present);
    protection::watch_hardware(servo, deci_volts, celsius, speed_rad_s, around);
    protection::watch_bus(servo, around.now_ns);
    follow(servo, present, is_fast, around.now_ns);
}

/// Moves on along the profile, and updates the status registers.
#[expect(clippy::cast_precision_loss, reason = "counts have 32 bits at most")]
fn follow(servo: &mut Servo, present: i64, is_fast: bool, now_ns: u64) {
    let mode = servo.get(OPERATING_MODE);
    if !is_torque_on(servo) {
        own_mut(&mut servo.state).motion = Motion { point: Point::rest(present as f64), ..Motion::default() };
    }
    let motion = &mut own_mut(&mut servo.state).motion;
    let mut status = 0;
    let mut is_under_way = false;
    if let Some(profile) = &motion.profile {
        motion.point = profile.at(now_ns);
        is_under_way = mode != MODE_VELOCITY && !profile.is_over(now_ns);
        status |= (profile.kind as i64) << 4;
    }
    let point = motion.point;
    if matches!(mode, MODE_POSITION | MODE_EXTENDED | MODE_CURRENT_POSITION) {
        let (goal, present) = (servo.value(GOAL_POSITION), present as f64);
        status |= if (goal - present).abs() <= ARRIVED_COUNTS { IN_POSITION } else { 0 };
        status |= if (point.position - present).abs() > FOLLOWING_COUNTS { NOT_FOLLOWING } else { 0 };
        status |= if is_under_way { PROFILE_ONGOING } else { 0 };
    }
    servo.registers.set(MOVING, i64::from(is_fast || is_under_way));
    servo.registers.set(MOVING_STATUS, status);
    servo.registers.set(VELOCITY_TRAJECTORY, round_to_i64(point.velocity / profile::VELOCITY_UNIT));
    servo.registers.set(POSITION_TRAJECTORY, round_to_i64(point.position));
}
