//! Why a world cannot be built, or a bus cannot be used.

use crate::body::BodyError;
use crate::faults::FaultError;
use crate::model::{Model, Protocol};

/// The bus's adapter is gone: a scripted unplug is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the adapter is unplugged")]
pub struct Unplugged;

/// What is wrong with the configuration of a world.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// The simulated body came apart in numbers as the robot was put down.
    #[error(
        "the simulated body is unstable: its numbers grew without bound as the robot was put down; this is a fault of the \
         simulation, not of the robot: please report it with the robot file (a smaller step_ms or a larger \
         rotor_inertia_kg_m2 may avoid it)"
    )]
    Unstable,
    /// No such servo model.
    #[error("bus `{bus}`, servo {id}: no model `{model}`; there are {known}")]
    UnknownModel {
        /// Bus name.
        bus: String,
        /// Servo id.
        id: u8,
        /// Model asked for.
        model: String,
        /// Models there are.
        known: String,
    },
    /// No such protocol.
    #[error("bus `{bus}`: no protocol `{protocol}` in the simulator")]
    UnknownProtocol {
        /// Bus name.
        bus: String,
        /// Protocol asked for.
        protocol: String,
    },
    /// The model speaks another protocol than its bus.
    #[error("bus `{bus}`, servo {id}: {model} speaks {speaks}, the bus speaks {expected}")]
    WrongProtocol {
        /// Bus name.
        bus: String,
        /// Servo id.
        id: u8,
        /// Model asked for.
        model: String,
        /// Protocol of the model.
        speaks: Protocol,
        /// Protocol of the bus.
        expected: Protocol,
    },
    /// An id that no servo can have.
    #[error("bus `{bus}`: id {id} is not possible; {protocol} servos have 0 to {max}")]
    BadId {
        /// Bus name.
        bus: String,
        /// The id.
        id: u8,
        /// Protocol of the bus.
        protocol: Protocol,
        /// Highest possible id.
        max: u8,
    },
    /// Two servos of a bus share an id.
    #[error("bus `{bus}`: two servos have id {id}; ids are unique on a bus")]
    DuplicateId {
        /// Bus name.
        bus: String,
        /// The id.
        id: u8,
    },
    /// Two buses share a name.
    #[error("two buses are named `{bus}`; fault scripts tell buses apart by name")]
    DuplicateBus {
        /// The name.
        bus: String,
    },
    /// A line rate that the protocol, or one of the models, does not have.
    #[error("bus `{bus}`: {baud} bit/s is not possible; its servos know {known}")]
    BadBaud {
        /// Bus name.
        bus: String,
        /// The rate.
        baud: u32,
        /// Allowed rates.
        known: String,
    },
    /// A number outside its range.
    #[error("bus `{bus}`: {key} is {value}; expected {expected}")]
    BadNumber {
        /// Bus name.
        bus: String,
        /// The field, with the servo if it is one of a servo.
        key: String,
        /// Its value.
        value: String,
        /// Allowed values.
        expected: &'static str,
    },
    /// An impossible setting of the inertial measurement unit.
    #[error("inertial measurement unit: {key} is {value}; expected {expected}")]
    BadImu {
        /// The field.
        key: &'static str,
        /// Its value.
        value: String,
        /// Allowed values.
        expected: String,
    },
    /// Faults on buses or servos that do not exist.
    #[error(transparent)]
    Faults(#[from] FaultError),
    /// An impossible body.
    #[error(transparent)]
    Body(#[from] BodyError),
}

impl BuildError {
    /// The error for a model that the crate does not have.
    pub fn unknown_model(bus: &str, id: u8, model: &str) -> BuildError {
        let known = Model::all().iter().map(|model| model.name.as_str()).collect::<Vec<_>>().join(", ");
        BuildError::UnknownModel { bus: bus.to_owned(), id, model: model.to_owned(), known }
    }
}
