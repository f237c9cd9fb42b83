//! Why a run cannot start: every difference between the robot and its file, for people.

use std::fmt;

use crate::bus::{ServoPlace, TransactionError};
use crate::model::Protocol;

/// Why a run cannot start. No servo has torque then.
#[derive(Debug, Clone, PartialEq)]
pub enum StartError {
    /// The servos differ from the robot file: all differences, at least one. Nothing was written to any servo.
    Disagrees(Vec<Disagreement>),
    /// A servo could not be prepared.
    Transaction(TransactionError),
}

impl fmt::Display for StartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StartError::Transaction(error) => error.fmt(f),
            StartError::Disagrees(all) => {
                for disagreement in all {
                    writeln!(f, "{disagreement}")?;
                }
                if all.iter().any(|one| matches!(one, Disagreement::Unheard(_))) {
                    writeln!(f, "'hippocamp scan' shows which ids answer, and an id that two servos have")?;
                }
                f.write_str("the robot is not as its file says; no servo was written to")
            }
        }
    }
}

impl std::error::Error for StartError {}

impl From<TransactionError> for StartError {
    fn from(error: TransactionError) -> StartError {
        StartError::Transaction(error)
    }
}

/// One difference between the robot and its file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Disagreement {
    /// A request to a servo failed.
    #[error(transparent)]
    Unheard(TransactionError),
    /// The servo's model is not that of the robot file.
    #[error(
        "{place} is another model: the robot file says {model} (model number {expected}), the servo reports model \
         number {found}{}: name that model in the robot file, or check that its bus and id are this joint's",
        models_with(*.protocol, *.found)
    )]
    OtherModel {
        /// The servo.
        place: ServoPlace,
        /// Protocol of its bus.
        protocol: Protocol,
        /// Model number it reports.
        found: i64,
        /// Model number of the robot file's model.
        expected: u16,
        /// Name of the robot file's model.
        model: &'static str,
    },
    /// A setting of a servo differs from what the controller needs.
    #[error("{place}: its register {register} reads {found}, {expected} is needed: {cure}")]
    OtherSetting {
        /// The servo.
        place: ServoPlace,
        /// Address of the register.
        register: u16,
        /// Its value.
        found: i64,
        /// The value needed.
        expected: i64,
        /// What to do.
        cure: &'static str,
    },
    /// A servo is too hot to get torque.
    #[error(
        "{place} is at {found_c} C, above the limit of {limit_c:.0} C (temperature_max_c): let it cool first"
    )]
    Hot {
        /// The servo.
        place: ServoPlace,
        /// Temperature it reports, degrees Celsius.
        found_c: i64,
        /// The robot file's limit, degrees Celsius.
        limit_c: f64,
    },
    /// A servo's supply voltage is out of range.
    #[error(
        "{place} sees {found_v:.1} V, and needs {lowest_v:.1} to {highest_v:.1} V: charge the battery, or check the \
         supply, its wires, and that the servo is the right model"
    )]
    Supply {
        /// The servo.
        place: ServoPlace,
        /// Voltage it reports, V.
        found_v: f64,
        /// The robot file's limit, V.
        lowest_v: f64,
        /// Highest voltage that the model tolerates, V.
        highest_v: f64,
    },
    /// A servo answers on a different bus from that in the robot file.
    #[error(
        "{place} answers on {found} instead: plug it into bus {bus}, or name the other bus in the robot file",
        bus = .place.bus
    )]
    OtherBus {
        /// The servo, on the bus where it should be.
        place: ServoPlace,
        /// The bus where it answers.
        found: BusDevice,
    },
    /// The servos of two buses each answer on the other's line.
    #[error(
        "the devices of {} and {} look swapped: the servos of each answer on the other's line; exchange the two \
         devices in the unit file (or in --port), or the two plugs",
        .0[0], .0[1]
    )]
    Swapped([BusDevice; 2]),
}

/// A bus, and the name of its device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusDevice {
    /// Name of the bus.
    pub bus: String,
    /// Its device, if it has a name.
    pub device: Option<String>,
}

impl fmt::Display for BusDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "bus {}", self.bus)?;
        self.device.iter().try_for_each(|device| write!(f, " ({device})"))
    }
}

/// The names of the models with this number, for a message; empty if none is known.
fn models_with(protocol: Protocol, number: i64) -> String {
    let models = protocol.spec().models.iter();
    let models = models.filter(|model| i64::from(model.model_number) == number);
    let names: Vec<_> = models.map(|model| model.name).collect();
    if names.is_empty() { String::new() } else { format!(" ({})", names.join(" or ")) }
}
