//! A recording judged again: its invariants from what was recorded, and the controller run anew on the
//! recorded replies, which must send the same goals.
//!
//! Comes in: the cycles of a recording, one after the other, into a [`Judge`]. Goes out: a [`Replay`]. Invariants are
//! checked in every recorded cycle. The controller is run up to the first cycle that is not there: what the servos said
//! in it is not known, and everything the controller does later depends on it.

use std::ops::RangeInclusive;

use crate::bus::ServoGoal;
use crate::capability::{FigureCapability, HorseCapability, PoseError, ReachError, TentacleCapability};
use crate::cycle::Controller;
use crate::ik::Method;
use crate::model::{Motion, Robot};
use crate::motion::Plan;
use crate::recording::{Ending, Recording, RunHeader, Sample, Task, gait_is_of};
use crate::telemetry::{BodyReport, FeetReport, JointsReport, Telemetry};

/// Furthest a planned standing foot may be from where it landed, m: rounding.
const SLIP_MAX_M: f64 = 1e-9;
/// Furthest a tip may be left from its target with the finish, m.
const RESIDUAL_MAX_M: f64 = 1e-6;

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// Cycles in the recording, all judged by what was recorded of them.
    pub cycles: u64,
    /// Numbers of the cycles that were run and are not in the recording, as far as it tells: the first so many gaps.
    pub gaps: Vec<RangeInclusive<u64>>,
    /// How many gaps there are.
    pub gap_count: u64,
    /// How many cycles are in them.
    pub dropped: u64,
    /// How many of the recorded cycles the controller ran again: those before the first gap.
    pub cycles_run_again: u64,
    /// True if the recording ends before the run did: what came then is not known.
    pub is_cut_short: bool,
    /// Joints, from the recorded goals and measurements.
    pub joints: JointsReport,
    /// Feet, from the recorded targets and measurements.
    pub feet: Option<FeetReport>,
    /// The trunk, where what it truly did was recorded.
    pub body: Option<BodyReport>,
    /// What should have held and did not, in words.
    pub violations: Vec<String>,
    /// Where the controller run again first does something else.
    pub difference: Option<Difference>,
}

/// Where a run and its replay part.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Number of the cycle.
    pub cycle: u64,
    /// Its beginning, s of the run.
    pub time_s: f64,
    /// The joint; none when it is the robot as a whole.
    pub joint: Option<usize>,
    /// What was recorded and what came now, in words.
    pub what: String,
}

impl Replay {
    /// True if everything that could be judged holds and nothing differs.
    pub fn agrees(&self) -> bool {
        self.violations.is_empty() && self.difference.is_none()
    }

    /// True if every cycle of the run was judged in every way.
    pub fn is_complete(&self) -> bool {
        self.gap_count == 0 && !self.is_cut_short
    }
}

/// Why a controller cannot be run again.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The robot cannot do what its file says.
    #[error(transparent)]
    Reach(#[from] ReachError),
    /// Nor take its poses.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// The recording's pose is none of the robot's.
    #[error("the recording's run.json: a pose of an unknown name, {0}")]
    UnknownPose(String),
    /// The recording's gait is none of the robot's.
    #[error("the recording's run.json: a gait that its robot.toml does not have, {0}")]
    UnknownGait(String),
    /// The recording's strokes are none.
    #[error("the recording's run.json: {0}")]
    Strokes(&'static str),
    /// The recording says that a horse moved its arms, or that arms walked.
    #[error("the recording's run.json is not that of its robot.toml: they are of different kinds of motion")]
    OtherKind,
}

/// Gaps that are kept one by one; a recording of many hours may have more.
const GAPS_KEPT: usize = 100;

/// Judges the cycles of one recording.
pub struct Judge<'r> {
    robot: &'r Robot,
    ik: Method,
    controller: Controller<'r>,
    telemetry: Telemetry,
    gaps: Vec<RangeInclusive<u64>>,
    gap_count: u64,
    dropped: u64,
    /// Number of the cycle that is to come next.
    next: u64,
    cycles_run_again: u64,
    has_truth: bool,
    difference: Option<Difference>,
}

impl<'r> Judge<'r> {
    /// For a recording of `robot` with this `header`.
    ///
    /// # Errors
    /// When the recorded run cannot be set up from them.
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

    /// Judges the next cycle; their numbers rise.
    pub fn look(&mut self, sample: &Sample) {
        let number = sample.times.number;
        if number > self.next {
            self.note_gap(self.next..=number - 1);
            self.telemetry.note_gap();
        }
        self.next = number.saturating_add(1);
        self.has_truth |= sample.truth.is_some();
        self.telemetry.observe(self.robot, &sample.record());
        if self.gap_count == 0 {
            self.cycles_run_again += 1;
            // Behind the first difference everything may differ.
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

    /// The verdict on a recording that ends so.
    pub fn end(mut self, ending: &Ending) -> Replay {
        if ending.cycles() > self.next {
            self.note_gap(self.next..=ending.cycles() - 1);
        }
        let (joints, feet) = (self.telemetry.joints_report(), self.telemetry.feet_report());
        Replay {
            cycles: self.telemetry.totals().0,
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

/// Judges a `recording` that is in memory.
///
/// # Errors
/// As [`Judge::new`].
pub fn replay(recording: &Recording) -> Result<Replay, ReplayError> {
    let mut judge = Judge::new(&recording.robot, &recording.header)?;
    recording.samples.iter().for_each(|sample| judge.look(sample));
    Ok(judge.end(&recording.ending))
}

fn plan(robot: &Robot, header: &RunHeader) -> Result<Plan, ReplayError> {
    match (&robot.motion, &header.task) {
        (Motion::Horse(horse), Task::Horse { command, gait }) => {
            if !gait_is_of(command.gait, robot) {
                return Err(ReplayError::UnknownGait(gait.clone()));
            }
            Ok(HorseCapability::of(robot, horse)?.plan(horse, *command).into())
        }
        (Motion::Tentacle(tentacle), Task::Tentacle { strokes }) => {
            let command = strokes.try_into().map_err(ReplayError::Strokes)?;
            Ok(TentacleCapability::of(robot, tentacle).plan(robot, tentacle, command).into())
        }
        (Motion::Figure(figure), Task::Figure { pose: name }) => {
            let pose = figure.poses.iter().position(|pose| pose.name == *name);
            let pose = pose.ok_or_else(|| ReplayError::UnknownPose(name.clone()))?;
            Ok(FigureCapability::of(robot, figure)?.plan(pose).into())
        }
        (Motion::Horse(_) | Motion::Tentacle(_) | Motion::Figure(_), _) => Err(ReplayError::OtherKind),
    }
}

/// One cycle of the controller on the recorded replies; what it does otherwise than the recorded one did.
fn run_again(robot: &Robot, controller: &mut Controller<'_>, sample: &Sample) -> Option<Difference> {
    let gap_s = sample.times.gap.as_secs_f64();
    controller.decide(gap_s, sample.order);
    controller.learn(gap_s, &sample.slots, &sample.imu);
    let now = controller.record(&sample.slots);
    let difference = |joint, what| {
        Some(Difference { cycle: sample.times.number, time_s: sample.times.began.as_secs_f64(), joint, what })
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
    if (sample.activity, sample.state.permission) != (now.activity, now.state.permission) {
        let what = format!(
            "recorded {:?} with permission {:?}, now {:?} with permission {:?}",
            sample.activity, sample.state.permission, now.activity, now.state.permission
        );
        return difference(None, what);
    }
    None
}

fn describe(goal: &ServoGoal) -> String {
    match goal {
        ServoGoal::Limp => "limp".to_owned(),
        ServoGoal::Keep => "what it was told last".to_owned(),
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
