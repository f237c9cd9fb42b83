//! Tracks whether all servos of a bus answered the last exchange.
//!
//! A servo may answer late, while the next goals cross the line, and spoil them for all servos of its bus. If one
//! servo is silent for long, the others are asked now and then which goal they hold.

use crate::model::{Robot, START_MIN_S};
use crate::signals::{JointState, Question};

/// On a bus with a silent servo the others are asked once in this many cycles.
const ASK_EVERY: u32 = 4;

/// The state of each bus.
#[derive(Debug)]
pub(super) struct Listening {
    /// The bus of each joint; `None` for a joint without a servo.
    bus_of: Vec<Option<usize>>,
    /// For each bus, true if all its servos answered.
    is_heard: Vec<bool>,
    /// For each bus, cycles since all its servos answered or were last asked.
    cycles: Vec<u32>,
}

impl Listening {
    pub(super) fn new(robot: &Robot) -> Listening {
        Listening {
            bus_of: robot.joints.iter().map(|joint| joint.servo.map(|servo| servo.bus)).collect(),
            is_heard: vec![true; robot.buses.len()],
            cycles: vec![0; robot.buses.len()],
        }
    }

    /// Notes the last exchange. The servo of a joint out of service may be silent for good: once it has been for long, it
    /// does not count.
    pub(super) fn note(&mut self, joints: &[JointState], is_out: &[bool]) {
        self.is_heard.fill(true);
        for ((bus, measured), is_out) in self.bus_of.iter().zip(joints).zip(is_out) {
            let place = bus.and_then(|bus| self.is_heard.get_mut(bus));
            let is_gone = *is_out && measured.age_s > START_MIN_S;
            if let (Some(is_heard), false) = (place, is_gone) {
                *is_heard &= measured.age_s <= 0.0;
            }
        }
        for (cycles, is_heard) in self.cycles.iter_mut().zip(&self.is_heard) {
            *cycles = if *is_heard { 0 } else { cycles.saturating_add(1) };
        }
    }

    /// True if every servo of the bus of `joint` answered the last exchange.
    pub(super) fn is_bus_heard(&self, joint: usize) -> bool {
        let bus = self.bus_of.get(joint).copied().flatten();
        bus.is_none_or(|bus| self.is_heard.get(bus).copied().unwrap_or_default())
    }

    /// If it is time, the question for a bus with a silent servo, and a joint of that bus.
    pub(super) fn question(&mut self) -> Option<(usize, Question)> {
        let bus = self.cycles.iter().position(|cycles| *cycles >= ASK_EVERY)?;
        self.cycles[bus] = 0;
        let joint = self.bus_of.iter().position(|of| *of == Some(bus))?;
        Some((joint, Question::Goal))
    }
}
