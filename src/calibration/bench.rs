//! A limp robot under observation while a person moves it.

use std::time::Duration;

use super::{CalibrateError, Person};
use crate::bus::{Buses, Ports, Slot};
use crate::model::{Robot, Servo};
use crate::units::Time;

/// Time between two looks.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// A servo that has not answered for longer than this is gone, s.
const LOST_AFTER_S: f64 = 1.0;
/// A hand turns a joint by less than this between two looks, turns of the horn: a larger change is a damaged reply
/// that passed its checksum.
const LOOK_TURNS: f64 = 1.0 / 24.0;

/// The robot, its buses, and the person.
pub(super) struct Bench<'b, P, H> {
    pub(super) robot: &'b Robot,
    pub(super) buses: Buses<P>,
    pub(super) person: &'b mut H,
    slots: Vec<Slot>,
    /// Last reported position of each servo, counts.
    said: Vec<Option<f64>>,
    /// Last position of each servo that two replies confirmed, counts.
    counts: Vec<Option<f64>>,
    unheard_s: Vec<f64>,
    looked: Time,
}

impl<'b, P: Ports, H: Person> Bench<'b, P, H> {
    pub(super) fn new(robot: &'b Robot, mut buses: Buses<P>, person: &'b mut H) -> Bench<'b, P, H> {
        let joints = robot.joints.len();
        let looked = buses.ports_mut().now();
        Bench {
            robot,
            buses,
            person,
            slots: vec![Slot::Missing; joints],
            said: vec![None; joints],
            counts: vec![None; joints],
            unheard_s: vec![0.0; joints],
            looked,
        }
    }

    /// Waits for the time of the next look, and looks; returns the time since the last one, s.
    ///
    /// # Errors
    /// If the person wants to stop, or a servo no longer answers.
    pub(super) fn look(&mut self) -> Result<f64, CalibrateError> {
        let before = self.looked;
        self.buses.ports_mut().wait_until(before + LOOK_EVERY);
        self.looked = self.buses.ports_mut().now();
        let dt_s = self.looked.since(before).as_secs_f64();
        if self.person.wants_to_stop() {
            return Err(CalibrateError::Left);
        }
        self.buses.look(&mut self.slots);
        for (index, joint) in self.robot.joints.iter().enumerate() {
            match self.slots[index] {
                Slot::Fresh(feedback) => {
                    let count = f64::from(feedback.position);
                    let turn = joint.servo.map_or(f64::INFINITY, |servo| servo.model.counts_per_turn);
                    if self.said[index].replace(count).is_some_and(|before| agree(before, count, turn)) {
                        self.counts[index] = Some(count);
                    } else {
                        self.slots[index] = Slot::Corrupt;
                    }
                    self.unheard_s[index] = 0.0;
                }
                Slot::Answered(_) | Slot::Corrupt | Slot::Missing => self.unheard_s[index] += dt_s,
            }
            if joint.servo.is_some() && self.unheard_s[index] > LOST_AFTER_S {
                return Err(CalibrateError::lost(self.robot, index));
            }
        }
        Ok(dt_s)
    }

    /// Position of the joint's servo, counts; looks until the servo answers.
    pub(super) fn count(&mut self, joint: usize) -> Result<f64, CalibrateError> {
        loop {
            self.look()?;
            if let (Some(count), Slot::Fresh(_)) = (self.counts[joint], self.slots[joint]) {
                return Ok(count);
            }
        }
    }

    /// Last confirmed position of the joint's servo, counts.
    pub(super) fn last_count(&self, joint: usize) -> Option<f64> {
        self.counts[joint]
    }

    /// Waits for `time` without looking at the robot.
    pub(super) fn pause(&mut self, time: Duration) {
        let until = self.buses.ports_mut().now() + time;
        self.buses.ports_mut().wait_until(until);
        self.looked = self.buses.ports_mut().now();
    }

    /// The person's answer to `words`, trimmed, in lower case.
    pub(super) fn ask(&mut self, words: &str) -> Result<String, CalibrateError> {
        // Input from before the question is no answer to it: a stray Enter must not turn a joint.
        while self.person.answer().is_some() {}
        self.person.hear(words);
        loop {
            self.look()?;
            if let Some(answer) = self.person.answer() {
                return Ok(answer.trim().to_lowercase());
            }
        }
    }

    /// True if the person says yes to `words`.
    pub(super) fn ask_whether(&mut self, words: &str) -> Result<bool, CalibrateError> {
        loop {
            match self.ask(&format!("{words} [y/n]"))?.as_str() {
                "y" | "yes" => return Ok(true),
                "n" | "no" => return Ok(false),
                _ => {}
            }
        }
    }

    /// The servo of a joint, with the settings of the robot file.
    pub(super) fn servo(&self, joint: usize) -> Result<Servo, CalibrateError> {
        self.robot.joints[joint].servo.ok_or_else(|| CalibrateError::lost(self.robot, joint))
    }
}

/// True if a joint turned by hand can have gone from one count to the other between two looks, also across the
/// encoder's seam. `turn` is a full turn, counts.
fn agree(before: f64, count: f64, turn: f64) -> bool {
    let off = (count - before).abs();
    off.min((turn - off).abs()) <= LOOK_TURNS * turn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_faster_than_a_hand_can_turn_does_not_agree() {
        assert!(agree(2000.0, 2160.0, 4096.0) && agree(4090.0, 100.0, 4096.0));
        assert!(
            !agree(2000.0, 2200.0, 4096.0) && !agree(0.0, 2048.0, 4096.0) && !agree(10.0, 34_000.0, 4096.0)
        );
    }
}
