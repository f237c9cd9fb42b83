//! Follows a point that moves: without lag on a steady path, never with a jump of speed.

use glam::DVec3;

/// Rate at which the remaining difference fades, 1/s.
const STIFFNESS_S: f64 = 8.0;

/// Largest speed, in its unit per second, and largest change of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    pub(super) speed: f64,
    pub(super) acceleration: f64,
}

/// A point that follows another.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Follower {
    at: DVec3,
    speed: DVec3,
    asked: DVec3,
}

impl Follower {
    /// At rest at `place`.
    pub(super) fn at(place: DVec3) -> Follower {
        Follower { at: place, speed: DVec3::ZERO, asked: place }
    }

    /// Its position.
    pub(super) fn place(&self) -> DVec3 {
        self.at
    }

    /// Distance of `asked` from the last target.
    pub(super) fn leap(&self, asked: DVec3) -> f64 {
        self.asked.distance(asked)
    }

    /// Follows `asked` for `dt_s`, like a spring without overshoot that takes the speed of `asked` into
    /// account: at a steady speed no difference remains.
    pub(super) fn step(&mut self, dt_s: f64, asked: DVec3, limits: Limits) {
        let asked_speed = ((asked - self.asked) / dt_s).clamp_length_max(limits.speed);
        self.asked = asked;
        let left = asked - self.at;
        let wanted = STIFFNESS_S * (STIFFNESS_S * left + 2.0 * (asked_speed - self.speed));
        let speed = self.speed + dt_s * wanted.clamp_length_max(limits.acceleration);
        // The speed from which it can still stop in time, plus the speed of the target.
        let braking = (2.0 * limits.acceleration * left.length()).sqrt() + asked_speed.length();
        let most = limits.speed.min(braking.max((self.speed.length() - limits.acceleration * dt_s).max(0.0)));
        self.speed = speed.clamp_length_max(most);
        self.at += self.speed * dt_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { speed: 0.3, acceleration: 0.8 };
    const DT_S: f64 = 0.01;

    #[test]
    fn a_point_on_a_circle_is_followed_within_a_fiftieth_of_its_radius() {
        let circle = |time_s: f64| 0.1 * DVec3::new((1.5 * time_s).cos(), (1.5 * time_s).sin(), 0.0);
        let mut follower = Follower::at(circle(0.0));
        for step in 1..2000 {
            let (before, now) = (follower, circle(f64::from(step) * DT_S));
            follower.step(DT_S, now, LIMITS);
            let change = (follower.speed - before.speed).length() / DT_S;
            assert!(change <= 1.01 * LIMITS.acceleration, "{change} m/s^2 at {step}");
            let off_m = follower.place().distance(now);
            assert!(step < 200 || off_m < 0.005, "{off_m} m off at {step}");
        }
    }

    #[test]
    fn a_follower_comes_to_rest_on_a_fixed_point() {
        let mut follower = Follower::at(DVec3::ZERO);
        for step in 0..600 {
            let before = follower.speed;
            follower.step(DT_S, DVec3::new(0.05, -0.02, 0.1), LIMITS);
            assert!(follower.speed.length() <= LIMITS.speed + 1e-12);
            let change = (follower.speed - before).length() / DT_S;
            assert!(change <= 1.01 * LIMITS.acceleration, "{change} m/s^2 at {step}");
        }
        assert!(follower.place().distance(DVec3::new(0.05, -0.02, 0.1)) < 1e-6);
        assert!(follower.speed.length() < 1e-6);
    }
}
