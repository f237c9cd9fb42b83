//! Which servos answer a request. Source: Feetech wiki, protocol ft-scs.
//!
//! Servos answer a broadcast ping in the order of their ids, as real ones do; the wiki allows it for a single servo
//! only.

use super::instruction::{answers_sync_read, obey, read};
use super::memory;
use super::packet::{BROADCAST, Request, status};
use super::sts::STATUS;
use crate::reply::Slot;
use crate::servo::{Servo, listener};

const SYNC_READ: u8 = 0x82;
const SYNC_WRITE: u8 = 0x83;

/// Carries out a request on the servos that hear it; returns their replies.
pub(crate) fn answer(request: &Request, servos: &mut [Servo], hears: &[bool], now_ns: u64) -> Vec<Slot> {
    let is_broadcast = request.id == BROADCAST;
    match (request.instruction, request.parameters.as_slice()) {
        (SYNC_READ, [address, count, ids @ ..]) if is_broadcast => {
            ids.iter().map(|&id| sync_read_slot(id, *address, *count, servos, hears)).collect()
        }
        (SYNC_WRITE, [address, count, rows @ ..]) if is_broadcast => {
            for row in rows.chunks_exact(usize::from(*count) + 1) {
                if let Some(index) = listener(row[0], servos, hears) {
                    memory::write(&mut servos[index], *address, &row[1..]);
                }
            }
            Vec::new()
        }
        _ => {
            let mut asked: Vec<usize> = (0..servos.len())
                .filter(|&index| hears[index] && (is_broadcast || servos[index].id() == request.id))
                .collect();
            asked.sort_by_key(|&index| servos[index].id());
            let mut slots = Vec::new();
            for index in asked {
                let servo = &mut servos[index];
                // The write of an id is answered by the old id: clients that set up real arms wait for that one
                // (huggingface/lerobot#1384).
                let id = servo.id();
                if let Some(data) =
                    obey(servo, request.instruction, &request.parameters, is_broadcast, now_ns)
                {
                    slots.push(talk(index, servo, id, &data));
                }
            }
            slots
        }
    }
}

fn talk(index: usize, servo: &Servo, id: u8, data: &[u8]) -> Slot {
    let bytes = status(id, servo.byte(STATUS), data);
    Slot::Talk { servo: index, bytes, delay_ns: servo.return_delay_ns(), starts_packet: true }
}

fn sync_read_slot(id: u8, address: u8, count: u8, servos: &[Servo], hears: &[bool]) -> Slot {
    match listener(id, servos, hears).filter(|&index| answers_sync_read(&servos[index])) {
        Some(index) => talk(index, &servos[index], id, &read(&servos[index], address, count)),
        None => Slot::Missing { bytes: 6 + usize::from(count) },
    }
}
