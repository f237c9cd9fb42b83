//! A servo that has switched its torque off by itself, where the robot may go on without it.
//!
//! ```text
//!   In ------- its alarm lasts -------> Out ---- parked ----> Restarting
//!    ^                                   ^                        |
//!    +------ heard without an alarm -----+------------------------+   not within RESTART_S
//! ```

use crate::signals::JointState;

/// How long a servo takes to come back at most, s: Feetech's take 1.8 s (STS manual), Dynamixels less.
const RESTART_S: f64 = 4.0;
/// How soon it may be restarted again, s.
const AGAIN_S: f64 = 10.0;

/// What became of one joint's servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Trip {
    /// It works; how long its alarm has lasted, s.
    In { wrong_s: f64 },
    /// It has tripped; how long it must be let be, s.
    Out { wait_s: f64 },
    /// It was told to restart so long ago, s.
    Restarting { since_s: f64 },
}

impl Trip {
    pub(super) const NONE: Trip = Trip::In { wrong_s: 0.0 };

    /// Looks at the servo `dt_s` after the last look: an alarm counts that lasts `delay_s`.
    pub(super) fn look(&mut self, dt_s: f64, delay_s: f64, measured: &JointState) {
        let is_heard = measured.age_s <= 0.0;
        let is_well = is_heard && measured.alarms == 0;
        *self = match *self {
            Trip::In { wrong_s } if is_heard && measured.alarms != 0 => {
                let wrong_s = wrong_s + dt_s;
                if wrong_s > delay_s { Trip::Out { wait_s: 0.0 } } else { Trip::In { wrong_s } }
            }
            Trip::In { .. } => Trip::NONE,
            // Some clear their alarm by themselves.
            Trip::Out { .. } if is_well => Trip::NONE,
            Trip::Out { wait_s } => Trip::Out { wait_s: (wait_s - dt_s).max(0.0) },
            // In the cycle it was told to, it was not asked.
            Trip::Restarting { since_s } if is_well && since_s > 2.0 * dt_s => Trip::NONE,
            Trip::Restarting { since_s } if since_s > RESTART_S => Trip::Out { wait_s: AGAIN_S },
            Trip::Restarting { since_s } => Trip::Restarting { since_s: since_s + dt_s },
        };
    }

    /// Whether the joint is to be left without torque.
    pub(super) fn is_out(self) -> bool {
        !matches!(self, Trip::In { .. })
    }

    /// Whether its silence is no wonder.
    pub(super) fn is_restarting(self) -> bool {
        matches!(self, Trip::Restarting { .. })
    }

    /// Whether it may be restarted now.
    pub(super) fn can_restart(self) -> bool {
        matches!(self, Trip::Out { wait_s } if wait_s <= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WELL: JointState = JointState {
        is_known: true,
        age_s: 0.0,
        is_damaged: false,
        position_rad: 0.0,
        speed_rad_s: 0.0,
        load_share: 0.0,
        voltage_v: 5.0,
        temperature_c: 30.0,
        alarms: 0,
    };
    const ALARMED: JointState = JointState { alarms: 0x80, ..WELL };
    const SILENT: JointState = JointState { age_s: 0.5, ..WELL };

    fn looked(trip: Trip, measured: &JointState, times: usize) -> Trip {
        (0..times).fold(trip, |mut trip, _| {
            trip.look(0.01, 0.5, measured);
            trip
        })
    }

    #[test]
    fn an_alarm_that_lasts_takes_it_out_and_a_restart_brings_it_back() {
        assert!(!looked(Trip::NONE, &ALARMED, 49).is_out());
        let out = looked(Trip::NONE, &ALARMED, 52);
        assert!(out.is_out() && out.can_restart());
        let restarting = looked(Trip::Restarting { since_s: 0.0 }, &SILENT, 100);
        assert!(restarting.is_out() && restarting.is_restarting());
        assert_eq!(looked(restarting, &WELL, 1), Trip::NONE);
    }

    #[test]
    fn a_restart_in_vain_is_tried_again_and_not_at_once() {
        let again = looked(Trip::Restarting { since_s: 0.0 }, &ALARMED, 402);
        assert!(again.is_out() && !again.can_restart());
        assert!(looked(again, &ALARMED, 1001).can_restart());
        assert!(!looked(again, &WELL, 1).is_out(), "one that is well needs none");
    }
}
