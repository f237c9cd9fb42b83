//! Reading and writing the control table: indirect addresses, access, lengths. Source: ROBOTIS e-manual, Protocol 2.0,
//! error field; X-series, Indirect Address.

use super::rules;
use crate::registers::dynamixel_x::{EEPROM_END, INDIRECT_START, TORQUE_ENABLE, indirect_address_of};
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

/// By what name a servo is spoken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Addressee {
    /// By its id: it answers.
    Own,
    /// With all others.
    All,
    /// By its secondary id: its EEPROM is out of reach.
    Group,
}

/// Registers and the numbers they are to hold.
pub(super) type Changes = Vec<(u16, i64)>;

/// Bytes of registers; every address must belong to one.
pub(super) fn read(servo: &Servo, address: u16, count: u16) -> Result<Vec<u8>, Refusal> {
    if count == 0 {
        return Err(Refusal::DataLength);
    }
    (0..count)
        .map(|offset| servo.registers.byte(meant(servo, address.checked_add(offset)?)))
        .collect::<Option<_>>()
        .ok_or(Refusal::Access)
}

/// The address that is meant by `address`: of indirect data what they point at. Those that point at indirect data
/// again mean that byte, whatever it points at.
fn meant(servo: &Servo, address: u16) -> u16 {
    if address < INDIRECT_START {
        return address;
    }
    let pointer = indirect_address_of(servo.model.name, address);
    pointer.and_then(|pointer| u16::try_from(servo.get(pointer)).ok()).unwrap_or(address)
}

/// What `data` would change, if all of it may be written.
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
        // Indirect data make up a register if they point at its bytes one after the other.
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
