//! The trajectory to a goal, under acceleration and running speed. In: goal, limits. Out: set position. Knows no
//! registers. Source: Feetech wiki, memory-sts, addresses 41 and 46.

/// A set point that moves to its goal.
#[derive(Debug, Default)]
pub(super) struct Profile {
    /// Its position, counts.
    pub(super) position: f64,
    /// Its speed, counts/s.
    pub(super) speed: f64,
}

impl Profile {
    /// Stands still at `position`.
    pub(super) fn rest_at(position: f64) -> Profile {
        Profile { position, speed: 0.0 }
    }

    /// One step of `dt_s` towards `goal` (counts), no faster than `speed_max` (counts/s) and with at most
    /// `acceleration` (counts/s²); both may be infinite.
    pub(super) fn step_to(&mut self, goal: f64, speed_max: f64, acceleration: f64, dt_s: f64) {
        let way = goal - self.position;
        let change = acceleration * dt_s;
        // Highest speed that can still stop at the goal, in whole steps; NaN if the acceleration is infinite, which
        // `min` ignores.
        let stoppable = ((0.5 * change).powi(2) + 2.0 * acceleration * way.abs()).sqrt() - 0.5 * change;
        let wanted = stoppable.min(speed_max).min(way.abs() / dt_s).copysign(way);
        self.speed += (wanted - self.speed).clamp(-change, change);
        self.position += self.speed * dt_s;
        if acceleration.is_infinite() {
            // A jump leaves no speed to slow down from.
            self.speed = 0.0;
        }
    }

    /// One step of the speed alone.
    pub(super) fn step_speed(&mut self, wanted: f64, acceleration: f64, dt_s: f64) {
        let change = acceleration * dt_s;
        self.speed += (wanted - self.speed).clamp(-change, change);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (time to the goal in s, top speed, largest change of speed in a step)
    fn run(goal: f64, speed_max: f64, acceleration: f64) -> (f64, f64, f64) {
        let (mut profile, mut top, mut change, mut steps) = (Profile::default(), 0f64, 0f64, 0);
        while (profile.position - goal).abs() > 1e-3 && steps < 100_000 {
            let before = profile.speed;
            profile.step_to(goal, speed_max, acceleration, 1e-3);
            top = top.max(profile.speed.abs());
            change = change.max((profile.speed - before).abs());
            assert!(profile.position.abs() <= goal.abs() + 1e-3, "never beyond: {}", profile.position);
            steps += 1;
        }
        (f64::from(steps) * 1e-3, top, change)
    }

    #[test]
    fn a_trapezoid_takes_distance_over_speed_plus_speed_over_acceleration() {
        for sign in [1.0, -1.0] {
            let (time_s, top, change) = run(sign * 2000.0, 1000.0, 2000.0);
            assert!((time_s - (2000.0 / 1000.0 + 1000.0 / 2000.0)).abs() < 0.01, "{time_s}");
            assert!(top <= 1000.0 + 1e-9 && change <= 2.0 + 1e-9, "{top} {change}");
        }
    }

    #[test]
    fn a_short_move_has_a_triangular_profile() {
        let (time_s, top, _) = run(100.0, 1000.0, 2000.0);
        assert!((time_s - 2.0 * (100.0f64 / 2000.0).sqrt()).abs() < 0.01, "{time_s}");
        assert!((top - (100.0f64 * 2000.0).sqrt()).abs() < 10.0, "{top}");
    }

    #[test]
    fn a_move_without_limits_arrives_at_once() {
        assert!((run(4000.0, f64::INFINITY, f64::INFINITY).0 - 1e-3).abs() < 1e-9);
        assert!((run(1000.0, 500.0, f64::INFINITY).0 - 2.0).abs() < 2e-3);
    }
}
