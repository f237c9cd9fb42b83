//! Reading and writing the control table: indirect addresses, access, lengths. Source: ROBOTIS e-manual, Protocol 2.0,
//! error field; X-series, Indirect Address.

use super::rules;
use super::x_series::{EEPROM_END, INDIRECT_START, TORQUE_ENABLE, indirect_address_of};
use crate::registers::{Access, RegisterFile};
use crate::servo::Servo;

/// Why a servo refuses; the numbers are the error field's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refusal {
    ResultFail = 1,
    Instruction = 2,
    Crc = 3,
    DataRange = 4,
    DataLength = 5,
    DataLimit = 6,
    Access = 7,
}

/// How a packet addresses a servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Addressee {
    /// By its id: it answers.
    Own,
    /// Together with all others.
    All,
    /// By its secondary id: it refuses EEPROM writes.
    Group,
}

/// Registers and their new values.
pub(super) type Changes = Vec<(u16, i64)>;

/// Reads bytes of registers; every address must belong to one.
pub(super) fn read(servo: &Servo, address: u16, count: u16) -> Result<Vec<u8>, Refusal> {
    if count == 0 {
        return Err(Refusal::DataLength);
    }
    (0..count)
        .map(|offset| servo.registers.byte(meant(servo, address.checked_add(offset)?)))
        .collect::<Option<_>>()
        .ok_or(Refusal::Access)
}

/// The address that `address` stands for: for indirect data, the one it points at. A pointer to other
/// indirect data means that byte itself: pointers do not chain.
fn meant(servo: &Servo, address: u16) -> u16 {
    if address < INDIRECT_START {
        return address;
    }
    let pointer = indirect_address_of(servo.model.indirect, address);
    pointer.and_then(|pointer| u16::try_from(servo.get(pointer)).ok()).unwrap_or(address)
}

/// The changes that `data` would make, if all of it may be written.
pub(super) fn check(
    servo: &Servo,
    address: u16,
    data: &[u8],
    addressee: Addressee,
) -> Result<Changes, Refusal> {
    let mut changes = Vec::new();
    let (mut here, mut rest) = (address, data);
    if rest.is_empty() {
        return Err(Refusal::DataLength);
    }
    while !rest.is_empty() {
        let first = meant(servo, here);
        let &register = servo.registers.at(first).ok_or(Refusal::Access)?;
        let is_locked =
            first < EEPROM_END && (servo.get(TORQUE_ENABLE) == 1 || addressee == Addressee::Group);
        if register.access == Access::Read || is_locked {
            return Err(Refusal::Access);
        }
        // Indirect data make up a register if they point at all its bytes in order.
        let is_whole = (0..u16::from(register.size)).all(|offset| {
            here.checked_add(offset).is_some_and(|at| meant(servo, at) == register.address + offset)
        });
        let bytes = rest.get(..usize::from(register.size)).filter(|_| is_whole).ok_or(Refusal::DataLength)?;
        let value = RegisterFile::meaning(&register, bytes);
        rules::check(servo, &register, value)?;
        changes.push((first, value));
        here = here.saturating_add(u16::from(register.size));
        rest = &rest[bytes.len()..];
    }
    Ok(changes)
}

/// Writes all registers of `data`, or none of them.
pub(super) fn write(
    servo: &mut Servo,
    address: u16,
    data: &[u8],
    addressee: Addressee,
    now_ns: u64,
) -> Result<(), Refusal> {
    let changes = check(servo, address, data, addressee)?;
    rules::apply(servo, &changes, now_ns);
    Ok(())
}
