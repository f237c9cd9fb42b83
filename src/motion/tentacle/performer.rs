//! Arms that go from stroke to stroke: the present stroke, its progress, and the positions of the arms in it.
//!
//! ```text
//!            +--> Keyed (sway, walk, swim) --+
//!   Still <--+--> Reach                    --+--> the next stroke
//!     |      +--> ToPath --> Travel        --+
//!     |      |
//!     +------+--> Approach --> Winding --> Unwinding --+   (only from Still: nothing sweeps through a pole)
//! ```
//! The joints blend from each stage to the next without a jump ([`crate::ik::HandOver`]); a new stage begins
//! at rest. The arm follows a target point that moves; only a point that jumps away starts a new motion.

use std::f64::consts::TAU;

use glam::DVec3;

use super::arm_plan::ArmPlan;
use super::follower::{Follower, Limits};
use super::progress::{Progress, RAMP_SHARE};
use super::settled::Settled;
use super::tour::Tour;
use super::{Grip, TentaclePlan};
use crate::model::{GROUPS, Pole, Robot, TipPath};
use crate::motion::{Stroke, StrokeCommand};
use crate::signals::{ArmAim, State, Targets};

/// Time in which strokes reach their tempo from rest, s.
const RAMP_S: f64 = 1.0;
/// Time constant of a turn towards a goal, s.
const TURN_TIME_S: f64 = 1.0;
/// Slowest tempo of winding and of paths: it ensures that an arm lets go in the end.
const TEMPO_MIN: f64 = 0.1;
/// Time to wind or unwind the whole arm at tempo 1, as a multiple of the stroke's.
const WIND_STROKES: f64 = 1.5;
/// Largest speed and acceleration of a tip along a path or after a point, arm lengths per s and per s^2.
const TIP_LENGTHS_S: f64 = 0.5;
const TIP_LENGTHS_S2: f64 = 2.0;
/// The same limits for the direction of a tip, rad/s and rad/s^2.
const DIRECTION_LIMITS: Limits = Limits { speed: 1.0, acceleration: 4.0 };
/// A point that moves this much further in a cycle than a tip can counts as a new point, arm lengths.
const LEAP_LENGTHS: f64 = 0.02;
/// A direction that turns this far in a cycle counts as a new one, rad.
const LEAP_RAD: f64 = 0.1;

/// The arms' stages.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Still, in the parked pose.
    Still,
    /// Motion by key angles: walking, swimming or swaying.
    Keyed(Keyed),
    /// The arm nearest to the point reaches for it, with or without a direction.
    Reach { has_direction: bool },
    /// The arm nearest to the start of the path reaches for that start.
    ToPath(TipPath),
    /// Its tip moves along the path, and stays at its end.
    Travel(TipPath),
    /// The arm beside the pole lies straight along it.
    Approach(Pole),
    /// It winds round the pole, and holds it.
    Winding(Pole),
    /// It unwinds again.
    Unwinding(Pole),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Keyed {
    Sway,
    Walk,
    Swim,
}

/// Moves the arms as commanded.
#[derive(Debug, Clone)]
pub struct Performer {
    arms: Vec<ArmPlan>,
    stroke_time_s: f64,
    tempo_max: [f64; 3],
    asked: StrokeCommand,
    stage: Stage,
    /// Counts changes of stage.
    change: u32,
    /// The arm that reaches or winds, index into `arms`.
    taking_part: usize,
    /// Phase of the stroke and its rate, rad and rad/s.
    phase: f64,
    rate_rad_s: f64,
    turn_rad: f64,
    /// The value that the turn follows, rad.
    turn_led_rad: f64,
    /// The target point, body frame, m, and the target direction.
    point: Follower,
    direction: Follower,
    /// The path that the tip follows, and how far along it the tip is.
    tour: Tour,
    travelled: Progress,
    /// How much of the arm is wound, and the grip.
    wound: Progress,
    grip: Grip,
    settled: Settled,
}

impl Performer {
    /// The arms of `robot`, still in their parked pose.
    pub fn new(robot: &Robot, plan: &TentaclePlan) -> Performer {
        let settings = &plan.settings;
        let arms = settings.arms.iter().enumerate();
        Performer {
            arms: arms.filter_map(|(index, arm)| ArmPlan::new(robot, plan, index, arm)).collect(),
            stroke_time_s: settings.stroke_time_s,
            tempo_max: plan.tempo_max,
            asked: StrokeCommand::default(),
            stage: Stage::Still,
            change: 0,
            taking_part: 0,
            phase: 0.0,
            rate_rad_s: 0.0,
            turn_rad: 0.0,
            turn_led_rad: 0.0,
            point: Follower::default(),
            direction: Follower::default(),
            tour: Tour::new(&[]),
            travelled: Progress::default(),
            wound: Progress::default(),
            grip: Grip::new(settings.grip_share),
            settled: Settled::new(robot.joints.len()),
        }
    }

    /// Advances by `dt_s` under `command`. A command with a number that is not finite counts as a command to rest.
    pub fn step(&mut self, dt_s: f64, state: &State, command: StrokeCommand) {
        self.asked = if command.is_finite() { command } else { StrokeCommand::default() };
        self.settled.look(dt_s, state);
        let next = self.next_stage();
        if std::mem::discriminant(&next) != std::mem::discriminant(&self.stage)
            || self.begins_anew(dt_s, next)
        {
            self.begin(next);
        }
        self.stage = next;
        self.advance_phase(dt_s);
        self.follow(dt_s);
        self.travel(dt_s);
        // Two lags in series: a new turn begins at rest.
        let share = 1.0 - (-2.0 * dt_s / TURN_TIME_S).exp();
        self.turn_led_rad += (self.asked.turn_rad - self.turn_led_rad) * share;
        self.turn_rad += (self.turn_led_rad - self.turn_rad) * share;
        self.wind(dt_s, state);
    }

    /// True if `next`, of the same kind as the present stage, is nevertheless a new motion.
    fn begins_anew(&self, dt_s: f64, next: Stage) -> bool {
        match (self.stage, next) {
            (Stage::Reach { .. }, Stage::Reach { .. }) => self.stage != next || self.leaps(dt_s),
            (Stage::Keyed(_), Stage::Keyed(_))
            | (Stage::ToPath(_), Stage::ToPath(_))
            | (Stage::Approach(_), Stage::Approach(_)) => self.stage != next,
            _ => false,
        }
    }

    /// True if the target point is a new one rather than the same point that moved on.
    fn leaps(&self, dt_s: f64) -> bool {
        let Stroke::Reach { point_in_body, direction } = self.asked.stroke else { return false };
        let most_m = self.length_m() * (LEAP_LENGTHS + TIP_LENGTHS_S * dt_s);
        let turns = |direction: DVec3| self.direction.leap(direction.normalize_or_zero()) > LEAP_RAD;
        self.point.leap(point_in_body) > most_m || direction.is_some_and(turns)
    }

    /// Length of the arm that reaches or winds, m.
    fn length_m(&self) -> f64 {
        self.arms.get(self.taking_part).map_or(0.0, ArmPlan::length_m)
    }

    fn next_stage(&self) -> Stage {
        match (self.stage, self.asked.stroke) {
            (Stage::Winding(pole), Stroke::Wind(same)) if pole == same => self.stage,
            (Stage::Winding(pole), _) => Stage::Unwinding(pole),
            (Stage::Unwinding(pole), Stroke::Wind(same)) if pole == same => Stage::Winding(pole),
            (Stage::Unwinding(_), _) if self.wound.share > 0.0 => self.stage,
            (Stage::Approach(pole), Stroke::Wind(same)) if pole == same && self.settled.is() => {
                Stage::Winding(pole)
            }
            (Stage::Approach(pole), Stroke::Wind(same)) if pole == same => self.stage,
            (Stage::Still, Stroke::Wind(pole)) if self.settled.is() && self.winder(pole).is_some() => {
                Stage::Approach(pole)
            }
            (_, Stroke::Wind(_) | Stroke::Park | Stroke::Rest | Stroke::LetGo) => Stage::Still,
            (_, Stroke::Sway) => Stage::Keyed(Keyed::Sway),
            (_, Stroke::Walk) => Stage::Keyed(Keyed::Walk),
            (_, Stroke::Swim) => Stage::Keyed(Keyed::Swim),
            (_, Stroke::Reach { direction, .. }) => Stage::Reach { has_direction: direction.is_some() },
            (Stage::Travel(path), Stroke::Path(same)) if path == same => self.stage,
            (Stage::ToPath(path), Stroke::Path(same)) if path == same && self.settled.is() => {
                Stage::Travel(path)
            }
            (_, Stroke::Path(path)) => Stage::ToPath(path),
        }
    }

    /// Begins stage `next` at rest.
    fn begin(&mut self, next: Stage) {
        // Winding continues from the approach, unwinding from winding, position by position; a path from its
        // first waypoint.
        if !matches!(next, Stage::Winding(..) | Stage::Unwinding(..) | Stage::Travel(..)) {
            self.change = self.change.wrapping_add(1);
            self.settled.begin();
        }
        self.phase = 0.0;
        self.rate_rad_s = 0.0;
        match next {
            Stage::Reach { .. } => {
                if let Stroke::Reach { point_in_body, direction } = self.asked.stroke {
                    self.taking_part = self.nearest(point_in_body);
                    self.point = Follower::at(point_in_body);
                    self.direction = Follower::at(direction.unwrap_or_default().normalize_or_zero());
                }
            }
            Stage::ToPath(path) => {
                self.tour = Tour::new(path.waypoints());
                self.travelled = Progress::default();
                self.taking_part = self.nearest(self.tour.place(0.0));
            }
            Stage::Approach(pole) => {
                self.taking_part = self.winder(pole).unwrap_or(0);
                self.grip.let_go();
                self.wound = Progress::default();
            }
            _ => {}
        }
    }

    fn advance_phase(&mut self, dt_s: f64) {
        let Stage::Keyed(keyed) = self.stage else { return };
        let full_rad_s = TAU / self.stroke_time_s;
        let tempo = self.asked.tempo.min(self.tempo_max[keyed as usize]);
        let step = full_rad_s * dt_s / RAMP_S;
        self.rate_rad_s += (tempo * full_rad_s - self.rate_rad_s).clamp(-step, step);
        self.phase += self.rate_rad_s * dt_s;
    }

    /// Follows the target point.
    fn follow(&mut self, dt_s: f64) {
        let (Stage::Reach { .. }, Stroke::Reach { point_in_body, direction }) =
            (self.stage, self.asked.stroke)
        else {
            return;
        };
        let length_m = self.length_m();
        let limits = Limits { speed: TIP_LENGTHS_S * length_m, acceleration: TIP_LENGTHS_S2 * length_m };
        self.point.step(dt_s, point_in_body, limits);
        let direction = direction.unwrap_or_default().normalize_or_zero();
        self.direction.step(dt_s, direction, DIRECTION_LIMITS);
    }

    /// Advances along the path at its speed, with a ramp at either end.
    fn travel(&mut self, dt_s: f64) {
        let Stage::Travel(path) = self.stage else { return };
        let asked_m_s = path.speed_m_s() * self.asked.tempo.max(TEMPO_MIN);
        let speed_m_s = asked_m_s.min(TIP_LENGTHS_S * self.length_m());
        let time_s = self.tour.length_m() / (speed_m_s * (1.0 - RAMP_SHARE));
        if time_s > 0.0 && time_s.is_finite() {
            self.travelled.step(dt_s, 1.0, time_s);
        }
    }

    /// Winds and, once the arm is fully wound, grips; or loosens its grip and then unwinds.
    fn wind(&mut self, dt_s: f64, state: &State) {
        if let Stage::Unwinding(_) = self.stage
            && !self.grip.is_loose()
        {
            self.grip.loosen(dt_s);
            return;
        }
        let (goal, pole) = match self.stage {
            Stage::Winding(pole) => (1.0, pole),
            Stage::Unwinding(pole) => (0.0, pole),
            _ => return,
        };
        let asked_s = WIND_STROKES * self.stroke_time_s / self.asked.tempo.max(TEMPO_MIN);
        let least_s = self.arms.get(self.taking_part).map_or(0.0, |arm| arm.wind_time_s(pole));
        let time_s = asked_s.max(least_s);
        self.wound.step(dt_s, goal, time_s);
        if let (true, Some(arm)) = (self.wound.share >= 1.0, self.arms.get(self.taking_part)) {
            let hinges = arm.outer_hinges.clone();
            self.grip.step(dt_s, arm.radius_m, &state.joints[hinges.clone()], &state.is_out[hinges]);
        }
    }

    /// The arm whose root is nearest to `place`.
    fn nearest(&self, place: DVec3) -> usize {
        let distance = |arm: &ArmPlan| arm.root_m.distance(place);
        let nearest =
            self.arms.iter().enumerate().min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        nearest.map_or(0, |(index, _)| index)
    }

    /// The arm that would lie on the pole with the largest share of its length; `None` if no arm would.
    fn winder(&self, pole: Pole) -> Option<usize> {
        let share = |arm: &ArmPlan| arm.contact_share(pole);
        let arms = self.arms.iter().enumerate().filter_map(|(index, arm)| Some((index, share(arm)?)));
        arms.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }

    /// Writes the targets of the arms.
    pub fn write(&self, targets: &mut Targets) {
        let (arms, tips_in_body) = targets.set_arms();
        for (index, arm) in self.arms.iter().enumerate() {
            let takes_part = index == self.taking_part;
            let target = &mut arms[arm.chain];
            target.change = self.change;
            target.aim = ArmAim::Ends;
            target.faced_in_body = None;
            target.ends_in_body = arm.parked_in_body;
            let tip = &mut tips_in_body[arm.chain];
            match self.stage {
                Stage::Keyed(keyed) => arm.write_keyed(keyed, self.phase, self.turn_rad, target),
                Stage::Reach { has_direction } if takes_part => {
                    target.aim = if has_direction { ArmAim::TipAlong } else { ArmAim::Tip };
                    target.ends_in_body[GROUPS - 1] = self.point.place();
                    target.direction_in_body = self.direction.place();
                }
                Stage::ToPath(_) | Stage::Travel(_) if takes_part => {
                    target.aim = ArmAim::Tip;
                    target.ends_in_body[GROUPS - 1] =
                        self.tour.place(self.travelled.share * self.tour.length_m());
                }
                Stage::Approach(pole) if takes_part => arm.write_winding(pole, 0.0, 0.0, target),
                Stage::Winding(pole) | Stage::Unwinding(pole) if takes_part => {
                    arm.write_winding(pole, self.wound.share, self.grip.squeeze_m(), target);
                }
                _ => {}
            }
            // For display only.
            *tip = match target.aim {
                ArmAim::Places => target.places_in_body.last().copied().unwrap_or_default(),
                ArmAim::Ends | ArmAim::Tip | ArmAim::TipAlong => target.ends_in_body[GROUPS - 1],
            };
        }
    }

    /// True if the arms hold still in the parked pose and have arrived there.
    pub fn is_still(&self) -> bool {
        self.stage == Stage::Still && self.settled.is()
    }

    /// True if an arm is wound round a pole: it must then not be moved away joint by joint.
    pub fn is_wound(&self) -> bool {
        self.wound.share > 0.0
    }

    /// The present stroke, in the operator's terms.
    pub fn stroke(&self) -> Stroke {
        match self.stage {
            Stage::Still => match self.asked.stroke {
                Stroke::Park => Stroke::Park,
                _ => Stroke::Rest,
            },
            Stage::Keyed(Keyed::Sway) => Stroke::Sway,
            Stage::Keyed(Keyed::Walk) => Stroke::Walk,
            Stage::Keyed(Keyed::Swim) => Stroke::Swim,
            Stage::Reach { .. } => self.asked.stroke,
            Stage::ToPath(path) | Stage::Travel(path) => Stroke::Path(path),
            Stage::Approach(pole) | Stage::Winding(pole) => Stroke::Wind(pole),
            Stage::Unwinding(..) => Stroke::LetGo,
        }
    }
}
