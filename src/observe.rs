//! Observers of a run: their trait, the record that they get of each cycle, and the end of the run.
//!
//! An observer does not change the motion of the robot; it may only ask that the run stops. An observer with much to do
//! passes its data over a bounded channel to a thread of its own, as the recorder and the status line do.

use std::time::Duration;

use serde::Serialize;

use crate::bus::{BusStatistics, ServoGoal, Slot};
use crate::motion::{Activity, FailedRise, Order};
use crate::reflex::ReflexReport;
use crate::safety::Finding;
use crate::signals::{ImuReading, JointTargets, State, Status, Targets, TrueBody};
use crate::stopwatch::{LoopReport, Stage};
use crate::units::Time;

/// Looks on at a run.
pub trait Observer {
    /// Looks at a cycle that is over. The loop calls this once a cycle, so it must not block, nor allocate after the
    /// first cycle.
    fn observe(&mut self, cycle: &CycleRecord<'_>);

    /// The stage of the cycle to which the time of [`Observer::observe`] counts.
    fn stage(&self) -> Stage {
        Stage::Telemetry
    }

    /// Why the run has lost its purpose and should stop, in words that fit after "because"; `None` while it may go on.
    fn objection(&self) -> Option<&'static str> {
        None
    }

    /// Gets the end of the run, once the robot has stopped and waiting does no harm. May change `end` to a worse one.
    /// Observers get it in the order in which they were attached. `has_stopped_run` is true if the objection of this
    /// observer is the reason in `end`.
    fn end(&mut self, _end: &mut End, _has_stopped_run: bool) {}
}

/// One cycle, as the observers see it.
#[derive(Debug, Clone, Copy)]
pub struct CycleRecord<'a> {
    /// Its plain values.
    pub facts: Facts,
    /// The robot as the operator saw it when he gave the order of this cycle.
    pub status: Status,
    /// The generator's targets.
    pub targets: &'a Targets,
    /// The result of inverse kinematics.
    pub joints: &'a JointTargets,
    /// The goal registers that were sent, one per joint.
    pub goals: &'a [ServoGoal],
    /// The replies of the servos, one slot per joint.
    pub slots: &'a [Slot],
    /// The estimated state of the robot after the exchange.
    pub state: &'a State,
    /// Each bus after the exchange; empty without buses.
    pub buses: &'a [BusFacts],
}

/// The plain values of a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facts {
    /// When it was, and how long its parts took; all zero without buses.
    pub times: CycleTimes,
    /// Length of a cycle, s.
    pub dt_s: f64,
    /// The operator's order.
    pub order: Order,
    /// The robot's activity.
    pub activity: Activity,
    /// Present gait of a horse, index into [`crate::model::HorseMotion::gaits`]; `None` while it takes no steps.
    pub gait: Option<usize>,
    /// True while a horse changes from one gait to another.
    pub is_changing_gait: bool,
    /// Name of the arms' stroke; `None` for a horse, and at rest.
    pub stroke: Option<&'static str>,
    /// Present or next pose of a figure, index into [`crate::model::FigureMotion::poses`].
    pub pose: Option<usize>,
    /// Planned speed of the trunk, m/s.
    pub speed_m_s: f64,
    /// Planned yaw rate of the trunk, rad/s, positive to the left.
    pub yaw_rate_rad_s: f64,
    /// The last reading of the inertial measurement unit.
    pub imu: ImuReading,
    /// True if motion time stood still in this cycle.
    pub is_held: bool,
    /// Joints whose goal safety changed.
    pub interventions: u32,
    /// The last cause for which safety held or stopped the robot; `None` if it has done neither so far.
    pub cause: Option<Finding>,
    /// Restarts of tripped servos so far.
    pub servo_restarts: u64,
    /// Falls so far; `None` if the robot file does not mention them.
    pub falls: Option<ReflexReport>,
    /// How it failed to rise, if it did.
    pub failed_rise: Option<FailedRise>,
    /// How often an arm gave way to a load so far; `None` if the robot file does not mention that.
    pub arm_yields: Option<u32>,
    /// The true state of the trunk; only a simulated body reports it.
    pub truth: Option<TrueBody>,
}

/// When a cycle was, and how long its parts took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CycleTimes {
    /// Number of cycles before it in this run.
    pub number: u64,
    /// When it began.
    pub began: Time,
    /// How late that was after its deadline.
    pub late: Duration,
    /// Time since the cycle before began; for the first cycle, one period.
    pub gap: Duration,
    /// Computing time, without the exchange.
    pub work: Duration,
    /// Time of the exchange; all buses run at the same time.
    pub exchange: Duration,
}

/// One bus after a cycle. Counts are since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BusFacts {
    /// Exchanges begun, including those that could not be sent.
    pub exchanges: u64,
    /// Exchanges that were sent.
    pub sent: u64,
    /// Time of the last of these.
    pub exchange: Duration,
    /// Bytes sent.
    pub bytes_out: u64,
    /// Bytes received.
    pub bytes_in: u64,
    /// Missing replies.
    pub missing: u64,
    /// Corrupt replies.
    pub corrupt: u64,
    /// Good replies from ids that were not asked.
    pub unknown: u64,
    /// True if its port was gone when last used.
    pub is_gone: bool,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The run did what was asked, or the operator stopped it; it ended in its stop action.
    Completed,
    /// Safety stopped the run.
    StoppedBySafety,
    /// The robot fell, and lies limp.
    Fallen,
    /// Something else ended the run.
    Failed,
}

/// The end of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct End {
    /// Kind of end.
    pub outcome: Outcome,
    /// Reason for that outcome.
    pub reason: String,
    /// True if every servo has heard the end: then no servo has torque that it should not have.
    pub is_heard: bool,
    /// Duration of the run.
    pub duration: Duration,
    /// Cycles completed.
    pub cycles: u64,
    /// Cycles that began late.
    pub late_cycles: u64,
    /// Timing of the loop.
    pub loop_times: LoopReport,
    /// The last facts.
    pub facts: Facts,
    /// Each bus.
    pub buses: Vec<BusFacts>,
    /// The recording; `None` until an observer has made one.
    pub recording: Option<RecordingReport>,
}

/// The report of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RecordingReport {
    /// Name of the file.
    pub file: String,
    /// Cycles in the file.
    pub records: u64,
    /// Cycles missing from the file: the disk was too slow, or an error had ended the recording.
    pub dropped: u64,
    /// The error that ended the recording before the run.
    pub error: Option<String>,
}

impl Facts {
    /// Facts of a limp robot before the first cycle, of this length.
    pub fn limp(dt_s: f64) -> Facts {
        Facts {
            times: CycleTimes::default(),
            dt_s,
            order: Order::Go,
            activity: Activity::Limp,
            gait: None,
            is_changing_gait: false,
            stroke: None,
            pose: None,
            speed_m_s: 0.0,
            yaw_rate_rad_s: 0.0,
            imu: ImuReading::default(),
            is_held: false,
            interventions: 0,
            cause: None,
            servo_restarts: 0,
            falls: None,
            failed_rise: None,
            arm_yields: None,
            truth: None,
        }
    }
}

impl From<BusStatistics<'_>> for BusFacts {
    fn from(bus: BusStatistics<'_>) -> BusFacts {
        BusFacts {
            exchanges: bus.counters.exchanges,
            sent: bus.times.count,
            exchange: bus.times.last,
            bytes_out: bus.counters.bytes_out,
            bytes_in: bus.counters.bytes_in,
            missing: bus.counters.missing,
            corrupt: bus.counters.corrupt,
            unknown: bus.unknown_replies,
            is_gone: bus.is_gone,
        }
    }
}

impl Outcome {
    /// The word used in reports.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Completed => "completed",
            Outcome::StoppedBySafety => "stopped-by-safety",
            Outcome::Fallen => "fallen",
            Outcome::Failed => "failed",
        }
    }
}
