//! What Dynamixel servos do with a request, and what they answer. Source: ROBOTIS e-manual, Protocol 2.0.
//! Ping, read, write, sync read, fast sync read, sync write; anything else gets error 2.
//!
//! The data of a sync read are those of the moment the request ends, for every servo.

use super::control;
use super::packet::{BROADCAST, Request, crc16, fast_status_head, status};
use crate::registers::dynamixel_x::{
    EEPROM_END, FIRMWARE, HARDWARE_ERROR, MODEL_NUMBER, STATUS_RETURN_LEVEL, TORQUE_ENABLE,
};
use crate::registers::{Access, RegisterFile};
use crate::reply::Slot;
use crate::servo::{Servo, listener};

const PING: u8 = 0x01;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const SYNC_READ: u8 = 0x82;
const SYNC_WRITE: u8 = 0x83;
const FAST_SYNC_READ: u8 = 0x8A;

/// Why a servo refuses; the numbers are the error field's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Refusal {
    ResultFail = 1,
    Instruction = 2,
    DataRange = 4,
    DataLength = 5,
    Access = 7,
}

/// Status Return Level from which on reads are answered; pings always are.
const LEVEL_READ: i64 = 1;
/// Status Return Level from which on everything is answered.
const LEVEL_ALL: i64 = 2;

/// Carries out a request on the servos that hear it; returns what they say.
pub(crate) fn answer(request: &Request, servos: &mut [Servo], hears: &[bool]) -> Vec<Slot> {
    let is_broadcast = request.id == BROADCAST;
    match (request.instruction, request.parameters.as_slice()) {
        (SYNC_READ, &[a, b, c, d, ref ids @ ..]) if is_broadcast => {
            let (address, count) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
            ids.iter().map(|&id| sync_read_slot(id, address, count, servos, hears)).collect()
        }
        (FAST_SYNC_READ, &[a, b, c, d, ref ids @ ..]) if is_broadcast => {
            fast_sync_read(ids, u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]), servos, hears)
        }
        (SYNC_WRITE, &[a, b, c, d, ref rows @ ..]) if is_broadcast => {
            let (address, count) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
            for row in rows.chunks_exact(usize::from(count) + 1) {
                if let Some(index) = listener(row[0], servos, hears) {
                    // A refusal has nobody to hear it: sync write has no status packet.
                    let _ = write(&mut servos[index], address, &row[1..]);
                }
            }
            Vec::new()
        }
        (PING, _) if is_broadcast => {
            let mut order: Vec<usize> = (0..servos.len()).filter(|&index| hears[index]).collect();
            order.sort_by_key(|&index| servos[index].id());
            order.into_iter().map(|index| talk(index, &servos[index], ping(&servos[index]))).collect()
        }
        _ => {
            let mut slots = Vec::new();
            for (index, servo) in servos.iter_mut().enumerate().filter(|(index, _)| hears[*index]) {
                if is_broadcast || request.id == servo.id() {
                    let bytes = single(request, servo);
                    slots.extend(bytes.filter(|_| !is_broadcast).map(|bytes| talk(index, servo, bytes)));
                }
            }
            slots
        }
    }
}

fn talk(index: usize, servo: &Servo, bytes: Vec<u8>) -> Slot {
    Slot::Talk { servo: index, bytes, delay_ns: servo.return_delay_ns(), starts_packet: true }
}

fn answers(servo: &Servo, level: i64) -> bool {
    servo.get(STATUS_RETURN_LEVEL) >= level
}

/// Bit 7 of every error field: the hardware error register is not zero.
fn alert(servo: &Servo) -> u8 {
    if servo.get(HARDWARE_ERROR) == 0 { 0 } else { 0x80 }
}

fn ping(servo: &Servo) -> Vec<u8> {
    let [low, high, ..] = servo.get(MODEL_NUMBER).to_le_bytes();
    status(servo.id(), alert(servo), &[low, high, servo.byte(FIRMWARE)])
}

fn outcome(id: u8, servo: &Servo, result: Result<Vec<u8>, Refusal>) -> Vec<u8> {
    match result {
        Ok(data) => status(id, alert(servo), &data),
        Err(refusal) => status(id, alert(servo) | refusal as u8, &[]),
    }
}

/// A request for one servo; the bytes of its answer, if its return level lets it give one.
fn single(request: &Request, servo: &mut Servo) -> Option<Vec<u8>> {
    // A servo that is given a new id still answers that request under the old one.
    let id = servo.id();
    match (request.instruction, request.parameters.as_slice()) {
        (PING, _) => Some(ping(servo)),
        (READ, parameters) => {
            let result = match *parameters {
                [a, b, c, d] => read(servo, u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])),
                _ => Err(Refusal::DataLength),
            };
            answers(servo, LEVEL_READ).then(|| outcome(id, servo, result))
        }
        (WRITE, parameters) => {
            let does_answer = answers(servo, LEVEL_ALL);
            let result = match parameters {
                [a, b, data @ ..] => write(servo, u16::from_le_bytes([*a, *b]), data),
                _ => Err(Refusal::DataLength),
            };
            does_answer.then(|| outcome(id, servo, result.map(|()| Vec::new())))
        }
        _ => answers(servo, LEVEL_ALL).then(|| outcome(id, servo, Err(Refusal::Instruction))),
    }
}

fn sync_read_slot(id: u8, address: u16, count: u16, servos: &[Servo], hears: &[bool]) -> Slot {
    match listener(id, servos, hears).filter(|&index| answers(&servos[index], LEVEL_READ)) {
        Some(index) => {
            let servo = &servos[index];
            talk(index, servo, outcome(id, servo, read(servo, address, count)))
        }
        None => Slot::Missing { bytes: 11 + usize::from(count) },
    }
}

/// One packet by many servos: a block of error, id, data and CRC each, where a block's CRC is that of the
/// whole packet up to it. The body is not stuffed. The first servo's return delay counts, and a servo that
/// is not there ends the packet at its place. Source: ROBOTIS DynamixelSDK, fast sync read.
fn fast_sync_read(ids: &[u8], address: u16, count: u16, servos: &[Servo], hears: &[bool]) -> Vec<Slot> {
    let mut so_far = fast_status_head(ids.len() * (4 + usize::from(count)));
    let mut slots: Vec<Slot> = Vec::new();
    let mut crc = 0;
    for &id in ids {
        let heard = listener(id, servos, hears).filter(|&index| answers(&servos[index], LEVEL_READ));
        let Some(index) = heard else { break };
        let servo = &servos[index];
        let (error, data) = match read(servo, address, count) {
            Ok(data) => (alert(servo), data),
            Err(refusal) => (alert(servo) | refusal as u8, vec![0; usize::from(count)]),
        };
        so_far.extend([error, id]);
        so_far.extend(data);
        crc = crc16(crc, &so_far);
        let check = crc.to_le_bytes();
        so_far.extend(check);
        let is_first = slots.is_empty();
        let delay_ns = if is_first { servo.return_delay_ns() } else { 0 };
        let bytes = std::mem::take(&mut so_far);
        slots.push(Slot::Talk { servo: index, bytes, delay_ns, starts_packet: is_first });
        // The next block's CRC covers this one's too.
        crc = crc16(crc, &check);
    }
    slots
}

/// Bytes of registers; every address must belong to one.
fn read(servo: &Servo, address: u16, count: u16) -> Result<Vec<u8>, Refusal> {
    if count == 0 {
        return Err(Refusal::DataLength);
    }
    (0..count)
        .map(|offset| address.checked_add(offset).and_then(|here| servo.registers.byte(here)))
        .collect::<Option<_>>()
        .ok_or(Refusal::Access)
}

/// Writes all registers of `data`, or none of them.
fn write(servo: &mut Servo, address: u16, data: &[u8]) -> Result<(), Refusal> {
    let mut changes = Vec::new();
    let (mut here, mut rest) = (address, data);
    if rest.is_empty() {
        return Err(Refusal::DataLength);
    }
    while !rest.is_empty() {
        let &register = servo.registers.at(here).ok_or(Refusal::Access)?;
        if register.access == Access::Read || (here < EEPROM_END && servo.get(TORQUE_ENABLE) == 1) {
            return Err(Refusal::Access);
        }
        let bytes = rest.get(..usize::from(register.size)).filter(|_| register.address == here);
        let value = RegisterFile::meaning(&register, bytes.ok_or(Refusal::DataLength)?);
        if !control::accepts(servo, &register, value) {
            return Err(Refusal::DataRange);
        }
        if here == TORQUE_ENABLE && value == 1 && servo.is_shut_down {
            // Only a reboot gives torque back; the manual does not say which error tells so.
            return Err(Refusal::ResultFail);
        }
        changes.push((here, value));
        here += u16::from(register.size);
        rest = &rest[usize::from(register.size)..];
    }
    for (address, value) in changes {
        let before = servo.get(address);
        servo.registers.set(address, value);
        control::written(servo, address, before);
    }
    Ok(())
}
