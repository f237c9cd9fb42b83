//! The walking horse: a trunk that follows commands and four feet that step under it.
//!
//! ```text
//! Command -> limits, gait by speed (drive, auto) -> plan checked ahead (planner)
//!         -> speed profile and stride clock -> feet (walk) -> tips under a leaning trunk (posture)
//! ```

mod auto;
mod clock;
mod drive;
mod legged;
mod look_ahead;
mod planner;
mod posture;
mod profile;
mod reach_table;
#[cfg(test)]
mod tests;
pub mod thesis_rule;
mod walk;

use glam::DVec3;

use crate::model::{HorseMotion, Robot};
use crate::motion::curves::SwingCurve;
use crate::motion::legged::LeggedGenerator;
use crate::motion::{Command, GaitChoice, Generate, Intent, Plan, Planned};
pub use clock::StrideClock;
pub use drive::Drive;
pub use posture::TrunkPose;
pub use profile::{SpeedProfile, Velocity};
pub use reach_table::{LEVELS, LegReach, ReachTable, Reachable, StridePoint};
pub use walk::{FootPlace, Walk};

/// A horse from limp to limp.
pub type HorseGenerator = LeggedGenerator<Drive>;

/// Share of the half-excursion that steady strides fill: while the speed changes, feet go a little further.
const PLANNED_SHARE: f64 = 0.99;
/// Shortest stance of a change, swing times: 60 ms of the thesis' 0.3 s.
const SHORTEST_STANCE: f64 = 0.2;

/// Data about the robot that a walk needs, computed when the robot loads, and the command it starts with.
#[derive(Debug, Clone)]
pub struct HorsePlan {
    /// The robot's own settings.
    pub settings: HorseMotion,
    /// Neutral foot point of each leg when standing, body frame, m.
    pub neutral_in_body: [DVec3; 4],
    /// How far fore and aft of that point each foot may go, by posture.
    pub reach: ReachTable,
    /// Joint angles of the sitting robot, all chains, rad.
    pub sit_pose_rad: Vec<f64>,
    /// The lowest pose in which all feet stand on their neutral points: the trunk's height, m, and the joint angles, rad.
    pub crouch: (f64, Vec<f64>),
    /// Top speed of each of the settings' gaits.
    pub paces: Vec<Pace>,
    /// True if servos turn its joints; false for a robot on paper.
    pub is_driven: bool,
    /// True if the ground carries it: position servos do not throw it into the air, as gaits with flight would.
    pub stays_on_ground: bool,
    /// The command to carry out if the operator says no more than to go.
    pub command: Command,
}

/// Top speeds of a gait, m/s, both 0 or more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Forward.
    pub forward_m_s: f64,
    /// Backwards.
    pub backward_m_s: f64,
}

impl Pace {
    const NONE: Pace = Pace { forward_m_s: 0.0, backward_m_s: 0.0 };

    fn max(self, other: Pace) -> Pace {
        Pace {
            forward_m_s: self.forward_m_s.max(other.forward_m_s),
            backward_m_s: self.backward_m_s.max(other.backward_m_s),
        }
    }
}

/// The swing curve of a horse with these settings.
pub fn swing_of(horse: &HorseMotion) -> SwingCurve {
    SwingCurve { time_s: horse.swing_time_s, lift_m: horse.swing_lift_m, ramp_share: horse.swing_ramp_share }
}

impl HorsePlan {
    /// Name of a choice of gait, as used in files and options.
    pub fn gait_name(&self, choice: GaitChoice) -> &str {
        match choice {
            GaitChoice::Stand => "stand",
            GaitChoice::Auto => "auto",
            GaitChoice::Gait(gait) => self.settings.gaits.get(gait).map_or("stand", |gait| &gait.name),
        }
    }

    /// The choice of gait with that name; `None` if there is no such gait.
    pub fn gait_choice(&self, name: &str) -> Option<GaitChoice> {
        match name {
            "stand" => Some(GaitChoice::Stand),
            "auto" => Some(GaitChoice::Auto),
            name => self.settings.gaits.iter().position(|gait| gait.name == name).map(GaitChoice::Gait),
        }
    }

    /// Top speeds of the robot in a choice of gait, standing level.
    pub fn pace(&self, choice: GaitChoice) -> Pace {
        let of_gait = |gait: usize| self.paces.get(gait).copied().unwrap_or(Pace::NONE);
        match choice {
            GaitChoice::Stand => Pace::NONE,
            GaitChoice::Auto => self.ladder().map(of_gait).fold(Pace::NONE, Pace::max),
            GaitChoice::Gait(gait) => of_gait(gait),
        }
    }

    /// Top forward speed of the robot in a choice of gait, standing level, m/s.
    pub fn top_speed_m_s(&self, choice: GaitChoice) -> f64 {
        self.pace(choice).forward_m_s
    }

    /// The same plan, with the command to go straight ahead in a gait at `share` of its top speed.
    #[must_use]
    pub fn at_share(mut self, choice: GaitChoice, share: f64) -> HorsePlan {
        let speed_m_s = share * self.top_speed_m_s(choice);
        self.command = Command { gait: choice, speed_m_s, ..Command::default() };
        self
    }

    /// The swing curve of the robot file.
    pub fn swing(&self) -> SwingCurve {
        swing_of(&self.settings)
    }

    /// Largest speed of a foot relative to the trunk, in mid-swing of the gait with index `gait` at its
    /// servos' top speed, m/s; infinite for legs without servos, and while their paces are not known yet.
    fn swing_speed_max_m_s(&self, gait: usize) -> f64 {
        let Some(pace) = self.paces.get(gait).filter(|_| self.is_driven) else { return f64::INFINITY };
        let top_m_s = pace.forward_m_s.max(pace.backward_m_s);
        let stride_m = self.settings.gaits[gait].stride_m(top_m_s, self.settings.swing_time_s);
        self.swing().fastest_m_s(stride_m) - top_m_s
    }

    /// The speed at which a foot that lifts every `interval_s` swings as fast relative to the trunk as either
    /// of two gaits allows, m/s.
    fn speed_by_swing_m_s(&self, from: usize, to: usize, interval_s: f64) -> f64 {
        let fastest_m_s = self.swing_speed_max_m_s(from).max(self.swing_speed_max_m_s(to));
        fastest_m_s / (self.swing().fastest_m_s(interval_s) - 1.0)
    }

    /// The speed at which half a stance of `stance_s` and the overshoot of the swing fill the reach, m/s:
    /// V (stance / 2 + overshoot per speed) = 0.99 E, E being `reach_m`.
    pub fn speed_by_reach_m_s(&self, stance_s: f64, period_s: f64, reach_m: f64) -> f64 {
        let overshoot_s = self.swing().overshoot_m(1.0, period_s);
        PLANNED_SHARE * reach_m / (0.5 * stance_s + overshoot_s)
    }

    /// Top speed of the gait with index `gait` that the legs' reach allows, m/s.
    pub fn top_speed_by_reach_m_s(&self, gait: usize, reach_m: f64) -> f64 {
        let (gait, swing_s) = (&self.settings.gaits[gait], self.settings.swing_time_s);
        self.speed_by_reach_m_s(gait.stance_s(swing_s), gait.period_s(swing_s), reach_m)
    }

    /// Top speed of the gait with index `gait` in the direction of `speed_m_s`, m/s, 0 or more.
    fn top_m_s(&self, gait: usize, speed_m_s: f64, reach_m: f64) -> f64 {
        let Pace { forward_m_s, backward_m_s } = self.paces[gait];
        let by_servos_m_s = if speed_m_s < 0.0 { backward_m_s } else { forward_m_s };
        by_servos_m_s.min(self.top_speed_by_reach_m_s(gait, reach_m))
    }

    /// True if the robot has the gait and can move in it.
    fn can_do(&self, gait: usize) -> bool {
        self.paces.get(gait).is_some_and(|pace| pace.forward_m_s > 0.0)
    }

    /// Gaits that are chosen by speed, from the slowest to the fastest: indices.
    fn ladder(&self) -> impl Iterator<Item = usize> {
        let is_rung = |gait: &usize| self.settings.gaits[*gait].auto_froude_max.is_some();
        let is_reached = |gait: &usize| !(self.stays_on_ground && self.settings.gaits[*gait].has_flight());
        (0..self.settings.gaits.len()).filter(is_rung).filter(is_reached).filter(|gait| self.can_do(*gait))
    }

    /// Half the distance between the outermost legs' planes, m.
    fn half_width_m(&self) -> f64 {
        self.neutral_in_body.iter().map(|neutral| neutral.y.abs()).fold(0.0, f64::max)
    }

    /// The largest speed of any leg's plane, m/s.
    fn fastest_plane_m_s(&self, velocity: Velocity) -> f64 {
        self.neutral_in_body.iter().map(|neutral| velocity.at_side_m_s(neutral.y).abs()).fold(0.0, f64::max)
    }

    /// The slower of the two.
    fn slowest(&self, a: Velocity, b: Velocity) -> Velocity {
        if self.fastest_plane_m_s(a) <= self.fastest_plane_m_s(b) { a } else { b }
    }

    /// The same curve, slowed down until no leg's plane is faster than `top_m_s`.
    fn slowed_to(&self, velocity: Velocity, top_m_s: f64) -> Velocity {
        let fastest_m_s = self.fastest_plane_m_s(velocity);
        if fastest_m_s <= top_m_s { velocity } else { velocity * (top_m_s / fastest_m_s) }
    }

    /// Duration of a change of speed in which no leg's plane exceeds the acceleration limit, s.
    fn ramp_s(&self, from: Velocity, to: Velocity) -> f64 {
        self.fastest_plane_m_s(to - from) / self.settings.acceleration_m_s2
    }

    /// `wanted` limited to what the robot can do in the gait with index `gait`: first the turn to its limit,
    /// then the speed to what that leaves, so that a horse at its top speed slows down to turn.
    fn limited(&self, gait: usize, wanted: Velocity, reach_m: f64) -> Velocity {
        let forward_m_s = self.top_m_s(gait, 1.0, reach_m);
        let backward_m_s = self.top_m_s(gait, -1.0, reach_m);
        let half_width_m = self.half_width_m().max(f64::MIN_POSITIVE);
        let turn_max_rad_s =
            self.settings.yaw_rate_max_rad_s.min(forward_m_s.min(backward_m_s) / half_width_m);
        let yaw_rate_rad_s = wanted.yaw_rate_rad_s.clamp(-turn_max_rad_s, turn_max_rad_s);
        let by_turn_m_s = yaw_rate_rad_s.abs() * half_width_m;
        Velocity {
            speed_m_s: wanted
                .speed_m_s
                .clamp(-(backward_m_s - by_turn_m_s).max(0.0), (forward_m_s - by_turn_m_s).max(0.0)),
            yaw_rate_rad_s,
        }
    }
}

impl Planned for HorsePlan {
    fn resting_pose_rad(&self) -> &[f64] {
        &self.sit_pose_rad
    }

    fn intent(&self) -> Intent<'_> {
        Intent::Drive { gait: self.gait_name(self.command.gait), command: self.command }
    }

    fn done(&self) -> &'static str {
        "walked for the time asked"
    }

    fn generator(&self, robot: &Robot, move_for_s: f64) -> Box<dyn Generate> {
        Box::new(HorseGenerator::new(robot, Drive::standing(self.clone()), move_for_s))
    }

    fn at_share(&self, gait: GaitChoice, speed_share: f64) -> Option<Plan> {
        Some(self.clone().at_share(gait, speed_share).into())
    }
}
