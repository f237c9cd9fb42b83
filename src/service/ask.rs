//! Requests to one servo, and their results.

use std::fmt;

use super::error::Address;
use crate::bus::frame::Heard;
use crate::model::Protocol;

/// Instructions, with the same numbers for both makers.
const PING: u8 = 0x01;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const RESET: u8 = 0x06;
const REBOOT: u8 = 0x08;
/// Dynamixel's Factory Reset: all except id and line rate (e-manual, Protocol 2.0).
const RESET_KEEPS_ID_AND_BAUD: u8 = 0x02;
/// The alert bit of a Dynamixel error byte, beside the error number.
const ALERT: u8 = 0x80;

/// A request to one servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ask<'a> {
    /// Dynamixel: model number and firmware. Feetech: whether it is there.
    Ping,
    /// Reads registers.
    Read {
        /// First address.
        start: u16,
        /// Number of bytes.
        bytes: u8,
    },
    /// Writes bytes to registers, in the servo's byte order.
    Write {
        /// First address.
        start: u16,
        /// The bytes.
        data: &'a [u8],
    },
    /// Restarts the servo.
    Reboot,
    /// Resets all settings to the factory values, except id and line rate (Feetech: except the id).
    Reset,
}

impl Ask<'_> {
    /// True if the request can be repeated without further effect.
    pub(super) fn is_repeatable(&self) -> bool {
        !matches!(self, Ask::Reboot | Ask::Reset)
    }

    /// Instruction, parameters, and bytes of data in the answer.
    pub(super) fn packet(&self, protocol: Protocol) -> (u8, Vec<u8>, usize) {
        // Feetech addresses have one byte; its tables hold no others.
        let place = |start: u16| match protocol {
            Protocol::Dynamixel => start.to_le_bytes().to_vec(),
            Protocol::Feetech => start.to_le_bytes()[..1].to_vec(),
        };
        match self {
            Ask::Ping => (PING, Vec::new(), if protocol == Protocol::Dynamixel { 3 } else { 0 }),
            Ask::Read { start, bytes } => {
                let count: &[u8] = if protocol == Protocol::Dynamixel { &[*bytes, 0] } else { &[*bytes] };
                (READ, [&place(*start), count].concat(), usize::from(*bytes))
            }
            Ask::Write { start, data } => (WRITE, [&place(*start), *data].concat(), 0),
            Ask::Reboot => (REBOOT, Vec::new(), 0),
            Ask::Reset if protocol == Protocol::Dynamixel => (RESET, vec![RESET_KEEPS_ID_AND_BAUD], 0),
            Ask::Reset => (RESET, Vec::new(), 0),
        }
    }
}

impl fmt::Display for Ask<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Ask::Ping => f.write_str("a ping"),
            Ask::Read { start, bytes: 1 } => write!(f, "a read of register {start}"),
            Ask::Read { start, bytes } => {
                write!(f, "a read of registers {start} to {}", start + u16::from(*bytes) - 1)
            }
            Ask::Write { start, .. } => write!(f, "a write of register {start}"),
            Ask::Reboot => f.write_str("a restart"),
            Ask::Reset => f.write_str("a factory reset"),
        }
    }
}

/// The result of a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Answer {
    /// The data of the answer.
    Data(Vec<u8>),
    /// The servo refused; Dynamixel's error number.
    Refused(u8),
    /// An answer came with a wrong checksum.
    Damaged,
    /// No answer came.
    Missing,
}

impl Answer {
    /// Takes in a packet heard while an answer with `data_bytes` bytes of data from the servo at `address` is due.
    pub(super) fn take(&mut self, address: Address, data_bytes: usize, packet: Heard) {
        if matches!(self, Answer::Data(_) | Answer::Refused(_)) {
            return;
        }
        match packet {
            Heard::Status { id, error, data } if id == address.id => {
                let refusal = if address.protocol == Protocol::Dynamixel { error & !ALERT } else { 0 };
                *self = match refusal {
                    0 if data.len() == data_bytes => Answer::Data(data),
                    0 => Answer::Damaged,
                    number => Answer::Refused(number),
                };
            }
            Heard::Damaged(id) if id == address.id => *self = Answer::Damaged,
            Heard::Status { .. } | Heard::Damaged(_) => {}
        }
    }
}
