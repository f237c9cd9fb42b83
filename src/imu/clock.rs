//! Estimates when the last measurement arrived, although the loop looks at the line only once a cycle.
//!
//! Each look bounds the arrival: it came after the look before, and the number of bytes after it tells how much of
//! the next one has come. Measurements come a period apart. As looks and measurements drift past each other, the
//! bounds tighten. This is passive clock synchronisation (E. Olson, "A Passive Solution to the
//! Sensor Synchronization Problem", IROS 2010) with both bounds hard.

use std::time::Duration;

use crate::model::{IMU_SAMPLE_BYTES, ImuSettings};
use crate::units::Time;

/// Bits of a byte on the line: 8N1.
const BITS_PER_BYTE: f64 = 10.0;

#[derive(Debug)]
pub(super) struct ArrivalClock {
    period: Duration,
    byte: Duration,
    /// Estimated time at which the last measurement had fully arrived; `None` before the first.
    arrived: Option<Time>,
    /// The same for the last measurement with new values.
    renewed: Option<Time>,
    /// Time of the previous look.
    looked: Option<Time>,
}

impl ArrivalClock {
    pub(super) fn new(settings: Option<&ImuSettings>) -> ArrivalClock {
        let seconds = |of: fn(&ImuSettings) -> f64| {
            settings.map_or(Duration::ZERO, |it| Duration::from_secs_f64(of(it)))
        };
        ArrivalClock {
            period: seconds(|settings| 1.0 / settings.rate_hz),
            byte: seconds(|settings| BITS_PER_BYTE / f64::from(settings.baud)),
            arrived: None,
            renewed: None,
            looked: None,
        }
    }

    /// Notes that at `now` the loop found `fresh` measurements and `behind` bytes after the last one; `is_new` is
    /// true if the last had new values.
    pub(super) fn note(&mut self, now: Time, fresh: u32, behind: u32, is_new: bool) {
        if let Some((earliest, latest)) = (fresh > 0).then(|| self.bounds(now, behind)) {
            let middle = earliest + latest.since(earliest) / 2;
            let expected = self.arrived.map_or(middle, |arrived| arrived + self.period.saturating_mul(fresh));
            let arrived = expected.clamp(earliest, latest);
            self.arrived = Some(arrived);
            if is_new {
                self.renewed = Some(arrived);
            }
        }
        self.looked = Some(now);
    }

    /// Earliest and latest arrival of the last measurement. After it the line rests until the next begins, whose
    /// bytes follow without gaps.
    fn bounds(&self, now: Time, behind: u32) -> (Time, Time) {
        let rest = self.period.saturating_sub(self.byte.saturating_mul(IMU_SAMPLE_BYTES));
        let earliest = now - (rest + self.byte.saturating_mul(behind));
        let latest =
            behind.checked_sub(1).map_or(now, |but_one| now - (rest + self.byte.saturating_mul(but_one)));
        let looked = self.looked.unwrap_or_default();
        // For a unit that sends more, or at another rate, the arrival is known only to within a cycle.
        if latest <= looked { (looked, now) } else { (earliest.max(looked), latest) }
    }

    /// Age of the last measurement with new values, s; if there was none, time since the run began.
    pub(super) fn age_s(&self, now: Time) -> f64 {
        now.since(self.renewed.unwrap_or_default()).as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks every `look_us` at measurements that complete every 5003 us (a quartz that is 0.06 % slow), from 1234
    /// us on. Returns the largest error of the arrival time in the last of ten seconds, us.
    fn worst_error_us(look_us: u64) -> u64 {
        let mut clock = ArrivalClock {
            period: Duration::from_micros(5000),
            byte: Duration::from_micros(87),
            arrived: None,
            renewed: None,
            looked: None,
        };
        let (mut next_us, mut worst) = (1234_u64, 0_u64);
        for now_us in (0..10_000_000_u64).step_by(usize::try_from(look_us).unwrap()) {
            let (mut fresh, mut truth_us) = (0, 0);
            while next_us <= now_us {
                (fresh, truth_us, next_us) = (fresh + 1, next_us, next_us + 5003);
            }
            // Bytes of the next measurement begin to arrive 33 bytes before it is complete.
            let begun_us = (now_us + 33 * 87).saturating_sub(next_us);
            let behind = u32::try_from(begun_us / 87).unwrap();
            clock.note(Time(now_us * 1000), fresh, behind, true);
            if fresh > 0 && now_us > 9_000_000 {
                worst = worst.max(clock.renewed.unwrap().0.abs_diff(truth_us * 1000) / 1000);
            }
        }
        worst
    }

    #[test]
    fn the_time_of_arrival_is_estimated_better_than_a_cycle() {
        // The looks drift past the measurements, as two quartzes always do.
        for look_us in [2000, 5000, 10_000, 20_000] {
            let worst = worst_error_us(look_us);
            assert!(worst <= 1200, "looking every {look_us} us: {worst} us");
        }
        // Looks at a beat with the measurements tighten the bounds.
        assert!(worst_error_us(7000) < 200, "{}", worst_error_us(7000));
    }

    #[test]
    fn a_reading_ages_while_no_new_one_comes() {
        let at = |now_ms: u64| Time(now_ms * 1_000_000);
        let mut clock = ArrivalClock {
            period: Duration::from_millis(5),
            byte: Duration::from_micros(87),
            arrived: None,
            renewed: None,
            looked: None,
        };
        for now_ms in (0..100).step_by(10) {
            clock.note(at(now_ms), 2, 0, true);
        }
        assert!(clock.age_s(at(90)) <= 0.005);
        for now_ms in (100..500).step_by(10) {
            clock.note(at(now_ms), 2, 0, false);
        }
        assert!((clock.age_s(at(490)) - 0.4).abs() < 0.006, "frozen");
        for now_ms in (500..600).step_by(10) {
            clock.note(at(now_ms), 0, 0, false);
        }
        assert!((clock.age_s(at(590)) - 0.5).abs() < 0.006, "silent");
    }
}
