//! Observes a run: looks at every cycle as it passes, and produces a [`Report`] at the end.
//!
//! Its parts check the pipeline from outside: goal registers against the robot's ranges, feet from
//! the targets and from the measured joints. They change nothing and allocate nothing after the start.

mod arms;
mod body;
mod buses;
mod feet;
mod imu;
mod joints;
mod report;
mod verdict;
mod way;

use crate::model::Robot;
use crate::observe::{CycleRecord, End, Observer};
pub use crate::observe::{Outcome, RecordingReport};
use crate::plan::RunPlan;
use crate::signals::Outage;
pub use crate::stopwatch::{LoopReport, Quantiles};
use arms::ArmObserver;
use body::BodyObserver;
use buses::BusObserver;
use feet::FootObserver;
use imu::ImuObserver;
pub use imu::ImuReport;
use joints::JointObserver;
pub use report::{ArmsReport, BodyReport, BusReport, FeetReport, JointsReport, OutageReport, Report};
pub use verdict::{INCOMPLETE, Verdict, VerdictFinding, findings};
pub use way::{Followed, GroundPath, WalkTotals};

/// Observes a whole run.
#[derive(Debug)]
pub struct Telemetry<'r> {
    robot: &'r Robot,
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
    interventions: u64,
    held_cycles: u64,
    residual_max_m: f64,
    outages: Vec<(u64, Outage)>,
}

/// Outages kept one by one; a run of many hours may have more.
const OUTAGES_MAX: usize = 256;

impl<'r> Telemetry<'r> {
    /// Telemetry for a run of `robot`.
    pub fn new(robot: &'r Robot) -> Telemetry<'r> {
        // Simulated joints that turn freely have no trunk, whatever the robot estimates.
        let has_body = robot.motion.is_on_legs() && robot.bears_weight;
        Telemetry {
            robot,
            buses: BusObserver::new(robot),
            feet: robot.motion.is_on_legs().then(|| FootObserver::new(robot)),
            arms: robot.motion.tentacle().map(|tentacle| ArmObserver::new(robot, tentacle)),
            body: has_body.then(|| BodyObserver::new(robot)),
            joints: JointObserver::new(robot),
            imu: ImuObserver::new(robot),
            cycles: 0,
            interventions: 0,
            held_cycles: 0,
            residual_max_m: 0.0,
            outages: Vec::with_capacity(OUTAGES_MAX),
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

    /// Number of cycles so far.
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// Joints so far.
    pub fn joints_report(&self) -> JointsReport {
        self.joints.report()
    }

    /// Feet so far; `None` on a rig of arms.
    pub fn feet_report(&self) -> Option<FeetReport> {
        let feet = self.feet.as_ref()?;
        Some(FeetReport { ik_residual_max_m: self.residual_max_m, ..feet.report() })
    }

    /// The trunk so far; `None` on a rig of arms, and if nothing measured its motion.
    pub fn body_report(&self) -> Option<BodyReport> {
        self.body.as_ref()?.report()
    }

    /// The report of a run by `plan` that ended with `end`.
    pub fn report(&self, plan: &RunPlan, end: End) -> Report {
        let (gait, speed_m_s) = plan.gait_and_speed();
        let outage = |(cycle, outage): &(u64, Outage)| OutageReport {
            time_s: *cycle as f64 * self.robot.period_s(),
            joint: self.robot.joints[outage.joint].name.clone(),
            reason: outage.describe(self.robot),
        };
        let walked = self.body.as_ref().and_then(BodyObserver::walked);
        let report = Report {
            robot: self.robot.name.clone(),
            driver: plan.driver.clone(),
            gait,
            speed_m_s,
            duration_s: end.duration.as_secs_f64(),
            cycles: end.cycles,
            late_cycles: end.late_cycles,
            outcome: end.outcome,
            reason: end.reason,
            verdict: Verdict::Good,
            findings: Vec::new(),
            walked_s: walked.map(|walked| walked.time_s),
            asked: walked.map(|walked| walked.asked),
            reached: walked.map(|walked| walked.reached),
            is_end_heard: end.is_heard,
            safety_interventions: self.interventions,
            held_cycles: self.held_cycles,
            loop_times: end.loop_times,
            joints: self.joints_report(),
            feet: self.feet_report(),
            body: self.body_report(),
            arms: self.arms.as_ref().map(ArmObserver::report),
            imu: self.imu.as_ref().map(ImuObserver::report),
            falls: end.facts.falls,
            arm_yields: end.facts.arm_yields,
            outages: self.outages.iter().map(outage).collect(),
            servo_restarts: end.facts.servo_restarts,
            buses: self.buses.report(self.robot, end.duration, &end.buses),
            recording: end.recording,
        };
        report.judged(self.robot, walked)
    }

    /// Goals that safety must never let through, in words; `None` if there were no such goals.
    fn violations(&self) -> Option<String> {
        let JointsReport { range_violations, rate_violations, .. } = self.joints_report();
        (range_violations + rate_violations > 0).then(|| {
            format!(
                "{range_violations} goals were outside their range and {rate_violations} too fast: this is a defect of the \
                 program, please report it with the robot file"
            )
        })
    }
}

impl Observer for Telemetry<'_> {
    fn observe(&mut self, cycle: &CycleRecord<'_>) {
        self.cycles += 1;
        self.interventions += u64::from(cycle.facts.interventions);
        self.held_cycles += u64::from(cycle.facts.is_held);
        for residual_m in &cycle.joints.residual_m {
            self.residual_max_m = self.residual_max_m.max(*residual_m);
        }
        if let Some(outage) = cycle.state.outage
            && self.outages.len() < OUTAGES_MAX
        {
            self.outages.push((self.cycles, outage));
        }
        self.joints.observe(self.robot, cycle);
        self.buses.observe(self.robot, cycle);
        if let Some(imu) = &mut self.imu {
            imu.observe(cycle);
        }
        if let Some(arms) = &mut self.arms {
            arms.observe(self.robot, cycle);
        }
        if let Some(feet) = &mut self.feet {
            feet.observe(self.robot, cycle);
        }
        if let Some(body) = &mut self.body {
            body.observe(cycle);
        }
    }

    /// A robot that lies fallen has not completed its run, nor has one with goals that safety must never let through.
    fn end(&mut self, end: &mut End, _has_stopped_run: bool) {
        if end.outcome == Outcome::Completed && self.body.as_ref().is_some_and(BodyObserver::lies_fallen) {
            end.outcome = Outcome::Fallen;
            end.reason = "it fell and did not get up: set it on its feet and start it again".to_owned();
        }
        if let Some(violations) = self.violations() {
            end.outcome = Outcome::Failed;
            end.reason = format!("{violations}; {}", end.reason);
        }
    }
}
