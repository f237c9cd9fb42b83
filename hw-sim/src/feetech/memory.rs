//! What a host may write, and which writes outlast the supply. Source: Feetech wiki, memory-sts and memory-scscl.
//!
//! EPROM registers take effect at once, locked or not; only values written while unlocked survive a restart of the
//! servo.

use super::control::{self, present_counts};
use super::instruction::is_unlocked;
use super::sts::*;
use super::{State, own_mut};
use crate::model::COUNTS_PER_TURN;
use crate::registers::{Access, Register};
use crate::servo::Servo;

/// The count in the middle of a turn.
pub(super) const MIDDLE: i64 = 2048;
/// Largest position offset; newer firmware is said to allow 4095.
const OFFSET_MAX: i64 = 2047;

/// Writes whole registers inside the data, each clamped to its range; drops the rest.
pub(super) fn write(servo: &mut Servo, address: u8, data: &[u8]) {
    let mut offset = 0;
    while let Some(rest) = data.get(offset..).filter(|rest| !rest.is_empty()) {
        let here = u16::from(address) + u16::try_from(offset).unwrap_or(u16::MAX);
        let Some(&register) = servo.registers.at(here).filter(|register| register.address == here) else {
            offset += 1;
            continue;
        };
        let size = usize::from(register.size);
        if let Some(bytes) = rest.get(..size)
            && register.access == Access::ReadWrite
        {
            let (low, high) = range(servo, &register);
            let value = register.decode(bytes).clamp(low, high.max(low));
            let before = servo.get(here);
            set(servo, here, value);
            control::written(servo, here, before);
        }
        offset += size;
    }
}

/// Range of a register. The SCS series keeps goals inside its angle limits, unless both are 0; the STS series keeps
/// them as written.
fn range(servo: &Servo, register: &Register) -> (i64, i64) {
    let limits = (servo.get(MIN_ANGLE), servo.get(MAX_ANGLE));
    let has_limits = servo.model.is_scs && register.address == GOAL_POSITION && limits != (0, 0);
    if has_limits { limits } else { (register.min, register.max) }
}

/// Sets a register, and stores it if EPROM should keep it.
fn set(servo: &mut Servo, address: u16, value: i64) {
    servo.registers.set(address, value);
    if address < EPROM_END && is_unlocked(servo) {
        own_mut(&mut servo.state).stored.set(address, value);
    }
}

/// Parameter backup: works only if the servo is unlocked.
pub(super) fn back_up(servo: &mut Servo) {
    if is_unlocked(servo) {
        own_mut(&mut servo.state).backup = servo.registers.clone();
    }
}

/// Parameter recovery: restores all but the id from the backup, or as shipped; works only if the servo is unlocked.
pub(super) fn recover(servo: &mut Servo) {
    if is_unlocked(servo) {
        let id = servo.get(ID);
        let State { stored, backup, .. } = own_mut(&mut servo.state);
        for file in [&mut servo.registers, stored] {
            file.copy(backup, 0..EPROM_END);
            file.set(ID, id);
        }
        control::observe_position(servo);
    }
}

/// Makes the present position `counts`, by the offset. EPROM keeps it, locked or not: our reading of "calibrate".
pub(super) fn calibrate(servo: &mut Servo, counts: i64) {
    let actual = present_counts(servo) + servo.get(OFFSET);
    let offset = (actual - counts).rem_euclid(COUNTS_PER_TURN);
    let nearest = if offset > OFFSET_MAX { offset - COUNTS_PER_TURN } else { offset };
    servo.registers.set(OFFSET, nearest);
    own_mut(&mut servo.state).stored.set(OFFSET, nearest);
    control::forget_turns(servo);
}
