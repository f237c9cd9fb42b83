//! One joint's goal: finite, in range, within rate and acceleration.

use crate::model::{Joint, Pace, SafetySettings};

/// Differences smaller than this, rad, are rounding, not interventions.
const ROUNDING_RAD: f64 = 1e-9;
/// Play, sag and the error of a horn take a limp joint out of its range by this much, rad.
const ALMOST_RAD: f64 = 0.1;
/// A stop gives way by this much, rad, and the horn may be off by as much.
const STOP_SLACK_RAD: f64 = 0.1;

/// Holds one joint's goals to its limits, and remembers the last goal and its speed.
#[derive(Debug, Clone)]
pub(super) struct Limiter {
    range_rad: (f64, f64),
    rate_rad_s: f64,
    slow_rate_rad_s: f64,
    acceleration_rad_s2: f64,
    /// Where the servo has counts.
    servo_range_rad: (f64, f64),
    /// Where the joint meets its mechanical stops.
    stops_rad: (f64, f64),
    goal_rad: f64,
    speed_rad_s: f64,
    /// True from a start until the goal has reached what is wanted; till then it moves slowly.
    is_catching_up: bool,
}

impl Limiter {
    pub(super) fn new(joint: &Joint, settings: &SafetySettings) -> Limiter {
        let rate_rad_s = settings.rate_share * joint.no_load_speed_rad_s();
        Limiter {
            range_rad: joint.goal_range_rad(),
            rate_rad_s,
            slow_rate_rad_s: settings.slow_rate_rad_s.min(rate_rad_s),
            acceleration_rad_s2: settings.acceleration_rad_s2,
            servo_range_rad: joint.servo_range_rad(),
            stops_rad: joint.stops_rad(),
            goal_rad: 0.0,
            speed_rad_s: 0.0,
            is_catching_up: false,
        }
    }

    /// The next goal follows from here, at rest: the measured position, which may lie outside the range. The goal
    /// moves slowly until it has reached what is wanted.
    pub(super) fn start_from(&mut self, measured_rad: f64) {
        if measured_rad.is_finite() {
            self.goal_rad = measured_rad;
            self.speed_rad_s = 0.0;
            self.is_catching_up = true;
        }
    }

    /// The same inside the range, whatever was measured: for a joint that was inside and gave way.
    pub(super) fn start_inside(&mut self, measured_rad: f64) {
        self.start_from(measured_rad.clamp(self.range_rad.0, self.range_rad.1));
    }

    /// How long the longest way of a joint on its way back takes, s, at the slow rate, and a fifth more; 0 for one that is
    /// not on its way back.
    pub(super) fn longest_way_s(&self) -> f64 {
        if !self.is_catching_up {
            return 0.0;
        }
        let way_rad = (self.range_rad.1 - self.goal_rad).max(self.goal_rad - self.range_rad.0);
        1.2 * way_rad / self.slow_rate_rad_s
    }

    /// Whether the goal is still on its way to what is wanted, from where the joint was found.
    pub(super) fn is_catching_up(&self) -> bool {
        self.is_catching_up
    }

    /// The next goal follows from the last one, at rest.
    pub(super) fn rest_at_goal(&mut self) {
        self.speed_rad_s = 0.0;
    }

    /// Whether the servo has a count for the measured angle.
    pub(super) fn has_counts_at(&self, measured_rad: f64) -> bool {
        is_within(self.servo_range_rad, ROUNDING_RAD, measured_rad)
    }

    /// Whether a joint is so near its range that the torque, as it rises from nothing, may pull it inside.
    pub(super) fn is_almost_inside(&self, measured_rad: f64) -> bool {
        is_within(self.range_rad, ALMOST_RAD, measured_rad)
    }

    /// Whether a joint can be there without having broken its stops.
    pub(super) fn is_between_stops(&self, measured_rad: f64) -> bool {
        is_within(self.stops_rad, STOP_SLACK_RAD, measured_rad)
    }

    pub(super) fn goal_rad(&self) -> f64 {
        self.goal_rad
    }

    /// Nearest goal to `wanted_rad` that is allowed `dt_s` after the last one, and whether it had to differ. The servo
    /// may hold any goal from the lowest to the highest of `held_rad`: the next is a step of the rate from each.
    /// A wanted angle that is not finite brings the joint to rest.
    pub(super) fn next(&mut self, wanted_rad: f64, held_rad: (f64, f64), dt_s: f64) -> (f64, bool) {
        if !wanted_rad.is_finite() {
            return self.hold(wanted_rad, held_rad, dt_s);
        }
        // On the way in from outside, the joint may be where it is, but never further out.
        let (low, high) = (self.range_rad.0.min(self.goal_rad), self.range_rad.1.max(self.goal_rad));
        let in_range = wanted_rad.clamp(low, high);
        let goal = self.goal_rad + self.allowed_speed(in_range - self.goal_rad, dt_s) * dt_s;
        // Range outranks acceleration: a joint never overruns its limit to stop gently.
        let goal = self.near(goal.clamp(low, high), held_rad, dt_s);
        self.accept(goal, dt_s);
        // What is wanted outside the range is as near as it gets.
        self.is_catching_up &= differs(goal, in_range);
        (goal, differs(goal, wanted_rad))
    }

    /// The goal before this one, `dt_s` ago, rad.
    pub(super) fn goal_before_rad(&self, dt_s: f64) -> f64 {
        self.goal_rad - self.speed_rad_s * dt_s
    }

    /// Takes back all but this `share` of the last step, `dt_s` long; returns the goal.
    pub(super) fn shorten(&mut self, share: f64, dt_s: f64) -> f64 {
        let before = self.goal_before_rad(dt_s);
        let goal = before + share * (self.goal_rad - before);
        self.goal_rad = before;
        self.accept(goal, dt_s);
        goal
    }

    /// Comes to rest as fast as the acceleration limit allows; returns the goal, and whether that is not
    /// `wanted_rad`.
    pub(super) fn hold(&mut self, wanted_rad: f64, held_rad: (f64, f64), dt_s: f64) -> (f64, bool) {
        let goal = self.rest(held_rad, dt_s);
        (goal, differs(goal, wanted_rad))
    }

    fn rest(&mut self, held_rad: (f64, f64), dt_s: f64) -> f64 {
        let change = self.acceleration_rad_s2 * dt_s;
        let speed = self.speed_rad_s - self.speed_rad_s.clamp(-change, change);
        let (low, high) = (self.range_rad.0.min(self.goal_rad), self.range_rad.1.max(self.goal_rad));
        let goal = self.near((self.goal_rad + speed * dt_s).clamp(low, high), held_rad, dt_s);
        self.accept(goal, dt_s);
        goal
    }

    /// The nearest to `goal_rad` that is no further than a step of the rate from any goal the servo may hold. A servo that
    /// has not heard the last goals would else leap to the next.
    fn near(&self, goal_rad: f64, (lowest_rad, highest_rad): (f64, f64), dt_s: f64) -> f64 {
        let step_rad = self.rate_rad_s * dt_s;
        goal_rad.min(lowest_rad + step_rad).max(highest_rad - step_rad)
    }

    /// Speed towards a place `way_rad` off that keeps rate and acceleration, and can still stop there.
    fn allowed_speed(&self, way_rad: f64, dt_s: f64) -> f64 {
        let is_slow = self.is_outside() || self.is_catching_up;
        let rate_rad_s = if is_slow { self.slow_rate_rad_s } else { self.rate_rad_s };
        let pace = Pace { rate_rad_s, acceleration_rad_s2: self.acceleration_rad_s2 };
        pace.speed_towards(way_rad, self.speed_rad_s, dt_s)
    }

    fn is_outside(&self) -> bool {
        self.goal_rad < self.range_rad.0 - ROUNDING_RAD || self.goal_rad > self.range_rad.1 + ROUNDING_RAD
    }

    fn accept(&mut self, goal_rad: f64, dt_s: f64) {
        self.speed_rad_s = (goal_rad - self.goal_rad) / dt_s;
        self.goal_rad = goal_rad;
    }
}

/// Whether an angle is within a range and a slack beyond, rad.
fn is_within(range_rad: (f64, f64), slack_rad: f64, angle_rad: f64) -> bool {
    (range_rad.0 - slack_rad..=range_rad.1 + slack_rad).contains(&angle_rad)
}

/// An angle that is not finite differs from every goal.
fn differs(goal_rad: f64, wanted_rad: f64) -> bool {
    !wanted_rad.is_finite() || (goal_rad - wanted_rad).abs() > ROUNDING_RAD
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    /// A border that lets less and less of each step through slows a joint down, and does not throw it back.
    #[test]
    fn a_step_that_is_shortened_leaves_the_speed_it_had() {
        let text = include_str!("../../config/figure.toml");
        let robot = crate::config::parse(text, "figure.toml").unwrap().robot;
        let mut limiter = Limiter::new(&robot.joints[0], &robot.safety);
        let dt_s = robot.period_s();
        limiter.start_from(0.0);
        let mut before = limiter.goal_rad();
        for cycle in 0..200 {
            limiter.next(1.0, (before, before), dt_s);
            let share = if cycle < 20 { 1.0 } else { 0.3 };
            let goal = limiter.shorten(share, dt_s);
            assert!(goal >= before, "cycle {cycle}: back from {before} to {goal}");
            assert!((limiter.speed_rad_s - (goal - before) / dt_s).abs() < 1e-9, "cycle {cycle}");
            assert!((limiter.goal_before_rad(dt_s) - before).abs() < 1e-12, "cycle {cycle}");
            before = goal;
        }
    }
}
