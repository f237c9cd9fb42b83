//! Errors when one servo is asked something at start or stop.

use std::fmt;

use super::port::PortError;
use crate::model::servo_model::Register;
use crate::units::ServoId;

/// A request to a servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Asks whether the servo is there.
    Ping,
    /// Reads the value of a register.
    Read(Register),
    /// Writes a value to a register.
    Write(Register, i64),
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Request::Ping => write!(f, "a ping"),
            Request::Read(register) => {
                write!(f, "a read of register {} ({} bytes)", register.address, register.bytes)
            }
            Request::Write(register, value) => {
                write!(f, "a write of {value} to register {}", register.address)
            }
        }
    }
}

/// Identifies a servo in the user's words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServoPlace {
    /// Name of its bus.
    pub bus: String,
    /// Line rate of the bus, bits per second.
    pub baud: u32,
    /// Its id on that bus.
    pub id: ServoId,
    /// Name of the joint that it turns.
    pub joint: String,
}

impl fmt::Display for ServoPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "servo {} of joint {} on bus {}", self.id, self.joint, self.bus)
    }
}

/// Why a servo could not be pinged, read or written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TransactionError {
    /// The line is not there.
    #[error("{place}: {request} could not be sent: {source}")]
    Port {
        /// The servo that was asked.
        place: ServoPlace,
        /// The request.
        request: Request,
        /// The cause.
        source: PortError,
    },
    /// No answer came.
    #[error(
        "{place} did not answer {request} in {tries} tries: check its power and cable, that its id is {id}, \
         and that it is set to {baud} baud",
        id = place.id, baud = place.baud
    )]
    NoAnswer {
        /// The servo that was asked.
        place: ServoPlace,
        /// The request.
        request: Request,
        /// Number of tries.
        tries: u32,
    },
    /// Replies came, but all were damaged.
    #[error(
        "{place} sent only damaged replies to {request}, in {tries} tries: they do not pass their check or have the \
         wrong length; check that no other servo has id {id}, and the bus for loose plugs and long cables",
        id = place.id
    )]
    Corrupt {
        /// The servo that was asked.
        place: ServoPlace,
        /// The request.
        request: Request,
        /// Number of tries.
        tries: u32,
    },
    /// The servo understood the request and refused it.
    #[error("{place} refused {request} with error {error}: {meaning}")]
    Refused {
        /// The servo that was asked.
        place: ServoPlace,
        /// The request.
        request: Request,
        /// The protocol's number of the error.
        error: u8,
        /// Its meaning, and what to do.
        meaning: &'static str,
    },
    /// The joint has no servo.
    #[error("joint {joint} has no servo: only a robot whose joints name their servos can be asked")]
    NoServo {
        /// Index into [`crate::model::Robot::joints`].
        joint: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::dynamixel::DYNAMIXEL_X;
    use crate::model::Protocol;

    #[test]
    fn messages_name_servo_bus_joint_and_what_to_do() {
        let place =
            ServoPlace { bus: "legs".into(), baud: 57_600, id: ServoId(7), joint: "left_hind.hip".into() };
        let error = TransactionError::NoAnswer {
            place: place.clone(),
            request: Request::Read(DYNAMIXEL_X.present_position),
            tries: 3,
        };
        assert_eq!(
            error.to_string(),
            "servo 7 of joint left_hind.hip on bus legs did not answer a read of register 132 (4 bytes) in 3 \
             tries: check its power and cable, that its id is 7, and that it is set to 57600 baud"
        );
        let request = Request::Write(DYNAMIXEL_X.torque_enable, 1);
        let meaning = (Protocol::Dynamixel.spec().refusal)(7);
        let error = TransactionError::Refused { place, request, error: 7, meaning };
        assert_eq!(
            error.to_string(),
            "servo 7 of joint left_hind.hip on bus legs refused a write of 1 to register 64 with error 7: the \
             register cannot be accessed like this now; torque must be off to change settings, and its firmware \
             must know the register"
        );
    }
}
