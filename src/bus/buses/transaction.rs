//! Asks one servo one thing, at start and stop: blocking, with retries.

use super::{Buses, Line};
use crate::bus::client::Answer;
use crate::bus::error::{Request, ServoPlace, TransactionError};
use crate::bus::port::Ports;
use crate::bus::register::{decode, encode};
use crate::model::servo_model::Register;

/// Number of times that a request is sent before it is given up: one or two replies lost to noise are no reason not
/// to start.
pub(super) const TRIES: u32 = 3;

impl<P: Ports> Buses<P> {
    /// Checks that the joint's servo is there.
    ///
    /// # Errors
    /// [`TransactionError`], if it does not answer.
    pub fn ping(&mut self, joint: usize) -> Result<(), TransactionError> {
        match self.ask(joint, Request::Ping) {
            // A Feetech servo in voltage alarm answers like an echo; a read cannot be confused.
            Err(error @ TransactionError::NoAnswer { .. }) => {
                let model_number = self.line_of(joint)?.client.registers().model_number;
                self.ask(joint, Request::Read(model_number)).map_err(|_| error)?;
                Ok(())
            }
            result => result.map(|_| ()),
        }
    }

    /// Reads a register of the joint's servo, in the register's own units.
    ///
    /// # Errors
    /// [`TransactionError`], when no good answer came.
    pub fn read(&mut self, joint: usize, register: Register) -> Result<i64, TransactionError> {
        self.ask(joint, Request::Read(register))
    }

    /// Writes a register of the joint's servo, in the register's own units. A value that it cannot hold becomes
    /// the nearest one it can. Not public: a goal written this way would skip the safety checks.
    ///
    /// # Errors
    /// [`TransactionError`], if the servo refused it or did not take it.
    pub(super) fn write(
        &mut self,
        joint: usize,
        register: Register,
        value: i64,
    ) -> Result<(), TransactionError> {
        match self.ask(joint, Request::Write(register, value)) {
            // A servo can be set to answer reads only. Then a read shows what it holds.
            Err(error @ TransactionError::NoAnswer { .. }) => {
                let held = self.ask(joint, Request::Read(register)).ok();
                let written = decode(register, &encode(register, value).to_le_bytes());
                if held.is_some() && held == written { Ok(()) } else { Err(error) }
            }
            result => result.map(|_| ()),
        }
    }

    fn line_of(&self, joint: usize) -> Result<&Line, TransactionError> {
        let place = self.place(joint)?;
        self.lines.get(place.line).ok_or(TransactionError::NoServo { joint })
    }

    /// Reads a register of the servo at `place` on the bus of `line`, which need not be the joint's own bus.
    pub(super) fn read_at(
        &mut self,
        line: usize,
        place: ServoPlace,
        register: Register,
    ) -> Result<i64, TransactionError> {
        self.ask_at(line, place, Request::Read(register))
    }

    /// Asks with retries; returns the value read, or 0.
    fn ask(&mut self, joint: usize, request: Request) -> Result<i64, TransactionError> {
        let place = self.place(joint)?;
        let (line, place) = (place.line, place.servo.clone());
        self.ask_at(line, place, request)
    }

    fn ask_at(&mut self, index: usize, place: ServoPlace, request: Request) -> Result<i64, TransactionError> {
        let mut is_corrupt = false;
        for _ in 0..self.tries {
            let Some(line) = self.lines.get_mut(index) else { break };
            let bytes = match request {
                Request::Ping => line.client.begin_ping(place.id),
                Request::Read(register) => line.client.begin_read(place.id, register),
                Request::Write(register, value) => line.client.begin_write(place.id, register, value),
            };
            let sent = self.ports.discard_input(index).and_then(|()| self.ports.send(index, bytes));
            line.await_replies(&mut self.ports, sent.clone());
            if let Err(source) = sent {
                return Err(TransactionError::Port { place, request, source });
            }
            self.wait_for_replies(|_, _| {});
            let Some(line) = self.lines.get_mut(index) else { break };
            match line.client.finish_transaction() {
                Answer::Done { value, .. } => return Ok(value),
                Answer::Refused { error } => {
                    let meaning = line.client.refusal(error);
                    return Err(TransactionError::Refused { place, request, error, meaning });
                }
                Answer::Corrupt => is_corrupt = true,
                Answer::Missing => {}
            }
        }
        Err(match is_corrupt {
            true => TransactionError::Corrupt { place, request, tries: self.tries },
            false => TransactionError::NoAnswer { place, request, tries: self.tries },
        })
    }
}
