//! Observes a run: looks at every cycle as it passes, and produces a [`Report`] at the end.
//!
//! The observers check the pipeline from outside: goal registers against the robot's ranges, feet from
//! the targets and from the measured joints. They change nothing and allocate nothing after the start.

mod arms;
mod body;
mod buses;
mod feet;
mod imu;
mod joints;
mod report;
mod stages;
mod verdict;
mod way;

use crate::bus::{BusStatistics, ServoGoal, Slot};
use crate::model::Robot;
use crate::motion::{Activity, Order};
use crate::signals::{ImuReading, JointTargets, Outage, State, Targets, TrueBody};
use arms::ArmObserver;
use body::BodyObserver;
use buses::BusObserver;
use feet::FootObserver;
use hdrhistogram::Histogram;
use imu::ImuObserver;
pub use imu::ImuReport;
use joints::JointObserver;
pub use report::{
    ArmsReport, BodyReport, BusReport, FeetReport, JointsReport, LoopReport, OutageReport, Outcome,
    Quantiles, RecordingReport, Report,
};
use stages::StageObserver;
pub use stages::{SlowCycle, Stage, Stages};
pub use verdict::{INCOMPLETE, Verdict, VerdictFinding, findings};
pub use way::{Followed, Walked, Way};

/// One cycle, as the observers see it.
#[derive(Debug, Clone, Copy)]
pub struct CycleRecord<'a> {
    /// The operator's order.
    pub order: Order,
    /// The robot's activity.
    pub activity: Activity,
    /// Planned speed of the trunk, m/s.
    pub speed_m_s: f64,
    /// The generator's targets.
    pub targets: &'a Targets,
    /// The result of inverse kinematics.
    pub joints: &'a JointTargets,
    /// The goal registers that were sent, one per joint.
    pub goals: &'a [ServoGoal],
    /// The replies of the servos, one slot per joint.
    pub slots: &'a [Slot],
    /// The last reading of the inertial measurement unit.
    pub imu: &'a ImuReading,
    /// The estimated state of the robot after the exchange.
    pub state: &'a State,
    /// Joints whose goal safety changed.
    pub interventions: u32,
    /// True if motion time stood still in this cycle.
    pub is_held: bool,
    /// Length of a cycle, s.
    pub dt_s: f64,
    /// The true state of the trunk; only a simulated body reports it.
    pub truth: Option<TrueBody>,
}

/// Observes a whole run.
#[derive(Debug)]
pub struct Telemetry {
    buses: BusObserver,
    /// `None` on a rig without feet.
    feet: Option<FootObserver>,
    /// `None` on a rig without arms.
    arms: Option<ArmObserver>,
    /// `None` on a rig without feet.
    body: Option<BodyObserver>,
    joints: JointObserver,
    /// `None` on a robot without an inertial measurement unit.
    imu: Option<ImuObserver>,
    cycles: u64,
    late_cycles: u64,
    interventions: u64,
    held_cycles: u64,
    residual_max_m: f64,
    outages: Vec<(u64, Outage)>,
    work_us: Histogram<u64>,
    late_us: Histogram<u64>,
    stages: StageObserver,
}

/// Outages kept one by one; a run of many hours may have more.
const OUTAGES_MAX: usize = 256;

/// Longest time that a histogram distinguishes, microseconds.
const LONGEST_US: u64 = 60_000_000;

/// A histogram of microseconds that never grows.
pub(crate) fn histogram_us() -> Histogram<u64> {
    match Histogram::new_with_bounds(1, LONGEST_US, 3) {
        Ok(histogram) => histogram,
        // The bounds above are valid; a histogram with other bounds would serve as well.
        Err(_) => unreachable!("constant bounds"),
    }
}

impl Telemetry {
    /// Telemetry for a run of `robot`.
    pub fn new(robot: &Robot) -> Telemetry {
        // Simulated joints that turn freely have no trunk, whatever the robot estimates.
        let has_body = robot.motion.is_on_legs() && robot.bears_weight;
        Telemetry {
            buses: BusObserver::new(robot),
            feet: robot.motion.is_on_legs().then(|| FootObserver::new(robot)),
            arms: robot.motion.tentacle().map(|tentacle| ArmObserver::new(robot, tentacle)),
            body: has_body.then(|| BodyObserver::new(robot)),
            joints: JointObserver::new(robot),
            imu: ImuObserver::new(robot),
            cycles: 0,
            late_cycles: 0,
            interventions: 0,
            held_cycles: 0,
            residual_max_m: 0.0,
            outages: Vec::with_capacity(OUTAGES_MAX),
            work_us: histogram_us(),
            late_us: histogram_us(),
            stages: StageObserver::new(),
        }
    }

    /// Looks at one cycle.
    pub fn observe(&mut self, robot: &Robot, record: &CycleRecord<'_>) {
        self.cycles += 1;
        self.interventions += u64::from(record.interventions);
        self.held_cycles += u64::from(record.is_held);
        for residual_m in &record.joints.residual_m {
            self.residual_max_m = self.residual_max_m.max(*residual_m);
        }
        if let Some(outage) = record.state.outage
            && self.outages.len() < OUTAGES_MAX
        {
            self.outages.push((self.cycles, outage));
        }
        self.joints.observe(robot, record);
        self.buses.observe_replies(robot, record);
        if let Some(imu) = &mut self.imu {
            imu.observe(record);
        }
        if let Some(arms) = &mut self.arms {
            arms.observe(robot, record);
        }
        if let Some(feet) = &mut self.feet {
            feet.observe(robot, record);
        }
        if let Some(body) = &mut self.body {
            body.observe(record);
        }
    }

    /// Notes that the next cycle does not follow the last: checks from one cycle to the next restart.
    pub fn note_gap(&mut self) {
        self.joints.note_gap();
        if let Some(feet) = &mut self.feet {
            feet.note_gap();
        }
        if let Some(body) = &mut self.body {
            body.note_gap();
        }
    }

    /// Looks at the buses after a cycle's exchange.
    pub fn observe_buses<'s>(&mut self, buses: impl Iterator<Item = BusStatistics<'s>>) {
        self.buses.observe(buses);
    }

    /// Notes how late a cycle began after its deadline, and whether that counts as late.
    pub fn note_lateness(&mut self, late_us: u64, is_late: bool) {
        self.late_us.saturating_record(late_us);
        self.late_cycles += u64::from(is_late);
    }

    /// Notes the computing time of a cycle, without the exchange.
    pub fn note_work(&mut self, work_us: u64) {
        self.work_us.saturating_record(work_us);
    }
}
