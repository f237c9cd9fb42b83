//! The state of a Dynamixel as shipped, at power-on and after a reboot; and its backup. Source: ROBOTIS
//! e-manual, Protocol 2.0, Factory Reset, Reboot and Control Table Backup; X-series, Startup Configuration.

use super::control::{hold, is_torque_on, leave_turns_out};
use super::rules;
use super::state::{State, own_mut};
use super::table::{Addressee, Refusal};
use super::x_series::*;
use crate::registers::{Register, RegisterFile};
use crate::servo::Servo;

/// Startup Configuration: torque on.
const STARTUP_TORQUE_ON: i64 = 1;
/// Startup Configuration: restore the stored RAM.
const STARTUP_RAM_RESTORE: i64 = 2;
/// Parameters of Factory Reset: reset all; all but the id; all but id and line rate.
const RESET_ALL: u8 = 0xFF;
const RESET_BUT_ID: u8 = 1;
const RESET_BUT_ID_AND_BAUD: u8 = 2;
/// Bytes that must follow the first parameter of Clear.
const CLEAR_KEY: [u8; 4] = [0x44, 0x58, 0x4C, 0x22];
/// Bytes that must follow the first parameter of Control Table Backup.
const BACKUP_KEY: [u8; 4] = [0x43, 0x54, 0x52, 0x4C];

/// Sets up a servo at its first power-on.
pub(crate) fn power_on(servo: &mut Servo, id: u8, baud_code: i64, delay_units: i64) {
    servo.registers.set(ID, i64::from(id));
    servo.registers.set(BAUD, baud_code);
    servo.registers.set(RETURN_DELAY, delay_units);
    forget(servo);
}

/// Reboot: RAM as shipped, or as Startup Configuration sets it, no error, and no turns counted.
pub(crate) fn forget(servo: &mut Servo) {
    servo.registers.reset(EEPROM_END..u16::MAX);
    let state = own_mut(&mut servo.state);
    *state = State { backup: state.backup.take(), ..State::default() };
    leave_turns_out(servo);
    rules::reset_goals(servo);
    let startup = servo.get(STARTUP_CONFIGURATION);
    if let Some(backup) = own_mut(&mut servo.state).backup.take() {
        servo.registers.set(BACKUP_READY, 1);
        if startup & STARTUP_RAM_RESTORE != 0 {
            copy(servo, &backup, is_stored_ram);
        }
        own_mut(&mut servo.state).backup = Some(backup);
    }
    servo.registers.set(TORQUE_ENABLE, i64::from(startup & STARTUP_TORQUE_ON != 0));
    hold(servo);
}

/// True if Control Table Backup stores this register of RAM.
fn is_stored_ram(register: &Register) -> bool {
    let address = register.address;
    GAINS.contains(&address)
        || matches!(address, PROFILE_ACCELERATION | PROFILE_VELOCITY)
        || register.name == INDIRECT_ADDRESS
}

fn copy(servo: &mut Servo, from: &RegisterFile, which: impl Fn(&Register) -> bool) {
    for register in servo.model.registers.iter().filter(|register| which(register)) {
        servo.registers.set(register.address, from.get(register.address));
    }
}

/// Factory Reset; one sent to all servos at once keeps the ids. The manual does not say with which error a
/// servo refuses an unknown parameter; here it is out of range.
pub(super) fn factory_reset(
    servo: &mut Servo,
    parameters: &[u8],
    by: Addressee,
    now_ns: u64,
) -> Result<(), Refusal> {
    let first = match *parameters {
        [RESET_ALL] if by == Addressee::All => return Err(Refusal::ResultFail),
        [RESET_ALL] => ID,
        [RESET_BUT_ID] => BAUD,
        [RESET_BUT_ID_AND_BAUD] => RETURN_DELAY,
        [_] => return Err(Refusal::DataRange),
        _ => return Err(Refusal::DataLength),
    };
    servo.registers.reset(first..EEPROM_END);
    servo.restart(now_ns);
    Ok(())
}

/// Clear: resets the turn count if the shaft is at rest. We also move its goal along, so that it stays where
/// it is: our reading.
pub(super) fn clear(servo: &mut Servo, parameters: &[u8]) -> Result<(), Refusal> {
    match parameters.split_first() {
        Some((1, key)) if *key == CLEAR_KEY => {}
        Some((_, key)) if key.len() == CLEAR_KEY.len() => return Err(Refusal::DataRange),
        _ => return Err(Refusal::DataLength),
    }
    if servo.get(MOVING) != 0 {
        return Err(Refusal::ResultFail);
    }
    leave_turns_out(servo);
    hold(servo);
    Ok(())
}

/// Control Table Backup: stores (1) or restores (2) the EEPROM, and some of RAM for the next start.
pub(super) fn backup(servo: &mut Servo, parameters: &[u8], now_ns: u64) -> Result<(), Refusal> {
    let what = match parameters.split_first() {
        Some((&what @ 1..=2, key)) if *key == BACKUP_KEY => what,
        Some((_, key)) if key.len() == BACKUP_KEY.len() => return Err(Refusal::DataRange),
        _ => return Err(Refusal::DataLength),
    };
    if is_torque_on(servo) {
        return Err(Refusal::ResultFail);
    }
    if what == 1 {
        own_mut(&mut servo.state).backup = Some(servo.registers.clone());
        servo.registers.set(BACKUP_READY, 1);
        return Ok(());
    }
    let stored = own_mut(&mut servo.state).backup.take().ok_or(Refusal::ResultFail)?;
    copy(servo, &stored, |register| (ID..EEPROM_END).contains(&register.address));
    own_mut(&mut servo.state).backup = Some(stored);
    servo.restart(now_ns);
    Ok(())
}
