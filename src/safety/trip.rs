//! A servo that has switched its torque off by itself, or is jammed, where the robot may go on without it.
//!
//! ```text
//!   In ------- its alarm lasts -------> Out ---- parked ----> Restarting
//!    ^  or its joint does not follow     ^                        |
//!    +------ heard without an alarm -----+------------------------+   not within RESTART_S
//!            (jammed: and parked)
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
    /// It has tripped, or its joint is jammed and was let go so that it does not; how long it must be let be, s.
    Out { wait_s: f64, is_jammed: bool },
    /// It was told to restart so long ago, s.
    Restarting { since_s: f64 },
}

impl Trip {
    pub(super) const NONE: Trip = Trip::In { wrong_s: 0.0 };

    /// Looks at the servo `dt_s` after the last look: an alarm counts that lasts `delay_s`. What was jammed may try
    /// again only while the robot is parked.
    pub(super) fn look(&mut self, dt_s: f64, delay_s: f64, is_parked: bool, measured: &JointState) {
        let is_heard = measured.age_s <= 0.0;
        let is_well = is_heard && measured.alarms == 0;
        *self = match *self {
            Trip::In { wrong_s } if is_heard && measured.alarms != 0 => {
                let wrong_s = wrong_s + dt_s;
                if wrong_s > delay_s {
                    Trip::Out { wait_s: 0.0, is_jammed: false }
                } else {
                    Trip::In { wrong_s }
                }
            }
            // A lost reply says nothing about the alarm.
            Trip::In { .. } if !is_heard => *self,
            Trip::In { .. } => Trip::NONE,
            // Some clear their alarm by themselves. One that was jammed had none, or lost it as it went limp.
            Trip::Out { wait_s, is_jammed } if is_well && (!is_jammed || (is_parked && wait_s <= dt_s)) => {
                Trip::NONE
            }
            Trip::Out { wait_s, is_jammed } => Trip::Out { wait_s: (wait_s - dt_s).max(0.0), is_jammed },
            // In the cycle it was told to, it was not asked.
            Trip::Restarting { since_s } if is_well && since_s > 2.0 * dt_s => Trip::NONE,
            Trip::Restarting { since_s } if since_s > RESTART_S => {
                Trip::Out { wait_s: AGAIN_S, is_jammed: false }
            }
            Trip::Restarting { since_s } => Trip::Restarting { since_s: since_s + dt_s },
        };
    }

    /// Its joint does not follow its goal.
    pub(super) fn jam(&mut self) {
        *self = Trip::Out { wait_s: AGAIN_S, is_jammed: true };
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
        matches!(self, Trip::Out { wait_s, .. } if wait_s <= 0.0)
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
            trip.look(0.01, 0.5, false, measured);
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
    fn a_lost_reply_neither_ends_nor_adds_to_an_alarm() {
        let alternating = |times: usize| {
            (0..times).fold(Trip::NONE, |trip, time| {
                looked(trip, if time % 2 == 0 { &ALARMED } else { &SILENT }, 1)
            })
        };
        assert!(!alternating(98).is_out(), "heard 49 times");
        assert!(alternating(104).is_out(), "heard 52 times");
        assert_eq!(looked(alternating(98), &WELL, 1), Trip::NONE);
    }

    #[test]
    fn what_was_jammed_stays_out_until_the_robot_is_parked() {
        let mut trip = Trip::NONE;
        trip.jam();
        trip = looked(trip, &WELL, 2000);
        assert!(trip.is_out(), "though its servo is well");
        trip.look(0.01, 0.5, true, &WELL);
        assert_eq!(trip, Trip::NONE);
    }

    #[test]
    fn a_restart_in_vain_is_tried_again_and_not_at_once() {
        let again = looked(Trip::Restarting { since_s: 0.0 }, &ALARMED, 402);
        assert!(again.is_out() && !again.can_restart());
        assert!(looked(again, &ALARMED, 1001).can_restart());
        assert!(!looked(again, &WELL, 1).is_out(), "one that is well needs none");
    }
}
