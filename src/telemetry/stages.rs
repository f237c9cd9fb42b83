//! How long each stage of a cycle took, and which stage made the slowest cycle slow.
//!
//! Costs one reading of the clock per stage and two queries to the system per cycle.

use std::fmt;
use std::time::Duration;

use hdrhistogram::Histogram;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::{LONGEST_US, Quantiles, Telemetry};
use crate::platform::Usage;
use crate::units::Time;

/// A stage of the loop's cycle. The variants are in the order in which the stages run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// From the deadline until the loop runs.
    Wake,
    /// Orders of the driver and the signals, the sign of life to the guard, the status line.
    Orders,
    /// Detects and handles falls.
    Reflex,
    /// Gaits, strokes and poses, with their plans.
    Generator,
    /// Feedback from the trunk.
    Balance,
    /// Inverse kinematics.
    Kinematics,
    /// Corrects the sag of loaded joints.
    Sag,
    /// Lets overloaded arms yield.
    Yielding,
    /// Checks limits and watches for faults.
    Safety,
    /// Converts radians to counts.
    Counts,
    /// Exchanges all buses.
    Exchange,
    /// Reads the inertial measurement unit.
    Imu,
    /// Estimates the state from replies.
    Estimate,
    /// Runs the observers.
    Telemetry,
    /// Hands the cycle to the recording.
    Recording,
}

const COUNT: usize = 15;

impl Stage {
    /// All stages, in order.
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

/// A value for each stage; in a report an object with a key for each stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stages<T>([T; COUNT]);

impl<T> Stages<T> {
    /// The value of `stage`.
    pub fn of(&self, stage: Stage) -> &T {
        &self.0[stage as usize]
    }

    /// Each stage and its value, in order.
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

/// Measures the stages as they pass.
#[derive(Debug)]
pub(super) struct StageObserver {
    /// Times of each stage, microseconds.
    times_us: Vec<Histogram<u64>>,
    /// The first deadline.
    start: Option<Time>,
    cycles: u64,
    // State of the present cycle.
    deadline: Time,
    /// When the last stage ended.
    last: Time,
    took: Stages<Duration>,
    /// Usage at the end of the previous cycle; `None` before the second.
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
        // The first cycle allocates memory and requests real-time scheduling, while the robot is limp.
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

/// Two digits are enough to identify the slow stage, and leave the processor's cache to the stages.
fn histogram_of_stage() -> Histogram<u64> {
    match Histogram::new_with_bounds(1, LONGEST_US, 2) {
        Ok(histogram) => histogram,
        // The bounds above are valid; a histogram with other bounds would serve as well.
        Err(_) => unreachable!("constant bounds"),
    }
}

impl Telemetry {
    /// Notes that a cycle with this `deadline` begins `now`.
    pub fn begin_cycle(&mut self, deadline: Time, now: Time) {
        self.stages.begin(deadline, now);
    }

    /// Notes that `stage` ends `now`; it began when the previous stage ended.
    pub fn end_stage(&mut self, stage: Stage, now: Time) {
        self.stages.note(stage, now);
    }

    /// Notes that all stages of the cycle are over; `usage` is what the loop's thread has used so far.
    pub fn end_cycle(&mut self, usage: Usage) {
        self.stages.end(usage);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a cycle with this deadline, ms, whose stages take these times, ms, and whose thread has this usage.
    fn cycle(observer: &mut StageObserver, deadline_ms: u64, took_ms: &[(Stage, u64)], usage: Usage) {
        let at = |ms: u64| Time(1_000_000 * ms);
        let mut now_ms = deadline_ms;
        for stage in Stage::ALL {
            now_ms += took_ms.iter().filter(|(of, _)| *of == stage).map(|(_, ms)| ms).sum::<u64>();
            match stage {
                Stage::Wake => observer.begin(at(deadline_ms), at(now_ms)),
                stage => observer.note(stage, at(now_ms)),
            }
        }
        observer.end(usage);
    }

    fn usage(processor_ms: u64, waited_ms: u64, page_faults: u64) -> Usage {
        let [processor, waited] = [processor_ms, waited_ms].map(Duration::from_millis);
        Usage { processor, waited: Some(waited), page_faults, disk_faults: 1 }
    }

    #[test]
    fn the_slowest_cycle_is_kept_stage_by_stage_and_the_first_aside() {
        let mut observer = StageObserver::new();
        cycle(&mut observer, 500, &[(Stage::Orders, 900)], usage(5, 2, 70));
        let rest = (Stage::Exchange, 5);
        cycle(&mut observer, 1500, &[rest, (Stage::Wake, 1)], usage(6, 2, 70));
        cycle(&mut observer, 1510, &[rest, (Stage::Wake, 2), (Stage::Kinematics, 720)], usage(8, 721, 74));
        cycle(&mut observer, 2240, &[rest, (Stage::Safety, 1)], usage(9, 721, 74));
        let slowest = observer.slowest().unwrap();
        assert_eq!((slowest.number, slowest.total_us), (2, 727_000));
        assert!((slowest.time_s - 1.01).abs() < 1e-9, "{slowest:?}");
        assert_eq!(slowest.longest(), (Stage::Kinematics, 720_000));
        let all = slowest.stages_us.iter().filter(|(_, us)| **us > 0).map(|(stage, us)| (stage.name(), *us));
        assert_eq!(all.collect::<Vec<_>>(), [("wake", 2000), ("kinematics", 720_000), ("exchange", 5000)]);
        assert_eq!((slowest.processor_us, slowest.waited_us), (2000, Some(719_000)));
        assert_eq!((slowest.page_faults, slowest.disk_faults), (4, 0));
        assert_eq!(
            slowest.to_string(),
            "slowest cycle: number 2 at 1.0 s took 727000 us, 720000 of them kinematics; others had the processor for \
             719000 us of it, the loop for 2000 us, with 4 page faults"
        );
        assert_eq!(observer.first().unwrap().longest(), (Stage::Orders, 900_000));
        let quantiles = observer.quantiles();
        assert_eq!(quantiles.of(Stage::Yielding).max, 0);
        // Two digits.
        let max_us = quantiles.of(Stage::Kinematics).max;
        assert!((716_000..=728_000).contains(&max_us), "{max_us}");
    }

    #[test]
    fn an_exchange_is_the_longest_only_where_it_is_more_than_all_the_rest() {
        let mut observer = StageObserver::new();
        for (sag_ms, expected) in [(4, Stage::Exchange), (6, Stage::Sag)] {
            cycle(&mut observer, 0, &[(Stage::Exchange, 5), (Stage::Sag, sag_ms)], Usage::default());
            cycle(&mut observer, 20, &[(Stage::Exchange, 5), (Stage::Sag, sag_ms)], Usage::default());
            assert_eq!(observer.slowest().unwrap().longest().0, expected);
        }
    }

    #[test]
    fn a_report_names_each_stage_once() {
        let json = serde_json::to_value(Stages::<u64>::default()).unwrap();
        assert_eq!(json.as_object().unwrap().len(), Stage::ALL.len());
        assert_eq!(json["recording"], 0);
    }
}
