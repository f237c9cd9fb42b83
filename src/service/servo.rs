//! One servo: its identity, reading its registers, and writing them.

use std::time::Duration;

use super::error::{Address, ServiceError};
use super::line::ServicePort;
use crate::bus::ask::{Answer, Ask};
use crate::bus::protocols::IdentifyRequest;
use crate::bus::table::{Access, Identity, RegisterInfo, Value, decode_bytes, encode_bytes};
use crate::config::nearest;
use crate::model::servo_model::Register;
use crate::model::{Firmware, Protocol};
use crate::platform::monotonic;
use crate::units::ServoId;

/// Number of attempts to identify it.
const TRIES: u32 = 3;
/// Most bytes in one read.
const BLOCK_BYTES: u8 = 32;
/// Time within which a restarted servo answers again: Feetech says about 1.8 s.
const RESTART: Duration = Duration::from_secs(5);
/// Time between checks whether it answers again.
const LOOK_AGAIN: Duration = Duration::from_millis(100);

/// A register, its value, and its bytes in the servo's order.
type RegisterContent = (RegisterInfo, Value, Vec<u8>);

/// A servo that answers, on a line reserved for it.
#[derive(Debug)]
pub struct Servo<'p> {
    port: &'p mut ServicePort,
    address: Address,
    identity: Identity,
}

impl ServicePort {
    /// The servo at `address`; asks for its identity.
    ///
    /// # Errors
    /// If it does not answer, or only with damaged answers, as two servos with one id do.
    pub fn servo(&mut self, address: Address) -> Result<Servo<'_>, ServiceError> {
        let identity = self.identify(address, TRIES)?;
        Ok(Servo { port: self, address, identity })
    }

    /// The same with a single request: for addresses that may well be empty.
    ///
    /// # Errors
    /// As [`ServicePort::servo`].
    pub fn servo_at_once(&mut self, address: Address) -> Result<Servo<'_>, ServiceError> {
        let identity = self.identify(address, 1)?;
        Ok(Servo { port: self, address, identity })
    }

    /// The same servo again, without asking.
    pub fn known_servo(&mut self, address: Address, identity: Identity) -> Servo<'_> {
        Servo { port: self, address, identity }
    }

    /// The identity of the servo at `address`; asks up to `tries` times.
    pub(super) fn identify(&mut self, address: Address, tries: u32) -> Result<Identity, ServiceError> {
        let spec = address.protocol.spec();
        let ask = match spec.identify {
            IdentifyRequest::Ping => Ask::Ping,
            IdentifyRequest::Read { whole, .. } => Ask::Read { start: 0, bytes: whole },
        };
        let mut is_damaged = false;
        for number in 0..tries {
            match self.ask_raw(address, &ask)? {
                Answer::Data(data) => match (spec.identity)(&data) {
                    Some(identity) => {
                        self.let_late_answers_pass(number)?;
                        return Ok(identity);
                    }
                    None => is_damaged = true,
                },
                Answer::Refused(_) | Answer::Damaged => is_damaged = true,
                Answer::Missing => {}
            }
        }
        let request = ask.to_string();
        Err(match is_damaged {
            true => ServiceError::Damaged { address, request },
            false => ServiceError::NoAnswer { address, request },
        })
    }

    /// True if any servo answers at `address`, even with a damaged answer.
    ///
    /// # Errors
    /// If the line cannot be used.
    pub fn is_anybody_at(&mut self, address: Address) -> Result<bool, ServiceError> {
        match self.identify(address, 2) {
            Ok(_) | Err(ServiceError::Damaged { .. }) => Ok(true),
            Err(ServiceError::NoAnswer { .. }) => Ok(false),
            Err(error) => Err(error),
        }
    }
}

/// The identity of a backup's servo.
pub(super) fn identity_of_backup(protocol: Protocol, model_number: u16, is_big_endian: bool) -> Identity {
    let all = protocol.spec().series;
    let series = all.iter().find(|of| of.registers.is_big_endian == is_big_endian).unwrap_or(&all[0]);
    Identity { series, model_number, firmware: Firmware { major: 0, minor: None }, is_speed_fine: true }
}

impl Servo<'_> {
    /// Its present address.
    pub fn address(&self) -> Address {
        self.address
    }

    /// Its identity.
    pub fn identity(&self) -> Identity {
        self.identity
    }

    /// True if the adapter echoes.
    pub fn is_line_echoing(&self) -> bool {
        self.port.is_echoing()
    }

    /// The register of this name.
    ///
    /// # Errors
    /// If the servo lacks it; the error gives the most similar name, or all.
    pub fn register(&self, name: &str) -> Result<RegisterInfo, ServiceError> {
        self.identity.register(name).ok_or_else(|| {
            let registers = self.identity.registers();
            let is_named = |of: &&RegisterInfo| !of.name.starts_with("indirect_");
            let names: Vec<&str> = registers.iter().filter(is_named).map(|of| &*of.name).collect();
            let advice = match nearest(name, names.iter().copied()) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("it has {}", names.join(", ")),
            };
            ServiceError::NoRegister { address: self.address, name: name.to_owned(), advice }
        })
    }

    /// The value of the register of this name.
    ///
    /// # Errors
    /// If there is no such register, or no good answer came.
    pub fn read(&mut self, name: &str) -> Result<Value, ServiceError> {
        let register = self.register(name)?;
        let raw = self.read_raw(&register)?;
        Ok(self.identity.value(&register, raw))
    }

    /// The count in a register.
    ///
    /// # Errors
    /// If no good answer came.
    pub fn read_raw(&mut self, register: &RegisterInfo) -> Result<i64, ServiceError> {
        let Register { address, bytes, .. } = register.register;
        let data = self.read_at_least(address, u16::from(bytes))?;
        Ok(self.decode(register.register, data.get(..usize::from(bytes)).unwrap_or_default()))
    }

    /// `bytes` bytes from the address `start` on, in the servo's order.
    ///
    /// # Errors
    /// If no good answer came.
    pub fn read_bytes(&mut self, start: u16, bytes: u8) -> Result<Vec<u8>, ServiceError> {
        self.port.ask(self.address, &Ask::Read { start, bytes })
    }

    /// The same, perhaps with more bytes behind them: see [`crate::bus::protocols::ProtocolSpec::asked_bytes`].
    fn read_at_least(&mut self, start: u16, bytes: u16) -> Result<Vec<u8>, ServiceError> {
        let asked = (self.address.protocol.spec().asked_bytes)(bytes);
        self.read_bytes(start, u8::try_from(asked).unwrap_or(BLOCK_BYTES))
    }

    /// All its registers with their values, by address. Leaves out registers that its firmware lacks.
    ///
    /// # Errors
    /// If no good answer came.
    pub fn read_all(&mut self) -> Result<Vec<(RegisterInfo, Value)>, ServiceError> {
        Ok(self.read_all_bytes()?.into_iter().map(|(register, value, _)| (register, value)).collect())
    }

    /// The same with the bytes in the servo's order.
    pub(super) fn read_all_bytes(&mut self) -> Result<Vec<RegisterContent>, ServiceError> {
        let registers = self.identity.registers();
        let mut all = Vec::new();
        for block in blocks(&registers) {
            match self.read_block(block) {
                Ok(values) => all.extend(values),
                Err(ServiceError::Refused { .. }) => {
                    for register in block {
                        match self.read_block(std::slice::from_ref(register)) {
                            Ok(value) => all.extend(value),
                            Err(ServiceError::Refused { .. }) => {}
                            Err(error) => return Err(error),
                        }
                    }
                }
                Err(error) => return Err(error),
            }
        }
        Ok(all)
    }

    fn read_block(&mut self, block: &[RegisterInfo]) -> Result<Vec<RegisterContent>, ServiceError> {
        let (Some(first), Some(last)) = (block.first(), block.last()) else { return Ok(Vec::new()) };
        let start = first.register.address;
        let bytes = end(last) - start;
        let data = self.read_at_least(start, bytes)?;
        let value = |register: &RegisterInfo| {
            let from = usize::from(register.register.address - start);
            let bytes = data.get(from..from + usize::from(register.register.bytes)).unwrap_or_default();
            let value = self.identity.value(register, self.decode(register.register, bytes));
            (register.clone(), value, bytes.to_vec())
        };
        Ok(block.iter().map(value).collect())
    }

    /// Writes a register in its own unit, and reads it back. See [`Servo::write_raw`].
    ///
    /// # Errors
    /// If the value does not fit, or as [`Servo::write_raw`].
    pub(crate) fn write(&mut self, name: &str, physical: f64) -> Result<(), ServiceError> {
        let register = self.register(name)?;
        if register.access == Access::Fixed {
            return Err(ServiceError::Fixed { address: self.address, register: name.to_owned() });
        }
        let raw = self.identity.count(&register, physical)?;
        self.write_raw(&register, raw)
    }

    /// Writes a count to a register and reads it back. For a setting it takes the torque off and, where a
    /// servo has a lock, unlocks and locks the settings; it follows the servo to a new id or line rate.
    ///
    /// # Errors
    /// If the servo does not accept it.
    pub(crate) fn write_raw(&mut self, register: &RegisterInfo, raw: i64) -> Result<(), ServiceError> {
        match (register.access, &*register.name) {
            (Access::Fixed, _) => {
                let register = register.name.to_string();
                Err(ServiceError::Fixed { address: self.address, register })
            }
            (Access::Volatile, _) => self.put(register, raw),
            (Access::Setting, _) => self.change_settings(|servo| servo.put_setting(register, raw)),
        }
    }

    /// Calls `work` with settings writable: torque off, and unlocked where the servo has a lock. Locks them again afterwards,
    /// whatever the result.
    pub(crate) fn change_settings<R>(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<R, ServiceError>,
    ) -> Result<R, ServiceError> {
        let torque = self.register("torque_enable")?;
        if self.read_raw(&torque)? != 0 {
            self.put(&torque, 0)?;
        }
        let Some(lock) = self.identity.register("lock") else { return work(self) };
        self.put(&lock, 0)?;
        let result = work(self);
        // An error of the work takes precedence over a lock that did not close: it also closes when the power goes
        // off.
        let locked = self.put(&lock, 1);
        let result = result?;
        locked.map(|()| result)
    }

    /// Writes a setting inside [`Servo::change_settings`].
    pub(crate) fn put_setting(&mut self, register: &RegisterInfo, raw: i64) -> Result<(), ServiceError> {
        match &*register.name {
            "id" => self.move_to_id(register, raw),
            "baud_rate" => self.move_to_baud(register, raw),
            _ => self.put(register, raw),
        }
    }

    /// True if its settings are locked, or if it has no lock: writes to an unlocked servo survive without power.
    ///
    /// # Errors
    /// If no good answer came.
    pub fn is_locked(&mut self) -> Result<bool, ServiceError> {
        match self.identity.register("lock") {
            Some(lock) => Ok(self.read_raw(&lock)? == 1),
            None => Ok(true),
        }
    }

    /// Takes the torque off and returns whether it was on.
    pub(crate) fn take_torque_off(&mut self) -> Result<bool, ServiceError> {
        let torque = self.register("torque_enable")?;
        let had_torque = self.read_raw(&torque)? != 0;
        if had_torque {
            self.put(&torque, 0)?;
        }
        Ok(had_torque)
    }

    /// Restarts the servo, torque off, and waits until it answers again.
    pub(crate) fn reboot(&mut self) -> Result<(), ServiceError> {
        self.take_torque_off()?;
        self.ask_without_answer(&Ask::Reboot)?;
        self.await_return()
    }

    /// Resets every setting to the factory value, except id and line rate (Feetech: except the id), and waits until
    /// the servo answers again.
    pub(crate) fn reset(&mut self) -> Result<(), ServiceError> {
        self.take_torque_off()?;
        let lock = self.identity.register("lock");
        lock.iter().try_for_each(|lock| self.put(lock, 0))?;
        self.ask_without_answer(&Ask::Reset)?;
        self.await_return()?;
        lock.iter().try_for_each(|lock| self.put(lock, 1))
    }

    /// Sends a request; accepts that a servo may be too busy with it to answer.
    fn ask_without_answer(&mut self, ask: &Ask<'_>) -> Result<(), ServiceError> {
        match self.port.ask(self.address, ask) {
            Ok(_) | Err(ServiceError::NoAnswer { .. } | ServiceError::Damaged { .. }) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Waits until the servo answers, at its old rate or another.
    fn await_return(&mut self) -> Result<(), ServiceError> {
        let own = self.address;
        let others = own.protocol.bauds().into_iter().map(|baud| Address { baud, ..own });
        let places: Vec<Address> = std::iter::once(own).chain(others.filter(|at| *at != own)).collect();
        let deadline = monotonic() + RESTART;
        while monotonic() < deadline {
            self.port.pause(LOOK_AGAIN);
            for &at in &places {
                match self.port.identify(at, 1) {
                    Ok(identity) => {
                        (self.address, self.identity) = (at, identity);
                        return Ok(());
                    }
                    Err(error @ ServiceError::Gone { .. }) => return Err(error),
                    Err(_) => {}
                }
            }
        }
        self.identity = self.port.identify(own, 1)?;
        Ok(())
    }

    /// Waits for `time`.
    pub(crate) fn pause(&self, time: Duration) {
        self.port.pause(time);
    }

    fn move_to_id(&mut self, register: &RegisterInfo, raw: i64) -> Result<(), ServiceError> {
        let id = u8::try_from(raw).map(ServoId).ok().filter(|id| id.0 <= Protocol::ID_MAX);
        let moved = Address { id: id.unwrap_or(self.address.id), ..self.address };
        if moved == self.address {
            return Ok(());
        }
        if self.port.is_anybody_at(moved)? {
            return Err(ServiceError::IdTaken { address: moved });
        }
        self.move_to(register, raw, moved)
    }

    fn move_to_baud(&mut self, register: &RegisterInfo, raw: i64) -> Result<(), ServiceError> {
        let baud = self.address.protocol.baud_of_code(raw).unwrap_or(self.address.baud);
        let moved = Address { baud, ..self.address };
        if moved == self.address {
            return Ok(());
        }
        // Check that the adapter supports the rate before anything is written.
        self.port.set_baud(baud)?;
        self.move_to(register, raw, moved)
    }

    /// Writes a register that changes the address, and follows the servo there. The answer may come from either
    /// address, or be lost.
    fn move_to(&mut self, register: &RegisterInfo, raw: i64, moved: Address) -> Result<(), ServiceError> {
        let data = self.encode(register.register, raw);
        for _ in 0..TRIES {
            match self
                .port
                .ask_raw(self.address, &Ask::Write { start: register.register.address, data: &data })?
            {
                Answer::Refused(error) => {
                    let request = format!("a write of {}", register.name);
                    return Err(ServiceError::Refused { address: self.address, request, error });
                }
                Answer::Data(_) | Answer::Damaged | Answer::Missing => {}
            }
            if self.port.identify(moved, TRIES).is_ok() {
                self.address = moved;
                return Ok(());
            }
        }
        self.port.identify(self.address, TRIES)?;
        let found = self.read_raw(register)?;
        if found == raw {
            // The servo holds the new value but applies it only after a restart.
            self.ask_without_answer(&Ask::Reboot)?;
            self.await_return()?;
            if self.address == moved {
                let lock = self.identity.register("lock");
                return lock.iter().try_for_each(|lock| self.put(lock, 0));
            }
        }
        let register = register.name.to_string();
        Err(ServiceError::NotTaken { address: self.address, register, wanted: raw, found })
    }

    /// Writes a register and reads it back.
    fn put(&mut self, register: &RegisterInfo, raw: i64) -> Result<(), ServiceError> {
        let data = self.encode(register.register, raw);
        self.put_bytes(register, &data)
    }

    /// The same for bytes in the servo's order.
    pub(super) fn put_bytes(&mut self, register: &RegisterInfo, data: &[u8]) -> Result<(), ServiceError> {
        match self.port.ask(self.address, &Ask::Write { start: register.register.address, data }) {
            // A servo can be set to answer reads only. Then its content shows whether the write worked.
            Ok(_) | Err(ServiceError::NoAnswer { .. }) => {}
            Err(error) => return Err(error),
        }
        let found = self.read_block(std::slice::from_ref(register))?;
        if found.iter().all(|(_, _, bytes)| bytes == data) {
            return Ok(());
        }
        let found = found.first().map_or(0, |(_, value, _)| value.raw);
        let wanted = self.decode(register.register, data);
        let register = register.name.to_string();
        Err(ServiceError::NotTaken { address: self.address, register, wanted, found })
    }

    /// True if another servo answers at `address`.
    pub(super) fn is_anybody_else_at(&mut self, address: Address) -> Result<bool, ServiceError> {
        Ok(address != self.address && self.port.is_anybody_at(address)?)
    }

    fn encode(&self, register: Register, raw: i64) -> Vec<u8> {
        encode_bytes(self.identity.series, register, raw)
    }

    fn decode(&self, register: Register, bytes: &[u8]) -> i64 {
        decode_bytes(self.identity.series, register, bytes)
    }
}

fn end(register: &RegisterInfo) -> u16 {
    register.register.address + u16::from(register.register.bytes)
}

/// Blocks of adjacent registers, each of at most [`BLOCK_BYTES`].
fn blocks(registers: &[RegisterInfo]) -> Vec<&[RegisterInfo]> {
    let mut blocks = Vec::new();
    let mut rest = registers;
    while let Some(first) = rest.first() {
        let start = first.register.address;
        let is_next = |pair: &[RegisterInfo]| {
            end(&pair[0]) == pair[1].register.address && end(&pair[1]) - start <= u16::from(BLOCK_BYTES)
        };
        let count = 1 + rest.windows(2).take_while(|pair| is_next(pair)).count();
        let (block, others) = rest.split_at(count);
        blocks.push(block);
        rest = others;
    }
    blocks
}
