//! Four feet that step under a moving trunk: where each is now, and where it will be.
//!
//! Each leg works in its own plane, whose motion over the ground the speed profile gives in advance. A foot
//! lifts when the stride clock says, swings for the swing time, and lands half-way between the positions of
//! its root at touch-down and at the next lift-off. So every stance is centred under the leg, and no foot
//! slips in its plane, whatever speed, turn and gait do.

use glam::{DQuat, DVec2};

use super::HorsePlan;
use super::clock::StrideClock;
use super::posture::TrunkPose;
use super::profile::{SpeedProfile, Velocity};
use crate::model::VerticalOscillation;
use crate::motion::curves::{SwingCurve, smooth_step};
use crate::signals::{FootTarget, Targets};

/// Limit on a swing's speed while the trunk's speed changes, as a share of the fastest steady swing: the part
/// of the servos' rate that steady swings leave free.
const SWING_SPEED_SHARE: f64 = 1.02;
/// Share of the swing time in which a foot takes up its load, and again in which it gives it up.
const LOADING_SHARE: f64 = 0.2;
/// A foot is on its neutral point within this distance, m.
const CENTRED_M: f64 = 1e-9;

/// A walk under way.
#[derive(Debug, Clone)]
pub struct Walk {
    pub(super) swing: SwingCurve,
    /// Speed and turn, planned in advance.
    pub(super) profile: SpeedProfile,
    /// When legs lift; `None` while the horse stands.
    pub(super) strides: Option<Strides>,
    pub(super) legs: [Leg; 4],
}

/// The gait under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strides {
    pub(super) clock: StrideClock,
    /// The gait before and after the clock's change, indices into the robot's gaits.
    pub(super) from: usize,
    pub(super) to: usize,
    /// Largest speed of a foot relative to the trunk in a swing, m/s.
    pub(super) swing_speed_max_m_s: f64,
    /// True if the strides are ending: a foot that is on its neutral point after the trunk has stopped stays there.
    pub(super) is_ending: bool,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    /// Position of the neutral foot point, forward of the trunk and to the left of it, m.
    neutral_m: f64,
    pub(super) side_m: f64,
    pub(super) foot: Foot,
    /// Number of its next lift-off, by the stride clock.
    next_lift: i64,
}

/// A foot's state. Positions are distances along the leg's own plane, m.
#[derive(Debug, Clone, Copy)]
pub(super) enum Foot {
    /// On the ground since `since_s`.
    Stance { at_m: f64, since_s: f64 },
    /// In the air since `lifted_s`, between these positions.
    Swing { lifted_s: f64, from_m: f64, to_m: f64 },
}

/// State of a foot at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootPlace {
    /// Distance forward of its neutral point, m.
    pub excursion_m: f64,
    /// Distance forward of the trunk's middle, m.
    pub forward_m: f64,
    /// Height above the ground, m.
    pub up_m: f64,
    /// Distance to the left of the trunk's middle, m.
    pub side_m: f64,
    /// Distance its plane has moved since the walk began, m.
    pub plane_distance_m: f64,
    /// True in swing.
    pub is_swing: bool,
    /// Fraction of its share of the weight that it should carry, 0 to 1.
    pub load_share: f64,
    /// Largest acceleration of this swing, m/s^2; 0 in stance.
    pub swing_acceleration_m_s2: f64,
}

impl Strides {
    /// Strides by `clock`, which changes from the gait with index `from` to `to`.
    pub(super) fn new(
        plan: &HorsePlan,
        clock: StrideClock,
        from: usize,
        to: usize,
        is_ending: bool,
    ) -> Strides {
        let swing_speed_max_m_s = plan.swing_speed_max_m_s(from).max(plan.swing_speed_max_m_s(to));
        Strides { clock, from, to, swing_speed_max_m_s: SWING_SPEED_SHARE * swing_speed_max_m_s, is_ending }
    }

    /// The gait at time `s`: once a change has begun, the gait it leads to.
    pub(super) fn gait_at(&self, s: f64) -> usize {
        if s >= self.clock.change_start_s() { self.to } else { self.from }
    }

    /// True during a change of gait.
    pub(super) fn is_changing(&self, s: f64) -> bool {
        s >= self.clock.change_start_s() && s < self.clock.change_end_s()
    }
}

impl Walk {
    /// A horse that stands on its neutral points and takes no steps.
    pub fn standing(plan: &HorsePlan) -> Walk {
        Walk {
            swing: plan.swing(),
            profile: SpeedProfile::constant(Velocity::STILL),
            strides: None,
            legs: plan.neutral_in_body.map(|neutral| Leg {
                neutral_m: neutral.x,
                side_m: neutral.y,
                foot: Foot::Stance { at_m: neutral.x, since_s: f64::NEG_INFINITY },
                next_lift: 0,
            }),
        }
    }

    /// A horse that has long been walking at `velocity` in the gait with index `gait` at time 0; it is settled
    /// after one stride.
    pub fn cruising(plan: &HorsePlan, gait: usize, velocity: Velocity) -> Walk {
        let mut walk = Walk::standing(plan);
        walk.profile = SpeedProfile::constant(velocity);
        walk.begin(plan, gait, 0.0);
        let settings = &plan.settings;
        let half_stance_s = 0.5 * settings.gaits[gait].stance_s(settings.swing_time_s);
        let Some(Strides { clock, .. }) = walk.strides else { return walk };
        for (index, leg) in walk.legs.iter_mut().enumerate() {
            let middle_s = clock.lift_off_s(index, leg.next_lift) - half_stance_s;
            let at_m = leg.neutral_m + velocity.at_side_m_s(leg.side_m) * middle_s;
            leg.foot = Foot::Stance { at_m, since_s: middle_s - half_stance_s };
        }
        walk
    }

    /// Begins strides of the gait with index `gait` from a stand at `start_s`, with the left hind leg first.
    pub(super) fn begin(&mut self, plan: &HorsePlan, gait: usize, start_s: f64) {
        let settings = &plan.settings;
        let clock = StrideClock::starting(&settings.gaits[gait], settings.swing_time_s, start_s);
        self.strides = Some(Strides::new(plan, clock, gait, gait, false));
        for (index, leg) in self.legs.iter_mut().enumerate() {
            leg.next_lift = clock.next_lift_off(index, start_s);
        }
    }

    /// Sets each standing foot's next lift-off to the clock's first one after `now_s`: those that were
    /// skipped are past.
    pub(super) fn recount_lift_offs(&mut self, now_s: f64) {
        let Some(Strides { clock, .. }) = self.strides else { return };
        for (index, leg) in self.legs.iter_mut().enumerate() {
            if matches!(leg.foot, Foot::Stance { .. }) {
                leg.next_lift = leg.next_lift.max(clock.next_lift_off(index, now_s));
            }
        }
    }

    /// True if the horse stands on its neutral points and will take no more steps.
    pub fn is_standing(&self) -> bool {
        self.strides.is_none()
    }

    /// The gait at time `s`, index into the robot's gaits; `None` when standing.
    pub fn gait(&self, s: f64) -> Option<usize> {
        self.strides.map(|strides| strides.gait_at(s))
    }

    /// Number of strides since the horse began to walk; 0 when standing.
    pub fn phase(&self, s: f64) -> f64 {
        self.strides.map_or(0.0, |strides| strides.clock.phase(s))
    }

    /// Length of the last or present change of gait, strides; 0 if there was none.
    pub fn last_change_strides(&self) -> f64 {
        self.strides.map_or(0.0, |strides| strides.clock.change_strides())
    }

    /// Speed and turn of the trunk at time `s`.
    pub fn velocity(&self, s: f64) -> Velocity {
        self.profile.velocity_at(s)
    }

    /// Height of the trunk above its mean height at time `s`, from the oscillations of the robot's gaits, m.
    pub(super) fn vertical_oscillation_m(&self, plan: &HorsePlan, s: f64) -> f64 {
        let Some(Strides { clock, from, to, .. }) = self.strides else { return 0.0 };
        let vertical_oscillation = |gait: usize| plan.settings.gaits[gait].vertical_oscillation;
        if vertical_oscillation(from) == VerticalOscillation::NONE
            && vertical_oscillation(to) == VerticalOscillation::NONE
        {
            return 0.0;
        }
        let share = clock.share_changed(s);
        let [before, after] = clock.phases_since_left_hind(s);
        vertical_oscillation(from).height_m(before) * (1.0 - share)
            + vertical_oscillation(to).height_m(after) * share
    }

    /// Lifts and lands feet up to time `s`, at the clock's exact times, also between cycles.
    pub fn advance(&mut self, s: f64) {
        let Some(strides) = self.strides else { return };
        for index in 0..4 {
            while let Some((at_s, leg)) = self.next_event(&strides, index, &self.legs[index])
                && at_s <= s
            {
                self.legs[index] = leg;
            }
        }
    }

    /// Ends the strides if they are ending and every foot stands on its neutral point at time `s`.
    pub(super) fn end_if_settled(&mut self, s: f64) {
        if self.strides.is_some_and(|strides| strides.is_ending) && self.has_settled(s) {
            self.strides = None;
        }
    }

    fn has_settled(&self, s: f64) -> bool {
        self.is_still_by(s)
            && self.legs.iter().all(|leg| match leg.foot {
                Foot::Stance { at_m, .. } => self.is_centred(leg, at_m, s),
                Foot::Swing { .. } => false,
            })
    }

    fn is_still_by(&self, s: f64) -> bool {
        s >= self.profile.settled_s() && self.profile.settled().is_still()
    }

    fn is_centred(&self, leg: &Leg, at_m: f64, s: f64) -> bool {
        (at_m - leg.neutral_m - self.distance_m(leg, s)).abs() < CENTRED_M
    }

    fn distance_m(&self, leg: &Leg, s: f64) -> f64 {
        self.profile.distance_at_side_m(s, leg.side_m)
    }

    /// Time of the next lift-off or landing of `leg`, and its state after that; `None` if its state no longer
    /// changes.
    pub(super) fn next_event(&self, strides: &Strides, index: usize, leg: &Leg) -> Option<(f64, Leg)> {
        let mut after = *leg;
        match leg.foot {
            Foot::Stance { at_m, .. } => {
                let lifted_s = strides.clock.lift_off_s(index, leg.next_lift);
                after.next_lift += 1;
                if strides.is_ending && self.is_still_by(lifted_s) && self.is_centred(leg, at_m, lifted_s) {
                    return None;
                }
                let next_s = strides.clock.lift_off_s(index, after.next_lift);
                let middle_m =
                    0.5 * (self.distance_m(leg, lifted_s + self.swing.time_s) + self.distance_m(leg, next_s));
                after.foot = Foot::Swing { lifted_s, from_m: at_m, to_m: middle_m + leg.neutral_m };
                Some((lifted_s, after))
            }
            Foot::Swing { lifted_s, to_m, .. } => {
                let since_s = lifted_s + self.swing.time_s;
                after.foot = Foot::Stance { at_m: to_m, since_s };
                Some((since_s, after))
            }
        }
    }

    /// Height of the foot of `leg` above the ground at time `s`, m.
    pub(super) fn up_m(&self, leg: &Leg, s: f64) -> f64 {
        match leg.foot {
            Foot::Stance { .. } => 0.0,
            Foot::Swing { lifted_s, .. } => self.swing.height_m((s - lifted_s) / self.swing.time_s),
        }
    }

    /// Distance of the foot of `leg` forward of its neutral point at time `s`, m.
    pub(super) fn excursion_m(&self, leg: &Leg, s: f64) -> f64 {
        let at_m = match leg.foot {
            Foot::Stance { at_m, .. } => at_m,
            Foot::Swing { lifted_s, from_m, to_m } => {
                from_m + (to_m - from_m) * self.swing.way((s - lifted_s) / self.swing.time_s)
            }
        };
        at_m - self.distance_m(leg, s) - leg.neutral_m
    }

    /// State of the feet at time `s`, in the order of [`crate::model::LEG_NAMES`].
    pub fn feet(&self, s: f64) -> [FootPlace; 4] {
        std::array::from_fn(|index| {
            let leg = self.legs[index];
            let excursion_m = self.excursion_m(&leg, s);
            let (is_swing, swing_acceleration_m_s2) = match leg.foot {
                Foot::Stance { .. } => (false, 0.0),
                Foot::Swing { from_m, to_m, .. } => (true, self.swing.acceleration_max_m_s2(to_m - from_m)),
            };
            FootPlace {
                excursion_m,
                forward_m: excursion_m + leg.neutral_m,
                up_m: self.up_m(&leg, s),
                side_m: leg.side_m,
                plane_distance_m: self.distance_m(&leg, s),
                is_swing,
                load_share: self.load_share(index, &leg, s),
                swing_acceleration_m_s2,
            }
        })
    }

    /// Fraction of its share of the weight that the foot of `leg` should carry at time `s`: it rises after
    /// landing and falls before lift-off.
    fn load_share(&self, index: usize, leg: &Leg, s: f64) -> f64 {
        let Foot::Stance { since_s, .. } = leg.foot else { return 0.0 };
        let lifts_s =
            self.strides.and_then(|strides| self.next_event(&strides, index, leg)).map(|(at_s, _)| at_s);
        let from_end_s = (s - since_s).min(lifts_s.map_or(f64::INFINITY, |at_s| at_s - s));
        smooth_step(from_end_s / (LOADING_SHARE * self.swing.time_s))
    }

    /// Writes the tips and the plan at time `s` for a trunk in this pose, `sway_m` to the left of its
    /// feet, with its middle over `trunk_m` on the ground.
    pub(super) fn write(
        &self,
        plan: &HorsePlan,
        s: f64,
        trunk: &TrunkPose,
        sway_m: f64,
        trunk_m: DVec2,
        targets: &mut Targets,
    ) {
        let heading = DQuat::from_rotation_z(self.profile.turn_rad(s));
        targets.trunk_in_world = trunk_m.extend(trunk.height_m);
        targets.trunk_orientation = heading * trunk.tilt();
        let (trunk_in_world, trunk_orientation) = (targets.trunk_in_world, targets.trunk_orientation);
        let on_feet = targets.set_tips();
        for (foot, chain) in self.feet(s).iter().zip(plan.settings.legs) {
            let tip = trunk.tip_in_body(foot.forward_m, foot.up_m, foot.side_m - sway_m);
            on_feet.tips_in_body[chain] = tip;
            on_feet.feet.push(FootTarget {
                chain,
                in_world: trunk_in_world + trunk_orientation * tip,
                excursion_m: foot.excursion_m,
                plane_distance_m: foot.plane_distance_m,
                is_swing: foot.is_swing,
                load_share: foot.load_share,
                swing_acceleration_m_s2: foot.swing_acceleration_m_s2,
            });
        }
    }

    /// Writes the same for a trunk that stays level and goes straight ahead, with the gait's vertical oscillation.
    pub fn write_level(&self, plan: &HorsePlan, s: f64, targets: &mut Targets) {
        let height_m = plan.settings.stand_height_m + self.vertical_oscillation_m(plan, s);
        let trunk = TrunkPose { height_m, pitch_rad: 0.0, roll_rad: 0.0 };
        self.write(plan, s, &trunk, 0.0, DVec2::new(self.profile.distance_m(s), 0.0), targets);
    }
}
