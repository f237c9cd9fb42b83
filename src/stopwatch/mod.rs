//! How long each stage of a cycle took, which stage made the slowest cycle slow, and how late cycles began.
//!
//! Input: the clock at the end of each stage. Output: a [`LoopReport`]. Costs one reading of the clock per stage and two
//! queries to the system per cycle; allocates nothing after the start.

mod stage;
#[cfg(test)]
mod tests;

use std::fmt;
use std::time::Duration;

use hdrhistogram::Histogram;
use serde::Serialize;

use crate::platform::Usage;
use crate::units::Time;
pub use stage::{Stage, Stages};

/// Longest time that a histogram distinguishes, microseconds.
const LONGEST_US: u64 = 60_000_000;

/// One cycle, stage by stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SlowCycle {
    /// Number of cycles before it in this run.
    pub number: u64,
    /// Its deadline, s of the run.
    pub time_s: f64,
    /// Time from its deadline to its end.
    pub total_us: u64,
    /// Time of each stage.
    pub stages_us: Stages<u64>,
    /// Processor time of the loop's thread since the previous cycle.
    pub processor_us: u64,
    /// Time in which the thread was ready but another had the processor; `None` if the system does not count it.
    pub waited_us: Option<u64>,
    /// Page faults that the thread waited for.
    pub page_faults: u64,
    /// Page faults among these that came from a disk.
    pub disk_faults: u64,
}

impl SlowCycle {
    /// The longest stage and its time, microseconds. The exchange, which waits for the wire, counts only if it took
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

/// Timing of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LoopReport {
    /// Computing time of a cycle without the exchange; `None` on a virtual clock, which stands still meanwhile.
    pub work_us: Option<Quantiles>,
    /// Time from a cycle's deadline to its beginning.
    pub late_us: Quantiles,
    /// Time of each stage of a cycle; `None` on a virtual clock.
    pub stages_us: Option<Stages<Quantiles>>,
    /// The slowest cycle, not counting the first.
    pub slowest: Option<SlowCycle>,
    /// The first cycle, which allocates memory while the robot is limp.
    pub first: Option<SlowCycle>,
}

/// Values that 50, 99 and 99.9 percent of the samples stay below, and the largest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Quantiles {
    /// Median.
    pub p50: u64,
    /// 99th percentile.
    pub p99: u64,
    /// 99.9th percentile.
    pub p999: u64,
    /// Largest.
    pub max: u64,
}

impl Quantiles {
    /// The quantiles of a histogram of microseconds.
    pub fn of(histogram: &Histogram<u64>) -> Quantiles {
        Quantiles {
            p50: histogram.value_at_quantile(0.5),
            p99: histogram.value_at_quantile(0.99),
            p999: histogram.value_at_quantile(0.999),
            max: histogram.max(),
        }
    }
}

/// A histogram of microseconds that never grows, with this many digits of each value.
pub(crate) fn histogram_us(digits: u8) -> Histogram<u64> {
    match Histogram::new_with_bounds(1, LONGEST_US, digits) {
        Ok(histogram) => histogram,
        // The bounds above are valid; a histogram with other bounds would serve as well.
        Err(_) => unreachable!("constant bounds"),
    }
}

/// Whole microseconds.
pub(crate) fn micros(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}

/// Digits of a stage's time: two identify the slow stage, and leave the processor's cache to the stages.
const STAGE_DIGITS: u8 = 2;
/// Digits of all other times.
pub(crate) const DIGITS: u8 = 3;

/// Measures the stages as they pass.
#[derive(Debug)]
pub struct Stopwatch {
    work_us: Histogram<u64>,
    late_us: Histogram<u64>,
    late_cycles: u64,
    /// Times of each stage, microseconds.
    stages_us: Vec<Histogram<u64>>,
    /// The first deadline.
    start: Option<Time>,
    cycles: u64,
    // State of the present cycle.
    deadline: Time,
    late: Duration,
    /// When the last stage ended.
    last: Time,
    took: Stages<Duration>,
    /// Usage at the end of the previous cycle; `None` before the second.
    usage: Option<Usage>,
    first: Option<SlowCycle>,
    slowest: Option<SlowCycle>,
}

impl Stopwatch {
    /// A stopwatch that has measured nothing.
    #[allow(clippy::new_without_default, reason = "it allocates")]
    pub fn new() -> Stopwatch {
        Stopwatch {
            work_us: histogram_us(DIGITS),
            late_us: histogram_us(DIGITS),
            late_cycles: 0,
            stages_us: Stage::ALL.iter().map(|_| histogram_us(STAGE_DIGITS)).collect(),
            start: None,
            cycles: 0,
            deadline: Time::default(),
            late: Duration::ZERO,
            last: Time::default(),
            took: Stages::default(),
            usage: None,
            first: None,
            slowest: None,
        }
    }

    /// Notes that a cycle with this `deadline` begins `now`, and counts it as late if that is more than `tolerance` after.
    pub fn begin(&mut self, deadline: Time, now: Time, tolerance: Duration) {
        self.start = self.start.or(Some(deadline));
        self.deadline = deadline;
        self.late = now.since(deadline);
        self.late_us.saturating_record(micros(self.late));
        self.late_cycles += u64::from(self.late > tolerance);
        self.took = Stages::default();
        self.last = deadline;
        self.note(Stage::Wake, now);
    }

    /// Notes that `stage` ends `now`; it began when the previous stage ended.
    pub fn note(&mut self, stage: Stage, now: Time) {
        self.took.0[stage as usize] += now.since(self.last);
        self.last = now;
    }

    /// Notes that all stages of the cycle are over; `usage` is what the loop's thread has used so far.
    pub fn end(&mut self, usage: Usage) {
        self.work_us.saturating_record(micros(self.work()));
        let stages_us = Stages(self.took.0.map(micros));
        for (histogram, us) in self.stages_us.iter_mut().zip(stages_us.0) {
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
        // The first cycle allocates memory and requests real-time scheduling, while the robot is limp.
        if self.first.is_none() {
            self.first = Some(cycle);
        } else if self.slowest.is_none_or(|slowest| cycle.total_us > slowest.total_us) {
            self.slowest = Some(cycle);
        }
    }

    /// Time by which the present cycle began after its deadline.
    pub fn late(&self) -> Duration {
        self.late
    }

    /// Computing time of the present cycle until the last stage that has ended.
    pub fn work(&self) -> Duration {
        self.took.iter().filter(|(stage, _)| stage.is_work()).map(|(_, took)| *took).sum()
    }

    /// Time of one stage of the present cycle; zero until it has ended.
    pub fn took(&self, stage: Stage) -> Duration {
        *self.took.of(stage)
    }

    /// Number of cycles that began late so far.
    pub fn late_cycles(&self) -> u64 {
        self.late_cycles
    }

    /// Timing of the loop so far.
    pub fn report(&self) -> LoopReport {
        // A real cycle always computes for at least a microsecond.
        let is_measured = self.work_us.max() > 0;
        let quantiles = || Stages(std::array::from_fn(|stage| Quantiles::of(&self.stages_us[stage])));
        LoopReport {
            work_us: is_measured.then(|| Quantiles::of(&self.work_us)),
            late_us: Quantiles::of(&self.late_us),
            stages_us: is_measured.then(quantiles),
            slowest: self.slowest.filter(|_| is_measured),
            first: self.first.filter(|_| is_measured),
        }
    }
}
