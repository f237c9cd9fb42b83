//! Rejects measurements that passed their checksums but are false: an eight-bit sum lets one damaged frame in 256
//! pass.
//!
//! As with servos, a measurement is accepted if the trunk can have moved so since the one before, or if two in a
//! row agree. Limits are wide: a fall to the ground is a true measurement.

use glam::{DQuat, DVec3, EulerRot};

use super::RawSample;
use crate::units::Time;

/// The attitude changes by no more than the turn rates explain, plus this, rad: the unit's own filter lags.
const ANGLE_SLACK_RAD: f64 = 0.2;
/// The turn rate changes by no more than this from one measurement to the next, rad/s, ...
const RATE_STEP_RAD_S: f64 = 15.0;
/// ... nor the acceleration, m/s^2.
const ACCELERATION_STEP_M_S2: f64 = 150.0;

#[derive(Debug)]
pub(super) struct Filter {
    /// Time from one measurement to the next, s.
    period_s: f64,
    /// Measurements older than this are no longer compared with, s.
    stale_s: f64,
    accepted: Option<(Time, RawSample)>,
    dropped: Option<(Time, RawSample)>,
}

impl Filter {
    pub(super) fn new(period_s: f64, stale_s: f64) -> Filter {
        Filter { period_s, stale_s, accepted: None, dropped: None }
    }

    /// True if `sample`, found at `now`, is a measurement.
    pub(super) fn accepts(&mut self, now: Time, sample: &RawSample) -> bool {
        let follows = |past: &Option<(Time, RawSample)>| {
            past.as_ref()
                .is_some_and(|(then, before)| self.follows(now.since(*then).as_secs_f64(), before, sample))
        };
        let is_accepted = follows(&self.accepted) || follows(&self.dropped);
        let place = if is_accepted { &mut self.accepted } else { &mut self.dropped };
        *place = Some((now, *sample));
        if is_accepted {
            self.dropped = None;
        }
        is_accepted
    }

    /// True if the unit can measure `now` at `gap_s` after `before`.
    fn follows(&self, gap_s: f64, before: &RawSample, now: &RawSample) -> bool {
        let rates = [before.rate_rad_s(), now.rate_rad_s()];
        let fastest_rad_s = rates.map(DVec3::length).into_iter().fold(0.0, f64::max);
        let turned_rad = attitude(before).angle_between(attitude(now));
        // A look may find several measurements, or only the last of some that were lost.
        gap_s <= self.stale_s
            && turned_rad <= fastest_rad_s * (gap_s + self.period_s) + ANGLE_SLACK_RAD
            && rates[0].distance(rates[1]) <= RATE_STEP_RAD_S
            && before.specific_force_m_s2().distance(now.specific_force_m_s2()) <= ACCELERATION_STEP_M_S2
    }
}

fn attitude(sample: &RawSample) -> DQuat {
    let DVec3 { x: roll, y: pitch, z: yaw } = sample.angles_rad();
    DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A measurement of a level trunk with this roll, roll rate and forward acceleration: degrees, degrees/s and g.
    fn sample(roll_deg: f64, rate_deg_s: f64, ahead_g: f64) -> RawSample {
        RawSample::of(
            DVec3::new(ahead_g, 0.0, 1.0) * 9.806_65,
            DVec3::X * rate_deg_s.to_radians(),
            DVec3::X * roll_deg.to_radians(),
        )
    }

    fn accepted(samples: &[RawSample]) -> Vec<bool> {
        let mut filter = Filter::new(0.005, 0.1);
        let mut now = Time::default();
        let each = samples.iter().map(|sample| {
            now = now + std::time::Duration::from_millis(5);
            filter.accepts(now, sample)
        });
        each.collect()
    }

    #[test]
    fn one_false_measurement_is_dropped_and_two_that_agree_are_believed() {
        let still = sample(0.0, 0.0, 0.0);
        for wrong in [sample(60.0, 0.0, 0.0), sample(0.0, 1500.0, 0.0), sample(0.0, 0.0, 15.9)] {
            let found = accepted(&[still, still, wrong, still, wrong, wrong]);
            assert_eq!(found, [false, true, false, true, false, true], "{wrong:?}");
        }
    }

    #[test]
    fn the_fast_rotation_of_a_fall_is_believed() {
        let fall: Vec<RawSample> = (0..100).map(|step| sample(f64::from(step) * 0.9, 180.0, 0.0)).collect();
        assert_eq!(accepted(&fall).iter().filter(|is_accepted| !**is_accepted).count(), 1, "the first alone");
        // The ground stops it: 6 g, and no further turn.
        assert_eq!(
            accepted(&[sample(80.0, 400.0, 0.0), sample(82.0, 400.0, 0.0), sample(83.0, 0.0, 6.0)]),
            [false, true, true]
        );
    }
}
