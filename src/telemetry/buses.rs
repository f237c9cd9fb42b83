//! Buses: their traffic, and the times of their exchanges.

use std::time::Duration;

use hdrhistogram::Histogram;

use super::report::BusReport;
use crate::bus::timing::wire_time;
use crate::model::Robot;
use crate::observe::{BusFacts, CycleRecord};
use crate::stopwatch::{DIGITS, Quantiles, histogram_us, micros};

/// One bus so far.
#[derive(Debug)]
struct Seen {
    exchange_us: Histogram<u64>,
    /// Exchanges that were sent.
    sent: u64,
    /// Replies that were dropped as implausible.
    implausible: u64,
}

#[derive(Debug)]
pub(super) struct BusObserver(Vec<Seen>);

impl BusObserver {
    pub(super) fn new(robot: &Robot) -> BusObserver {
        let unseen = |_| Seen { exchange_us: histogram_us(DIGITS), sent: 0, implausible: 0 };
        BusObserver(robot.buses.iter().map(unseen).collect())
    }

    pub(super) fn observe(&mut self, robot: &Robot, cycle: &CycleRecord<'_>) {
        for (joint, state) in robot.joints.iter().zip(&cycle.state.joints) {
            let bus = joint.servo.filter(|_| state.is_implausible).map(|servo| servo.bus);
            if let Some(seen) = bus.and_then(|bus| self.0.get_mut(bus)) {
                seen.implausible += 1;
            }
        }
        for (seen, bus) in self.0.iter_mut().zip(cycle.buses) {
            // An exchange that could not be sent took no time.
            if bus.sent > seen.sent {
                seen.exchange_us.saturating_record(micros(bus.exchange));
                seen.sent = bus.sent;
            }
        }
    }

    /// A report for each bus, which ended as `buses` say, over a run of this `duration`.
    pub(super) fn report(&self, robot: &Robot, duration: Duration, buses: &[BusFacts]) -> Vec<BusReport> {
        let all = robot.buses.iter().zip(buses).zip(&self.0);
        let of_bus = all.map(|((described, bus), seen)| {
            let bytes = usize::try_from(bus.bytes_out + bus.bytes_in).unwrap_or(usize::MAX);
            BusReport {
                name: described.name.clone(),
                exchanges: bus.exchanges,
                bytes_out: bus.bytes_out,
                bytes_in: bus.bytes_in,
                missing: bus.missing,
                corrupt: bus.corrupt,
                implausible: seen.implausible,
                unknown: bus.unknown,
                wire_share: wire_time(bytes, described.baud).as_secs_f64() / duration.as_secs_f64().max(1e-9),
                exchange_us: Quantiles::of(&seen.exchange_us),
            }
        });
        of_bus.collect()
    }
}
