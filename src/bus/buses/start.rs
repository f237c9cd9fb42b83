//! Before the first cycle and after the last: checks that the servos are those of the robot file, and makes them
//! limp.
//!
//! Every servo is asked before any is written to, and all disagreements are reported at once. A servo that does
//! not answer on its own bus is looked for on the other buses, so that two swapped adapters, or a
//! plug on the wrong bus, are reported as such.

use std::time::Duration;

use super::Buses;
use super::disagreement::{BusDevice, Disagreement, StartError};
use crate::bus::TransactionError;
use crate::bus::port::Ports;
use crate::bus::{ServoGoal, Slot};
use crate::model::{Firmware, Robot, Servo};

/// The result of asking one servo.
#[derive(Debug)]
enum Found {
    AsExpected,
    OtherModel(i64),
    OtherSetting {
        register: u16,
        found: i64,
        expected: i64,
        cure: &'static str,
    },
    Unheard(TransactionError),
    /// Temperature, degrees Celsius.
    Hot(i64),
    /// Supply, V.
    Supply(f64),
    /// It answers on this other line.
    Elsewhere(usize),
}

const SET_MODE: &str = "set it to position control with 'hippocamp setup'";
const SET_DELAY: &str =
    "it counts units of 2 microseconds; set it with 'hippocamp setup', or return_delay_us in the robot file";
/// Number of times that limp goals are sent, in case one is lost.
const LIMP_TRIES: u32 = 4;
/// Quiet time on a line before the servos are let go without being asked: late replies are over by then.
const LIMP_REST: Duration = Duration::from_millis(100);

impl<P: Ports> Buses<P> {
    /// Asks every servo whether it is there and is the model that the robot file names; then makes it limp and
    /// clears what another program may have left in it, including a tripped bus watchdog. [`Buses::notes`] then
    /// holds what is worth a remark only.
    ///
    /// # Errors
    /// All servos that disagree ([`StartError::Disagrees`]; then nothing was written to any servo), or the
    /// first that could not be made limp.
    pub fn prepare(&mut self, robot: &Robot) -> Result<(), StartError> {
        self.identify(robot)?;
        for (index, joint) in robot.joints.iter().enumerate() {
            let Some(servo) = &joint.servo else { continue };
            for &(register, value) in servo.model.registers.preparation {
                self.write(index, register, value)?;
            }
        }
        self.ports.expect_servos(robot);
        Ok(())
    }

    fn identify(&mut self, robot: &Robot) -> Result<(), StartError> {
        let mut gone = vec![false; robot.buses.len()];
        let mut asked = Vec::new();
        for (joint, servo) in servos(robot) {
            // A missing port is reported only once.
            if gone[servo.bus] {
                continue;
            }
            let found = self.ask_who(robot, joint, servo);
            gone[servo.bus] = matches!(found, Found::Unheard(TransactionError::Port { .. }));
            asked.push((joint, *servo, found));
        }
        let disagreements = self.disagreements(robot, &asked)?;
        if disagreements.is_empty() { Ok(()) } else { Err(StartError::Disagrees(disagreements)) }
    }

    fn ask_who(&mut self, robot: &Robot, joint: usize, servo: &Servo) -> Found {
        let number = servo.model.registers.model_number;
        match self.ping(joint).and_then(|()| self.read(joint, number)) {
            Ok(found) if found == i64::from(servo.model.model_number) => {
                self.ask_settings(robot, joint, servo)
            }
            Ok(found) => Found::OtherModel(found),
            Err(error @ TransactionError::NoAnswer { .. }) => {
                match self.look_elsewhere(robot, joint, servo) {
                    Some(line) => Found::Elsewhere(line),
                    None => Found::Unheard(error),
                }
            }
            Err(error) => Found::Unheard(error),
        }
    }

    /// Checks that the right servo has the settings that the controller needs.
    fn ask_settings(&mut self, robot: &Robot, joint: usize, servo: &Servo) -> Found {
        let registers = servo.model.registers;
        let delay = i64::from(robot.buses[servo.bus].return_delay_us / 2);
        let modes = registers.expected.iter().map(|&(register, value)| (register, value, SET_MODE));
        let delays = registers.return_delay.iter().map(|&register| (register, delay, SET_DELAY));
        for (register, expected, cure) in modes.chain(delays) {
            match self.read(joint, register) {
                Ok(found) if found == expected => {}
                Ok(found) => {
                    return Found::OtherSetting { register: register.address, found, expected, cure };
                }
                Err(error) => return Found::Unheard(error),
            }
        }
        match self.ask_state(robot, joint, servo) {
            Ok(found) => found,
            Err(error) => Found::Unheard(error),
        }
    }

    /// Checks that the right servo is fit to get torque; notes a different firmware.
    fn ask_state(&mut self, robot: &Robot, joint: usize, servo: &Servo) -> Result<Found, TransactionError> {
        let registers = servo.model.registers;
        let celsius = self.read(joint, registers.present_temperature)?;
        let decivolts = self.read(joint, registers.present_voltage)?;
        if let Some(expected) = servo.firmware {
            let found = self.firmware(joint, servo)?;
            if found != expected {
                let place = &self.place(joint)?.servo;
                self.notes.push(format!(
                    "{place} has firmware {found}, the unit file says {expected}: an update can reset what a servo was \
                     set to; calibrate the robot again"
                ));
            }
        }
        // These registers hold no number that f64 cannot hold.
        #[allow(clippy::cast_precision_loss, reason = "two bytes at most")]
        let (measured_c, volts) = (celsius as f64, decivolts as f64 / 10.0);
        Ok(if measured_c > robot.safety.temperature_c {
            Found::Hot(celsius)
        } else if volts < robot.buses[servo.bus].voltage_min_v || servo.model.is_too_much(volts) {
            Found::Supply(volts)
        } else {
            Found::AsExpected
        })
    }

    /// The firmware of `servo`, which belongs to the joint.
    ///
    /// # Errors
    /// If no good answer came.
    pub(crate) fn firmware(&mut self, joint: usize, servo: &Servo) -> Result<Firmware, TransactionError> {
        let (major, minor) = servo.model.registers.firmware;
        // One byte each.
        let mut byte =
            |register| self.read(joint, register).map(|value| u8::try_from(value).unwrap_or(u8::MAX));
        Ok(Firmware { major: byte(major)?, minor: minor.map(byte).transpose()? })
    }

    /// Has the joint's servo permanently take its shaft's present position as its middle count. The joint must be
    /// limp; the call may be repeated.
    ///
    /// # Errors
    /// If the servo does not accept it.
    pub(crate) fn set_middle(&mut self, joint: usize, servo: &Servo) -> Result<(), TransactionError> {
        let registers = servo.model.registers;
        for &(register, value) in registers.set_middle {
            match self.write(joint, register, value) {
                // The servo answers once it has stored it, or not at all; then the shaft's position tells.
                Err(TransactionError::NoAnswer { .. }) if register == registers.torque_enable => {}
                result => result?,
            }
        }
        Ok(())
    }

    /// Remarks from the start that do not prevent it: a sentence each, for a person to read.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The other bus on which a servo of this id and model answers, if there is one. If the robot file has
    /// the id on that bus too, an answer would prove nothing.
    fn look_elsewhere(&mut self, robot: &Robot, joint: usize, servo: &Servo) -> Option<usize> {
        let place = self.place(joint).ok()?.servo.clone();
        let register = servo.model.registers.model_number;
        (0..robot.buses.len()).filter(|line| *line != servo.bus).find(|line| {
            let is_taken = servos(robot).any(|(_, other)| other.bus == *line && other.id == servo.id);
            let is_same_language = robot.buses[*line].protocol == servo.model.protocol;
            is_same_language
                && !is_taken
                && self.read_at(*line, place.clone(), register) == Ok(i64::from(servo.model.model_number))
        })
    }

    fn disagreements(
        &self,
        robot: &Robot,
        asked: &[(usize, Servo, Found)],
    ) -> Result<Vec<Disagreement>, TransactionError> {
        let swapped = swapped_buses(robot, asked);
        let mut disagreements: Vec<Disagreement> = swapped
            .iter()
            .map(|&(a, b)| Disagreement::Swapped([self.bus_device(robot, a), self.bus_device(robot, b)]))
            .collect();
        for (joint, servo, found) in asked {
            let is_swapped = swapped.iter().any(|&(a, b)| [a, b].contains(&servo.bus));
            if is_swapped && !matches!(found, Found::Unheard(_)) {
                continue;
            }
            let place = self.place(*joint)?.servo.clone();
            disagreements.push(match found {
                Found::AsExpected => continue,
                Found::OtherModel(found) => Disagreement::OtherModel {
                    place,
                    protocol: servo.model.protocol,
                    found: *found,
                    expected: servo.model.model_number,
                    model: servo.model.name,
                },
                Found::OtherSetting { register, found, expected, cure } => {
                    let (register, found, expected) = (*register, *found, *expected);
                    Disagreement::OtherSetting { place, register, found, expected, cure }
                }
                Found::Unheard(error) => Disagreement::Unheard(error.clone()),
                Found::Hot(found_c) => {
                    Disagreement::Hot { place, found_c: *found_c, limit_c: robot.safety.temperature_c }
                }
                Found::Supply(found_v) => Disagreement::Supply {
                    place,
                    found_v: *found_v,
                    lowest_v: robot.buses[servo.bus].voltage_min_v,
                    highest_v: servo.model.voltage_max_v,
                },
                Found::Elsewhere(line) => {
                    Disagreement::OtherBus { place, found: self.bus_device(robot, *line) }
                }
            });
        }
        Ok(disagreements)
    }

    fn bus_device(&self, robot: &Robot, bus: usize) -> BusDevice {
        BusDevice { bus: robot.buses[bus].name.clone(), device: self.ports.device(bus).map(str::to_owned) }
    }

    /// Takes the torque off all servos without asking any, and without knowing whether one has heard it. It serves
    /// lines whose replies come so late that they run into the next request: servos there hear only a host that
    /// leaves them time to finish.
    pub fn limp_unheard(&mut self) {
        for _ in 0..LIMP_TRIES {
            let rests = self.ports.now() + LIMP_REST;
            self.ports.wait_until(rests);
            for (index, line) in self.lines.iter_mut().enumerate() {
                // A missing port is tried again.
                let _ = self.ports.discard_input(index);
                let _ = self.ports.send(index, line.client.begin_limp());
            }
        }
    }

    /// Takes the torque off all servos, outside the pipeline: for ends in which the motion has no part. True if
    /// every servo has answered a request that took its torque off.
    pub fn limp(&mut self) -> bool {
        let count = self.places.len();
        let mut slots = vec![Slot::Missing; count];
        let mut has_heard: Vec<bool> = self.places.iter().map(Option::is_none).collect();
        for _ in 0..LIMP_TRIES {
            self.exchange_counts(&vec![ServoGoal::Limp; count], &mut slots);
            for (heard, slot) in has_heard.iter_mut().zip(&slots) {
                *heard |= matches!(slot, Slot::Fresh(_));
            }
        }
        has_heard.into_iter().all(|heard| heard)
    }
}

pub(super) fn servos(robot: &Robot) -> impl Iterator<Item = (usize, &Servo)> {
    robot.joints.iter().enumerate().filter_map(|(joint, of)| Some((joint, of.servo.as_ref()?)))
}

/// Pairs of buses whose servos answer on each other's line while no servo of either answers on its own, except
/// one that has a twin of the same id and model on the other bus.
fn swapped_buses(robot: &Robot, asked: &[(usize, Servo, Found)]) -> Vec<(usize, usize)> {
    let has_twin = |servo: &Servo, bus: usize, number: i64| {
        servos(robot).any(|(_, other)| {
            other.bus == bus && other.id == servo.id && i64::from(other.model.model_number) == number
        })
    };
    // True if the line of `a` looks like that of `b`.
    let looks_like = |a: usize, b: usize| {
        let on_a = || asked.iter().filter(move |(_, servo, _)| servo.bus == a);
        let is_of_b = |(_, servo, found): &(usize, Servo, Found)| match found {
            Found::Elsewhere(line) => *line == b,
            Found::OtherModel(number) => has_twin(servo, b, *number),
            Found::AsExpected
            | Found::OtherSetting { .. }
            | Found::Hot(_)
            | Found::Supply(_)
            | Found::Unheard(_) => false,
        };
        let is_at_home = |(_, servo, found): &(usize, Servo, Found)| {
            matches!(found, Found::AsExpected | Found::OtherSetting { .. } | Found::Hot(_) | Found::Supply(_))
                && !has_twin(servo, b, i64::from(servo.model.model_number))
        };
        on_a().any(is_of_b) && !on_a().any(is_at_home)
    };
    let count = robot.buses.len();
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
    pairs
        .filter(|&(a, b)| robot.buses[a].protocol == robot.buses[b].protocol)
        .filter(|&(a, b)| looks_like(a, b) && looks_like(b, a))
        .collect()
}
