//! Limits on the speed and acceleration of a joint's goal.

/// The limits of one joint's goal.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    /// Largest speed, rad/s.
    pub rate_rad_s: f64,
    /// Largest acceleration or deceleration, rad/s^2.
    pub acceleration_rad_s2: f64,
}

impl Pace {
    /// Speed, rad/s, for the next `dt_s` of a goal that moves at `speed_rad_s` towards a position `way_rad`
    /// off: it keeps the limits, and the goal can still stop at that position.
    pub fn speed_towards(self, way_rad: f64, speed_rad_s: f64, dt_s: f64) -> f64 {
        let wanted = way_rad / dt_s;
        if self.permits(wanted, speed_rad_s, dt_s) {
            return wanted;
        }
        let change = self.acceleration_rad_s2 * dt_s;
        // The speed from which whole steps of deceleration end exactly at the position.
        let braking =
            (0.25 * change * change + 2.0 * self.acceleration_rad_s2 * way_rad.abs()).sqrt() - 0.5 * change;
        let towards = wanted.signum() * wanted.abs().min(braking).min(self.rate_rad_s);
        self.speed_near(towards, speed_rad_s, dt_s)
    }

    /// True if a goal may move at `wanted_rad_s` in the `dt_s` after it moved at `speed_rad_s`, rad/s.
    pub fn permits(self, wanted_rad_s: f64, speed_rad_s: f64, dt_s: f64) -> bool {
        let change = self.acceleration_rad_s2 * dt_s;
        wanted_rad_s.abs() <= self.rate_rad_s && (wanted_rad_s - speed_rad_s).abs() <= change * (1.0 + 1e-9)
    }

    /// The speed nearest to `wanted_rad_s` that may follow `speed_rad_s` after `dt_s`, rad/s. The rate limit
    /// takes precedence over the acceleration limit.
    pub fn speed_near(self, wanted_rad_s: f64, speed_rad_s: f64, dt_s: f64) -> f64 {
        let change = self.acceleration_rad_s2 * dt_s;
        wanted_rad_s
            .clamp(speed_rad_s - change, speed_rad_s + change)
            .clamp(-self.rate_rad_s, self.rate_rad_s)
    }
}
