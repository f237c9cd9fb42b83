//! One joint's goal: finite, in range, within rate and acceleration.

use crate::model::{ALMOST_INSIDE_RAD, Joint, Pace, SafetySettings};

/// Differences smaller than this, rad, are rounding, not interventions.
const ROUNDING_RAD: f64 = 1e-9;
/// A stop gives way by this much, rad, and the horn may be off by as much.
const STOP_SLACK_RAD: f64 = 0.1;

/// Keeps one joint's goals within its limits, and remembers the last goal and its speed.
#[derive(Debug, Clone)]
pub(super) struct Limiter {
    range_rad: (f64, f64),
    rate_rad_s: f64,
    slow_rate_rad_s: f64,
    acceleration_rad_s2: f64,
    /// Range in which the servo has counts.
    servo_range_rad: (f64, f64),
    /// Angles of the joint's mechanical stops.
    stops_rad: (f64, f64),
    goal_rad: f64,
    speed_rad_s: f64,
    /// True from a start until the goal has reached the wanted angle; until then it moves slowly.
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

    /// Starts the next goal at the measured position, at rest; it may lie outside the range. The goal
    /// moves slowly until it has reached the wanted angle.
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

    /// Time that the longest way of a returning joint takes at the slow rate, plus a fifth, s; 0 for a joint that
    /// is not returning.
    pub(super) fn longest_way_s(&self) -> f64 {
        if !self.is_catching_up {
            return 0.0;
        }
        let way_rad = (self.range_rad.1 - self.goal_rad).max(self.goal_rad - self.range_rad.0);
        1.2 * way_rad / self.slow_rate_rad_s
    }

    /// True while the goal is still on its way from where the joint was found to the wanted angle.
    pub(super) fn is_catching_up(&self) -> bool {
        self.is_catching_up
    }

    /// Starts the next goal at the last one, at rest.
    pub(super) fn rest_at_goal(&mut self) {
        self.speed_rad_s = 0.0;
    }

    /// True if the servo has a count for the measured angle.
    pub(super) fn has_counts_at(&self, measured_rad: f64) -> bool {
        is_within(self.servo_range_rad, ROUNDING_RAD, measured_rad)
    }

    /// True if a joint is so near its range that the torque, as it rises from zero, may pull it inside.
    pub(super) fn is_almost_inside(&self, measured_rad: f64) -> bool {
        is_within(self.range_rad, ALMOST_INSIDE_RAD, measured_rad)
    }

    /// True if a joint can be at this angle without having broken its stops.
    pub(super) fn is_between_stops(&self, measured_rad: f64) -> bool {
        is_within(self.stops_rad, STOP_SLACK_RAD, measured_rad)
    }

    pub(super) fn goal_rad(&self) -> f64 {
        self.goal_rad
    }

    /// The allowed goal nearest to `wanted_rad`, `dt_s` after the last one, and whether it had to differ. The servo
    /// may hold any goal from the lowest to the highest of `held_rad`: the next goal is within a step of the rate
    /// of each. A wanted angle that is not finite brings the joint to rest.
    pub(super) fn next(&mut self, wanted_rad: f64, held_rad: (f64, f64), dt_s: f64) -> (f64, bool) {
        if !wanted_rad.is_finite() {
            return self.hold(wanted_rad, held_rad, dt_s);
        }
        // On the way in from outside, the joint may be outside the range, but never further out.
        let (low, high) = (self.range_rad.0.min(self.goal_rad), self.range_rad.1.max(self.goal_rad));
        let in_range = wanted_rad.clamp(low, high);
        let goal = self.goal_rad + self.allowed_speed(in_range - self.goal_rad, dt_s) * dt_s;
        // Range outranks acceleration: a joint never overruns its limit to stop gently.
        let goal = self.near(goal.clamp(low, high), held_rad, dt_s);
        self.accept(goal, dt_s);
        // An angle outside the range counts as reached at the border.
        self.is_catching_up &= differs(goal, in_range);
        (goal, differs(goal, wanted_rad))
    }

    /// The goal before this one, `dt_s` ago, rad.
    pub(super) fn goal_before_rad(&self, dt_s: f64) -> f64 {
        self.goal_rad - self.speed_rad_s * dt_s
    }

    /// Shortens the last step, `dt_s` long, to this `share`; returns the goal.
    pub(super) fn shorten(&mut self, share: f64, dt_s: f64) -> f64 {
        let before = self.goal_before_rad(dt_s);
        let goal = before + share * (self.goal_rad - before);
        self.goal_rad = before;
        self.accept(goal, dt_s);
        goal
    }

    /// Brings the joint to rest as fast as the acceleration limit allows; returns the goal, and whether it differs
    /// from `wanted_rad`.
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

    /// The angle nearest to `goal_rad` that is within a step of the rate of every goal that the servo may hold.
    /// Otherwise a servo that has not heard the last goals would leap to the next.
    fn near(&self, goal_rad: f64, (lowest_rad, highest_rad): (f64, f64), dt_s: f64) -> f64 {
        let step_rad = self.rate_rad_s * dt_s;
        goal_rad.min(lowest_rad + step_rad).max(highest_rad - step_rad)
    }

    /// Speed towards a target `way_rad` away that keeps rate and acceleration, and can still stop there.
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

/// True if an angle is within a range plus a slack, rad.
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

    /// A border that shortens each step more and more slows a joint down, and does not throw it back.
    #[test]
    fn a_shortened_step_keeps_speed_and_goal_consistent() {
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
