//! How long each stage of a cycle took, and which one made the slowest cycle slow.
//!
//! Costs a look at the clock a stage and two questions to the system a cycle.

use std::fmt;
use std::time::Duration;

use hdrhistogram::Histogram;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::{LONGEST_US, Quantiles, Telemetry};
use crate::platform::Usage;
use crate::units::Time;

/// A part of the loop's cycle, in the order in which they are done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// From the deadline until the loop ran.
    Wake,
    /// The driver's and the signals' orders, the sign of life to the guard, the status line.
    Orders,
    /// Falls.
    Reflex,
    /// Gaits, strokes and poses, with their plans.
    Generator,
    /// Feedback by the trunk.
    Balance,
    /// Inverse kinematics.
    Kinematics,
    /// What loaded joints give way.
    Sag,
    /// Arms that give way.
    Yielding,
    /// Limits and watch.
    Safety,
    /// Radians to counts.
    Counts,
    /// All buses.
    Exchange,
    /// The inertial measurement unit.
    Imu,
    /// From replies to what is known.
    Estimate,
    /// The observers of the run.
    Telemetry,
    /// Handing the cycle to the recording.
    Recording,
}

const COUNT: usize = 15;

impl Stage {
    /// All of them, in order.
    pub const ALL: [Stage; COUNT] = [
        Stage::Wake,
        Stage::Orders,
        Stage::Reflex,
        Stage::Generator,
        Stage::Balance,
        Stage::Kinematics,
        Stage::Sag,
        Stage::Yielding,
        Stage::Safety,
        Stage::Counts,
        Stage::Exchange,
        Stage::Imu,
        Stage::Estimate,
        Stage::Telemetry,
        Stage::Recording,
    ];

    /// The word used in reports.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Wake => "wake",
            Stage::Orders => "orders",
            Stage::Reflex => "reflex",
            Stage::Generator => "generator",
            Stage::Balance => "balance",
            Stage::Kinematics => "kinematics",
            Stage::Sag => "sag",
            Stage::Yielding => "yielding",
            Stage::Safety => "safety",
            Stage::Counts => "counts",
            Stage::Exchange => "exchange",
            Stage::Imu => "imu",
            Stage::Estimate => "estimate",
            Stage::Telemetry => "telemetry",
            Stage::Recording => "recording",
        }
    }
}

/// Something for each stage; in a report an object, a key a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stages<T>([T; COUNT]);

impl<T> Stages<T> {
    /// That of `stage`.
    pub fn of(&self, stage: Stage) -> &T {
        &self.0[stage as usize]
    }

    /// Each stage and what is its, in order.
    pub fn iter(&self) -> impl Iterator<Item = (Stage, &T)> {
        Stage::ALL.into_iter().zip(&self.0)
    }
}

impl<T: Serialize> Serialize for Stages<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(COUNT))?;
        for (stage, value) in self.iter() {
            map.serialize_entry(stage.name(), value)?;
        }
        map.end()
    }
}

/// One cycle, stage by stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SlowCycle {
    /// Cycles before it in this run.
    pub number: u64,
    /// Its deadline, s of the run.
    pub time_s: f64,
    /// From its deadline to its end.
    pub total_us: u64,
    /// Each stage.
    pub stages_us: Stages<u64>,
    /// Time since the cycle before in which the loop's thread was on a processor.
    pub processor_us: u64,
    /// Time in which it could have run and another thread had the processor; none where the system does not count it.
    pub waited_us: Option<u64>,
    /// Pages of memory it had to wait for.
    pub page_faults: u64,
    /// Of these such as came from a disk.
    pub disk_faults: u64,
}

impl SlowCycle {
    /// The stage that took longest, and how long, microseconds; the exchange, which waits for the wire, only if it took
    /// longer than all others together.
    pub fn longest(&self) -> (Stage, u64) {
        let exchange_us = *self.stages_us.of(Stage::Exchange);
        if 2 * exchange_us > self.total_us {
            return (Stage::Exchange, exchange_us);
        }
        let others = self.stages_us.iter().filter(|(stage, _)| *stage != Stage::Exchange);
        others.max_by_key(|(_, us)| **us).map_or((Stage::Wake, 0), |(stage, us)| (stage, *us))
    }
}

impl fmt::Display for SlowCycle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (stage, us) = self.longest();
        let (number, time_s, name) = (self.number, self.time_s, stage.name());
        write!(
            f,
            "slowest cycle: number {number} at {time_s:.1} s took {} us, {us} of them {name}; ",
            self.total_us
        )?;
        if let Some(waited_us) = self.waited_us {
            write!(f, "others had the processor for {waited_us} us of it, ")?;
        }
        write!(f, "the loop for {} us, with {} page faults", self.processor_us, self.page_faults)
    }
}

/// Watches the stages go by.
#[derive(Debug)]
pub(super) struct StageObserver {
    /// Each stage, microseconds.
    times_us: Vec<Histogram<u64>>,
    /// The first deadline.
    start: Option<Time>,
    cycles: u64,
    // Of the cycle under way.
    deadline: Time,
    /// When the last stage ended.
    last: Time,
    took: Stages<Duration>,
    /// At the end of the cycle before; none before the second.
    usage: Option<Usage>,
    first: Option<SlowCycle>,
    slowest: Option<SlowCycle>,
}

impl StageObserver {
    pub(super) fn new() -> StageObserver {
        StageObserver {
            times_us: Stage::ALL.iter().map(|_| histogram_of_stage()).collect(),
            start: None,
            cycles: 0,
            deadline: Time::default(),
            last: Time::default(),
            took: Stages::default(),
            usage: None,
            first: None,
            slowest: None,
        }
    }

    fn begin(&mut self, deadline: Time, now: Time) {
        self.start = self.start.or(Some(deadline));
        self.deadline = deadline;
        self.took = Stages::default();
        self.last = deadline;
        self.note(Stage::Wake, now);
    }

    fn note(&mut self, stage: Stage, now: Time) {
        self.took.0[stage as usize] += now.since(self.last);
        self.last = now;
    }

    fn end(&mut self, usage: Usage) {
        let micros = |time: Duration| u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        let stages_us = Stages(self.took.0.map(micros));
        for (histogram, us) in self.times_us.iter_mut().zip(stages_us.0) {
            histogram.saturating_record(us);
        }
        let since = self.usage.map_or(Usage::default(), |before| usage.since(&before));
        let cycle = SlowCycle {
            number: self.cycles,
            time_s: self.deadline.since(self.start.unwrap_or_default()).as_secs_f64(),
            total_us: micros(self.last.since(self.deadline)),
            stages_us,
            processor_us: micros(since.processor),
            waited_us: since.waited.map(micros),
            page_faults: since.page_faults,
            disk_faults: since.disk_faults,
        };
        self.cycles += 1;
        self.usage = Some(usage);
        // In the first one memory is taken and the system asked for its promises, while the robot is limp.
        if self.first.is_none() {
            self.first = Some(cycle);
        } else if self.slowest.is_none_or(|slowest| cycle.total_us > slowest.total_us) {
            self.slowest = Some(cycle);
        }
    }

    pub(super) fn quantiles(&self) -> Stages<Quantiles> {
        Stages(std::array::from_fn(|stage| Quantiles::of(&self.times_us[stage])))
    }

    pub(super) fn first(&self) -> Option<SlowCycle> {
        self.first
    }

    pub(super) fn slowest(&self) -> Option<SlowCycle> {
        self.slowest
    }
}

/// Two digits are enough to see which stage it was, and leave the processor's cache to the stages.
fn histogram_of_stage() -> Histogram<u64> {
    match Histogram::new_with_bounds(1, LONGEST_US, 2) {
        Ok(histogram) => histogram,
        // The bounds above are right; a histogram with other bounds would be as good.
        Err(_) => unreachable!("constant bounds"),
    }
}

impl Telemetry {
    /// A cycle with this `deadline` begins `now`.
    pub fn begin_cycle(&mut self, deadline: Time, now: Time) {
        self.stages.begin(deadline, now);
    }

    /// `stage` ends `now`; it began when the one before it ended.
    pub fn end_stage(&mut self, stage: Stage, now: Time) {
        self.stages.note(stage, now);
    }

    /// All stages of the cycle are over, and the loop's thread has used so much of the machine so far.
    pub fn end_cycle(&mut self, usage: Usage) {
        self.stages.end(usage);
    }
}
