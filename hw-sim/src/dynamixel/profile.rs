//! The trajectory to a goal: a velocity that ramps up, stays and ramps down. Source: ROBOTIS e-manual,
//! X-series, "What is the Profile", Profile Acceleration (108), Profile Velocity (112), Moving Status (123).
//!
//! In: start, goal, the two registers. Out: position and velocity at any time. The manual says that after a
//! new goal in motion the velocity changes smoothly to the new profile: here the new profile starts with the
//! position and velocity of the old one.

/// Unit of Profile Velocity, count/s: 0.229 rpm.
pub(super) const VELOCITY_UNIT: f64 = 0.229 / 60.0 * 4096.0;
/// Unit of Profile Acceleration, count/s²: 214.577 rev/min².
const ACCELERATION_UNIT: f64 = 214.577 / 3600.0 * 4096.0;
/// Unit of both in a time-based profile, s.
const TIME_UNIT: f64 = 1e-3;

/// Kind of a profile, as in bits 4 and 5 of Moving Status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// No profile.
    Step = 0,
    /// Velocity without ramps.
    Rectangular = 1,
    /// Never reaches the highest velocity.
    Triangular = 2,
    Trapezoidal = 3,
}

/// The profile registers, in their own units. 0 means no limit; without a velocity limit there is no profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Settings {
    pub(super) velocity: i64,
    pub(super) acceleration: i64,
    pub(super) is_time_based: bool,
}

/// One moment of a profile.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Point {
    /// Counts.
    pub(super) position: f64,
    /// count/s.
    pub(super) velocity: f64,
    /// count/s².
    pub(super) acceleration: f64,
}

impl Point {
    pub(super) fn rest(position: f64) -> Point {
        Point { position, ..Point::default() }
    }
}

/// Velocity against time as three straight pieces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Profile {
    pub(super) kind: Kind,
    /// Goal of the profile, in the goal register's unit, and its settings.
    goal: i64,
    settings: Settings,
    start_ns: u64,
    start: Point,
    end: Point,
    /// Velocity between the ramps, count/s.
    cruise: f64,
    /// Durations of ramp, cruise and ramp, s.
    durations: [f64; 3],
}

impl Profile {
    /// A profile from `start` to rest at the position `goal`, counts.
    pub(super) fn to_position(start: Point, goal: i64, settings: Settings, start_ns: u64) -> Profile {
        let place = float(goal);
        let (kind, cruise, durations) = match settings {
            Settings { velocity: 0, .. } => (Kind::Step, 0.0, [0.0; 3]),
            Settings { is_time_based: true, .. } => in_time(start, place, settings),
            Settings { acceleration: 0, velocity, .. } => {
                let distance = place - start.position;
                let cruise = (float(velocity) * VELOCITY_UNIT).copysign(distance);
                (Kind::Rectangular, cruise, [0.0, distance / cruise, 0.0])
            }
            _ => with_ramps(start, place, settings),
        };
        Profile { kind, goal, settings, start_ns, start, end: Point::rest(place), cruise, durations }
    }

    /// A profile from `start` to the velocity `goal`, in units of [`VELOCITY_UNIT`].
    pub(super) fn to_velocity(start: Point, goal: i64, settings: Settings, start_ns: u64) -> Profile {
        let velocity = float(goal) * VELOCITY_UNIT;
        let acceleration = float(settings.acceleration);
        let (kind, duration) = match settings {
            Settings { acceleration: 0, .. } => (Kind::Step, 0.0),
            Settings { is_time_based: true, .. } => (Kind::Trapezoidal, acceleration * TIME_UNIT),
            _ => {
                let change = (velocity - start.velocity).abs();
                (Kind::Trapezoidal, change / (acceleration * ACCELERATION_UNIT))
            }
        };
        let end = Point { velocity, ..Point::default() };
        let durations = [duration, 0.0, 0.0];
        Profile { kind, goal, settings, start_ns, start, end, cruise: velocity, durations }
    }

    /// True if it was made for this goal with these settings.
    pub(super) fn is_for(&self, goal: i64, settings: Settings) -> bool {
        self.goal == goal && self.settings == settings
    }

    pub(super) fn is_over(&self, now_ns: u64) -> bool {
        self.elapsed_s(now_ns) >= self.durations.iter().sum()
    }

    #[expect(
        clippy::cast_precision_loss,
        reason = "a way takes minutes, and has 52 bits for its nanoseconds"
    )]
    fn elapsed_s(&self, now_ns: u64) -> f64 {
        now_ns.saturating_sub(self.start_ns) as f64 * 1e-9
    }

    /// The point at `now_ns`.
    pub(super) fn at(&self, now_ns: u64) -> Point {
        let mut left_s = self.elapsed_s(now_ns);
        let mut position = self.start.position;
        let velocities = [self.start.velocity, self.cruise, self.cruise, self.end.velocity];
        for (ends, duration) in velocities.windows(2).zip(self.durations) {
            let (from, to) = (ends[0], ends[1]);
            if left_s < duration {
                let acceleration = (to - from) / duration;
                let velocity = from + acceleration * left_s;
                return Point {
                    position: position + (from + velocity) / 2.0 * left_s,
                    velocity,
                    acceleration,
                };
            }
            position += (from + to) / 2.0 * duration;
            left_s -= duration;
        }
        self.end
    }
}

/// Profile with given total and ramp times; a ramp takes at most half of the total.
fn in_time(start: Point, goal: f64, settings: Settings) -> (Kind, f64, [f64; 3]) {
    let total = float(settings.velocity) * TIME_UNIT;
    let ramp = (float(settings.acceleration) * TIME_UNIT).min(total / 2.0);
    let cruise = (goal - start.position - start.velocity * ramp / 2.0) / (total - ramp);
    let kind = if settings.acceleration == 0 {
        Kind::Rectangular
    } else if ramp < total / 2.0 {
        Kind::Trapezoidal
    } else {
        Kind::Triangular
    };
    (kind, cruise, [ramp, total - 2.0 * ramp, ramp])
}

/// Profile with given highest velocity and acceleration. All but the result is computed in the direction of
/// the cruise: from the point where it would come to rest if it braked now, towards the goal.
fn with_ramps(start: Point, goal: f64, settings: Settings) -> (Kind, f64, [f64; 3]) {
    let highest = float(settings.velocity) * VELOCITY_UNIT;
    let acceleration = float(settings.acceleration) * ACCELERATION_UNIT;
    let braking = start.velocity * start.velocity.abs() / (2.0 * acceleration);
    let forward = 1.0f64.copysign(goal - start.position - braking);
    let (distance, first) = (forward * (goal - start.position), forward * start.velocity);
    let reachable = (acceleration * distance + first * first / 2.0).max(0.0).sqrt();
    let cruise = if first > highest { highest } else { highest.min(reachable) };
    let ramps = (cruise * cruise - first * first) / (2.0 * acceleration)
        * if first > cruise { -1.0 } else { 1.0 }
        + cruise * cruise / (2.0 * acceleration);
    let between = if cruise > 0.0 { ((distance - ramps) / cruise).max(0.0) } else { 0.0 };
    let kind = if cruise < highest { Kind::Triangular } else { Kind::Trapezoidal };
    let durations = [(cruise - first).abs() / acceleration, between, cruise / acceleration];
    (kind, forward * cruise, durations)
}

#[expect(clippy::cast_precision_loss, reason = "registers have 32 bits at most")]
fn float(value: i64) -> f64 {
    value as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convert::nanoseconds;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        /// From any position and speed to any goal: no jump in position, none in velocity where there are
        /// ramps, within the velocity and acceleration limits, and up to the goal.
        #[test]
        fn every_profile_is_continuous_and_ends_at_its_goal(
            position in -5_000.0..5_000.0f64,
            velocity in -3_000.0..3_000.0f64,
            goal in -5_000i64..5_000,
            fastest in 1i64..400,
            steepest in 0i64..400,
            is_time_based: bool,
        ) {
            let settings = Settings { velocity: fastest, acceleration: steepest, is_time_based };
            let start = Point { position, velocity, acceleration: 0.0 };
            let profile = Profile::to_position(start, goal, settings, 0);
            let total: f64 = profile.durations.iter().sum();
            prop_assert!(profile.durations.iter().all(|duration| *duration >= 0.0), "{:?}", profile);
            if is_time_based {
                prop_assert!((total - float(fastest) * TIME_UNIT).abs() < 1e-9);
            }
            let step_ns = 1 + nanoseconds(total / 500.0);
            #[expect(clippy::cast_precision_loss, reason = "a step is short")]
            let step_s = 1e-9 * step_ns as f64;
            let mut last = profile.at(0);
            prop_assert!((last.position - position).abs() < 1e-6);
            for step in 1..=501 {
                let now = profile.at(step * step_ns);
                let has_ramps = steepest > 0;
                if has_ramps && !is_time_based {
                    let most = float(steepest) * ACCELERATION_UNIT * step_s;
                    prop_assert!((now.velocity - last.velocity).abs() < most * 1.001 + 1e-6, "{:?}", profile);
                    let limit = (float(fastest) * VELOCITY_UNIT).max(velocity.abs());
                    prop_assert!(now.velocity.abs() < limit + 1e-6);
                }
                // The distance is the area under the velocity; this is not exact if the velocity bends inside
                // the step.
                let faster = now.velocity.abs().max(last.velocity.abs()).max(profile.cruise.abs());
                prop_assert!((now.position - last.position).abs() < faster * step_s + 1e-6, "{:?}", profile);
                last = now;
            }
            prop_assert!(profile.is_over(501 * step_ns));
            prop_assert_eq!(last, Point::rest(float(goal)));
        }
    }
}
