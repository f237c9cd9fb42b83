//! Sends settings again to servos that may have lost them: those that were ordered to restart, and those that were
//! silent for so long that a glitch of their supply may have restarted them.
//!
//! The settings are those written before a run (except torque) and the bus watchdog. The first exchanges
//! after the servo is heard again carry them, before its goals in each. No servo answers them.

use std::time::Duration;

use super::watchdog::UNIT;
use crate::model::START_MIN_S;
use crate::units::Time;

/// Number of exchanges that carry the settings, in case one is lost.
const TRIES: u8 = 3;

/// The state of the settings of one line's servos.
#[derive(Debug)]
pub(super) struct SettingsResend {
    /// Value of the bus watchdogs; `None` while they are not armed.
    watchdog_units: Option<u8>,
    /// When each servo was last heard; `None` before the first time.
    heard: Vec<Option<Time>>,
    /// Exchanges that must still carry the settings of each servo.
    left: Vec<u8>,
}

impl SettingsResend {
    pub(super) fn new(servos: usize) -> SettingsResend {
        SettingsResend { watchdog_units: None, heard: vec![None; servos], left: vec![0; servos] }
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

    /// Value of the bus watchdogs.
    pub(super) fn watchdog_units(&self) -> Option<u8> {
        self.watchdog_units
    }

    /// Notes a reply of the line's servo number `index`.
    pub(super) fn note_heard(&mut self, index: usize, now: Time) {
        let (Some(heard), Some(left)) = (self.heard.get_mut(index), self.left.get_mut(index)) else { return };
        let starts = Duration::from_secs_f64(START_MIN_S);
        let longest = self.watchdog_units.map_or(starts, |units| starts.min(UNIT * u32::from(units)));
        if heard.is_some_and(|heard| now.since(heard) >= longest) {
            *left = TRIES;
        }
        *heard = Some(now);
    }

    /// Notes that the line's servo number `index` is ordered to restart and loses its settings.
    pub(super) fn note_restart(&mut self, index: usize) {
        if let Some(heard) = self.heard.get_mut(index) {
            *heard = Some(Time::default());
        }
    }

    /// True if the next exchange must carry the settings of servo number `index`.
    pub(super) fn take(&mut self, index: usize) -> bool {
        let Some(left) = self.left.get_mut(index) else { return false };
        let is_left = *left > 0;
        *left = left.saturating_sub(1);
        is_left
    }
}
