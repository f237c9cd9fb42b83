//! How a Feetech servo uses its registers: modes, drive, feedback. Source: Feetech wiki, memory-sts, memory-scscl.
//!
//! For each count of error the position loop asks for a quarter of P tenths of a percent of the supply (the table's
//! "1/4"): 5.21 of the supply for each radian at P = 32; 5.28 were measured (kscalelabs/sysid,
//! STS_3215_12V_20250317). The integral gain and its limit, 0 as shipped, and the factory block are stored but have
//! no effect. The scale of the speed loop's gains is not published: ours hold the speed.

use super::scs::RUNNING_TIME;
use super::sts::*;
use crate::convert::round_to_i64;
use crate::model::COUNTS_PER_TURN;
use crate::motor::Drive;
use crate::servo::{Conditions, Servo};

use super::profile::Profile;
use super::{Run, State, memory, own, own_mut, protection};

const MODE_POSITION: i64 = 0;
const MODE_SPEED: i64 = 1;
const MODE_PWM: i64 = 2;
const MODE_STEP: i64 = 3;
/// Torque switch: damping output.
const DAMPING: i64 = 2;
/// Torque switch: makes the present position 2048.
const CALIBRATE: i64 = 128;
/// Phase: the motor turns the other way.
const PHASE_DRIVE_REVERSED: i64 = 1;
/// Phase: speed in steps of 1 count/s; without this bit, of 50.
const PHASE_FINE_SPEED: i64 = 4;
/// Phase: speed 0 is the highest; without this bit, none. For positions only: clients stop speed mode with 0.
const PHASE_ZERO_IS_HIGHEST: i64 = 8;
/// Phase: position counts on past one turn; without this bit it wraps.
const PHASE_FULL_ANGLE: i64 = 16;
/// Phase: the encoder counts the other way.
const PHASE_FEEDBACK_REVERSED: i64 = 128;
/// Unit of acceleration, counts/s².
const ACCELERATION_UNIT: f64 = 100.0;
/// Coarse unit of speed, and of the moving threshold, counts/s.
const COARSE_SPEED: f64 = 50.0;
/// Period of the loops, s; the position is updated each millisecond (STS3250 data sheet).
const STEP_S: f64 = 1e-3;
/// Time that a shaft must stand before it counts as arrived, s: the factory block's DTs.
const STANDING_S: f64 = 0.020;

pub(crate) fn power_on(servo: &mut Servo, id: u8, baud_code: i64, delay_units: i64) {
    servo.registers.set(ID, i64::from(id));
    servo.registers.set(BAUD, baud_code);
    servo.registers.set(RETURN_DELAY, delay_units);
    // Only the backup keeps the values as shipped.
    let backup = std::mem::replace(own_mut(&mut servo.state), State::new(&servo.registers)).backup;
    own_mut(&mut servo.state).backup = backup;
    forget(servo);
}

/// Starts from EPROM: RAM as shipped, and no turns counted.
pub(crate) fn forget(servo: &mut Servo) {
    servo.registers.copy(&own(&servo.state).stored, 0..EPROM_END);
    servo.registers.reset(EPROM_END..u16::MAX);
    if !servo.model.is_scs {
        servo.registers.set(TORQUE_LIMIT, servo.get(MAX_TORQUE));
    }
    own_mut(&mut servo.state).run = Run::default();
    forget_turns(servo);
}

/// Reduces the position to an angle within one turn.
pub(super) fn forget_turns(servo: &mut Servo) {
    let counts = encoder(servo);
    servo.turns_left_out = if servo.model.is_scs { 0 } else { counts - counts.rem_euclid(COUNTS_PER_TURN) };
    observe_position(servo);
    rest(servo);
}

/// Drops the trajectory and its history: the set point is the shaft's position.
#[expect(clippy::cast_precision_loss, reason = "counts have 32 bits at most")]
fn rest(servo: &mut Servo) {
    let present = present_counts(servo);
    let run = &mut own_mut(&mut servo.state).run;
    run.profile = Profile::rest_at(present as f64);
    run.own_goal = present;
    (run.last_error, run.speed_drive, run.is_under_way) = (0.0, 0.0, false);
}

pub(crate) fn is_torque_on(servo: &Servo) -> bool {
    matches!(servo.get(TORQUE_SWITCH), 1 | DAMPING)
}

/// The mode; SCS has no register for it: it works as a motor when both its angle limits are 0.
fn mode(servo: &Servo) -> i64 {
    let is_motor = || (servo.get(MIN_ANGLE), servo.get(MAX_ANGLE)) == (0, 0);
    match servo.model.is_scs {
        false => servo.get(MODE),
        true if is_motor() => MODE_PWM,
        true => MODE_POSITION,
    }
}

pub(super) fn is_position_mode(servo: &Servo) -> bool {
    mode(servo) == MODE_POSITION
}

fn has_phase(servo: &Servo, bit: i64) -> bool {
    servo.get(PHASE) & bit != 0
}

fn encoder(servo: &Servo) -> i64 {
    if servo.model.is_scs {
        // A potentiometer has end stops.
        return servo.encoder_counts.clamp(0, 1023);
    }
    if has_phase(servo, PHASE_FEEDBACK_REVERSED) { -servo.encoder_counts } else { servo.encoder_counts }
}

/// Position: the encoder's value less the offset (the opposite sign to Dynamixel's).
pub(super) fn present_counts(servo: &Servo) -> i64 {
    let counts = encoder(servo) - servo.turns_left_out;
    if servo.model.is_scs {
        return counts;
    }
    // The offset acts in position mode only (servolab; STS_servos#9).
    let offset = if is_position_mode(servo) { servo.get(OFFSET) } else { 0 };
    let counts = counts - offset;
    if has_phase(servo, PHASE_FULL_ANGLE) { counts } else { counts.rem_euclid(COUNTS_PER_TURN) }
}

/// Counts in one step of the position registers.
fn resolution(servo: &Servo) -> i64 {
    if servo.model.is_scs { 1 } else { servo.get(ANGLE_RESOLUTION).max(1) }
}

/// Goal position of the servo, counts. A goal beyond the angle limits stays in its register as written; the servo
/// goes to the limit (huggingface/lerobot#3585). Both limits 0: multi-turn, without limits. A servo that has had no
/// goal since its power came on stays where it is (likely: our reading).
fn goal_counts(servo: &Servo) -> i64 {
    let run = &own(&servo.state).run;
    if mode(servo) == MODE_STEP || !run.has_goal {
        return run.own_goal;
    }
    let goal = servo.get(GOAL_POSITION);
    let (low, high) = (servo.get(MIN_ANGLE), servo.get(MAX_ANGLE));
    let has_limits = is_position_mode(servo) && (low, high) != (0, 0);
    let goal = if has_limits { goal.clamp(low, high.max(low)) } else { goal };
    goal * resolution(servo)
}

pub(super) fn observe_position(servo: &mut Servo) {
    let present = present_counts(servo);
    let shown = match mode(servo) {
        // Step mode: the remaining distance.
        MODE_STEP => goal_counts(servo) - present,
        _ => present,
    };
    servo.registers.set(PRESENT_POSITION, shown / resolution(servo));
}

/// Carries out the side effects of a write to the register at `address`, which held `before`.
pub(super) fn written(servo: &mut Servo, address: u16, before: i64) {
    match address {
        TORQUE_SWITCH => match servo.get(TORQUE_SWITCH) {
            CALIBRATE if !servo.model.is_scs => {
                servo.registers.set(TORQUE_SWITCH, 0);
                memory::calibrate(servo, memory::MIDDLE);
            }
            0 => own_mut(&mut servo.state).run.protection.let_go(),
            1 | DAMPING if before == 0 => {
                let is_under_way = own(&servo.state).run.is_under_way;
                rest(servo);
                own_mut(&mut servo.state).run.is_under_way = is_under_way;
            }
            1 | DAMPING => {}
            // Only 0, 1, 2 and 128 have a meaning.
            _ => servo.registers.set(TORQUE_SWITCH, 0),
        },
        GOAL_POSITION => {
            servo.note_goal(servo.get(GOAL_POSITION));
            if mode(servo) == MODE_STEP {
                own_mut(&mut servo.state).run.own_goal += servo.get(GOAL_POSITION) * resolution(servo);
            }
            servo.registers.set(GOAL_READ_BACK, servo.get(GOAL_POSITION));
            let run = &mut own_mut(&mut servo.state).run;
            (run.has_goal, run.is_woken) = (true, true);
            let goal = goal_counts(servo);
            let is_elsewhere = goal != present_counts(servo);
            let run = &mut own_mut(&mut servo.state).run;
            run.way = (to_f64(goal) - run.profile.position).abs();
            run.is_under_way |= is_elsewhere;
            run.still_s = 0.0;
        }
        PHASE => forget_turns(servo),
        MODE | MIN_ANGLE | MAX_ANGLE => rest(servo),
        _ => {}
    }
    observe_position(servo);
}

/// What the bridge does in this step, at shaft speed `speed_rad_s`.
pub(crate) fn drive(servo: &mut Servo, speed_rad_s: f64) -> Drive {
    wake(servo);
    let demand = match (servo.get(TORQUE_SWITCH), mode(servo)) {
        (0, _) => {
            own_mut(&mut servo.state).run.demand = 0.0;
            return Drive::Off;
        }
        (1, MODE_POSITION | MODE_STEP) => position_drive(servo),
        (1, MODE_SPEED) => speed_drive(servo, speed_rad_s),
        (1, _) => pwm(servo),
        _ => 0.0,
    };
    own_mut(&mut servo.state).run.demand = demand;
    let limit = if servo.model.is_scs { MAX_TORQUE } else { TORQUE_LIMIT };
    let limit = (servo.value(limit) / 1000.0).min(protection::drive_limit(servo));
    let drive = demand.clamp(-limit, limit);
    Drive::Duty(if has_phase(servo, PHASE_DRIVE_REVERSED) { -drive } else { drive })
}

/// A goal written to a limp servo switches its torque on, at the next tick of its control loop
/// (huggingface/lerobot#3585; Feetech's protocol page, 4.3, example 4).
fn wake(servo: &mut Servo) {
    let is_woken = std::mem::take(&mut own_mut(&mut servo.state).run.is_woken);
    if is_woken && servo.get(TORQUE_SWITCH) == 0 && matches!(mode(servo), MODE_POSITION | MODE_STEP) {
        servo.registers.set(TORQUE_SWITCH, 1);
        written(servo, TORQUE_SWITCH, 0);
    }
}

/// The open-loop drive. The STS series turns to smaller counts at a positive value (huggingface/lerobot#4547, measured
/// with firmware 3.10). The SCS series keeps it in the register of the running time, with its sign in bit 10.
fn pwm(servo: &Servo) -> f64 {
    let raw = servo.get(if servo.model.is_scs { RUNNING_TIME } else { GOAL_PWM });
    let signed = match (servo.model.is_scs, raw & 0x400) {
        (false, _) => -raw,
        (true, 0) => raw & 0x3FF,
        (true, _) => -(raw & 0x3FF),
    };
    to_f64(signed) / 1000.0
}

#[expect(clippy::cast_precision_loss, reason = "counts have 32 bits at most")]
fn to_f64(counts: i64) -> f64 {
    counts as f64
}

/// One unit of the speed registers, counts/s.
fn speed_unit(servo: &Servo) -> f64 {
    if servo.model.is_scs || has_phase(servo, PHASE_FINE_SPEED) { 1.0 } else { COARSE_SPEED }
}

/// Acceleration, counts/s².
fn acceleration(servo: &Servo) -> f64 {
    let units = if servo.model.is_scs { 0 } else { servo.get(ACCELERATION) };
    if units == 0 { f64::INFINITY } else { ACCELERATION_UNIT * to_f64(units) }
}

/// Highest speed on the way to a goal, counts/s.
fn speed_max(servo: &Servo) -> f64 {
    let speed = servo.value(RUNNING_SPEED).abs() * speed_unit(servo);
    let time_s = if servo.model.is_scs { servo.value(RUNNING_TIME) * 1e-3 } else { 0.0 };
    if speed > 0.0 {
        speed
    } else if time_s > 0.0 {
        own(&servo.state).run.way / time_s
    } else if has_phase(servo, PHASE_ZERO_IS_HIGHEST) {
        f64::INFINITY
    } else {
        0.0
    }
}

fn position_drive(servo: &mut Servo) -> f64 {
    let goal = to_f64(goal_counts(servo));
    let acceleration = acceleration(servo);
    let speed_max = speed_max(servo);
    own_mut(&mut servo.state).run.profile.step_to(goal, speed_max, acceleration, STEP_S);
    let error = own(&servo.state).run.profile.position - to_f64(present_counts(servo));
    let change = error - own(&servo.state).run.last_error;
    own_mut(&mut servo.state).run.last_error = error;
    if (-servo.value(DEAD_BAND_NEGATIVE)..=servo.value(DEAD_BAND_POSITIVE)).contains(&error) {
        return 0.0;
    }
    let (p, d) = (servo.value(POSITION_P), servo.value(POSITION_D));
    // SCS: estimate, since its table has no such factors.
    let (p, d) = if servo.model.is_scs { (p, d) } else { (p / 4.0, d / 8.0) };
    let drive = 1e-3 * (p * error + d * change);
    let least = servo.value(MIN_START_TORQUE) / 1000.0;
    drive.abs().max(least).copysign(drive)
}

fn speed_drive(servo: &mut Servo, speed_rad_s: f64) -> f64 {
    let wanted = servo.value(RUNNING_SPEED) * speed_unit(servo);
    let acceleration = acceleration(servo);
    let sign = if has_phase(servo, PHASE_DRIVE_REVERSED) { -1.0 } else { 1.0 };
    let (p, i) = (servo.value(SPEED_P), servo.value(SPEED_I));
    let no_load = servo.model.no_load_speed_rad_s;
    let counts_per_rad = servo.model.counts_per_rad();
    let run = &mut own_mut(&mut servo.state).run;
    run.profile.step_speed(wanted, acceleration, STEP_S);
    // As shares of the no-load speed: at P = 10 the drive is five times the error, at I = 10 it grows as much in
    // 0.05 s.
    let error = (run.profile.speed / counts_per_rad - sign * speed_rad_s) / no_load;
    run.speed_drive = (run.speed_drive + 2.0 * i * error * STEP_S * 5.0).clamp(-1.0, 1.0);
    (0.5 * p * error + run.speed_drive).clamp(-1.0, 1.0)
}

/// Writes what the servo measures into its registers.
pub(crate) fn observe(servo: &mut Servo, speed_rad_s: f64, around: &Conditions) {
    let sign = if has_phase(servo, PHASE_FEEDBACK_REVERSED) { -1.0 } else { 1.0 };
    let speed_counts = sign * speed_rad_s * servo.model.counts_per_rad();
    let amperes = servo.motor.current_a(&servo.model);
    let current = servo.model.current_unit_a.map_or(0, |unit| round_to_i64(amperes / unit));
    let deci_volts = round_to_i64(around.supply_v * 10.0);
    let unit = speed_unit(servo);
    let (duty, celsius) = (servo.motor.duty, servo.motor.temperature_c);
    let registers = &mut servo.registers;
    registers.set(PRESENT_SPEED, round_to_i64(speed_counts / unit));
    registers.set(PRESENT_LOAD, round_to_i64(duty * 1000.0));
    registers.set(PRESENT_VOLTAGE, deci_volts);
    registers.set(PRESENT_TEMPERATURE, round_to_i64(celsius));
    registers.set(PRESENT_CURRENT, current);
    let turns = speed_counts.abs() > COARSE_SPEED * servo.value(MOVING_THRESHOLD).max(1.0);
    let is_moving = is_moving(servo, turns, around.dt_s);
    servo.registers.set(MOVING, i64::from(is_moving));
    observe_position(servo);
    protection::watch(servo, deci_volts, current, turns, around);
}

/// True on the way to a goal until the shaft stands there; in the other modes, while it turns.
fn is_moving(servo: &mut Servo, turns: bool, dt_s: f64) -> bool {
    if !is_torque_on(servo) {
        return false;
    }
    if !matches!(mode(servo), MODE_POSITION | MODE_STEP) {
        return turns;
    }
    let is_at_goal = (own(&servo.state).run.profile.position - to_f64(goal_counts(servo))).abs() < 1.0;
    let run = &mut own_mut(&mut servo.state).run;
    run.still_s = if turns || !is_at_goal { 0.0 } else { run.still_s + dt_s };
    run.is_under_way &= run.still_s < STANDING_S;
    run.is_under_way
}
