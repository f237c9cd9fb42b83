//! Arms under way from stroke to stroke: which one they do, how far they are in it, and where that has them be.
//!
//! ```text
//!            +--> Keyed (sway, walk, swim) --+
//!   Still <--+--> Reach                    --+--> whatever is asked next
//!     |      |
//!     +------+--> Approach --> Winding --> Unwinding --+   (only from Still: nothing sweeps through a pole)
//! ```
//! From each to the next the joints go over without a leap ([`crate::ik::HandOver`]); what is new begins at rest.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::settled::Settled;
use super::stroke::{Part, Strokes};
use super::variation::Variation;
use super::winding::Winding;
use super::wound::Wound;
use super::{Grip, TentaclePlan};
use crate::model::{ArmGeometry, GROUPS, Pole, Robot};
use crate::motion::{Stroke, StrokeCommand};
use crate::signals::{Aim, ArmAim, ArmTarget, State, Targets};

/// Time in which strokes come to their tempo from rest, s.
const RAMP_S: f64 = 1.0;
/// Time constant of the turn towards a goal, s.
const TURN_TIME_S: f64 = 1.0;
/// Slowest tempo of winding: an arm that is to let go does so in the end.
const TEMPO_MIN: f64 = 0.1;
/// Time to wind or unwind the whole arm at tempo 1, times the stroke's.
const WIND_STROKES: f64 = 1.5;

/// What the arms do.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// As they are parked.
    Still,
    /// By key angles: walking, swimming or swaying.
    Keyed(Keyed),
    /// The arm nearest to the point reaches for it.
    Reach { point_in_body: DVec3, direction: Option<DVec3> },
    /// The arm beside the pole lies straight along it.
    Approach(Pole),
    /// It winds round the pole, and holds it.
    Winding(Pole),
    /// It unwinds again.
    Unwinding(Pole),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Keyed {
    Sway,
    Walk,
    Swim,
}

/// One arm.
#[derive(Debug, Clone)]
struct ArmPlan {
    chain: usize,
    root_m: DVec3,
    root_rotation: DQuat,
    group_lengths_m: [f64; GROUPS],
    links_m: Vec<f64>,
    radius_m: f64,
    strokes: Strokes,
    /// Ends of its groups where it is parked, body frame, m.
    parked_in_body: [DVec3; GROUPS],
    /// The hinges of its outer two groups.
    outer_hinges: std::ops::Range<usize>,
}

/// Moves arms as they are asked to.
#[derive(Debug, Clone)]
pub struct Performer {
    arms: Vec<ArmPlan>,
    stroke_time_s: f64,
    tempo_max: [f64; 3],
    asked: StrokeCommand,
    stage: Stage,
    /// Counts stages.
    change: u32,
    /// The arm that reaches or winds; index into `arms`.
    taking_part: usize,
    /// Phase of the stroke and its rate, rad and rad/s.
    phase: f64,
    rate_rad_s: f64,
    turn_rad: f64,
    /// How much of what can be wound is.
    wound: Wound,
    grip: Grip,
    settled: Settled,
}

impl Performer {
    /// Arms of `robot`, still where they are parked.
    pub fn new(robot: &Robot, plan: &TentaclePlan) -> Performer {
        let settings = &plan.settings;
        let arm = |(index, arm): (usize, &crate::model::ArmSettings)| {
            let chain = &robot.chains[arm.chain];
            let joints = robot.joints_of(chain);
            // Robot files make no others.
            let geometry = ArmGeometry::of(chain, joints).ok()?;
            let angles = plan.park_pose_rad[chain.joints.clone()].iter().copied();
            let places = robot.places_in_body(chain, angles);
            let part =
                Part { role: arm.role, is_right: chain.root_m.y < 0.0, walk_plane_rad: arm.stroke_plane_rad };
            let first_outer =
                geometry.joints.get(geometry.joints_to_end(0)).map_or(0, |joint| joint.hinges.start);
            Some(ArmPlan {
                chain: arm.chain,
                root_m: chain.root_m,
                root_rotation: chain.root_rotation,
                group_lengths_m: geometry.group_lengths_m(),
                links_m: geometry.joints.iter().map(|joint| joint.link_m).collect(),
                radius_m: arm.radius_m,
                strokes: Strokes::new(
                    part,
                    settings.between,
                    Variation::new(settings.seed, index, settings.variation_rad),
                ),
                parked_in_body: std::array::from_fn(|group| {
                    let joints = geometry.joints_to_end(group);
                    // A link ends behind its joint's last hinge; on tendons there are no hinges between.
                    let hinges = geometry.joints[joints - 1].hinges.end;
                    places[if chain.tendons.is_some() { joints } else { hinges }]
                }),
                outer_hinges: chain.joints.start + first_outer..chain.joints.end,
            })
        };
        Performer {
            arms: settings.arms.iter().enumerate().filter_map(arm).collect(),
            stroke_time_s: settings.stroke_time_s,
            tempo_max: plan.tempo_max,
            asked: StrokeCommand::default(),
            stage: Stage::Still,
            change: 0,
            taking_part: 0,
            phase: 0.0,
            rate_rad_s: 0.0,
            turn_rad: 0.0,
            wound: Wound::default(),
            grip: Grip::new(settings.grip_share),
            settled: Settled::new(robot.joints.len()),
        }
    }

    /// Goes on by `dt_s` as `command` says. A command with a number that is none counts as one to rest.
    pub fn step(&mut self, dt_s: f64, state: &State, command: StrokeCommand) {
        self.asked = if command.is_finite() { command } else { StrokeCommand::default() };
        self.settled.look(dt_s, state);
        let next = self.next_stage();
        if std::mem::discriminant(&next) != std::mem::discriminant(&self.stage) || self.begins_anew(next) {
            self.begin(next);
        }
        self.stage = next;
        self.advance_phase(dt_s);
        self.turn_rad += (self.asked.turn_rad - self.turn_rad) * (1.0 - (-dt_s / TURN_TIME_S).exp());
        self.wind(dt_s, state);
    }

    /// Whether `next`, of the same kind as what the arms do, is another motion all the same.
    fn begins_anew(&self, next: Stage) -> bool {
        match (self.stage, next) {
            (Stage::Keyed(now), Stage::Keyed(next)) => now != next,
            (Stage::Reach { .. }, Stage::Reach { .. }) => self.stage != next,
            (Stage::Approach(now), Stage::Approach(next)) => now != next,
            _ => false,
        }
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
            (_, Stroke::Reach { point_in_body, direction }) => Stage::Reach { point_in_body, direction },
        }
    }

    /// What begins, begins at rest.
    fn begin(&mut self, next: Stage) {
        // Winding goes on from the approach, and unwinding from that, place by place.
        if !matches!(next, Stage::Winding(..) | Stage::Unwinding(..)) {
            self.change = self.change.wrapping_add(1);
            self.settled.begin();
        }
        self.phase = 0.0;
        self.rate_rad_s = 0.0;
        match next {
            Stage::Reach { point_in_body, .. } => self.taking_part = self.nearest(point_in_body),
            Stage::Approach(pole) => {
                self.taking_part = self.winder(pole).unwrap_or(0);
                self.grip.let_go();
                self.wound = Wound::default();
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

    /// Winds or unwinds, and once all is wound, grips.
    fn wind(&mut self, dt_s: f64, state: &State) {
        let goal = match self.stage {
            Stage::Winding(_) => 1.0,
            Stage::Unwinding(_) => 0.0,
            _ => return,
        };
        let time_s = WIND_STROKES * self.stroke_time_s / self.asked.tempo.clamp(TEMPO_MIN, 1.0);
        self.wound.step(dt_s, goal, time_s);
        if let (true, Some(arm)) = (self.wound.share >= 1.0, self.arms.get(self.taking_part)) {
            self.grip.step(dt_s, arm.radius_m, &state.joints[arm.outer_hinges.clone()]);
        }
    }

    /// The arm whose root is nearest to a place.
    fn nearest(&self, place: DVec3) -> usize {
        let distance = |arm: &ArmPlan| arm.root_m.distance(place);
        let nearest =
            self.arms.iter().enumerate().min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        nearest.map_or(0, |(index, _)| index)
    }

    /// The arm that comes to lie on the pole most; none if none does.
    fn winder(&self, pole: Pole) -> Option<usize> {
        let share = |arm: &ArmPlan| arm.winding(pole, 0.0).map(|winding| winding.contact_share());
        let arms = self.arms.iter().enumerate().filter_map(|(index, arm)| Some((index, share(arm)?)));
        arms.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }

    /// Writes where the arms are to be.
    pub fn write(&self, targets: &mut Targets) {
        targets.aim = Aim::Arms;
        targets.feet.clear();
        for (index, arm) in self.arms.iter().enumerate() {
            let takes_part = index == self.taking_part;
            let target = &mut targets.arms[arm.chain];
            target.change = self.change;
            target.aim = ArmAim::Ends;
            target.ends_in_body = arm.parked_in_body;
            let tip = &mut targets.tips_in_body[arm.chain];
            match self.stage {
                Stage::Keyed(keyed) => arm.write_keyed(keyed, self.phase, self.turn_rad, target),
                Stage::Reach { point_in_body, direction } if takes_part => {
                    target.aim = if direction.is_some() { ArmAim::TipAlong } else { ArmAim::Tip };
                    target.ends_in_body[GROUPS - 1] = point_in_body;
                    target.direction_in_body = direction.unwrap_or(DVec3::X);
                }
                Stage::Approach(pole) if takes_part => arm.write_winding(pole, 0.0, 0.0, target),
                Stage::Winding(pole) | Stage::Unwinding(pole) if takes_part => {
                    arm.write_winding(pole, self.wound.share, self.grip.squeeze_m(), target);
                }
                _ => {}
            }
            // For those who look on.
            *tip = match target.aim {
                ArmAim::Places => target.places_in_body.last().copied().unwrap_or_default(),
                ArmAim::Ends | ArmAim::Tip | ArmAim::TipAlong => target.ends_in_body[GROUPS - 1],
            };
        }
    }

    /// Whether the arms hold still as they are parked, and have come there.
    pub fn is_still(&self) -> bool {
        self.stage == Stage::Still && self.settled.is()
    }

    /// Whether an arm is round a pole, so that it must not be taken away from there joint by joint.
    pub fn is_wound(&self) -> bool {
        self.wound.share > 0.0
    }

    /// What they do, of what a person asked for.
    pub fn stroke(&self) -> Stroke {
        match self.stage {
            Stage::Still => match self.asked.stroke {
                Stroke::Park => Stroke::Park,
                _ => Stroke::Rest,
            },
            Stage::Keyed(Keyed::Sway) => Stroke::Sway,
            Stage::Keyed(Keyed::Walk) => Stroke::Walk,
            Stage::Keyed(Keyed::Swim) => Stroke::Swim,
            Stage::Reach { point_in_body, direction } => Stroke::Reach { point_in_body, direction },
            Stage::Approach(pole) | Stage::Winding(pole) => Stroke::Wind(pole),
            Stage::Unwinding(..) => Stroke::LetGo,
        }
    }
}

impl ArmPlan {
    fn to_body(&self, in_arm: DVec3) -> DVec3 {
        self.root_m + self.root_rotation * in_arm
    }

    /// Moves it by a stroke at a phase of it.
    fn write_keyed(&self, keyed: Keyed, phase: f64, turn_rad: f64, target: &mut ArmTarget) {
        let stroke = match keyed {
            Keyed::Walk => &self.strokes.walk,
            Keyed::Swim => &self.strokes.swim,
            Keyed::Sway => {
                target.aim = ArmAim::Places;
                self.strokes.sway.write(phase, self.links_m.iter().copied(), &mut target.places_in_body);
                target.places_in_body.iter_mut().for_each(|place| *place = self.to_body(*place));
                return;
            }
        };
        let in_arm = stroke.ends_in_arm(self.group_lengths_m, phase, turn_rad);
        target.ends_in_body = in_arm.map(|place| self.to_body(place));
    }

    fn winding(&self, pole: Pole, squeeze_m: f64) -> Option<Winding> {
        let ahead = self.root_rotation * DVec3::X;
        Winding::new(self.root_m, ahead, self.links_m.iter().copied(), self.radius_m, pole, squeeze_m).ok()
    }

    /// Lays its links along and round the pole, `wound` of what can be (0 to 1).
    fn write_winding(&self, pole: Pole, wound: f64, squeeze_m: f64, target: &mut ArmTarget) {
        let Some(winding) = self.winding(pole, squeeze_m) else { return };
        target.aim = ArmAim::Places;
        winding.write(wound * winding.length_m(), self.links_m.iter().copied(), &mut target.places_in_body);
    }
}
