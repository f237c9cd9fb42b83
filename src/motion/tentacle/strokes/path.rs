//! A path: the arm nearest to its start brings its tip there, moves it along the path, and stays at the end.

use super::{Needs, Shown, StrokeKind};
use crate::model::{GROUPS, TipPath};
use crate::motion::Place;
use crate::motion::tentacle::arm_plan::{ArmPlan, TIP_LENGTHS_S, nearest};
use crate::motion::tentacle::perform::{Course, Moment, Perform, TEMPO_MIN};
use crate::motion::tentacle::progress::{Progress, RAMP_SHARE};
use crate::motion::tentacle::tour::Tour;
use crate::signals::{ArmAim, ArmTarget};

/// The stroke.
pub const KIND: StrokeKind = StrokeKind {
    name: NAME,
    meaning: "brings the tip of the nearest arm to the beginning of a path, and along it at its speed; stays at the \
              end",
    key: Some('7'),
    needs: Needs::Path,
    is_rhythmic: false,
    shown: Some(Shown { strokes: 2.0, hold_s: 4.0 }),
    make: |_| Box::new(Travel::new()),
};

const NAME: &str = "path";

/// Follows a path.
#[derive(Debug)]
struct Travel {
    /// The arm that follows it, index into the arms.
    arm: usize,
    path: Option<TipPath>,
    tour: Tour,
    /// False while the arm still reaches for the start of the path.
    has_left: bool,
    /// How far along the path the tip is.
    travelled: Progress,
}

impl Travel {
    fn new() -> Travel {
        let tour = Tour::new(&[]);
        Travel { arm: 0, path: None, tour, has_left: false, travelled: Progress::default() }
    }

    /// Advances along the path at its speed, with a ramp at either end.
    fn advance(&mut self, moment: &Moment<'_>, path: TipPath) {
        let length_m = moment.arms.get(self.arm).map_or(0.0, ArmPlan::length_m);
        let asked_m_s = path.speed_m_s() * moment.command.tempo.max(TEMPO_MIN);
        let speed_m_s = asked_m_s.min(TIP_LENGTHS_S * length_m);
        let time_s = self.tour.length_m() / (speed_m_s * (1.0 - RAMP_SHARE));
        if time_s > 0.0 && time_s.is_finite() {
            self.travelled.step(moment.dt_s, 1.0, time_s);
        }
    }
}

impl Perform for Travel {
    fn step(&mut self, moment: &Moment<'_>) -> Course {
        let Place::Path(path) = moment.command.stroke.place else { return Course::Parks };
        if moment.is_new || self.path != Some(path) {
            let tour = Tour::new(path.waypoints());
            let arm = nearest(moment.arms, tour.place(0.0));
            *self = Travel { arm, path: Some(path), tour, ..Travel::new() };
            return Course::Begins;
        }
        self.has_left |= moment.is_settled;
        if self.has_left {
            self.advance(moment, path);
        }
        Course::Continues
    }

    fn write(&self, index: usize, _arm: &ArmPlan, _turn_rad: f64, target: &mut ArmTarget) {
        if index == self.arm {
            target.aim = ArmAim::Tip;
            let along_m = self.travelled.share * self.tour.length_m();
            target.ends_in_body[GROUPS - 1] = self.tour.place(along_m);
        }
    }

    fn name(&self) -> &'static str {
        NAME
    }
}
