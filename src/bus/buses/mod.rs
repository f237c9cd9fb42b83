//! All buses of a robot over its ports.
//!
//! Takes a goal for each joint. Returns a [`Slot`] for each joint. One thread exchanges all buses at the same
//! time. A lost reply, or a whole bus gone, is a value in its slots and never cuts the exchange
//! short for the others. An exchange allocates nothing and never panics.

mod disagreement;
mod line;
mod occupants;
mod settings_resend;
mod start;
mod transaction;
mod watchdog;

use std::time::Duration;

use super::client::{BusClient, Counters};
use super::error::ServoPlace;
use super::port::Ports;
use super::timing::GroupRead;
use super::{ServoGoal, Slot, TransactionError};
use crate::counts::Goals;
use crate::model::Robot;
use crate::units::ServoId;
pub use disagreement::{BusDevice, Disagreement, StartError};
use line::Line;
pub(in crate::bus) use occupants::Occupants;
pub use watchdog::watchdog_time;

/// Durations of exchanges, from sending to the last reply or the deadline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExchangeTimes {
    /// The last exchange.
    pub last: Duration,
    /// The longest exchange.
    pub max: Duration,
    /// The sum of all exchanges.
    pub total: Duration,
    /// Number of exchanges, without those that could not be sent.
    pub count: u64,
}

/// Statistics of one bus since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusStatistics<'a> {
    /// Name, from the robot file.
    pub name: &'a str,
    /// Its traffic.
    pub counters: Counters,
    /// Good packets from ids that were not asked.
    pub unknown_replies: u64,
    /// Durations of exchanges.
    pub times: ExchangeTimes,
    /// Kind of read for the next exchange.
    pub group_read: GroupRead,
    /// True if its port was gone when last used.
    pub is_gone: bool,
}

/// Every bus of a robot, and the ports that carry them.
#[derive(Debug)]
pub struct Buses<P> {
    ports: P,
    lines: Vec<Line>,
    /// Bus and index of each joint's servo, in the robot's order of joints.
    places: Vec<Option<Place>>,
    /// How often a single servo is asked before the loop gives it up.
    tries: u32,
    /// Remarks from the start.
    notes: Vec<String>,
}

#[derive(Debug)]
struct Place {
    line: usize,
    servo: ServoPlace,
}

impl<P: Ports> Buses<P> {
    /// The buses of `robot`. Allocates all memory that exchanges need. Expects a checked robot: each id once on a
    /// bus, and one set of registers for all servos of a bus.
    pub fn new(robot: &Robot, ports: P) -> Buses<P> {
        let period = Duration::from_secs_f64(robot.period_s());
        let lines = robot.buses.iter().enumerate().map(|(index, bus)| {
            let servos = || {
                robot.joints.iter().enumerate().filter_map(|(joint, of)| {
                    of.servo.filter(|servo| servo.bus == index).map(|servo| (joint, servo))
                })
            };
            let registers = servos()
                .next()
                .map_or(bus.protocol.spec().series[0].registers, |(_, servo)| servo.model.registers);
            let ids: Vec<ServoId> = servos().map(|(_, servo)| servo.id).collect();
            let joints = servos().map(|(joint, _)| joint).collect();
            Line::new(index, BusClient::new(bus, registers, &ids), joints, period)
        });
        let places = robot.joints.iter().map(|joint| {
            let servo = joint.servo?;
            let bus = robot.buses.get(servo.bus)?;
            let place =
                ServoPlace { bus: bus.name.clone(), baud: bus.baud, id: servo.id, joint: joint.name.clone() };
            Some(Place { line: servo.bus, servo: place })
        });
        Buses {
            ports,
            lines: lines.collect(),
            places: places.collect(),
            tries: transaction::TRIES,
            notes: Vec::new(),
        }
    }

    /// Sends every joint its goal and reads what every servo reports.
    ///
    /// `goals` and `out` are in the order of [`Robot::joints`]. A joint without a servo stays
    /// [`Slot::Missing`]. Returns when every bus has all replies or is past its own deadline.
    pub fn exchange(&mut self, goals: &Goals, out: &mut [Slot]) {
        if let Some(joint) = goals.restart() {
            self.lines.iter_mut().for_each(|line| line.restart_servo(joint));
        }
        if let Some((joint, question)) = goals.question() {
            self.lines.iter_mut().for_each(|line| line.ask(joint, question));
        }
        self.exchange_counts(goals.servos(), out);
    }

    /// Like [`Buses::exchange`], for counts that need not have passed safety: for tests, and for letting go.
    /// A joint without a goal goes limp.
    fn exchange_counts(&mut self, goals: &[ServoGoal], out: &mut [Slot]) {
        out.fill(Slot::Missing);
        for line in &mut self.lines {
            line.begin_exchange(&mut self.ports, goals);
        }
        self.finish_exchange(out);
    }

    /// Reads what every servo reports and writes nothing to any: torque and goals stay unchanged. `out` is as in
    /// [`Buses::exchange`].
    pub fn look(&mut self, out: &mut [Slot]) {
        out.fill(Slot::Missing);
        for line in &mut self.lines {
            line.begin_look(&mut self.ports);
        }
        self.finish_exchange(out);
    }

    fn finish_exchange(&mut self, out: &mut [Slot]) {
        self.wait_for_replies(|line, took| {
            let times = &mut line.times;
            times.last = took;
            times.max = times.max.max(took);
            times.total = times.total.saturating_add(took);
            times.count += 1;
        });
        let now = self.ports.now();
        for line in &mut self.lines {
            line.finish_exchange(now, out);
        }
    }

    /// Polls all lines until none awaits a reply, and calls `done` for each line that has waited.
    fn wait_for_replies(&mut self, mut done: impl FnMut(&mut Line, Duration)) {
        loop {
            let mut wait_until = None;
            for line in &mut self.lines {
                match line.poll(&mut self.ports) {
                    Some(deadline) => {
                        wait_until = Some(wait_until.map_or(deadline, |earliest| deadline.min(earliest)));
                    }
                    None => {
                        if let Some(took) = line.end_wait(self.ports.now()) {
                            done(line, took);
                        }
                    }
                }
            }
            let Some(deadline) = wait_until else { return };
            self.ports.wait_for_input(deadline);
        }
    }

    /// Statistics of each bus since the start, in the robot's order of buses.
    pub fn statistics(&self) -> impl Iterator<Item = BusStatistics<'_>> {
        self.lines.iter().map(|line| BusStatistics {
            name: line.client.name(),
            counters: line.client.counters(),
            unknown_replies: line.client.unknown_replies(),
            times: line.times,
            group_read: line.client.group_read(),
            is_gone: line.is_gone(),
        })
    }

    /// The lines that came back with other servos: see [`Ports::strangers`].
    pub fn strangers(&self) -> Vec<String> {
        self.ports.strangers()
    }

    /// The ports, for their clock and wait.
    pub fn ports_mut(&mut self) -> &mut P {
        &mut self.ports
    }

    /// Returns the ports.
    pub fn into_ports(self) -> P {
        self.ports
    }

    fn place(&self, joint: usize) -> Result<&Place, TransactionError> {
        self.places.get(joint).and_then(Option::as_ref).ok_or(TransactionError::NoServo { joint })
    }
}

#[cfg(test)]
mod tests;
