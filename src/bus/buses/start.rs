//! Before the first cycle and after the last: are these the servos of the robot file, and are they limp?

use super::Buses;
use crate::bus::ServoGoal;
use crate::bus::port::Ports;
use crate::bus::{ServoPlace, TransactionError};
use crate::model::Robot;

/// Why a run cannot start. No torque was on then.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StartError {
    /// A servo cannot be asked.
    #[error(transparent)]
    Transaction(#[from] TransactionError),
    /// Another servo than the robot file says.
    #[error(
        "{place} says it is model number {found}, the robot file says {expected} ({model}): check that its bus and \
         id are the ones of this joint"
    )]
    OtherModel {
        /// Where.
        place: ServoPlace,
        /// Model number it reports.
        found: i64,
        /// Model number of the robot file's model.
        expected: u16,
        /// Name of the robot file's model.
        model: &'static str,
    },
}

/// Limp goals are sent this often, in case one is lost.
const LIMP_TRIES: u32 = 3;

impl<P: Ports> Buses<P> {
    /// Asks every servo whether it is there and is the model the robot file says; then makes it limp and
    /// clears what another program may have left in it.
    ///
    /// # Errors
    /// The first servo that is not. Nothing was written to any servo then.
    pub fn prepare(&mut self, robot: &Robot) -> Result<(), StartError> {
        self.identify(robot)?;
        for (index, joint) in robot.joints.iter().enumerate() {
            let Some(servo) = &joint.servo else { continue };
            for &(register, value) in servo.model.registers.preparation {
                self.write(index, register, value)?;
            }
        }
        Ok(())
    }

    fn identify(&mut self, robot: &Robot) -> Result<(), StartError> {
        for (index, joint) in robot.joints.iter().enumerate() {
            let Some(servo) = &joint.servo else { continue };
            self.ping(index)?;
            let found = self.read(index, servo.model.registers.model_number)?;
            let expected = servo.model.model_number;
            if found != i64::from(expected) {
                let place = self.place(index)?.servo.clone();
                return Err(StartError::OtherModel { place, found, expected, model: servo.model.name });
            }
        }
        Ok(())
    }

    /// Takes the torque off all servos, outside the pipeline: for ends the motion has no part in.
    pub fn limp(&mut self) {
        let count = self.places.len();
        let mut slots = vec![crate::bus::Slot::Missing; count];
        for _ in 0..LIMP_TRIES {
            self.exchange_counts(&vec![ServoGoal::Limp; count], &mut slots);
        }
    }
}
