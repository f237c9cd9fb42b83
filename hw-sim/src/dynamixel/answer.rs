//! How Dynamixel servos carry out a packet and answer it. Source: ROBOTIS e-manual, Protocol 2.0.

use super::group::Line;
use super::packet::{BROADCAST, STATUS, status};
use super::power;
use super::state::own_mut;
use super::table::{self, Addressee, Refusal};
use super::x_series::{
    FIRMWARE, HARDWARE_ERROR, MODEL_NUMBER, REGISTERED_INSTRUCTION, SECONDARY_ID, STATUS_RETURN_LEVEL,
};
use crate::decoder::{Received, Request};
use crate::reply::Slot;
use crate::servo::Servo;

const PING: u8 = 0x01;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const REG_WRITE: u8 = 0x04;
const ACTION: u8 = 0x05;
const FACTORY_RESET: u8 = 0x06;
const REBOOT: u8 = 0x08;
const CLEAR: u8 = 0x10;
const CONTROL_TABLE_BACKUP: u8 = 0x20;
const SYNC_READ: u8 = 0x82;
const SYNC_WRITE: u8 = 0x83;
const FAST_SYNC_READ: u8 = 0x8A;
const BULK_READ: u8 = 0x92;
const BULK_WRITE: u8 = 0x93;
const FAST_BULK_READ: u8 = 0x9A;

/// Lowest Status Return Level at which a servo answers reads; it always answers pings.
pub(super) const LEVEL_READ: i64 = 1;
/// Lowest Status Return Level at which a servo answers everything.
const LEVEL_ALL: i64 = 2;
/// Highest secondary id; values above switch it off.
const SECONDARY_ID_MAX: u8 = 252;

/// Carries out a packet on the servos that hear it; returns their replies.
pub(crate) fn answer(packet: &Received, servos: &mut [Servo], hears: &[bool], now_ns: u64) -> Vec<Slot> {
    match packet {
        Received::Request(request) => carry_out(request, servos, hears, now_ns),
        Received::BadChecksum { id } => {
            let named = servos.iter().enumerate().filter(|(index, servo)| hears[*index] && servo.id() == *id);
            let willing = named.filter(|(_, servo)| answers(servo, LEVEL_ALL));
            willing.map(|(index, servo)| talk(index, servo, outcome(*id, servo, Err(Refusal::Crc)))).collect()
        }
    }
}

fn carry_out(request: &Request, servos: &mut [Servo], hears: &[bool], now_ns: u64) -> Vec<Slot> {
    if request.instruction == STATUS {
        // Servos ignore a host that sends status packets.
        return Vec::new();
    }
    // For the Bus Watchdog every instruction packet is a sign of life, whatever its id.
    for (servo, _) in servos.iter_mut().zip(hears).filter(|(_, hears)| **hears) {
        servo.heard_ns = now_ns;
    }
    if request.id == BROADCAST {
        let parameters = &request.parameters;
        let mut line = Line { servos: &mut *servos, hears, now_ns };
        match request.instruction {
            PING => return pings(servos, hears),
            SYNC_READ => return line.sync_read(parameters),
            BULK_READ => return line.bulk_read(parameters),
            FAST_SYNC_READ => return line.fast_sync_read(parameters),
            FAST_BULK_READ => return line.fast_bulk_read(parameters),
            SYNC_WRITE => {
                line.sync_write(parameters);
                return Vec::new();
            }
            BULK_WRITE => {
                line.bulk_write(parameters);
                return Vec::new();
            }
            _ => {}
        }
    }
    let mut slots = Vec::new();
    for (index, servo) in servos.iter_mut().enumerate().filter(|(index, _)| hears[*index]) {
        let Some(by) = addressee(servo, request.id) else { continue };
        // A servo that gets another id, level or delay still answers that request with the old ones.
        let (id, delay_ns) = (servo.id(), servo.return_delay_ns());
        let does_answer = by == Addressee::Own
            && match request.instruction {
                PING => true,
                READ => answers(servo, LEVEL_READ),
                _ => answers(servo, LEVEL_ALL),
            };
        let result = single(request, servo, by, now_ns);
        if does_answer {
            let bytes = outcome(id, servo, result);
            slots.push(Slot::Talk { servo: index, bytes, delay_ns, starts_packet: true });
        }
    }
    slots
}

/// How `id` addresses this servo; `None` if it does not.
pub(super) fn addressee(servo: &Servo, id: u8) -> Option<Addressee> {
    match id {
        BROADCAST => Some(Addressee::All),
        _ if id == servo.id() => Some(Addressee::Own),
        0..=SECONDARY_ID_MAX if id == servo.byte(SECONDARY_ID) => Some(Addressee::Group),
        _ => None,
    }
}

/// Replies to a broadcast ping: all servos answer, in order of id.
fn pings(servos: &[Servo], hears: &[bool]) -> Vec<Slot> {
    let mut order: Vec<(usize, &Servo)> =
        servos.iter().enumerate().filter(|(index, _)| hears[*index]).collect();
    order.sort_by_key(|(_, servo)| servo.id());
    order
        .into_iter()
        .map(|(index, servo)| talk(index, servo, outcome(servo.id(), servo, Ok(ping(servo)))))
        .collect()
}

pub(super) fn talk(index: usize, servo: &Servo, bytes: Vec<u8>) -> Slot {
    Slot::Talk { servo: index, bytes, delay_ns: servo.return_delay_ns(), starts_packet: true }
}

pub(super) fn answers(servo: &Servo, level: i64) -> bool {
    servo.get(STATUS_RETURN_LEVEL) >= level
}

/// Bit 7 of every error field: set if the hardware error register is not zero.
pub(super) fn alert(servo: &Servo) -> u8 {
    if servo.get(HARDWARE_ERROR) == 0 { 0 } else { 0x80 }
}

fn ping(servo: &Servo) -> Vec<u8> {
    let [low, high, ..] = servo.get(MODEL_NUMBER).to_le_bytes();
    vec![low, high, servo.byte(FIRMWARE)]
}

pub(super) fn outcome(id: u8, servo: &Servo, result: Result<Vec<u8>, Refusal>) -> Vec<u8> {
    match result {
        Ok(data) => status(id, alert(servo), &data),
        Err(refusal) => status(id, alert(servo) | refusal as u8, &[]),
    }
}

/// Carries out an instruction for one servo; returns the data of its answer.
fn single(request: &Request, servo: &mut Servo, by: Addressee, now_ns: u64) -> Result<Vec<u8>, Refusal> {
    let parameters = request.parameters.as_slice();
    match request.instruction {
        PING => return Ok(ping(servo)),
        READ => {
            let &[a, b, c, d] = parameters else { return Err(Refusal::DataLength) };
            return table::read(servo, u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        }
        WRITE => {
            let (address, data) = address_and_data(parameters)?;
            table::write(servo, address, data, by, now_ns)
        }
        REG_WRITE => {
            // The manual does not say so, but we refuse it at once, as a write would be, and let it replace
            // an older one.
            let (address, data) = address_and_data(parameters)?;
            table::check(servo, address, data, by)?;
            own_mut(&mut servo.state).registered = Some((address, data.to_vec(), by));
            servo.registers.set(REGISTERED_INSTRUCTION, 1);
            Ok(())
        }
        ACTION => {
            let (address, data, by) =
                own_mut(&mut servo.state).registered.take().ok_or(Refusal::Instruction)?;
            servo.registers.set(REGISTERED_INSTRUCTION, 0);
            table::write(servo, address, &data, by, now_ns)
        }
        REBOOT => {
            servo.restart(now_ns);
            Ok(())
        }
        // These two instructions write EEPROM.
        FACTORY_RESET | CONTROL_TABLE_BACKUP if by == Addressee::Group => Err(Refusal::Access),
        FACTORY_RESET => power::factory_reset(servo, parameters, by, now_ns),
        CONTROL_TABLE_BACKUP => power::backup(servo, parameters, now_ns),
        CLEAR => power::clear(servo, parameters),
        _ => Err(Refusal::Instruction),
    }
    .map(|()| Vec::new())
}

fn address_and_data(parameters: &[u8]) -> Result<(u16, &[u8]), Refusal> {
    match parameters {
        [a, b, data @ ..] => Ok((u16::from_le_bytes([*a, *b]), data)),
        _ => Err(Refusal::DataLength),
    }
}
