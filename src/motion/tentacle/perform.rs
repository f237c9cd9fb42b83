//! The part of a stroke that runs in the loop: what each file of a stroke fills.

use std::fmt;

use super::TentaclePlan;
use super::arm_plan::ArmPlan;
use crate::motion::StrokeCommand;
use crate::signals::{ArmTarget, State};

/// Slowest tempo of winding and of paths: it ensures that an arm lets go in the end.
pub(super) const TEMPO_MIN: f64 = 0.1;

/// The arms a performance is made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rig<'a> {
    pub(super) arms: &'a [ArmPlan],
    pub(super) plan: &'a TentaclePlan,
    /// Fastest tempo of the stroke, as a multiple of the robot file's.
    pub(super) tempo_max: f64,
}

/// One cycle of a performance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment<'a> {
    /// Length of the last cycle, s.
    pub(super) dt_s: f64,
    pub(super) state: &'a State,
    pub(super) arms: &'a [ArmPlan],
    /// The command; every number is finite.
    pub(super) command: StrokeCommand,
    /// True if the command asks for this stroke; false for one that ends before the next may begin.
    pub(super) is_asked: bool,
    /// True in the first cycle after another stroke, or after the arms were parked.
    pub(super) is_new: bool,
    /// True if the arms were on their way to the parked pose, or in it.
    pub(super) was_parked: bool,
    /// True if the joints have come to rest at their targets.
    pub(super) is_settled: bool,
}

/// What a stroke does with the arms in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    /// The arms go to the parked pose, or stay in it.
    Parks,
    /// A new motion begins at rest.
    Begins,
    /// The motion continues.
    Continues,
}

/// Performs one stroke. The joints blend from each motion to the next without a jump ([`crate::ik::HandOver`]).
pub(super) trait Perform: fmt::Debug + Send {
    /// Advances by a cycle.
    fn step(&mut self, moment: &Moment<'_>) -> Course;

    /// Writes the target of `arm`, number `index` of the arms, which stays parked where this writes nothing.
    /// `turn_rad` is the turn towards a goal on the left.
    fn write(&self, index: usize, arm: &ArmPlan, turn_rad: f64, target: &mut ArmTarget);

    /// Name of the stroke that it performs at present, in the operator's terms; not asked of parked arms.
    fn name(&self) -> &'static str;

    /// True if it must end by itself before another stroke may begin.
    fn must_end(&self) -> bool {
        false
    }

    /// True if an arm is wound round a pole: it must then not be moved away joint by joint.
    fn is_wound(&self) -> bool {
        false
    }
}

/// Performs the strokes in which arms stay parked.
#[derive(Debug)]
pub(super) struct Parked;

impl Perform for Parked {
    fn step(&mut self, _moment: &Moment<'_>) -> Course {
        Course::Parks
    }

    fn write(&self, _index: usize, _arm: &ArmPlan, _turn_rad: f64, _target: &mut ArmTarget) {}

    fn name(&self) -> &'static str {
        crate::motion::Stroke::REST.name
    }
}
