//! Errors between the program and one servo.

use std::fmt;
use std::path::PathBuf;

use crate::bus::serial::OpenCause;
use crate::bus::table::BadValue;
use crate::model::Protocol;
use crate::units::ServoId;

/// The address of a servo: where it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Address {
    /// Its protocol.
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

/// Why a request to a servo failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ServiceError {
    /// The device cannot be opened.
    #[error("{}", OpenWords(path, cause))]
    Open {
        /// The device.
        path: PathBuf,
        /// The cause.
        cause: OpenCause,
    },
    /// The adapter is gone.
    #[error("{} is gone: plug its adapter in again and start again", path.display())]
    Gone {
        /// The device.
        path: PathBuf,
    },
    /// The adapter does not support this rate.
    #[error("{} cannot run at {baud} baud ({reason}): use another adapter for servos at that rate", path.display())]
    Baud {
        /// The device.
        path: PathBuf,
        /// The line rate wanted, bit/s.
        baud: u32,
        /// The system's error.
        reason: String,
    },
    /// No answer came.
    #[error(
        "{address} did not answer {request}: check its power and cable; 'hippocamp scan' lists the servos that \
         answer"
    )]
    NoAnswer {
        /// Address of the servo.
        address: Address,
        /// The request, in words.
        request: String,
    },
    /// Every answer was damaged.
    #[error(
        "{address} sent only damaged answers to {request}: two servos may have this id (unplug all but one, and give \
         each an id of its own), or a plug is loose"
    )]
    Damaged {
        /// Address of the servo.
        address: Address,
        /// The request, in words.
        request: String,
    },
    /// The servo understood and refused.
    #[error("{address} refused {request} with error {error}: {}", (address.protocol.spec().refusal)(*error))]
    Refused {
        /// Address of the servo.
        address: Address,
        /// The request, in words.
        request: String,
        /// The protocol's number of the error.
        error: u8,
    },
    /// The servo accepted the write and holds something else.
    #[error(
        "{address}: {register} was set to {wanted} and reads {found}: its model or firmware may not accept that \
         value"
    )]
    NotTaken {
        /// Address of the servo.
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
        /// Address of the servo.
        address: Address,
        /// The name asked for.
        name: String,
        /// The most similar name, or all names.
        advice: String,
    },
    /// The register is read-only.
    #[error("{register} of {address} cannot be written: the servo alone sets it")]
    Fixed {
        /// Address of the servo.
        address: Address,
        /// Name of the register.
        register: String,
    },
    /// The servo is of another model than expected.
    #[error("{address} is model number {found}, not {expected}: this is for another model")]
    OtherModel {
        /// Address of the servo.
        address: Address,
        /// Its model number.
        found: u16,
        /// The expected one.
        expected: u16,
    },
    /// A register no longer holds the value written before.
    #[error(
        "{address} no longer holds what was written to {register}: repeat the command, and check its supply"
    )]
    NotKept {
        /// Address of the servo.
        address: Address,
        /// Name of the register.
        register: String,
    },
    /// The id is not free.
    #[error("{address} exists already: each servo on a line needs an id of its own")]
    IdTaken {
        /// Address of the servo that has it.
        address: Address,
    },
    /// The value does not fit.
    #[error("{0}")]
    BadValue(#[from] BadValue),
    /// The user broke off.
    #[error("interrupted by the user")]
    Interrupted,
}

struct OpenWords<'a>(&'a PathBuf, &'a OpenCause);

impl fmt::Display for OpenWords<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.1.write(f, self.0)
    }
}
