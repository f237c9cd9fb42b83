//! How one servo carries out an instruction. Source: Feetech wiki, protocol ft-scs, section 4.
//!
//! FT-SCS has no code for a refusal: the alarm bits of a status packet describe the servo's health, not the
//! request. A servo does not answer an instruction that it does not know.

use super::sts::{ASYNC_FLAG, RESPONSE_LEVEL};
use super::{memory, own_mut, series};
use crate::servo::Servo;

const PING: u8 = 0x01;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const REG_WRITE: u8 = 0x04;
const ACTION: u8 = 0x05;
const RECOVER: u8 = 0x06;
const RESTART: u8 = 0x08;
const BACK_UP: u8 = 0x09;
const RESET: u8 = 0x0A;
const CALIBRATE: u8 = 0x0B;

/// Carries out the instruction; returns the data of the answer, if there is one.
pub(super) fn obey(
    servo: &mut Servo,
    instruction: u8,
    parameters: &[u8],
    is_broadcast: bool,
    now_ns: u64,
) -> Option<Vec<u8>> {
    let is_known = match (instruction, parameters) {
        // The one instruction that servos answer even when it is sent to all.
        (PING, _) => return Some(Vec::new()),
        (READ, &[address, count]) if !is_broadcast => return Some(read(servo, address, count)),
        (WRITE, [address, data @ ..]) => {
            memory::write(servo, *address, data);
            true
        }
        (REG_WRITE, [address, data @ ..]) => {
            own_mut(&mut servo.state).run.pending = Some((*address, data.to_vec()));
            servo.registers.set(ASYNC_FLAG, 1);
            true
        }
        (ACTION, []) => {
            if let Some((address, data)) = own_mut(&mut servo.state).run.pending.take() {
                servo.registers.set(ASYNC_FLAG, 0);
                memory::write(servo, address, &data);
            }
            true
        }
        (RECOVER, []) => {
            memory::recover(servo);
            true
        }
        (BACK_UP, []) => {
            memory::back_up(servo);
            true
        }
        (RESTART, []) => {
            servo.restart(now_ns);
            return None;
        }
        (RESET, []) => {
            super::control::forget_turns(servo);
            true
        }
        (CALIBRATE, []) if !servo.model.is_scs => {
            memory::calibrate(servo, memory::MIDDLE);
            true
        }
        (CALIBRATE, &[low, high]) if !servo.model.is_scs => {
            memory::calibrate(servo, i64::from(u16::from_le_bytes([low, high])));
            true
        }
        _ => false,
    };
    (is_known && !is_broadcast && servo.get(RESPONSE_LEVEL) == 1).then(Vec::new)
}

/// True if the servo answers sync read. The wiki has it for "some" servos; the SCS series is not among them.
pub(super) fn answers_sync_read(servo: &Servo) -> bool {
    !servo.model.is_scs
}

/// Reads bytes of the table; zeros outside it.
pub(super) fn read(servo: &Servo, address: u8, count: u8) -> Vec<u8> {
    (0..u16::from(count))
        .map(|offset| servo.registers.byte(u16::from(address) + offset).unwrap_or(0))
        .collect()
}

/// True if EPROM now keeps writes without power.
pub(super) fn is_unlocked(servo: &Servo) -> bool {
    servo.get(series(servo).lock) == 0
}
