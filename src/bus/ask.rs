//! Requests to one servo outside the loop, and their results.

use std::{fmt, io};

use super::frame::Heard;
use super::protocols::ProtocolSpec;
use crate::units::ServoId;

/// Instructions, with the same numbers for both makers.
pub(super) const PING: u8 = 0x01;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const RESET: u8 = 0x06;
pub(super) const REBOOT: u8 = 0x08;

/// A request to one servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ask<'a> {
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
    pub(crate) fn is_repeatable(&self) -> bool {
        !matches!(self, Ask::Reboot | Ask::Reset)
    }

    /// Instruction, parameters, and bytes of data in the answer.
    pub(crate) fn packet(&self, spec: &ProtocolSpec) -> (u8, Vec<u8>, usize) {
        let word = |value: u16| value.to_le_bytes()[..spec.word_bytes].to_vec();
        match self {
            Ask::Ping => (PING, Vec::new(), usize::from(spec.ping_bytes)),
            Ask::Read { start, bytes } => {
                (READ, [word(*start), word(u16::from(*bytes))].concat(), usize::from(*bytes))
            }
            Ask::Write { start, data } => (WRITE, [&word(*start), *data].concat(), 0),
            Ask::Reboot => (REBOOT, Vec::new(), 0),
            Ask::Reset => (RESET, spec.reset_parameters.to_vec(), 0),
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
pub(crate) enum Answer {
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
    /// Takes in a packet heard while an answer with `data_bytes` bytes of data from the servo `asked` is due.
    pub(crate) fn take(&mut self, spec: &ProtocolSpec, asked: ServoId, data_bytes: usize, packet: Heard) {
        if matches!(self, Answer::Data(_) | Answer::Refused(_)) {
            return;
        }
        match packet {
            Heard::Status { id, error, data } if id == asked => {
                *self = match (spec.alarms_and_refusal)(error).1 {
                    0 if data.len() == data_bytes => Answer::Data(data),
                    0 => Answer::Damaged,
                    number => Answer::Refused(number),
                };
            }
            Heard::Damaged(id) if id == asked => *self = Answer::Damaged,
            Heard::Status { .. } | Heard::Damaged(_) => {}
        }
    }
}

/// A library by others that carries out requests on a copy of a line.
pub(crate) trait Library: fmt::Debug + Send {
    /// Sets the line's rate, bit/s.
    fn set_baud(&mut self, baud: u32) -> io::Result<()>;

    /// Sends the request once.
    ///
    /// # Errors
    /// If the line cannot be used.
    fn ask(&mut self, id: ServoId, ask: &Ask<'_>) -> io::Result<Answer>;
}
