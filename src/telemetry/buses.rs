//! Buses: their traffic, and the times of their exchanges.

use std::time::Duration;

use hdrhistogram::Histogram;

use super::report::{BusReport, Quantiles};
use super::{CycleRecord, histogram_us};
use crate::bus::BusStatistics;
use crate::bus::timing::wire_time;
use crate::model::{Bus, Robot};

#[derive(Debug)]
pub(super) struct BusObserver {
    /// For each bus: exchange times, microseconds, and number of exchanges seen.
    seen: Vec<(Histogram<u64>, u64)>,
    /// Replies of each bus that were dropped as implausible.
    implausible: Vec<u64>,
}

impl BusObserver {
    pub(super) fn new(robot: &Robot) -> BusObserver {
        BusObserver {
            seen: robot.buses.iter().map(|_| (histogram_us(), 0)).collect(),
            implausible: vec![0; robot.buses.len()],
        }
    }

    /// Counts the replies of a cycle that were dropped.
    pub(super) fn observe_replies(&mut self, robot: &Robot, record: &CycleRecord<'_>) {
        for (joint, state) in robot.joints.iter().zip(&record.state.joints) {
            let bus = joint.servo.filter(|_| state.is_implausible).map(|servo| servo.bus);
            if let Some(count) = bus.and_then(|bus| self.implausible.get_mut(bus)) {
                *count += 1;
            }
        }
    }

    pub(super) fn observe<'s>(&mut self, buses: impl Iterator<Item = BusStatistics<'s>>) {
        for ((times, count), bus) in self.seen.iter_mut().zip(buses) {
            // An exchange that could not be sent took no time.
            if bus.times.count > *count {
                times.saturating_record(u64::try_from(bus.times.last.as_micros()).unwrap_or(u64::MAX));
                *count = bus.times.count;
            }
        }
    }

    /// A report for each bus, over a run of this `duration`.
    pub(super) fn report<'s>(
        &self,
        robot: &Robot,
        duration: Duration,
        buses: impl Iterator<Item = BusStatistics<'s>>,
    ) -> Vec<BusReport> {
        let of_bus = |(((described, statistics), (times, _)), implausible): (
            ((&Bus, BusStatistics<'_>), &(_, u64)),
            &u64,
        )| {
            let counters = statistics.counters;
            let bytes = usize::try_from(counters.bytes_out + counters.bytes_in).unwrap_or(usize::MAX);
            BusReport {
                name: described.name.clone(),
                exchanges: counters.exchanges,
                bytes_out: counters.bytes_out,
                bytes_in: counters.bytes_in,
                missing: counters.missing,
                corrupt: counters.corrupt,
                implausible: *implausible,
                unknown: statistics.unknown_replies,
                wire_share: wire_time(bytes, described.baud).as_secs_f64() / duration.as_secs_f64().max(1e-9),
                exchange_us: Quantiles::of(times),
            }
        };
        robot.buses.iter().zip(buses).zip(&self.seen).zip(&self.implausible).map(of_bus).collect()
    }
}
