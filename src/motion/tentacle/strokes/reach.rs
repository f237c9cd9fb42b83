//! Reaching: the arm nearest to a point brings its tip there, with or without a direction.

use glam::DVec3;

use super::{Needs, Shown, StrokeKind};
use crate::model::GROUPS;
use crate::motion::Place;
use crate::motion::tentacle::arm_plan::{ArmPlan, TIP_LENGTHS_S, nearest};
use crate::motion::tentacle::follower::{Follower, Limits};
use crate::motion::tentacle::perform::{Course, Moment, Perform};
use crate::signals::{ArmAim, ArmTarget};

/// The stroke.
pub const KIND: StrokeKind = StrokeKind {
    name: NAME,
    meaning: "brings the tip of the nearest arm to a point, with a direction if you give one; follows a point that \
              moves",
    key: Some('4'),
    needs: Needs::Point,
    is_rhythmic: false,
    shown: Some(Shown { strokes: 0.0, hold_s: 4.0 }),
    make: |_| Box::new(Reach::default()),
};

const NAME: &str = "reach";
/// Largest acceleration of a tip after a point, arm lengths per s^2.
const TIP_LENGTHS_S2: f64 = 2.0;
/// Largest speed and acceleration of the direction of a tip, rad/s and rad/s^2.
const DIRECTION_LIMITS: Limits = Limits { speed: 1.0, acceleration: 4.0 };
/// A point that moves this much further in a cycle than a tip can counts as a new point, arm lengths.
const LEAP_LENGTHS: f64 = 0.02;
/// A direction that turns this far in a cycle counts as a new one, rad.
const LEAP_RAD: f64 = 0.1;

/// Reaches for a point that moves; only a point that jumps away starts a new motion.
#[derive(Debug, Default)]
struct Reach {
    /// The arm that reaches, index into the arms.
    arm: usize,
    has_direction: bool,
    /// The target point, body frame, m, and the target direction.
    point: Follower,
    direction: Follower,
}

impl Reach {
    /// True if the target point is a new one rather than the same point that moved on.
    fn leaps(&self, moment: &Moment<'_>, in_body: DVec3, direction: Option<DVec3>) -> bool {
        let most_m = self.length_m(moment.arms) * (LEAP_LENGTHS + TIP_LENGTHS_S * moment.dt_s);
        let turns = |direction: DVec3| self.direction.leap(direction.normalize_or_zero()) > LEAP_RAD;
        self.point.leap(in_body) > most_m || direction.is_some_and(turns)
    }

    /// Length of the arm that reaches, m.
    fn length_m(&self, arms: &[ArmPlan]) -> f64 {
        arms.get(self.arm).map_or(0.0, ArmPlan::length_m)
    }
}

impl Perform for Reach {
    fn step(&mut self, moment: &Moment<'_>) -> Course {
        let Place::Point { in_body, direction } = moment.command.stroke.place else { return Course::Parks };
        let begins = moment.is_new
            || self.has_direction != direction.is_some()
            || self.leaps(moment, in_body, direction);
        self.has_direction = direction.is_some();
        let direction = direction.unwrap_or_default().normalize_or_zero();
        if begins {
            self.arm = nearest(moment.arms, in_body);
            self.point = Follower::at(in_body);
            self.direction = Follower::at(direction);
        }
        let length_m = self.length_m(moment.arms);
        let limits = Limits { speed: TIP_LENGTHS_S * length_m, acceleration: TIP_LENGTHS_S2 * length_m };
        self.point.step(moment.dt_s, in_body, limits);
        self.direction.step(moment.dt_s, direction, DIRECTION_LIMITS);
        if begins { Course::Begins } else { Course::Continues }
    }

    fn write(&self, index: usize, _arm: &ArmPlan, _turn_rad: f64, target: &mut ArmTarget) {
        if index == self.arm {
            target.aim = if self.has_direction { ArmAim::TipAlong } else { ArmAim::Tip };
            target.ends_in_body[GROUPS - 1] = self.point.place();
            target.direction_in_body = self.direction.place();
        }
    }

    fn name(&self) -> &'static str {
        NAME
    }
}
