//! A servo that switched its torque off by itself, or is jammed, on a robot that may continue without it.
//!
//! ```text
//!   In ------- its alarm lasts -------> Out -- parked, overload -> Restarting
//!    ^  or its joint does not follow     ^                            |
//!    +------ heard without an alarm -----+----------------------------+   not within RESTART_S
//!            (jammed: and parked)
//! ```
//! A restart clears the memory of an overload and no other fault: a servo whose alarm has another cause (heat,
//! voltage, its encoder) stays out until the alarm is over. A servo that does not report the cause is restarted
//! once each time the robot is parked.

use crate::model::OVERLOAD_ALARM;
use crate::signals::{JointState, OutageCause};

/// Longest time a servo takes to come back, s: Feetech's take 1.8 s (STS manual), Dynamixels less.
const RESTART_S: f64 = 4.0;
/// Shortest time between two restarts of a servo, s.
const AGAIN_S: f64 = 10.0;
/// How often a servo is asked for the cause of its alarm before it counts as one that does not report it.
const QUESTIONS: u8 = 3;

/// The state of one joint's servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ServoOutage {
    stage: Stage,
    /// How often it was asked for the cause since it went out.
    asked: u8,
    /// True if it was restarted without a known cause since the robot was parked.
    was_restarted: bool,
    /// True if its outage was reported.
    is_reported: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// The servo works; how long its alarm has lasted, s.
    Working { alarm_s: f64 },
    /// It tripped, or its joint is jammed and was let go so that it does not trip; how long it must rest, s.
    Out { wait_s: f64, is_jammed: bool },
    /// It was ordered to restart; time since then, s.
    Restarting { since_s: f64 },
}

impl Stage {
    const NONE: Stage = Stage::Working { alarm_s: 0.0 };
}

impl ServoOutage {
    pub(super) const NONE: ServoOutage =
        ServoOutage { stage: Stage::NONE, asked: 0, was_restarted: false, is_reported: false };

    /// Looks at the servo `dt_s` after the last look. An alarm counts once it has lasted `delay_s`. A jammed joint
    /// may try again only while the robot is parked.
    pub(super) fn look(&mut self, dt_s: f64, delay_s: f64, is_parked: bool, measured: &JointState) {
        let is_heard = measured.age_s <= 0.0;
        let is_well = is_heard && measured.alarms == 0;
        self.stage = match self.stage {
            Stage::Working { alarm_s } if is_heard && measured.alarms != 0 => {
                let alarm_s = alarm_s + dt_s;
                if alarm_s > delay_s {
                    Stage::Out { wait_s: 0.0, is_jammed: false }
                } else {
                    Stage::Working { alarm_s }
                }
            }
            // A lost reply says nothing about the alarm.
            Stage::Working { .. } if !is_heard => self.stage,
            Stage::Working { .. } => Stage::NONE,
            // Some servos clear their alarm by themselves. A jammed servo had no alarm, or lost it as it went limp.
            Stage::Out { wait_s, is_jammed } if is_well && (!is_jammed || (is_parked && wait_s <= dt_s)) => {
                Stage::NONE
            }
            Stage::Out { wait_s, is_jammed } => Stage::Out { wait_s: (wait_s - dt_s).max(0.0), is_jammed },
            // The cycle that sent the restart asked no servo.
            Stage::Restarting { since_s } if is_well && since_s > 2.0 * dt_s => Stage::NONE,
            Stage::Restarting { since_s } if since_s > RESTART_S => {
                Stage::Out { wait_s: AGAIN_S, is_jammed: false }
            }
            Stage::Restarting { since_s } => Stage::Restarting { since_s: since_s + dt_s },
        };
        if !self.is_out() {
            (self.asked, self.is_reported) = (0, false);
        }
        self.was_restarted &= is_parked;
    }

    /// Notes that the joint does not follow its goal.
    pub(super) fn jam(&mut self) {
        self.stage = Stage::Out { wait_s: AGAIN_S, is_jammed: true };
    }

    /// True if the joint should stay without torque.
    pub(super) fn is_out(self) -> bool {
        !matches!(self.stage, Stage::Working { .. })
    }

    /// True if its silence is expected.
    pub(super) fn is_restarting(self) -> bool {
        matches!(self.stage, Stage::Restarting { .. })
    }

    /// True if the servo should be asked for the cause of its alarm.
    pub(super) fn needs_question(self, measured: &JointState) -> bool {
        let is_alarmed = measured.age_s <= 0.0 && measured.alarms != 0 && measured.alarm_causes == 0;
        is_alarmed && matches!(self.stage, Stage::Out { .. }) && self.asked < QUESTIONS
    }

    /// Notes that the servo is asked.
    pub(super) fn ask(&mut self) {
        self.asked = self.asked.saturating_add(1);
    }

    /// The cause of its outage, once it is known or cannot become known; returned only once.
    pub(super) fn take_cause(&mut self, measured: &JointState) -> Option<OutageCause> {
        let Stage::Out { is_jammed, .. } = self.stage else { return None };
        let is_known = is_jammed || measured.alarm_causes != 0 || self.asked >= QUESTIONS;
        if self.is_reported || !is_known {
            return None;
        }
        self.is_reported = true;
        Some(if is_jammed { OutageCause::Jam } else { OutageCause::Alarm(measured.alarm_causes) })
    }

    /// True if a restart may help the servo and it may restart now, given that the robot is parked.
    pub(super) fn can_restart(self, measured: &JointState) -> bool {
        let helps = match measured.alarm_causes {
            OVERLOAD_ALARM => true,
            0 => measured.alarms != 0 && self.asked >= QUESTIONS && !self.was_restarted,
            _ => false,
        };
        helps && matches!(self.stage, Stage::Out { wait_s, .. } if wait_s <= 0.0)
    }

    /// Notes that the servo is ordered to restart.
    pub(super) fn restart(&mut self, measured: &JointState) {
        self.was_restarted |= measured.alarm_causes == 0;
        self.stage = Stage::Restarting { since_s: 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A healthy servo.
    fn well() -> JointState {
        JointState { is_known: true, voltage_v: 5.0, temperature_c: 30.0, ..JointState::default() }
    }

    fn silent() -> JointState {
        JointState { age_s: 0.5, ..well() }
    }

    /// A Dynamixel that raises an alarm and has reported these causes; 0 if it has not.
    fn alarmed(alarm_causes: u8) -> JointState {
        JointState { alarms: 0x80, alarm_causes, ..well() }
    }

    fn looked(servo: ServoOutage, measured: &JointState, times: usize) -> ServoOutage {
        look(servo, measured, times, false)
    }

    fn look(servo: ServoOutage, measured: &JointState, times: usize, is_parked: bool) -> ServoOutage {
        (0..times).fold(servo, |mut servo, _| {
            servo.look(0.01, 0.5, is_parked, measured);
            servo
        })
    }

    fn restarted(mut servo: ServoOutage, measured: &JointState) -> ServoOutage {
        assert!(servo.can_restart(measured));
        servo.restart(measured);
        servo
    }

    #[test]
    fn a_lasting_overload_takes_a_servo_out_and_a_restart_brings_it_back() {
        let overload = alarmed(0x20);
        assert!(!looked(ServoOutage::NONE, &overload, 49).is_out());
        let out = looked(ServoOutage::NONE, &overload, 52);
        assert!(out.is_out());
        let restarting = looked(restarted(out, &overload), &silent(), 100);
        assert!(restarting.is_out() && restarting.is_restarting());
        assert_eq!(looked(restarting, &well(), 1), ServoOutage::NONE);
    }

    #[test]
    fn alarms_other_than_overload_cause_no_restart() {
        // Causes that a restart does not clear: voltage, heat, encoder, shock; and an overload that came with heat.
        for causes in [0x01, 0x04, 0x08, 0x10, 0x24] {
            let measured = alarmed(causes);
            let mut out = look(ServoOutage::NONE, &measured, 100_000, true);
            assert!(out.is_out() && !out.can_restart(&measured), "0x{causes:02X}");
            assert_eq!(out.take_cause(&measured), Some(OutageCause::Alarm(causes)));
            assert_eq!(out.take_cause(&measured), None, "told once");
            assert_eq!(looked(out, &well(), 1), ServoOutage::NONE, "heat passes");
        }
    }

    #[test]
    fn a_servo_that_does_not_report_the_cause_is_asked_three_times_and_restarted_once_per_park() {
        let measured = alarmed(0);
        let mut out = look(ServoOutage::NONE, &measured, 60, true);
        for _ in 0..3 {
            assert!(out.needs_question(&measured) && !out.can_restart(&measured));
            assert_eq!(out.take_cause(&measured), None, "it may yet say why");
            out.ask();
        }
        assert!(!out.needs_question(&measured));
        assert_eq!(out.take_cause(&measured), Some(OutageCause::Alarm(0)));
        let again = look(restarted(out, &measured), &measured, 100_000, true);
        assert!(again.is_out() && !again.can_restart(&measured), "it was tried in this park");
        let next_park = look(look(again, &measured, 1, false), &measured, 1, true);
        assert!(next_park.can_restart(&measured));
    }

    #[test]
    fn a_lost_reply_neither_ends_nor_adds_to_an_alarm() {
        let alternating = |times: usize| {
            (0..times).fold(ServoOutage::NONE, |servo, time| {
                looked(servo, &if time % 2 == 0 { alarmed(0x20) } else { silent() }, 1)
            })
        };
        assert!(!alternating(98).is_out(), "heard 49 times");
        assert!(alternating(104).is_out(), "heard 52 times");
        assert_eq!(looked(alternating(98), &well(), 1), ServoOutage::NONE);
    }

    #[test]
    fn a_jammed_servo_stays_out_until_the_robot_is_parked() {
        let mut servo = ServoOutage::NONE;
        servo.jam();
        assert_eq!(servo.take_cause(&well()), Some(OutageCause::Jam));
        servo = looked(servo, &well(), 2000);
        assert!(servo.is_out() && !servo.can_restart(&well()), "though its servo is well");
        servo.look(0.01, 0.5, true, &well());
        assert_eq!(servo, ServoOutage::NONE);
    }

    #[test]
    fn a_failed_restart_is_tried_again_after_a_wait() {
        let overload = alarmed(0x20);
        let out = looked(ServoOutage::NONE, &overload, 52);
        let again = looked(restarted(out, &overload), &overload, 402);
        assert!(again.is_out() && !again.can_restart(&overload));
        assert!(looked(again, &overload, 1001).can_restart(&overload));
        assert!(!looked(again, &well(), 1).is_out(), "one that is well needs none");
    }
}
