//! The curves of which motions consist: the smooth step and the swing of a foot.

use std::f64::consts::{PI, TAU};

/// Quintic smooth step: 0 at u <= 0, 1 at u >= 1, first and second derivative 0 at both ends.
pub fn smooth_step(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// Largest slope of [`smooth_step`], at u = 1/2.
pub const SMOOTH_STEP_SLOPE_MAX: f64 = 1.875;

/// Integral of [`smooth_step`] from 0 to u, for 0 <= u <= 1.
pub fn smooth_step_integral(u: f64) -> f64 {
    u * u * u * u * (2.5 + u * (u - 3.0))
}

/// The swing of a foot: the share of its way, and its height, over the swing time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwingCurve {
    /// Swing time, s.
    pub time_s: f64,
    /// Height in mid-swing, m.
    pub lift_m: f64,
    /// Share of the swing time in which the foot accelerates, and again that in which it slows down; 0 < r < 0.5.
    pub ramp_share: f64,
}

impl SwingCurve {
    /// Share of the way completed at the share `u` of the time: speed rises linearly from rest over the ramp share,
    /// stays constant, and falls to rest again, so that world velocity is continuous at lift-off and landing.
    pub fn way(&self, u: f64) -> f64 {
        let (u, r) = (u.clamp(0.0, 1.0), self.ramp_share);
        let peak = 1.0 / (1.0 - r);
        if u < r {
            0.5 * peak * u * u / r
        } else if u <= 1.0 - r {
            peak * (u - 0.5 * r)
        } else {
            1.0 - 0.5 * peak * (1.0 - u) * (1.0 - u) / r
        }
    }

    /// Largest speed of a foot in a swing of `distance_m`, m/s.
    pub fn fastest_m_s(&self, distance_m: f64) -> f64 {
        distance_m / ((1.0 - self.ramp_share) * self.time_s)
    }

    /// Height above the ground at the share `u` of the time, m: lift sin^2(pi u).
    pub fn height_m(&self, u: f64) -> f64 {
        let sine = (PI * u.clamp(0.0, 1.0)).sin();
        self.lift_m * sine * sine
    }

    /// An upper bound on the acceleration of a foot in a swing of `distance_m`, m/s^2.
    pub fn acceleration_max_m_s2(&self, distance_m: f64) -> f64 {
        let along = distance_m / ((1.0 - self.ramp_share) * self.ramp_share * self.time_s * self.time_s);
        let up = self.lift_m * 0.5 * (TAU / self.time_s) * (TAU / self.time_s);
        along.hypot(up)
    }

    /// How far behind the lift-off point, in the body's frame, the foot falls at the steady speed `speed_m_s`
    /// before it is as fast as the trunk, m; it overshoots the landing point ahead by the same distance.
    /// `period_s` is the stride's.
    pub fn overshoot_m(&self, speed_m_s: f64, period_s: f64) -> f64 {
        0.5 * speed_m_s * self.catch_up_s(speed_m_s * period_s, speed_m_s)
    }

    /// Time from lift-off until the foot, in a swing of `distance_m`, is as fast as a trunk at `speed_m_s`, s; the
    /// time from when it is slower again until it lands is the same. At most the ramp's time; 0 if the foot
    /// goes the other way.
    pub fn catch_up_s(&self, distance_m: f64, speed_m_s: f64) -> f64 {
        let ramp_s = self.ramp_share * self.time_s;
        let acceleration = distance_m / ((1.0 - self.ramp_share) * ramp_s * self.time_s);
        if acceleration * speed_m_s <= 0.0 { 0.0 } else { (speed_m_s / acceleration).min(ramp_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_foot_starts_and_lands_at_rest_and_never_exceeds_its_acceleration() {
        let swing = SwingCurve { time_s: 0.3, lift_m: 0.1, ramp_share: 0.15 };
        let (way, dt) = (2.0, 1e-5);
        let at = |s: f64| {
            let u = s / swing.time_s;
            (way * swing.way(u), swing.height_m(u))
        };
        let mut before = (0.0, 0.0);
        for step in 0..30_001 {
            let s = f64::from(step) * dt;
            let (a, b) = (at(s), at(s + dt));
            let velocity = ((b.0 - a.0) / dt, (b.1 - a.1) / dt);
            let jump = f64::hypot(velocity.0 - before.0, velocity.1 - before.1);
            assert!(jump <= swing.acceleration_max_m_s2(way) * dt * (1.0 + 1e-6) + 1e-9, "at {s} s");
            before = velocity;
        }
        assert!((swing.way(1.0) - 1.0).abs() < 1e-15 && swing.height_m(1.0).abs() < 1e-15);
        assert!((swing.height_m(0.5) - 0.1).abs() < 1e-15);
    }

    #[test]
    fn overshoot_is_that_of_the_swing_curve_in_the_body_frame() {
        let swing = SwingCurve { time_s: 0.3, lift_m: 0.0, ramp_share: 0.1 };
        let (speed, period) = (13.3, 0.4);
        let furthest = (0..3000)
            .map(|step| f64::from(step) * 1e-4)
            .map(|s| speed * period * swing.way(s / 0.3) - speed * s)
            .fold(0.0_f64, f64::min);
        assert!((swing.overshoot_m(speed, period) + furthest).abs() < 1e-5);
    }
}
