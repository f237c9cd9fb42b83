//! What servos must be told again that may have forgotten it: those that were told to start anew, and those that were
//! silent for so long that they may have, after a glitch of their supply.
//!
//! That is what is written before a run (torque left aside) and the bus watchdog. It comes with the first exchanges
//! after the servo is heard again, before its goals in each. None of it is answered.

use std::time::Duration;

use super::watchdog::UNIT;
use crate::model::START_MIN_S;
use crate::units::Time;

/// It is sent this often, in case it is lost.
const TRIES: u8 = 3;

/// What one line knows of its servos' settings.
#[derive(Debug)]
pub(super) struct Renewals {
    /// What the bus watchdogs are set to; none while they are not armed.
    watchdog_units: Option<u8>,
    /// When each servo was last heard; none before the first time.
    heard: Vec<Option<Time>>,
    /// Exchanges that are still to tell each.
    left: Vec<u8>,
}

impl Renewals {
    pub(super) fn new(servos: usize) -> Renewals {
        Renewals { watchdog_units: None, heard: vec![None; servos], left: vec![0; servos] }
    }

    pub(super) fn arm_watchdog(&mut self, units: u8, now: Time) {
        self.watchdog_units = Some(units);
        self.heard.fill(Some(now));
    }

    pub(super) fn disarm_watchdog(&mut self) {
        self.watchdog_units = None;
    }

    pub(super) fn has_watchdog(&self) -> bool {
        self.watchdog_units.is_some()
    }

    /// What the bus watchdogs are set to.
    pub(super) fn watchdog_units(&self) -> Option<u8> {
        self.watchdog_units
    }

    /// A reply of the line's servo number `index` came.
    pub(super) fn note_heard(&mut self, index: usize, now: Time) {
        let (Some(heard), Some(left)) = (self.heard.get_mut(index), self.left.get_mut(index)) else { return };
        let starts = Duration::from_secs_f64(START_MIN_S);
        let longest = self.watchdog_units.map_or(starts, |units| starts.min(UNIT * u32::from(units)));
        if heard.is_some_and(|heard| now.since(heard) >= longest) {
            *left = TRIES;
        }
        *heard = Some(now);
    }

    /// The line's servo number `index` is told to start anew, and forgets all.
    pub(super) fn note_restart(&mut self, index: usize) {
        if let Some(heard) = self.heard.get_mut(index) {
            *heard = Some(Time::default());
        }
    }

    /// Whether the next exchange is to tell the servo number `index`.
    pub(super) fn take(&mut self, index: usize) -> bool {
        let Some(left) = self.left.get_mut(index) else { return false };
        let is_left = *left > 0;
        *left = left.saturating_sub(1);
        is_left
    }
}
