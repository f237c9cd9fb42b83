//! The walking horse: a trunk that follows a speed ramp and four feet that step under it.
//!
//! One clock for all legs; a leg lifts when the clock passes its lag, swings for the swing time, and
//! lands half-way between where its root will be at touch-down and at the next lift-off (both read ahead
//! in the ramp). So every stance is centred under the leg, whatever the speed does, and no foot slips.

mod generator;
#[cfg(test)]
mod tests;
pub mod thesis_rule;

use glam::DVec3;

use crate::model::{Gait, HorseMotion};
use crate::motion::curves::{SMOOTH_STEP_SLOPE_MAX, SpeedRamp, SwingCurve};
use crate::signals::{FootTarget, Targets};
pub use generator::HorseGenerator;

/// What a walk needs to know of the robot, worked out when the robot loads.
#[derive(Debug, Clone)]
pub struct HorsePlan {
    /// The robot's own settings.
    pub settings: HorseMotion,
    /// Neutral foot point of each leg when standing, body frame, m.
    pub neutral_in_body: [DVec3; 4],
    /// How far fore and aft of it every foot may go, m.
    pub half_excursion_m: f64,
    /// Joint angles of the sitting robot, all chains, rad.
    pub sit_pose_rad: Vec<f64>,
    /// The gait it will walk.
    pub gait: Gait,
    /// The speed it will walk at, m/s, within what geometry and servos allow.
    pub speed_m_s: f64,
}

/// A foot is on its neutral point when this close to it, m.
const CENTRED_M: f64 = 1e-9;

/// A start that would leave a foot out of reach is made slower by this factor, this often at most.
const RAMP_GROWTH: f64 = 1.1;
const RAMPS_TRIED: u32 = 40;
/// How much longer than the acceleration limit asks for a stop may take, tried in this order.
const STOP_STRETCHES: [f64; 6] = [1.0, 1.3, 1.7, 2.2, 3.5, 6.0];

/// A walk under way.
#[derive(Debug, Clone)]
pub struct Walk {
    swing: SwingCurve,
    period_s: f64,
    ramp: SpeedRamp,
    legs: [Leg; 4],
}

#[derive(Debug, Clone, Copy)]
struct Leg {
    /// Neutral foot point ahead of the trunk, m.
    neutral_m: f64,
    foot: Foot,
    next_lift_s: f64,
}

#[derive(Debug, Clone, Copy)]
enum Foot {
    /// On the ground here (world x, m).
    Stance { at_m: f64 },
    /// In the air since `lifted_s`, between these places (world x, m).
    Swing { lifted_s: f64, from_m: f64, to_m: f64 },
}

/// Share of the half-excursion steady strides fill: while the speed changes, feet go a little further.
const PLANNED_SHARE: f64 = 0.99;

impl HorsePlan {
    /// The speed at which half a stance and the overshoot of the swing fill the reach, m/s:
    /// V (alpha T / 2 + overshoot per speed) = 0.99 E.
    pub fn top_speed_by_reach_m_s(&self) -> f64 {
        let period_s = self.gait.period_s(self.settings.swing_time_s);
        let overshoot_s = self.swing().overshoot_m(1.0, period_s);
        PLANNED_SHARE * self.half_excursion_m / (0.5 * self.gait.duty_factor * period_s + overshoot_s)
    }

    /// The swing curve of the robot file.
    pub fn swing(&self) -> SwingCurve {
        SwingCurve {
            time_s: self.settings.swing_time_s,
            lift_m: self.settings.swing_lift_m,
            ramp_share: self.settings.swing_ramp_share,
        }
    }
}

impl Walk {
    /// A horse that stands on its neutral points and takes no step.
    pub fn standing(plan: &HorsePlan) -> Walk {
        Walk {
            swing: plan.swing(),
            period_s: plan.gait.period_s(plan.settings.swing_time_s),
            ramp: SpeedRamp::still(0.0),
            legs: plan.neutral_in_body.map(|neutral| Leg {
                neutral_m: neutral.x,
                foot: Foot::Stance { at_m: neutral.x },
                next_lift_s: f64::INFINITY,
            }),
        }
    }

    /// The same, beginning to walk at time `start_s` with the left hind, and at full speed after `ramp_s`
    /// (see [`Walk::find_start_ramp_s`]).
    pub fn begin(plan: &HorsePlan, start_s: f64, ramp_s: f64) -> Walk {
        let mut walk = Walk::standing(plan);
        for (leg, lag) in walk.legs.iter_mut().zip(plan.gait.lags) {
            leg.next_lift_s = start_s + lag * walk.period_s;
        }
        walk.ramp =
            SpeedRamp { start_s, duration_s: ramp_s, from_m_s: 0.0, to_m_s: plan.speed_m_s, start_m: 0.0 };
        walk
    }

    /// Shortest time to speed up in, s, that keeps the acceleration and leaves no foot out of reach: feet that
    /// wait long for their first step are left behind, and swings end in a faster stride than they began in.
    pub fn find_start_ramp_s(plan: &HorsePlan) -> f64 {
        let mut ramp_s = Walk::standing(plan).ramp_duration_s(plan, plan.speed_m_s);
        for _ in 0..RAMPS_TRIED {
            if Walk::begin(plan, 0.0, ramp_s).stays_in_reach(plan, 0.0, ramp_s) {
                break;
            }
            ramp_s *= RAMP_GROWTH;
        }
        ramp_s
    }

    /// True if no foot leaves the half-excursion from `from_s` until one period after `until_s`.
    fn stays_in_reach(mut self, plan: &HorsePlan, from_s: f64, until_s: f64) -> bool {
        let step_s = self.swing.time_s / 200.0;
        let mut s = from_s;
        while s < until_s + self.period_s {
            self.advance(s);
            if self.legs.iter().any(|leg| self.excursion_m(leg, s).abs() > plan.half_excursion_m) {
                return false;
            }
            s += step_s;
        }
        true
    }

    /// How far the foot of `leg` is ahead of its neutral point at time `s`, m.
    fn excursion_m(&self, leg: &Leg, s: f64) -> f64 {
        let at_m = match leg.foot {
            Foot::Stance { at_m } => at_m,
            Foot::Swing { lifted_s, from_m, to_m } => {
                from_m + (to_m - from_m) * self.swing.way((s - lifted_s) / self.swing.time_s)
            }
        };
        at_m - self.ramp.place_m(s) - leg.neutral_m
    }

    /// A horse that has long been walking at `speed_m_s` when time begins; settled after one stride.
    pub fn cruising(plan: &HorsePlan, speed_m_s: f64) -> Walk {
        let mut walk = Walk::standing(plan);
        walk.ramp = SpeedRamp { from_m_s: speed_m_s, to_m_s: speed_m_s, ..walk.ramp };
        for (leg, lag) in walk.legs.iter_mut().zip(plan.gait.lags) {
            leg.next_lift_s = lag * walk.period_s;
            let half_stance_s = 0.5 * plan.gait.duty_factor * walk.period_s;
            leg.foot = Foot::Stance { at_m: leg.neutral_m + speed_m_s * (leg.next_lift_s - half_stance_s) };
        }
        walk
    }

    /// From `s` on, slows down to a stand, if that can be done now without a foot leaving its reach: one that
    /// is in the air while the horse speeds up lands where only a faster trunk will catch up with it.
    /// Returns whether it does; if not, nothing has changed, and in another phase of the stride it will. If it
    /// `must`, it does in any case, in the gentlest way.
    pub fn try_stop(&mut self, plan: &HorsePlan, s: f64, must: bool) -> bool {
        let (from_m_s, start_m) = (self.ramp.speed_m_s(s), self.ramp.place_m(s));
        let shortest_s = self.ramp_duration_s(plan, from_m_s);
        for stretch in STOP_STRETCHES {
            let duration_s = stretch * shortest_s;
            let mut stopping = self.clone();
            stopping.ramp = SpeedRamp { start_s: s, duration_s, from_m_s, to_m_s: 0.0, start_m };
            let is_last_resort = must && stretch >= STOP_STRETCHES[STOP_STRETCHES.len() - 1];
            if is_last_resort || stopping.clone().stays_in_reach(plan, s, s + duration_s) {
                *self = stopping;
                return true;
            }
        }
        false
    }

    fn ramp_duration_s(&self, plan: &HorsePlan, change_m_s: f64) -> f64 {
        (SMOOTH_STEP_SLOPE_MAX * change_m_s.abs() / plan.settings.acceleration_m_s2).max(self.period_s)
    }

    /// True once stopped with every foot on the ground at its neutral point.
    pub fn is_standing(&self, s: f64) -> bool {
        self.is_stopped_by(s)
            && self.legs.iter().all(|leg| match leg.foot {
                Foot::Stance { at_m } => self.is_centred(leg, at_m, s),
                Foot::Swing { .. } => false,
            })
    }

    fn is_stopped_by(&self, s: f64) -> bool {
        self.ramp.to_m_s.abs() < f64::MIN_POSITIVE && s >= self.ramp.end_s()
    }

    fn is_centred(&self, leg: &Leg, at_m: f64, s: f64) -> bool {
        (at_m - leg.neutral_m - self.ramp.place_m(s)).abs() < CENTRED_M
    }

    /// Lifts and lands feet up to time `s`, at the exact times the clock gives, between cycles too.
    pub fn advance(&mut self, s: f64) {
        for index in 0..4 {
            loop {
                let leg = self.legs[index];
                match leg.foot {
                    Foot::Stance { at_m } if s >= leg.next_lift_s => {
                        let lifted_s = leg.next_lift_s;
                        self.legs[index].next_lift_s += self.period_s;
                        if !(self.is_stopped_by(lifted_s) && self.is_centred(&leg, at_m, lifted_s)) {
                            let root_m = 0.5
                                * (self.ramp.place_m(lifted_s + self.swing.time_s)
                                    + self.ramp.place_m(lifted_s + self.period_s));
                            self.legs[index].foot =
                                Foot::Swing { lifted_s, from_m: at_m, to_m: root_m + leg.neutral_m };
                        }
                    }
                    Foot::Swing { lifted_s, to_m, .. } if s >= lifted_s + self.swing.time_s => {
                        self.legs[index].foot = Foot::Stance { at_m: to_m };
                    }
                    _ => break,
                }
            }
        }
    }

    /// Writes the tips and the plan at time `s` for a trunk `height_m` above the ground.
    pub fn write(&self, plan: &HorsePlan, s: f64, height_m: f64, targets: &mut Targets) {
        let trunk_m = self.ramp.place_m(s);
        targets.trunk_in_world = DVec3::new(trunk_m, 0.0, height_m);
        targets.feet.clear();
        for (index, leg) in self.legs.iter().enumerate() {
            let (at_m, up_m, is_swing, bound) = match leg.foot {
                Foot::Stance { at_m } => (at_m, 0.0, false, 0.0),
                Foot::Swing { lifted_s, from_m, to_m } => {
                    let u = (s - lifted_s) / self.swing.time_s;
                    let bound = self.swing.acceleration_max_m_s2(to_m - from_m);
                    (from_m + (to_m - from_m) * self.swing.way(u), self.swing.height_m(u), true, bound)
                }
            };
            let chain = plan.settings.legs[index];
            let in_world = DVec3::new(at_m, plan.neutral_in_body[index].y, up_m);
            targets.tips_in_body[chain] = in_world - targets.trunk_in_world;
            targets.feet.push(FootTarget {
                chain,
                in_world,
                excursion_m: at_m - trunk_m - leg.neutral_m,
                is_swing,
                swing_acceleration_m_s2: bound,
            });
        }
    }

    /// Speed of the trunk at time `s`, m/s.
    pub fn speed_m_s(&self, s: f64) -> f64 {
        self.ramp.speed_m_s(s)
    }
}
