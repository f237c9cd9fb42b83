//! A common interface of the two protocols, so that the client is written once.

use super::packet::Event;
use super::{dynamixel, feetech};
use crate::model::servo_model::Register;
use crate::model::{Protocol, Registers};
use crate::units::ServoId;

/// Encoders and decoder of a bus's protocol.
#[derive(Debug)]
pub(super) enum Codec {
    Feetech(feetech::Decoder),
    Dynamixel(dynamixel::Decoder),
}

impl Codec {
    /// A codec for a bus with `servos` servos of these registers.
    pub(super) fn new(protocol: Protocol, registers: &Registers, servos: usize) -> Codec {
        // Single reads have up to 4 bytes.
        Codec::with_room(protocol, usize::from(registers.feedback_bytes).max(4), servos)
    }

    /// A codec for status packets of up to `parameters_max` data bytes, and fast replies of `servos` servos.
    pub(super) fn with_room(protocol: Protocol, parameters_max: usize, servos: usize) -> Codec {
        match protocol {
            Protocol::Feetech => Codec::Feetech(feetech::Decoder::new(parameters_max)),
            Protocol::Dynamixel => Codec::Dynamixel(dynamixel::Decoder::new(parameters_max, servos)),
        }
    }

    pub(super) fn ping(&self, out: &mut Vec<u8>, id: ServoId) {
        match self {
            Codec::Feetech(_) => feetech::ping(out, id),
            Codec::Dynamixel(_) => dynamixel::ping(out, id),
        }
    }

    /// Appends a restart, which returns the servo to its state at power-on.
    pub(super) fn restart(&self, out: &mut Vec<u8>, id: ServoId) {
        match self {
            Codec::Feetech(_) => feetech::request(out, id.0, feetech::RESTART, &[]),
            Codec::Dynamixel(_) => dynamixel::request(out, id.0, dynamixel::REBOOT, &[]),
        }
    }

    /// Appends a read of `register`.
    pub(super) fn read(&self, out: &mut Vec<u8>, id: ServoId, register: Register) {
        let Register { address, .. } = register;
        match self {
            Codec::Feetech(_) => {
                let bytes = read_bytes(Protocol::Feetech, register);
                feetech::read(out, id, low_byte(address), low_byte(bytes));
            }
            Codec::Dynamixel(_) => {
                dynamixel::read(out, id, address, read_bytes(Protocol::Dynamixel, register));
            }
        }
    }

    /// Appends a read of a block of registers.
    pub(super) fn read_block(&self, out: &mut Vec<u8>, id: ServoId, address: u16, bytes: u16) {
        match self {
            Codec::Feetech(_) => feetech::read(out, id, low_byte(address), low_byte(bytes)),
            Codec::Dynamixel(_) => dynamixel::read(out, id, address, bytes),
        }
    }

    pub(super) fn write(&self, out: &mut Vec<u8>, id: ServoId, register: Register, raw: u64) {
        let Register { address, bytes, .. } = register;
        match self {
            Codec::Feetech(_) => feetech::write(out, id, low_byte(address), bytes, raw),
            Codec::Dynamixel(_) => dynamixel::write(out, id, address, bytes, raw),
        }
    }

    pub(super) fn sync_write(
        &self,
        out: &mut Vec<u8>,
        register: Register,
        values: impl Iterator<Item = (ServoId, u64)>,
    ) {
        let Register { address, bytes, .. } = register;
        match self {
            Codec::Feetech(_) => feetech::sync_write(out, low_byte(address), bytes, values),
            Codec::Dynamixel(_) => dynamixel::sync_write(out, address, bytes, values),
        }
    }

    pub(super) fn sync_read(&self, out: &mut Vec<u8>, address: u16, bytes: u16, ids: &[ServoId]) {
        match self {
            Codec::Feetech(_) => feetech::sync_read(out, low_byte(address), low_byte(bytes), ids),
            Codec::Dynamixel(_) => dynamixel::sync_read(out, address, bytes, ids),
        }
    }

    /// Appends a fast sync read and prepares for the reply. Feetech has no fast read and gets a plain one.
    pub(super) fn fast_sync_read(&mut self, out: &mut Vec<u8>, address: u16, bytes: u16, ids: &[ServoId]) {
        match self {
            Codec::Feetech(_) => self.sync_read(out, address, bytes, ids),
            Codec::Dynamixel(decoder) => {
                dynamixel::fast_sync_read(out, address, bytes, ids);
                decoder.expect_fast_reply(ids.len(), usize::from(bytes));
            }
        }
    }

    pub(super) fn clear(&mut self) {
        match self {
            Codec::Feetech(decoder) => decoder.clear(),
            Codec::Dynamixel(decoder) => decoder.clear(),
        }
    }

    pub(super) fn push(&mut self, bytes: &[u8]) -> usize {
        match self {
            Codec::Feetech(decoder) => decoder.push(bytes),
            Codec::Dynamixel(decoder) => decoder.push(bytes),
        }
    }

    pub(super) fn end_of_input(&mut self) {
        match self {
            Codec::Feetech(decoder) => decoder.end_of_input(),
            Codec::Dynamixel(decoder) => decoder.end_of_input(),
        }
    }

    pub(super) fn next_event(&mut self) -> Option<Event<'_>> {
        match self {
            Codec::Feetech(decoder) => decoder.next_event(),
            Codec::Dynamixel(decoder) => decoder.next_event(),
        }
    }
}

/// Feetech addresses and counts have one byte; its tables hold no larger values.
fn low_byte(word: u16) -> u8 {
    let [low, _] = word.to_le_bytes();
    low
}

/// Data bytes in the reply to a ping.
pub(super) fn ping_bytes(protocol: Protocol) -> u16 {
    match protocol {
        Protocol::Feetech => 0,
        // A Dynamixel answers with model number and firmware version.
        Protocol::Dynamixel => 3,
    }
}

/// Data bytes in the reply to [`Codec::read`].
///
/// A Feetech read request has two parameters, address and count, and the reply has its alarms in the place of the
/// request's instruction. So the reply to a read of two bytes can equal its request bit for bit, and could not
/// be told from an adapter's echo of an unanswered request. Asked for a third byte, the reply is longer.
pub(super) fn read_bytes(protocol: Protocol, register: Register) -> u16 {
    match (protocol, register.bytes) {
        (Protocol::Feetech, 2) => 3,
        (_, bytes) => u16::from(bytes),
    }
}

/// True if a status packet could be the echo of a Feetech ping: 1 in the place of the instruction
/// and no data.
///
/// A servo with only the voltage alarm answers a ping with the very bytes of the request. If they counted as an
/// answer, an adapter that echoes would seem to have servos; so they never count, and a caller that gets no answer
/// to a ping must read a register instead, whose reply cannot be confused ([`read_bytes`]).
pub(super) fn may_be_echoed_ping(protocol: Protocol, error: u8, parameters: &[u8]) -> bool {
    protocol == Protocol::Feetech && error == feetech::PING && parameters.is_empty()
}

/// Splits a status packet's error byte into alarm bits and the number of a refusal, 0 for none. Feetech has only
/// alarms: they come with a valid answer.
pub(super) fn alarms_and_refusal(protocol: Protocol, error: u8) -> (u8, u8) {
    match protocol {
        Protocol::Feetech => (error, 0),
        Protocol::Dynamixel => (error & dynamixel::ALERT, error & !dynamixel::ALERT),
    }
}
