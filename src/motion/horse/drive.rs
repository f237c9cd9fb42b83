//! A horse on its feet: follows commands within its capability, and sets the positions of trunk and feet.

use glam::DVec2;

use super::planner::{Found, Planner, ReachLimit, Request};
use super::posture::{PostureTransition, TrunkPose};
use super::profile::Velocity;
use super::reach_table::Reachable;
use super::walk::Walk;
use super::{HorsePlan, auto};
use crate::motion::curves::smooth_step;
use crate::motion::{Command, GaitChoice, Posture};
use crate::signals::Targets;

/// A horse on its feet.
#[derive(Debug, Clone)]
pub struct Drive {
    plan: HorsePlan,
    walk: Walk,
    planner: Planner,
    transition: PostureTransition,
    /// The requested posture, and its limited value.
    asked: Posture,
    granted: Posture,
    /// Reach of the feet on the trunk's present way.
    way_reach: Reachable,
    /// Share of the gaits' vertical oscillation that the trunk makes, 0 to 1: it grows with the first stride and fades with
    /// the last.
    oscillation_share: f64,
    /// Limit on speed, as a share of the gait's top speed, 0 to 1.
    speed_share: f64,
    now_s: f64,
    /// Position of the trunk's middle over the ground, m.
    trunk_m: DVec2,
}

impl Drive {
    /// A horse that stands at time 0.
    pub fn standing(plan: HorsePlan) -> Drive {
        Drive {
            walk: Walk::standing(&plan),
            planner: Planner::new(),
            transition: PostureTransition::level(plan.settings.stand_height_m),
            asked: Posture::default(),
            granted: Posture::default(),
            way_reach: plan.reach.level,
            oscillation_share: 0.0,
            speed_share: 1.0,
            now_s: 0.0,
            trunk_m: DVec2::ZERO,
            plan,
        }
    }

    /// Limits the speed from now on to this share of each gait's top speed, 0 to 1; the change is as smooth
    /// as for a command.
    pub fn limit_speed(&mut self, share: f64) {
        self.speed_share = share;
    }

    /// Resets to standing at time 0, as if the horse had not moved yet.
    pub fn reset_to_stand(&mut self) {
        self.walk = Walk::standing(&self.plan);
        self.planner = Planner::new();
        self.transition = PostureTransition::level(self.plan.settings.stand_height_m);
        (self.asked, self.granted) = (Posture::default(), Posture::default());
        self.way_reach = self.plan.reach.level;
        self.oscillation_share = 0.0;
        self.now_s = 0.0;
        self.trunk_m = DVec2::ZERO;
    }

    /// Its plan.
    pub fn plan(&self) -> &HorsePlan {
        &self.plan
    }

    /// Advances by `dt_s` under `command`; without one, to a level stand. A command with a number that is not
    /// finite counts as none.
    pub fn step(&mut self, dt_s: f64, command: Option<Command>) {
        let before_s = self.now_s;
        self.now_s += dt_s;
        self.walk.advance(self.now_s);
        self.transition.advance(dt_s);
        self.follow(command.filter(Command::is_finite).unwrap_or_default());
        self.move_trunk(before_s);
        self.breathe(dt_s);
        if self.oscillation_share <= 0.0 {
            self.walk.end_if_settled(self.now_s);
        }
    }

    fn follow(&mut self, command: Command) {
        if command.posture != self.asked {
            self.asked = command.posture;
            self.granted = self.plan.reach.limited(command.posture);
        }
        // The gait it is changing to: a change that begins by slowing down is no reason to drop that gait.
        let present = self.walk.strides.map(|strides| strides.to);
        let now = self.walk.velocity(self.now_s);
        let (next, reach) = self.next_posture();
        let reach_m = reach.half_excursion_m;
        let wanted = Velocity { speed_m_s: command.speed_m_s, yaw_rate_rad_s: command.yaw_rate_rad_s };
        let request = match command.gait {
            GaitChoice::Gait(gait) if self.plan.can_do(gait) => {
                Request { gait: Some(gait), velocity: self.plan.limited(gait, wanted, reach_m) }
            }
            // Finish one change before the next.
            GaitChoice::Auto => match present.filter(|_| self.has_change_to_come() && !wanted.is_still()) {
                Some(gait) => {
                    Request { gait: Some(gait), velocity: self.plan.limited(gait, wanted, reach_m) }
                }
                None => auto::request(&self.plan, present, now, wanted, reach_m),
            },
            GaitChoice::Stand | GaitChoice::Gait(_) => Request { gait: None, velocity: Velocity::STILL },
        };
        let request = self.slowed(request, reach_m);
        // A horse that should stand does so in its present posture. If its steps do not fit another posture
        // yet, they must first be made to fit.
        let is_to_stand_first = request.gait.is_none() && self.is_walking();
        let (plan, walk, now_s) = (&self.plan, &mut self.walk, self.now_s);
        self.planner.begin_cycle();
        let goes_on = !is_to_stand_first
            && match self.planner.follow(plan, walk, now_s, request, (ReachLimit::Next, &reach)) {
                Found::Way => true,
                Found::NoneYet => false,
                Found::None => self.planner.keeps(walk, now_s, &reach),
            };
        if goes_on {
            self.transition.aim_for(next);
            self.way_reach = reach;
        } else if is_to_stand_first || self.way_reach != reach {
            self.planner.follow(plan, walk, now_s, request, (ReachLimit::Present, &self.way_reach));
        }
    }

    /// `request` limited to the permitted share of the top speed.
    fn slowed(&self, mut request: Request, reach_m: f64) -> Request {
        if let Some(gait) = request.gait.filter(|_| self.speed_share < 1.0) {
            let speed_m_s = &mut request.velocity.speed_m_s;
            let top_m_s = self.speed_share * self.plan.top_m_s(gait, *speed_m_s, reach_m);
            *speed_m_s = speed_m_s.clamp(-top_m_s, top_m_s);
        }
        request
    }

    /// True from the time a change of gait is planned until it is over.
    fn has_change_to_come(&self) -> bool {
        self.walk
            .strides
            .is_some_and(|strides| strides.from != strides.to && self.now_s < strides.clock.change_end_s())
    }

    /// The posture to go to next, and the reach of the feet until then: straight to the granted posture, or
    /// by way of the level stand.
    fn next_posture(&self) -> (Posture, Reachable) {
        let table = &self.plan.reach;
        if self.transition.now() == self.granted && self.transition.goal() == self.granted {
            return (self.granted, table.at(self.granted));
        }
        if self.transition.goal() == self.granted {
            return (self.granted, self.way_reach);
        }
        let way_to = |goal| {
            let [a, b] = self.transition.way_begins().map(|begin| table.between(begin, goal));
            a.and(&b)
        };
        let straight = way_to(self.granted);
        if table.is_enough(&straight) {
            return (self.granted, straight.and(&self.way_reach));
        }
        let level = Posture::default();
        if self.transition.goal() == level { (level, self.way_reach) } else { (level, way_to(level)) }
    }

    /// Moves the trunk's middle along its heading.
    fn move_trunk(&mut self, before_s: f64) {
        let profile = &self.walk.profile;
        let heading_rad = 0.5 * (profile.turn_rad(before_s) + profile.turn_rad(self.now_s));
        let distance_m = profile.distance_m(self.now_s) - profile.distance_m(before_s);
        self.trunk_m += distance_m * DVec2::from_angle(heading_rad);
    }

    fn breathe(&mut self, dt_s: f64) {
        let Some(strides) = self.walk.strides else {
            self.oscillation_share = 0.0;
            return;
        };
        let is_ending = strides.is_ending && self.now_s >= self.walk.profile.settled_s();
        let step = dt_s / strides.clock.settled_period_s();
        self.oscillation_share =
            (self.oscillation_share + if is_ending { -step } else { step }).clamp(0.0, 1.0);
    }

    /// True once the horse stands level on its neutral points and will stay so.
    pub fn is_standing(&self) -> bool {
        self.walk.is_standing() && self.transition.is_level()
    }

    /// True while the horse takes steps.
    pub fn is_walking(&self) -> bool {
        !self.walk.is_standing()
    }

    /// True once the horse goes in the gait, and at the speed and turn, of `command`, or as near to it as possible.
    pub fn does(&self, command: Command) -> bool {
        let is_changing = self.walk.strides.is_some_and(|strides| strides.is_changing(self.now_s));
        let is_asked_gait = match command.gait {
            GaitChoice::Stand => self.walk.is_standing(),
            GaitChoice::Gait(gait) => self.gait() == Some(gait),
            GaitChoice::Auto => true,
        };
        is_asked_gait
            && !is_changing
            && self.planner.has_settled()
            && self.now_s >= self.walk.profile.settled_s()
    }

    /// Speed and turn of the trunk.
    pub fn velocity(&self) -> Velocity {
        self.walk.velocity(self.now_s)
    }

    /// The gait, index into the robot's gaits; `None` when the horse stands.
    pub fn gait(&self) -> Option<usize> {
        self.walk.gait(self.now_s)
    }

    /// True during a change of gait.
    pub fn is_changing_gait(&self) -> bool {
        self.walk.strides.is_some_and(|strides| strides.is_changing(self.now_s))
    }

    /// Stances and swings checked in the last step to find a plan.
    #[cfg(test)]
    pub(super) fn looked(&self) -> u32 {
        self.planner.looked
    }

    /// Its steps.
    pub fn walk(&self) -> &Walk {
        &self.walk
    }

    /// Its time, s.
    pub fn now_s(&self) -> f64 {
        self.now_s
    }

    /// Writes the tips and the plan for a trunk whose posture begins `height_m` above the ground.
    pub fn write(&self, height_m: f64, targets: &mut Targets) {
        let posture = self.transition.now();
        let vertical_oscillation_m =
            smooth_step(self.oscillation_share) * self.walk.vertical_oscillation_m(&self.plan, self.now_s);
        let trunk = TrunkPose {
            height_m: height_m + posture.rise_m + vertical_oscillation_m,
            pitch_rad: posture.pitch_rad,
            roll_rad: posture.roll_rad,
        };
        self.walk.write(&self.plan, self.now_s, &trunk, posture.sway_m, self.trunk_m, targets);
    }
}
