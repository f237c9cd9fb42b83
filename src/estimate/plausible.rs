//! Rejects replies that passed their checksum but are not measurements.
//!
//! A Feetech checksum has eight bits, so one damaged reply in 256 passes it. A filter for each servo compares every
//! reply with the one before: it accepts the reply if a servo can have got there since, and drops it if not. A
//! dropped reply counts again if the next one agrees with it: two damaged replies do not agree, two true ones do.
//! After a silence there is nothing to compare with, so two replies must agree then too.

use crate::model::{Joint, SafetySettings};
use crate::signals::JointState;

/// A joint turns no faster than this multiple of its servo's no-load speed, whatever pushes it, ...
const SPEED_SHARE: f64 = 1.5;
/// ... give or take this much, rad: play, noise, and a limp leg that drops.
const SLACK_RAD: f64 = 0.1;
/// The speed register never exceeds this multiple of the no-load speed: a limp leg may be flung.
const REPORTED_SPEED_SHARE: f64 = 6.0;
/// The load register never exceeds this multiple of the stall torque: makers state it at one voltage.
const LOAD_SHARE_MAX: f64 = 2.5;
/// The supply changes by no more than this between two replies, V, ...
const VOLTAGE_STEP_V: f64 = 3.0;
/// ... nor the temperature, degrees Celsius.
const TEMPERATURE_STEP_C: f64 = 8.0;

/// Past replies of one servo.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    /// Positions that the servo can report at all, rad: its counts and one turn beyond on either side.
    position_rad: (f64, f64),
    speed_max_rad_s: f64,
    reported_speed_max_rad_s: f64,
    /// After a silence longer than this there is nothing to compare with, s. Time in which the loop stood still
    /// does not count.
    silence_s: f64,
    accepted: Option<EarlierReply>,
    dropped: Option<EarlierReply>,
}

/// An earlier reply.
#[derive(Debug, Clone, Copy)]
struct EarlierReply {
    reading: JointState,
    age_s: f64,
    /// How long the servo had been unheard at the exchange before this reply, s.
    unheard_s: f64,
}

impl Filter {
    pub(super) fn new(joint: &Joint, settings: &SafetySettings) -> Filter {
        let (low, high) = joint.servo_range_rad();
        let turn_rad = std::f64::consts::TAU;
        let no_load_rad_s = joint.no_load_speed_rad_s();
        Filter {
            position_rad: (low - turn_rad, high + turn_rad),
            speed_max_rad_s: SPEED_SHARE * no_load_rad_s,
            reported_speed_max_rad_s: REPORTED_SPEED_SHARE * no_load_rad_s,
            silence_s: settings.lost_after_s(),
            accepted: None,
            dropped: None,
        }
    }

    /// Ages the past replies by `gap_s`, s.
    pub(super) fn age(&mut self, gap_s: f64) {
        for past in [&mut self.accepted, &mut self.dropped].into_iter().flatten() {
            past.unheard_s = past.age_s;
            past.age_s += gap_s;
        }
    }

    /// True if `reading`, taken now, is a measurement.
    pub(super) fn accepts(&mut self, reading: &JointState) -> bool {
        let past = EarlierReply { reading: *reading, age_s: 0.0, unheard_s: 0.0 };
        if !self.is_possible(reading) {
            return false;
        }
        let follows = |before: &Option<EarlierReply>| {
            before.as_ref().is_some_and(|before| self.follows(before, reading))
        };
        let is_accepted = follows(&self.accepted) || follows(&self.dropped);
        if is_accepted {
            (self.accepted, self.dropped) = (Some(past), None);
        } else {
            self.dropped = Some(past);
        }
        is_accepted
    }

    /// True if any servo of this model can report this.
    fn is_possible(&self, reading: &JointState) -> bool {
        let (low, high) = self.position_rad;
        (low..=high).contains(&reading.position_rad)
            && reading.speed_rad_s.abs() <= self.reported_speed_max_rad_s
            && reading.load_share.abs() <= LOAD_SHARE_MAX
    }

    /// True if a servo that reported `before` can report `now`.
    fn follows(&self, before: &EarlierReply, now: &JointState) -> bool {
        let EarlierReply { reading, age_s, unheard_s } = before;
        let turn_rad = self.speed_max_rad_s * age_s + SLACK_RAD;
        *unheard_s <= self.silence_s
            && (now.position_rad - reading.position_rad).abs() <= turn_rad
            && (now.voltage_v - reading.voltage_v).abs() <= VOLTAGE_STEP_V
            && (now.temperature_c - reading.temperature_c).abs() <= TEMPERATURE_STEP_C
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    const DT_S: f64 = 0.01;

    fn filter() -> Filter {
        let robot =
            crate::config::parse(include_str!("../../config/horse.toml"), "horse.toml").unwrap().robot;
        Filter::new(&robot.joints[6], &robot.safety)
    }

    fn at(position_rad: f64) -> JointState {
        JointState {
            is_known: true,
            position_rad,
            voltage_v: 12.0,
            temperature_c: 30.0,
            ..JointState::default()
        }
    }

    /// Whether the filter accepts replies that come one per cycle.
    fn accepted(filter: &mut Filter, readings: &[JointState]) -> Vec<bool> {
        let each = readings.iter().map(|reading| {
            filter.age(DT_S);
            filter.accepts(reading)
        });
        each.collect()
    }

    #[test]
    fn one_false_reading_of_each_kind_is_dropped_and_the_next_true_one_taken() {
        let wrong = [
            at(1.0),
            at(-2.0),
            at(53.5),
            JointState { speed_rad_s: 40.0, ..at(0.0) },
            JointState { load_share: -3.0, ..at(0.0) },
            JointState { voltage_v: 25.0, ..at(0.0) },
            JointState { voltage_v: 1.0, ..at(0.0) },
            JointState { temperature_c: 200.0, ..at(0.0) },
            JointState { position_rad: f64::NAN, ..at(0.0) },
        ];
        for reading in wrong {
            let mut filter = filter();
            let found = accepted(&mut filter, &[at(0.0), at(0.0), reading, at(0.0), at(0.0)]);
            assert_eq!(found, [false, true, false, true, true], "{reading:?}");
        }
    }

    #[test]
    fn the_first_reading_and_the_first_after_silence_need_a_second_that_agrees() {
        let mut filter = filter();
        assert_eq!(
            accepted(&mut filter, &[at(0.3), at(-0.8), at(0.2), at(0.21)]),
            [false, false, false, true]
        );
        (0..100).for_each(|_| filter.age(DT_S));
        assert_eq!(accepted(&mut filter, &[at(0.22), at(0.22)]), [false, true]);
        // A loop that stood still did not ask: the servo was not silent.
        filter.age(1.0);
        assert!(filter.accepts(&at(0.22)));
    }

    #[test]
    fn two_replies_that_agree_are_believed() {
        let mut filter = filter();
        accepted(&mut filter, &[at(0.0), at(0.0)]);
        let hot = JointState { temperature_c: 72.0, voltage_v: 8.0, ..at(1.2) };
        assert_eq!(accepted(&mut filter, &[hot, hot]), [false, true]);
        // No servo can be more than a turn outside its counts, however often it reports that.
        assert_eq!(accepted(&mut filter, &[at(53.5), at(53.5), at(53.5)]), [false; 3]);
    }

    #[test]
    fn a_joint_at_its_top_speed_is_followed_through_lost_replies() {
        let mut filter = filter();
        let speed_rad_s = filter.speed_max_rad_s / SPEED_SHARE;
        accepted(&mut filter, &[at(0.0), at(0.0)]);
        for cycles in [1.0, 3.0, 9.0] {
            let gap_s = cycles * DT_S;
            let before = filter.accepted.unwrap().reading.position_rad;
            filter.age(gap_s);
            assert!(filter.accepts(&at(before + speed_rad_s * gap_s)), "after {gap_s} s");
        }
    }
}
