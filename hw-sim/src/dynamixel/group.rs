//! Instructions for many servos at once: sync and bulk, plain and fast. Source: ROBOTIS e-manual, Protocol 2.0.
//!
//! Every servo returns its data from the moment the request ends.

use super::answer::{LEVEL_READ, addressee, alert, answers, outcome, talk};
use super::packet::{crc16, fast_status_head};
use super::table::{self, Addressee};
use crate::reply::Slot;
use crate::servo::Servo;

/// One servo and the registers to read from it.
struct Item {
    id: u8,
    address: u16,
    count: u16,
}

/// The servos of a bus, and which of them hear the line.
pub(super) struct Line<'a> {
    pub(super) servos: &'a mut [Servo],
    pub(super) hears: &'a [bool],
    pub(super) now_ns: u64,
}

impl Line<'_> {
    /// The servo with this id, if its return level lets it answer reads.
    fn reader(&self, id: u8) -> Option<(usize, &Servo)> {
        let mut heard = self.servos.iter().enumerate().filter(|(index, _)| self.hears[*index]);
        heard.find(|(_, servo)| servo.id() == id).filter(|(_, servo)| answers(servo, LEVEL_READ))
    }

    fn write(&mut self, id: u8, address: u16, data: &[u8]) {
        for (servo, _) in self.servos.iter_mut().zip(self.hears).filter(|(_, hears)| **hears) {
            if let Some(by @ (Addressee::Own | Addressee::Group)) = addressee(servo, id) {
                // A refusal is dropped: group writes have no status packet.
                let _ = table::write(servo, address, data, by, self.now_ns);
            }
        }
    }

    /// Sync read: one address and length for all servos.
    pub(super) fn sync_read(&self, parameters: &[u8]) -> Vec<Slot> {
        self.read(&sync_items(parameters))
    }

    /// Fast sync read: the same, answered by one packet.
    pub(super) fn fast_sync_read(&self, parameters: &[u8]) -> Vec<Slot> {
        self.fast_read(&sync_items(parameters))
    }

    /// Bulk read: an address and length for each servo.
    pub(super) fn bulk_read(&self, parameters: &[u8]) -> Vec<Slot> {
        self.read(&bulk_items(parameters))
    }

    /// Fast bulk read: the same, answered by one packet.
    pub(super) fn fast_bulk_read(&self, parameters: &[u8]) -> Vec<Slot> {
        self.fast_read(&bulk_items(parameters))
    }

    /// Sync write: one address and length, and data for each servo.
    pub(super) fn sync_write(&mut self, parameters: &[u8]) {
        let &[a, b, c, d, ref rows @ ..] = parameters else { return };
        let (address, count) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        for row in rows.chunks_exact(usize::from(count) + 1) {
            self.write(row[0], address, &row[1..]);
        }
    }

    /// Bulk write: address, length and data for each servo.
    pub(super) fn bulk_write(&mut self, parameters: &[u8]) {
        let mut rest = parameters;
        while let &[id, a, b, c, d, ref more @ ..] = rest {
            let count = usize::from(u16::from_le_bytes([c, d]));
            let Some((data, next)) = more.split_at_checked(count) else { return };
            self.write(id, u16::from_le_bytes([a, b]), data);
            rest = next;
        }
    }

    /// Every servo sends a packet of its own, one after the other.
    fn read(&self, items: &[Item]) -> Vec<Slot> {
        let slot = |item: &Item| match self.reader(item.id) {
            Some((index, servo)) => {
                talk(index, servo, outcome(item.id, servo, table::read(servo, item.address, item.count)))
            }
            None => Slot::Missing { bytes: 11 + usize::from(item.count) },
        };
        items.iter().map(slot).collect()
    }

    /// One packet that many servos share: each sends a block of error, id, data and CRC, where a block's CRC
    /// is that of the whole packet up to it. The body is not stuffed. The return delay is the first servo's,
    /// and a missing servo ends the packet at its place.
    fn fast_read(&self, items: &[Item]) -> Vec<Slot> {
        let mut so_far = fast_status_head(items.iter().map(|item| 4 + usize::from(item.count)).sum());
        let mut slots: Vec<Slot> = Vec::new();
        let mut crc = 0;
        for &Item { id, address, count } in items {
            let Some((index, servo)) = self.reader(id) else { break };
            let (error, data) = match table::read(servo, address, count) {
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
}

fn sync_items(parameters: &[u8]) -> Vec<Item> {
    let &[a, b, c, d, ref ids @ ..] = parameters else { return Vec::new() };
    let (address, count) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
    ids.iter().map(|&id| Item { id, address, count }).collect()
}

fn bulk_items(parameters: &[u8]) -> Vec<Item> {
    let item = |row: &[u8]| Item {
        id: row[0],
        address: u16::from_le_bytes([row[1], row[2]]),
        count: u16::from_le_bytes([row[3], row[4]]),
    };
    parameters.chunks_exact(5).map(item).collect()
}
