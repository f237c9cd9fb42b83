//! How fast a joint's goal may go, and gain and lose speed.

/// The limits of one joint's goal.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    /// Fastest, rad/s.
    pub rate_rad_s: f64,
    /// Most gain or loss of speed, rad/s^2.
    pub acceleration_rad_s2: f64,
}

impl Pace {
    /// Speed, rad/s, for the next `dt_s` of a goal that goes at `speed_rad_s` and has a place `way_rad` off to reach: it
    /// keeps the limits, and the goal can still stop at that place.
    pub fn speed_towards(self, way_rad: f64, speed_rad_s: f64, dt_s: f64) -> f64 {
        let wanted = way_rad / dt_s;
        if self.permits(wanted, speed_rad_s, dt_s) {
            return wanted;
        }
        let change = self.acceleration_rad_s2 * dt_s;
        // The speed from which whole steps of deceleration end on the spot.
        let braking =
            (0.25 * change * change + 2.0 * self.acceleration_rad_s2 * way_rad.abs()).sqrt() - 0.5 * change;
        let towards = wanted.signum() * wanted.abs().min(braking).min(self.rate_rad_s);
        self.speed_near(towards, speed_rad_s, dt_s)
    }

    /// Whether a goal may go at `wanted_rad_s` in the `dt_s` after it went at `speed_rad_s`, rad/s.
    pub fn permits(self, wanted_rad_s: f64, speed_rad_s: f64, dt_s: f64) -> bool {
        let change = self.acceleration_rad_s2 * dt_s;
        wanted_rad_s.abs() <= self.rate_rad_s && (wanted_rad_s - speed_rad_s).abs() <= change * (1.0 + 1e-9)
    }

    /// The nearest to `wanted_rad_s` that may follow `speed_rad_s` after `dt_s`, rad/s. The rate outranks the
    /// acceleration.
    pub fn speed_near(self, wanted_rad_s: f64, speed_rad_s: f64, dt_s: f64) -> f64 {
        let change = self.acceleration_rad_s2 * dt_s;
        wanted_rad_s
            .clamp(speed_rad_s - change, speed_rad_s + change)
            .clamp(-self.rate_rad_s, self.rate_rad_s)
    }
}
