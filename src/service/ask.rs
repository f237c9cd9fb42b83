//! What can be asked of one servo, and what becomes of it.

use std::fmt;

use super::error::Address;
use crate::bus::frame::Heard;
use crate::model::Protocol;

/// Instructions, which both makers number alike.
const PING: u8 = 0x01;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const RESET: u8 = 0x06;
const REBOOT: u8 = 0x08;
/// Dynamixel's Factory Reset: all but id and line rate (e-manual, Protocol 2.0).
const RESET_KEEPS_ID_AND_BAUD: u8 = 0x02;
/// The alert of a Dynamixel error byte, beside the number.
const ALERT: u8 = 0x80;

/// A question to one servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ask<'a> {
    /// Dynamixel: model number and firmware. Feetech: whether it is there.
    Ping,
    /// Registers.
    Read {
        /// First address.
        start: u16,
        /// How many bytes.
        bytes: u8,
    },
    /// The bytes of registers, as they stand in the servo.
    Write {
        /// First address.
        start: u16,
        /// The bytes.
        data: &'a [u8],
    },
    /// To start anew.
    Reboot,
    /// To take all settings back to what the factory set, but for id and line rate (Feetech: but for the id).
    Reset,
}

impl Ask<'_> {
    /// Whether asking twice does no more than asking once.
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

/// What became of a question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Answer {
    /// It was answered.
    Data(Vec<u8>),
    /// The servo would not; Dynamixel's error number.
    Refused(u8),
    /// Something came that did not pass its check.
    Damaged,
    /// Nothing came.
    Missing,
}

impl Answer {
    /// Takes a packet into account that was heard while the servo at `address` was to answer with so many bytes.
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
