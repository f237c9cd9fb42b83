//! `/loop` and `/buses`: when the cycle was, how long its parts took, and how the buses fared.

use std::borrow::Cow;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::super::sample::Sample;
use super::Stamp;
use crate::model::Robot;
use crate::observe::{BusFacts, CycleTimes};
use crate::units::Time;

/// `hippocamp.Buses`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Buses<'a> {
    /// Time of the message.
    pub timestamp: Stamp,
    /// All buses.
    pub buses: Vec<Bus<'a>>,
}

/// One bus: see [`crate::observe::BusFacts`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bus<'a> {
    /// Name.
    pub name: Cow<'a, str>,
    /// Duration of the exchange.
    pub exchange_ns: u64,
    /// Replies missing since the start.
    pub missing: u64,
    /// Corrupt replies since the start.
    pub corrupt: u64,
    /// True if its port was gone.
    pub is_gone: bool,
}

impl<'a> Buses<'a> {
    /// The message of `sample` at `timestamp`.
    pub(in crate::recording) fn of(robot: &'a Robot, sample: &Sample, timestamp: Stamp) -> Buses<'a> {
        let buses = robot.buses.iter().zip(&sample.buses).map(|(bus, sample)| Bus {
            name: bus.name.as_str().into(),
            exchange_ns: nanoseconds(sample.exchange),
            missing: sample.missing,
            corrupt: sample.corrupt,
            is_gone: sample.is_gone,
        });
        Buses { timestamp, buses: buses.collect() }
    }

    /// Puts what the message holds into `sample`.
    pub(in crate::recording) fn read_into(&self, sample: &mut Sample) {
        for (facts, bus) in sample.buses.iter_mut().zip(&self.buses) {
            *facts = BusFacts {
                exchange: Duration::from_nanos(bus.exchange_ns),
                missing: bus.missing,
                corrupt: bus.corrupt,
                is_gone: bus.is_gone,
                ..BusFacts::default()
            };
        }
    }
}

/// `hippocamp.Loop`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Loop {
    /// Time of the message.
    pub timestamp: Stamp,
    /// Number of cycles before this one.
    pub cycle: u64,
    /// When the cycle began, on the run's clock.
    pub began_ns: u64,
    /// Time since the previous cycle began, dropped cycles included.
    pub gap_ns: u64,
    /// How late the cycle began.
    pub late_ns: u64,
    /// Time spent computing.
    pub work_ns: u64,
    /// Time spent in the exchange on all buses.
    pub exchange_ns: u64,
}

impl Loop {
    /// The message of `sample` at `timestamp`.
    pub(in crate::recording) fn of(sample: &Sample, timestamp: Stamp) -> Loop {
        Loop {
            timestamp,
            cycle: sample.facts.times.number,
            began_ns: sample.facts.times.began.0,
            gap_ns: nanoseconds(sample.facts.times.gap),
            late_ns: nanoseconds(sample.facts.times.late),
            work_ns: nanoseconds(sample.facts.times.work),
            exchange_ns: nanoseconds(sample.facts.times.exchange),
        }
    }

    /// Puts what the message holds into `sample`.
    pub(in crate::recording) fn read_into(&self, sample: &mut Sample) {
        sample.facts.times = CycleTimes {
            number: self.cycle,
            began: Time(self.began_ns),
            late: Duration::from_nanos(self.late_ns),
            gap: Duration::from_nanos(self.gap_ns),
            work: Duration::from_nanos(self.work_ns),
            exchange: Duration::from_nanos(self.exchange_ns),
        };
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
