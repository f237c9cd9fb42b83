//! What Feetech servos do with a request, and what they answer. Source: Feetech wiki, protocol ft-scs.
//! Ping, read, write, sync read and sync write; other instructions are ignored in silence.
//!
//! Reads outside the table give zeros and writes to what the host may not change are dropped, since FT-SCS has
//! no word for refusal: the alarm bits of a status packet speak of the servo's health, not of the request.

use super::packet::{BROADCAST, Request, status};
use crate::registers::feetech_sts::{GOAL_POSITION, MAX_ANGLE, MIN_ANGLE, RESPONSE_LEVEL, STATUS};
use crate::registers::{Access, RegisterFile};
use crate::reply::Slot;
use crate::servo::{Servo, listener};

const PING: u8 = 0x01;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const SYNC_READ: u8 = 0x82;
const SYNC_WRITE: u8 = 0x83;

/// Carries out a request on the servos that hear it; returns what they say.
pub(crate) fn answer(request: &Request, servos: &mut [Servo], hears: &[bool]) -> Vec<Slot> {
    match (request.instruction, request.parameters.as_slice()) {
        (SYNC_READ, [address, count, ids @ ..]) if request.id == BROADCAST => {
            ids.iter().map(|&id| sync_read_slot(id, *address, *count, servos, hears)).collect()
        }
        (SYNC_WRITE, [address, count, rows @ ..]) if request.id == BROADCAST => {
            for row in rows.chunks_exact(usize::from(*count) + 1) {
                if let Some(index) = listener(row[0], servos, hears) {
                    write(&mut servos[index], *address, &row[1..]);
                }
            }
            Vec::new()
        }
        _ => {
            let mut slots = Vec::new();
            for (index, servo) in servos.iter_mut().enumerate().filter(|(index, _)| hears[*index]) {
                if request.id == BROADCAST || request.id == servo.id() {
                    slots.extend(single(request, servo).map(|bytes| talk(index, servo, bytes)));
                }
            }
            slots
        }
    }
}

fn talk(index: usize, servo: &Servo, bytes: Vec<u8>) -> Slot {
    Slot::Talk { servo: index, bytes, delay_ns: servo.return_delay_ns(), starts_packet: true }
}

/// A request for one servo; the bytes of its answer, if it gives one.
fn single(request: &Request, servo: &mut Servo) -> Option<Vec<u8>> {
    let is_broadcast = request.id == BROADCAST;
    // Asked under its old id, a servo answers with the new one it has just been given.
    let reply = |servo: &Servo, data: &[u8]| Some(status(servo.id(), servo.byte(STATUS), data));
    match (request.instruction, request.parameters.as_slice()) {
        (PING, _) => reply(servo, &[]),
        (READ, &[address, count]) if !is_broadcast => reply(servo, &read(servo, address, count)),
        (WRITE, [address, data @ ..]) => {
            write(servo, *address, data);
            (!is_broadcast && servo.get(RESPONSE_LEVEL) == 1).then(|| reply(servo, &[])).flatten()
        }
        _ => None,
    }
}

fn sync_read_slot(id: u8, address: u8, count: u8, servos: &[Servo], hears: &[bool]) -> Slot {
    match listener(id, servos, hears) {
        Some(index) => {
            let servo = &servos[index];
            let data = read(servo, address, count);
            talk(index, servo, status(id, servo.byte(STATUS), &data))
        }
        None => Slot::Missing { bytes: 6 + usize::from(count) },
    }
}

fn read(servo: &Servo, address: u8, count: u8) -> Vec<u8> {
    (0..u16::from(count))
        .map(|offset| servo.registers.byte(u16::from(address) + offset).unwrap_or(0))
        .collect()
}

/// Writes what may be written: whole registers inside the data, each brought into its range.
fn write(servo: &mut Servo, address: u8, data: &[u8]) {
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
            let (low, high) = range(servo, here, (register.min, register.max));
            let value = RegisterFile::meaning(&register, bytes).clamp(low, high.max(low));
            servo.registers.set(here, value);
            super::control::written(servo, here);
        }
        offset += size;
    }
}

/// Goals are held inside the angle limits, unless both limits are 0 (multi-turn).
fn range(servo: &Servo, address: u16, table: (i64, i64)) -> (i64, i64) {
    let limits = (servo.get(MIN_ANGLE), servo.get(MAX_ANGLE));
    if address == GOAL_POSITION && limits != (0, 0) && super::control::is_position_mode(servo) {
        limits
    } else {
        table
    }
}
