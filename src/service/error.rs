//! What can go wrong between the program and one servo.

use std::fmt;
use std::path::PathBuf;

use super::registers::BadValue;
use crate::bus::refusal;
use crate::bus::serial::OpenCause;
use crate::model::Protocol;
use crate::units::ServoId;

/// Where a servo answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Address {
    /// Its language.
    pub protocol: Protocol,
    /// Line rate it listens at, bit/s.
    pub baud: u32,
    /// Its id.
    pub id: ServoId,
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "servo {} ({}, {} baud)", self.id, self.protocol.name(), self.baud)
    }
}

/// Why something could not be done with a servo.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ServiceError {
    /// The device cannot be opened.
    #[error("{}", OpenWords(path, cause))]
    Open {
        /// The device.
        path: PathBuf,
        /// Its faults.
        cause: OpenCause,
    },
    /// The adapter is gone.
    #[error("{} is gone: plug its adapter in again and start anew", path.display())]
    Gone {
        /// The device.
        path: PathBuf,
    },
    /// The adapter cannot go at this rate.
    #[error("{} cannot go at {baud} baud ({reason}): use another adapter for servos at that rate", path.display())]
    Baud {
        /// The device.
        path: PathBuf,
        /// Line rate wanted, bit/s.
        baud: u32,
        /// What the system says.
        reason: String,
    },
    /// Nothing came back.
    #[error(
        "{address} did not answer {request}: check its power and cable; 'hippocamp scan' finds who answers"
    )]
    NoAnswer {
        /// Who was asked.
        address: Address,
        /// What, in words.
        request: String,
    },
    /// What came back was damaged each time.
    #[error(
        "{address} sent only damaged answers to {request}: two servos may have this id (unplug all but one, and give \
         each an id of its own), or a plug is loose"
    )]
    Damaged {
        /// Who was asked.
        address: Address,
        /// What, in words.
        request: String,
    },
    /// The servo understood and would not.
    #[error("{address} refused {request} with error {error}: {}", refusal(*error))]
    Refused {
        /// Who was asked.
        address: Address,
        /// What, in words.
        request: String,
        /// Error number of Dynamixel Protocol 2.0.
        error: u8,
    },
    /// It said yes and holds something else.
    #[error(
        "{address} was given {wanted} for {register} and holds {found}: its model or firmware may not take that value"
    )]
    NotTaken {
        /// Who.
        address: Address,
        /// Name of the register.
        register: String,
        /// Count written.
        wanted: i64,
        /// Count read back.
        found: i64,
    },
    /// The servo has no such register.
    #[error("{address} has no register {name}; {advice}")]
    NoRegister {
        /// Who.
        address: Address,
        /// What was asked for.
        name: String,
        /// The name it is like, or all names.
        advice: String,
    },
    /// The register is not for writing.
    #[error("{register} of {address} cannot be written: the servo alone sets it")]
    Fixed {
        /// Who.
        address: Address,
        /// Name of the register.
        register: String,
    },
    /// It is another model than the one meant.
    #[error("{address} is model number {found}, not {expected}: this is for another model")]
    OtherModel {
        /// Who.
        address: Address,
        /// Its model number.
        found: u16,
        /// The one meant.
        expected: u16,
    },
    /// A register does not hold what was written before.
    #[error(
        "{address} no longer holds what was written to {register}: do the same again, and look at its supply"
    )]
    NotKept {
        /// Who.
        address: Address,
        /// Name of the register.
        register: String,
    },
    /// The id is not free.
    #[error("{address} is there already: each servo on a line needs an id of its own")]
    IdTaken {
        /// Who has it.
        address: Address,
    },
    /// The value does not fit.
    #[error("{0}")]
    BadValue(#[from] BadValue),
    /// The user has broken off.
    #[error("broken off by the user")]
    Interrupted,
}

struct OpenWords<'a>(&'a PathBuf, &'a OpenCause);

impl fmt::Display for OpenWords<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.1.write(f, self.0)
    }
}
