//! Winding round a pole. Only parked arms begin it, so that nothing sweeps through the pole; a wound arm unwinds
//! before any other stroke.

use super::{Needs, Shown, StrokeKind};
use crate::model::Pole;
use crate::motion::tentacle::Grip;
use crate::motion::tentacle::arm_plan::ArmPlan;
use crate::motion::tentacle::perform::{Course, Moment, Perform, Rig, TEMPO_MIN};
use crate::motion::tentacle::progress::Progress;
use crate::motion::{Place, Stroke};
use crate::signals::ArmTarget;

/// The stroke. In a show arms rest, lie along the pole, wind round it and hold it.
pub const KIND: StrokeKind = StrokeKind {
    name: NAME,
    meaning: "an arm that can wind rests first, then lies along the pole, winds round it, and holds it by the load \
              that its servos report",
    key: Some('5'),
    needs: Needs::Pole,
    is_rhythmic: false,
    shown: Some(Shown { strokes: 2.0, hold_s: 5.0 }),
    make: |rig| Box::new(Wind::new(rig)),
};

const NAME: &str = "wind";
/// Time to wind or unwind the whole arm at tempo 1, as a multiple of the stroke's.
const WIND_STROKES: f64 = 1.5;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// The arm beside the pole lies straight along it.
    Approach,
    /// It winds round the pole, and holds it.
    Winding,
    /// It unwinds again.
    Unwinding,
}

/// Winds an arm round a pole, and unwinds it.
#[derive(Debug)]
struct Wind {
    /// The arm that winds, index into the arms.
    arm: usize,
    /// The pole and what the arm does there; `None` while the arms are parked.
    at: Option<(Pole, Stage)>,
    /// How much of the arm is wound, and the grip.
    wound: Progress,
    grip: Grip,
    stroke_time_s: f64,
}

impl Wind {
    fn new(rig: &Rig<'_>) -> Wind {
        let settings = &rig.plan.settings;
        Wind {
            arm: 0,
            at: None,
            wound: Progress::default(),
            grip: Grip::new(settings.grip_share),
            stroke_time_s: settings.stroke_time_s,
        }
    }

    /// What it does next; `None` to park.
    fn next(&self, moment: &Moment<'_>) -> Option<(Pole, Stage)> {
        let asked = match moment.command.stroke.place {
            Place::Pole(pole) if moment.is_asked => Some(pole),
            _ => None,
        };
        let present = if moment.is_new { None } else { self.at };
        match present {
            None => {
                let pole = asked.filter(|_| moment.was_parked && moment.is_settled)?;
                winder(moment.arms, pole).map(|_| (pole, Stage::Approach))
            }
            Some((pole, Stage::Approach)) => {
                asked.filter(|asked| *asked == pole)?;
                Some((pole, if moment.is_settled { Stage::Winding } else { Stage::Approach }))
            }
            Some((pole, _)) if asked == Some(pole) => Some((pole, Stage::Winding)),
            Some((_, Stage::Unwinding)) if self.wound.share <= 0.0 => None,
            Some((pole, _)) => Some((pole, Stage::Unwinding)),
        }
    }

    /// Winds and, once the arm is fully wound, grips; or loosens its grip and then unwinds.
    fn wind(&mut self, moment: &Moment<'_>, pole: Pole, stage: Stage) {
        let goal = match stage {
            Stage::Approach => return,
            Stage::Winding => 1.0,
            Stage::Unwinding if self.grip.is_loose() => 0.0,
            Stage::Unwinding => {
                self.grip.loosen(moment.dt_s);
                return;
            }
        };
        let arm = moment.arms.get(self.arm);
        let asked_s = WIND_STROKES * self.stroke_time_s / moment.command.tempo.max(TEMPO_MIN);
        let least_s = arm.map_or(0.0, |arm| arm.wind_time_s(pole));
        self.wound.step(moment.dt_s, goal, asked_s.max(least_s));
        if let (true, Some(arm)) = (self.wound.share >= 1.0, arm) {
            let hinges = arm.outer_hinges.clone();
            let state = moment.state;
            self.grip.step(moment.dt_s, arm.radius_m, &state.joints[hinges.clone()], &state.is_out[hinges]);
        }
    }
}

/// The arm that would lie on the pole with the largest share of its length; `None` if no arm would.
fn winder(arms: &[ArmPlan], pole: Pole) -> Option<usize> {
    let share = |arm: &ArmPlan| arm.contact_share(pole);
    let arms = arms.iter().enumerate().filter_map(|(index, arm)| Some((index, share(arm)?)));
    arms.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
}

impl Perform for Wind {
    fn step(&mut self, moment: &Moment<'_>) -> Course {
        let was_at = if moment.is_new { None } else { self.at };
        self.at = self.next(moment);
        let Some((pole, stage)) = self.at else { return Course::Parks };
        if was_at.is_none() {
            self.arm = winder(moment.arms, pole).unwrap_or(0);
            self.grip.let_go();
            self.wound = Progress::default();
            return Course::Begins;
        }
        self.wind(moment, pole, stage);
        Course::Continues
    }

    fn write(&self, index: usize, arm: &ArmPlan, _turn_rad: f64, target: &mut ArmTarget) {
        let Some((pole, stage)) = self.at.filter(|_| index == self.arm) else { return };
        match stage {
            Stage::Approach => arm.write_winding(pole, 0.0, 0.0, target),
            Stage::Winding | Stage::Unwinding => {
                arm.write_winding(pole, self.wound.share, self.grip.squeeze_m(), target);
            }
        }
    }

    fn name(&self) -> &'static str {
        match self.at {
            Some((_, Stage::Unwinding)) => Stroke::LET_GO.name,
            _ => NAME,
        }
    }

    fn must_end(&self) -> bool {
        match self.at {
            Some((_, Stage::Winding)) => true,
            Some((_, Stage::Unwinding)) => self.is_wound(),
            Some((_, Stage::Approach)) | None => false,
        }
    }

    fn is_wound(&self) -> bool {
        self.wound.share > 0.0
    }
}
