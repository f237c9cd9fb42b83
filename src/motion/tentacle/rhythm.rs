//! Strokes that repeat by phase: walking, swimming, swaying.

use std::f64::consts::TAU;
use std::fmt;

use super::arm_plan::ArmPlan;
use super::key_angles::KeyInterpolation;
use super::perform::{Course, Moment, Perform, Rig};
use crate::signals::ArmTarget;

/// Time in which strokes reach their tempo from rest, s.
const RAMP_S: f64 = 1.0;

/// One arm's part in a stroke.
pub(super) trait OfArm: fmt::Debug + Send {
    /// Writes the target of `arm` at `phase`, rad; one stroke is 2 pi. `turn_rad` is the turn towards a goal on the
    /// left.
    fn write(&self, arm: &ArmPlan, phase: f64, turn_rad: f64, target: &mut ArmTarget);
}

/// Performs a stroke that repeats, at the tempo of the command.
#[derive(Debug)]
pub(super) struct Rhythm<A> {
    name: &'static str,
    arms: Vec<A>,
    /// Rate of the phase at tempo 1, rad/s.
    full_rad_s: f64,
    tempo_max: f64,
    /// Phase of the stroke and its rate, rad and rad/s.
    phase: f64,
    rate_rad_s: f64,
}

impl<A: OfArm> Rhythm<A> {
    /// The stroke of this name, each arm in the part that `of_arm` gives it.
    pub(super) fn new(
        name: &'static str,
        rig: &Rig<'_>,
        of_arm: impl Fn(&ArmPlan, KeyInterpolation) -> A,
    ) -> Rhythm<A> {
        let settings = &rig.plan.settings;
        Rhythm {
            name,
            arms: rig.arms.iter().map(|arm| of_arm(arm, settings.between)).collect(),
            full_rad_s: TAU / settings.stroke_time_s,
            tempo_max: rig.tempo_max,
            phase: 0.0,
            rate_rad_s: 0.0,
        }
    }
}

impl<A: OfArm> Perform for Rhythm<A> {
    fn step(&mut self, moment: &Moment<'_>) -> Course {
        if moment.is_new {
            (self.phase, self.rate_rad_s) = (0.0, 0.0);
        }
        let tempo = moment.command.tempo.min(self.tempo_max);
        let step = self.full_rad_s * moment.dt_s / RAMP_S;
        self.rate_rad_s += (tempo * self.full_rad_s - self.rate_rad_s).clamp(-step, step);
        self.phase += self.rate_rad_s * moment.dt_s;
        if moment.is_new { Course::Begins } else { Course::Continues }
    }

    fn write(&self, index: usize, arm: &ArmPlan, turn_rad: f64, target: &mut ArmTarget) {
        if let Some(part) = self.arms.get(index) {
            part.write(arm, self.phase, turn_rad, target);
        }
    }

    fn name(&self) -> &'static str {
        self.name
    }
}
