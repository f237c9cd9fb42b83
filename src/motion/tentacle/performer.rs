//! Arms that go from stroke to stroke: the present stroke, the turn of the strokes, and the targets of the arms.
//!
//! Each stroke performs itself ([`Perform`]). The joints blend from each to the next without a jump
//! ([`crate::ik::HandOver`]); a new motion begins at rest.

use super::TentaclePlan;
use super::arm_plan::ArmPlan;
use super::perform::{Course, Moment, Perform, Rig};
use super::settled::Settled;
use super::strokes::STROKES;
use crate::model::{GROUPS, Robot};
use crate::motion::{Stroke, StrokeCommand};
use crate::signals::{ArmAim, State, Targets};

/// Time constant of a turn towards a goal, s.
const TURN_TIME_S: f64 = 1.0;

/// Moves the arms as commanded.
#[derive(Debug)]
pub struct Performer {
    arms: Vec<ArmPlan>,
    /// In the order of [`STROKES`].
    strokes: Vec<Box<dyn Perform>>,
    asked: StrokeCommand,
    /// The stroke that moves the arms, index into `strokes`; `None` while they go to the parked pose or stay there.
    present: Option<usize>,
    /// Counts motions that began.
    change: u32,
    turn_rad: f64,
    /// The value that the turn follows, rad.
    turn_led_rad: f64,
    settled: Settled,
}

impl Performer {
    /// The arms of `robot`, still in their parked pose.
    pub fn new(robot: &Robot, plan: &TentaclePlan) -> Performer {
        let arms = plan.settings.arms.iter().enumerate();
        let arms: Vec<_> = arms.filter_map(|(index, arm)| ArmPlan::new(robot, plan, index, arm)).collect();
        let made = STROKES.iter().zip(&plan.tempo_max);
        Performer {
            strokes: made
                .map(|(kind, tempo_max)| (kind.make)(&Rig { arms: &arms, plan, tempo_max: *tempo_max }))
                .collect(),
            arms,
            asked: StrokeCommand::default(),
            present: None,
            change: 0,
            turn_rad: 0.0,
            turn_led_rad: 0.0,
            settled: Settled::new(robot.joints.len()),
        }
    }

    /// Advances by `dt_s` under `command`. A command with a number that is not finite, or with a stroke of an unknown
    /// name, counts as a command to rest.
    pub fn step(&mut self, dt_s: f64, state: &State, command: StrokeCommand) {
        let asked = STROKES.iter().position(|kind| kind.name == command.stroke.name);
        let asked = asked.filter(|_| command.is_finite());
        self.asked = if asked.is_some() { command } else { StrokeCommand::default() };
        self.settled.look(dt_s, state);
        self.perform(dt_s, state, asked);
        // Two lags in series: a new turn begins at rest.
        let share = 1.0 - (-2.0 * dt_s / TURN_TIME_S).exp();
        self.turn_led_rad += (self.asked.turn_rad - self.turn_led_rad) * share;
        self.turn_rad += (self.turn_led_rad - self.turn_rad) * share;
    }

    /// Advances the stroke `asked`, index into `strokes`, or the present one if that has to end first.
    fn perform(&mut self, dt_s: f64, state: &State, asked: Option<usize>) {
        let unfinished = self.present.filter(|present| self.strokes[*present].must_end());
        let next = unfinished.or(asked);
        let moment = Moment {
            dt_s,
            state,
            arms: &self.arms,
            command: self.asked,
            is_asked: next == asked,
            is_new: next != self.present,
            was_parked: self.present.is_none(),
            is_settled: self.settled.is(),
        };
        let course = next.map_or(Course::Parks, |next| self.strokes[next].step(&moment));
        let present = if course == Course::Parks { None } else { next };
        if course == Course::Begins || (present.is_none() && self.present.is_some()) {
            self.change = self.change.wrapping_add(1);
            self.settled.begin();
        }
        self.present = present;
    }

    fn performing(&self) -> Option<&dyn Perform> {
        self.present.map(|present| &*self.strokes[present])
    }

    /// Writes the targets of the arms.
    pub fn write(&self, targets: &mut Targets) {
        let (arms, tips_in_body) = targets.set_arms();
        for (index, arm) in self.arms.iter().enumerate() {
            let target = &mut arms[arm.chain];
            target.change = self.change;
            target.aim = ArmAim::Ends;
            target.faced_in_body = None;
            target.ends_in_body = arm.parked_in_body;
            if let Some(stroke) = self.performing() {
                stroke.write(index, arm, self.turn_rad, target);
            }
            // For display only.
            tips_in_body[arm.chain] = match target.aim {
                ArmAim::Places => target.places_in_body.last().copied().unwrap_or_default(),
                ArmAim::Ends | ArmAim::Tip | ArmAim::TipAlong => target.ends_in_body[GROUPS - 1],
            };
        }
    }

    /// True if the arms hold still in the parked pose and have arrived there.
    pub fn is_still(&self) -> bool {
        self.present.is_none() && self.settled.is()
    }

    /// True if an arm is wound round a pole: it must then not be moved away joint by joint.
    pub fn is_wound(&self) -> bool {
        self.performing().is_some_and(Perform::is_wound)
    }

    /// Name of the present stroke, in the operator's terms.
    pub fn stroke(&self) -> &'static str {
        match self.performing() {
            Some(stroke) => stroke.name(),
            None if self.asked.stroke == Stroke::PARK => Stroke::PARK.name,
            None => Stroke::REST.name,
        }
    }
}
