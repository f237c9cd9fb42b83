//! The path on which arms travel: a cubic Bezier curve at constant speed (Ishizuka 2008, 3.5).
//!
//! (3.18) is misprinted and means the Bernstein form; (3.20) and (3.21) print the derivatives without their
//! factors 3 and 6.

use glam::{DVec2, DVec3};

/// Number of pieces of the curve whose lengths are computed in advance.
const PIECES: usize = 32;
/// Number of Newton steps to find a point within a piece.
const NEWTON_STEPS: u32 = 4;

/// Nodes and weights of five-point Gauss-Legendre quadrature on 0 to 1.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_095),
    (0.230_765_344_947_158, 0.239_314_335_249_683),
    (0.5, 0.284_444_444_444_444),
    (0.769_234_655_052_842, 0.239_314_335_249_683),
    (0.953_089_922_969_332, 0.118_463_442_528_095),
];

/// A cubic Bezier curve, with the lengths of its pieces.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    points: [DVec3; 4],
    /// Length from the start to the beginning of each piece, and the whole length, m.
    lengths_m: [f64; PIECES + 1],
}

impl Route {
    /// The route through these control points, m: it begins at the first and ends at the last. `None` if it
    /// has no length or a point is not finite.
    pub fn new(points: [DVec3; 4]) -> Option<Route> {
        let mut route = Route { points, lengths_m: [0.0; PIECES + 1] };
        for piece in 0..PIECES {
            let begin = piece as f64 / PIECES as f64;
            let length_m = route.length_between(begin, (piece + 1) as f64 / PIECES as f64);
            route.lengths_m[piece + 1] = route.lengths_m[piece] + length_m;
        }
        (route.length_m() > 0.0 && route.length_m().is_finite()).then_some(route)
    }

    /// Its length, m.
    pub fn length_m(&self) -> f64 {
        self.lengths_m[PIECES]
    }

    /// The point at the parameter `s`, 0 to 1 (3.19), m.
    pub fn place(&self, s: f64) -> DVec3 {
        let [a, b, c, d] = self.points;
        let t = 1.0 - s;
        a * (t * t * t) + b * (3.0 * s * t * t) + c * (3.0 * s * s * t) + d * (s * s * s)
    }

    /// Its derivative with respect to the parameter, m: 3 times what (3.20) prints.
    pub fn velocity(&self, s: f64) -> DVec3 {
        let [a, b, c, d] = self.points;
        let t = 1.0 - s;
        3.0 * ((b - a) * (t * t) + (c - b) * (2.0 * s * t) + (d - c) * (s * s))
    }

    /// Its second derivative with respect to the parameter, m: 6 times what (3.21) prints.
    pub fn acceleration(&self, s: f64) -> DVec3 {
        let [a, b, c, d] = self.points;
        6.0 * ((c - 2.0 * b + a) * (1.0 - s) + (d - 2.0 * c + b) * s)
    }

    /// The parameter at the distance `distance_m` along it; beyond an end, that end.
    pub fn parameter_at(&self, distance_m: f64) -> f64 {
        let distance_m = distance_m.clamp(0.0, self.length_m());
        let piece = self.lengths_m.partition_point(|begin| *begin <= distance_m).clamp(1, PIECES) - 1;
        let [begin, end] = [piece, piece + 1].map(|piece| piece as f64 / PIECES as f64);
        let (low_m, high_m) = (self.lengths_m[piece], self.lengths_m[piece + 1]);
        let mut s = begin + (end - begin) * (distance_m - low_m) / (high_m - low_m).max(f64::MIN_POSITIVE);
        for _ in 0..NEWTON_STEPS {
            let left_m = distance_m - low_m - self.length_between(begin, s);
            let speed_m = self.velocity(s).length();
            // At a cusp, keep the linear guess.
            if speed_m > 1e-9 * self.length_m() {
                s = (s + left_m / speed_m).clamp(begin, end);
            }
        }
        s
    }

    /// The point after `time_s` at `speed_m_s` from the start, m.
    pub fn place_at(&self, time_s: f64, speed_m_s: f64) -> DVec3 {
        self.place(self.parameter_at(time_s * speed_m_s))
    }

    /// Direction at the distance `distance_m`, unit length; x if the direction is undefined there.
    pub fn direction_at(&self, distance_m: f64) -> DVec3 {
        self.velocity(self.parameter_at(distance_m)).try_normalize().unwrap_or(DVec3::X)
    }

    fn length_between(&self, from: f64, to: f64) -> f64 {
        let speed = |share: f64| self.velocity(from + share * (to - from)).length();
        (to - from) * GAUSS.iter().map(|(node, weight)| weight * speed(*node)).sum::<f64>()
    }
}

/// The sweep that turns strokes towards a direction of travel: from the heading to `direction` (both seen
/// from above, world frame), positive to the left, at most `most_rad` either way, rad.
pub fn sweep_towards(heading_rad: f64, direction: DVec3, most_rad: f64) -> f64 {
    let to = direction.truncate();
    if to.length_squared() <= 0.0 {
        return 0.0;
    }
    DVec2::from_angle(heading_rad).angle_to(to).clamp(-most_rad, most_rad)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    fn bend() -> Route {
        Route::new([
            DVec3::new(0.0, 0.0, 0.0),
            DVec3::new(1.5, 0.2, 0.1),
            DVec3::new(-0.4, 1.0, 0.5),
            DVec3::new(1.0, 1.2, -0.3),
        ])
        .unwrap()
    }

    #[test]
    fn derivatives_are_those_of_numerical_differentiation() {
        let (route, h) = (bend(), 1e-5);
        for step in 1..100 {
            let s = f64::from(step) / 100.0;
            let velocity = (route.place(s + h) - route.place(s - h)) / (2.0 * h);
            assert!(velocity.distance(route.velocity(s)) < 1e-8, "at {s}");
            let acceleration = (route.velocity(s + h) - route.velocity(s - h)) / (2.0 * h);
            assert!(acceleration.distance(route.acceleration(s)) < 1e-8, "at {s}");
        }
        assert_eq!(route.place(0.0), DVec3::ZERO);
        assert!(route.place(1.0).distance(DVec3::new(1.0, 1.2, -0.3)) < 1e-12);
    }

    #[test]
    fn the_speed_along_a_route_is_constant() {
        let route = bend();
        let steps: Vec<f64> = (0..=1000).map(|step| f64::from(step) / 1000.0).collect();
        let polygon: f64 = steps.windows(2).map(|s| route.place(s[0]).distance(route.place(s[1]))).sum();
        assert!((route.length_m() - polygon).abs() < 1e-5, "{} m, {polygon} m by chords", route.length_m());
        let dt_s = route.length_m() / 0.2 / 500.0;
        for step in 0..500 {
            let at = |step: i32| route.place_at(f64::from(step) * dt_s, 0.2);
            let speed_m_s = at(step).distance(at(step + 1)) / dt_s;
            assert!((speed_m_s - 0.2).abs() < 2e-4, "{speed_m_s} m/s at step {step}");
        }
        assert!(route.place_at(1e9, 1.0).distance(route.place(1.0)) < 1e-12, "and it ends at its end");
    }

    #[test]
    fn strokes_turn_towards_the_goal_within_their_limit() {
        assert!((sweep_towards(0.3, DVec3::new(0.0, 2.0, 5.0), 3.0) - (FRAC_PI_2 - 0.3)).abs() < 1e-5);
        assert!(
            (sweep_towards(3.0, DVec3::new(-1.0, -0.2, 0.0), 0.5) - (PI - 3.0 + 0.2_f64.atan())).abs() < 1e-9
        );
        assert!((sweep_towards(0.0, DVec3::NEG_Y, 0.5) + 0.5).abs() < 1e-12);
        assert!(sweep_towards(0.0, DVec3::Z, 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_route_without_length_is_refused() {
        assert_eq!(Route::new([DVec3::ONE; 4]), None);
        assert_eq!(Route::new([DVec3::ZERO, DVec3::X, DVec3::NAN, DVec3::Y]), None);
    }
}
