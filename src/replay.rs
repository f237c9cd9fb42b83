//! Judges a recording again: checks its invariants from the recorded data, and runs the controller again on the
//! recorded replies, which must produce the same goals.
//!
//! Takes the cycles of a recording, one after the other, into a [`Judge`]. Returns a [`Replay`]. Invariants are
//! checked in every recorded cycle. The controller runs up to the first missing cycle: the servos' replies in that
//! cycle are unknown, and everything the controller does later depends on them.

use std::ops::RangeInclusive;

use crate::bus::ServoGoal;
use crate::cycle::Controller;
use crate::ik::Method;
use crate::kinds::{self, CapabilityError, TaskError};
use crate::model::Robot;
use crate::motion::Plan;
use crate::observe::Observer;
use crate::recording::{Ending, Recording, RunHeader, Sample};
use crate::telemetry::{BodyReport, FeetReport, JointsReport, Telemetry};

/// Furthest a planned stance foot may be from its touch-down, m: rounding.
const SLIP_MAX_M: f64 = 1e-9;
/// Largest residual of a tip from its target in inverse kinematics with the finish, m.
const RESIDUAL_MAX_M: f64 = 1e-6;

/// Result of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// Cycles in the recording; all are checked from the recorded data.
    pub cycles: u64,
    /// Numbers of the cycles that ran but are missing from the recording, as far as it shows: only the first gaps.
    pub gaps: Vec<RangeInclusive<u64>>,
    /// Number of gaps.
    pub gap_count: u64,
    /// Number of cycles in the gaps.
    pub dropped: u64,
    /// Number of recorded cycles that the controller ran again: those before the first gap.
    pub cycles_run_again: u64,
    /// True if the recording ends before the run did: the rest of the run is unknown.
    pub is_cut_short: bool,
    /// Joints, from the recorded goals and measurements.
    pub joints: JointsReport,
    /// Feet, from the recorded targets and measurements.
    pub feet: Option<FeetReport>,
    /// The trunk, if its true state was recorded.
    pub body: Option<BodyReport>,
    /// Violated invariants, in words.
    pub violations: Vec<String>,
    /// First difference between the recorded controller and the one run again.
    pub difference: Option<Difference>,
}

/// The point where a run and its replay differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Number of the cycle.
    pub cycle: u64,
    /// Start of the cycle, s of the run.
    pub time_s: f64,
    /// The joint; `None` if the difference concerns the whole robot.
    pub joint: Option<usize>,
    /// The recorded and the new value, in words.
    pub what: String,
}

impl Replay {
    /// True if everything that could be checked holds and nothing differs.
    pub fn agrees(&self) -> bool {
        self.violations.is_empty() && self.difference.is_none()
    }

    /// True if every cycle of the run was checked in every way.
    pub fn is_complete(&self) -> bool {
        self.gap_count == 0 && !self.is_cut_short
    }
}

/// Why a controller cannot be run again.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The robot cannot do what its file says.
    #[error(transparent)]
    Capability(#[from] CapabilityError),
    /// The robot cannot do the recording's task.
    #[error("the recording's run.json: {0}")]
    Task(#[from] TaskError),
}

/// Most gaps that are kept one by one; a recording of many hours may have more.
const GAPS_KEPT: usize = 100;

/// Judges the cycles of one recording.
pub struct Judge<'r> {
    robot: &'r Robot,
    ik: Method,
    controller: Controller<'r>,
    telemetry: Telemetry<'r>,
    gaps: Vec<RangeInclusive<u64>>,
    gap_count: u64,
    dropped: u64,
    /// Number of the next expected cycle.
    next: u64,
    cycles_run_again: u64,
    has_truth: bool,
    difference: Option<Difference>,
}

impl<'r> Judge<'r> {
    /// A judge for a recording of `robot` with this `header`.
    ///
    /// # Errors
    /// If the recorded run cannot be set up from them.
    pub fn new(robot: &'r Robot, header: &RunHeader) -> Result<Judge<'r>, ReplayError> {
        Ok(Judge {
            robot,
            ik: header.ik,
            controller: Controller::new(robot, plan(robot, header)?, header.ik, header.walk_for_s),
            telemetry: Telemetry::new(robot),
            gaps: Vec::new(),
            gap_count: 0,
            dropped: 0,
            next: 0,
            cycles_run_again: 0,
            has_truth: false,
            difference: None,
        })
    }

    /// Judges the next cycle; cycle numbers rise.
    pub fn look(&mut self, sample: &Sample) {
        let number = sample.facts.times.number;
        if number > self.next {
            self.note_gap(self.next..=number - 1);
            self.telemetry.note_gap();
        }
        self.next = number.saturating_add(1);
        self.has_truth |= sample.facts.truth.is_some();
        self.telemetry.observe(&sample.record());
        if self.gap_count == 0 {
            self.cycles_run_again += 1;
            // After the first difference everything may differ.
            if self.difference.is_none() {
                self.difference = run_again(self.robot, &mut self.controller, sample);
            }
        }
    }

    fn note_gap(&mut self, gap: RangeInclusive<u64>) {
        self.gap_count += 1;
        self.dropped = self.dropped.saturating_add(gap.end() - gap.start()).saturating_add(1);
        if self.gaps.len() < GAPS_KEPT {
            self.gaps.push(gap);
        }
    }

    /// The verdict on a recording with this `ending`.
    pub fn end(mut self, ending: &Ending) -> Replay {
        if ending.cycles() > self.next {
            self.note_gap(self.next..=ending.cycles() - 1);
        }
        let (joints, feet) = (self.telemetry.joints_report(), self.telemetry.feet_report());
        Replay {
            cycles: self.telemetry.cycles(),
            gaps: self.gaps,
            gap_count: self.gap_count,
            dropped: self.dropped,
            cycles_run_again: self.cycles_run_again,
            is_cut_short: matches!(ending, Ending::CutShort { .. }),
            joints,
            feet,
            body: self.telemetry.body_report().filter(|_| self.has_truth),
            violations: violations(&joints, feet.as_ref(), self.ik),
            difference: self.difference,
        }
    }
}

/// Judges a `recording` in memory.
///
/// # Errors
/// The same as [`Judge::new`].
pub fn replay(recording: &Recording) -> Result<Replay, ReplayError> {
    let mut judge = Judge::new(&recording.robot, &recording.header)?;
    recording.samples.iter().for_each(|sample| judge.look(sample));
    Ok(judge.end(&recording.ending))
}

fn plan(robot: &Robot, header: &RunHeader) -> Result<Plan, ReplayError> {
    Ok(kinds::of(robot)?.plan_of_task(robot, &header.task)?)
}

/// Runs one cycle of the controller on the recorded replies; returns the first difference from the recorded cycle.
fn run_again(robot: &Robot, controller: &mut Controller<'_>, sample: &Sample) -> Option<Difference> {
    let gap_s = sample.facts.times.gap.as_secs_f64();
    controller.decide(gap_s, sample.facts.order);
    controller.learn(gap_s, &sample.slots, &sample.facts.imu);
    let now = controller.record(&sample.slots);
    let difference = |joint, what| {
        Some(Difference {
            cycle: sample.facts.times.number,
            time_s: sample.facts.times.began.as_secs_f64(),
            joint,
            what,
        })
    };
    for (joint, (recorded, again)) in sample.goals.iter().zip(now.goals).enumerate() {
        if recorded != again {
            let what = format!("recorded goal {}, now {}", describe(recorded), describe(again));
            return difference(Some(joint), what);
        }
    }
    for (joint, (recorded, again)) in sample.state.joints.iter().zip(&now.state.joints).enumerate() {
        let has_servo = robot.joints[joint].servo.is_some();
        if has_servo && recorded.position_rad.to_bits() != again.position_rad.to_bits() {
            let what = format!(
                "recorded as measured at {:.4} degrees, but the recorded reply means {:.4}",
                recorded.position_rad.to_degrees(),
                again.position_rad.to_degrees()
            );
            return difference(Some(joint), what);
        }
    }
    if (sample.facts.activity, sample.state.permission) != (now.facts.activity, now.state.permission) {
        let what = format!(
            "recorded {:?} with permission {:?}, now {:?} with permission {:?}",
            sample.facts.activity, sample.state.permission, now.facts.activity, now.state.permission
        );
        return difference(None, what);
    }
    None
}

fn describe(goal: &ServoGoal) -> String {
    match goal {
        ServoGoal::Limp => "limp".to_owned(),
        ServoGoal::Keep => "its last goal".to_owned(),
        ServoGoal::Move { position, torque_limit } => {
            format!("count {position} with torque limit {torque_limit}")
        }
    }
}

fn violations(joints: &JointsReport, feet: Option<&FeetReport>, ik: Method) -> Vec<String> {
    let mut found = Vec::new();
    if joints.range_violations > 0 {
        found.push(format!("{} goals outside their joint's range", joints.range_violations));
    }
    if joints.rate_violations > 0 {
        found.push(format!(
            "{} goals further from the one before than the rate limit",
            joints.rate_violations
        ));
    }
    let Some(feet) = feet else { return found };
    if feet.stance_slip_planned_max_m > SLIP_MAX_M {
        found.push(format!(
            "a standing foot planned to slip by {:.3} mm",
            feet.stance_slip_planned_max_m * 1e3
        ));
    }
    if feet.swing_velocity_jump_max_m_s > 0.0 {
        found.push(format!("a foot's planned velocity jumps by {:.4} m/s", feet.swing_velocity_jump_max_m_s));
    }
    if ik == Method::CcdThenFinish && feet.ik_residual_max_m > RESIDUAL_MAX_M {
        found.push(format!("inverse kinematics left {:.4} mm", feet.ik_residual_max_m * 1e3));
    }
    found
}
