//! The trunk's speed and turn over time, known in advance.

use std::ops::{Add, Mul, Sub};

/// Speed and turn of the trunk.
///
/// A leg works in one plane, fore and aft, at a fixed distance beside the trunk's middle. In a turn each
/// plane has its own speed, `V - w y`, and so its own stride.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Velocity {
    /// Forward, m/s.
    pub speed_m_s: f64,
    /// To the left, rad/s.
    pub yaw_rate_rad_s: f64,
}

impl Velocity {
    /// Standing still.
    pub const STILL: Velocity = Velocity { speed_m_s: 0.0, yaw_rate_rad_s: 0.0 };

    /// Speed of the plane `side_m` to the left of the trunk's middle, m/s.
    pub fn at_side_m_s(self, side_m: f64) -> f64 {
        self.speed_m_s - self.yaw_rate_rad_s * side_m
    }

    /// True if speed and yaw rate are zero.
    pub fn is_still(self) -> bool {
        self.speed_m_s.abs() < f64::MIN_POSITIVE && self.yaw_rate_rad_s.abs() < f64::MIN_POSITIVE
    }
}

impl Add for Velocity {
    type Output = Velocity;
    fn add(self, other: Velocity) -> Velocity {
        Velocity {
            speed_m_s: self.speed_m_s + other.speed_m_s,
            yaw_rate_rad_s: self.yaw_rate_rad_s + other.yaw_rate_rad_s,
        }
    }
}

impl Sub for Velocity {
    type Output = Velocity;
    fn sub(self, other: Velocity) -> Velocity {
        self + other * -1.0
    }
}

impl Mul<f64> for Velocity {
    type Output = Velocity;
    fn mul(self, factor: f64) -> Velocity {
        Velocity { speed_m_s: self.speed_m_s * factor, yaw_rate_rad_s: self.yaw_rate_rad_s * factor }
    }
}

/// Most pieces of a profile: the present motion, and two ramps with the time between them, twice over.
const PIECES: usize = 10;

/// Constant acceleration from `start_s` on, until the next piece begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Piece {
    start_s: f64,
    /// Velocity at its start.
    velocity: Velocity,
    /// Change of the velocity per second.
    gain: Velocity,
    /// Path length and heading of the trunk up to its start, m and rad.
    distance_m: f64,
    turn_rad: f64,
}

impl Piece {
    fn velocity_at(&self, s: f64) -> Velocity {
        self.velocity + self.gain * (s - self.start_s)
    }

    fn distance_m(&self, s: f64) -> f64 {
        let t = s - self.start_s;
        self.distance_m + t * (self.velocity.speed_m_s + 0.5 * t * self.gain.speed_m_s)
    }

    fn turn_rad(&self, s: f64) -> f64 {
        let t = s - self.start_s;
        self.turn_rad + t * (self.velocity.yaw_rate_rad_s + 0.5 * t * self.gain.yaw_rate_rad_s)
    }
}

/// Speed and turn over time: straight lines, joined without a jump; constant after the last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedProfile {
    pieces: [Piece; PIECES],
    count: usize,
}

impl SpeedProfile {
    /// The same velocity for good; path length and heading are 0 at time 0.
    pub fn constant(velocity: Velocity) -> SpeedProfile {
        let mut pieces = [Piece::default(); PIECES];
        pieces[0].velocity = velocity;
        SpeedProfile { pieces, count: 1 }
    }

    fn pieces(&self) -> &[Piece] {
        &self.pieces[..self.count]
    }

    fn piece(&self, s: f64) -> &Piece {
        let later = self.pieces().iter().rposition(|piece| piece.start_s <= s);
        &self.pieces[later.unwrap_or(0)]
    }

    /// Speed and turn at time `s`.
    pub fn velocity_at(&self, s: f64) -> Velocity {
        self.piece(s).velocity_at(s)
    }

    /// Path length of the trunk's middle up to time `s`, m.
    pub fn distance_m(&self, s: f64) -> f64 {
        self.piece(s).distance_m(s)
    }

    /// Heading at time `s`, rad, to the left of the heading at time 0.
    pub fn turn_rad(&self, s: f64) -> f64 {
        self.piece(s).turn_rad(s)
    }

    /// Path length up to time `s` of the plane `side_m` to the left of the trunk's middle, m.
    pub fn distance_at_side_m(&self, s: f64, side_m: f64) -> f64 {
        let piece = self.piece(s);
        piece.distance_m(s) - piece.turn_rad(s) * side_m
    }

    /// Time when the last change is over, s.
    pub fn settled_s(&self) -> f64 {
        self.pieces[self.count - 1].start_s
    }

    /// The final velocity.
    pub fn settled(&self) -> Velocity {
        self.pieces[self.count - 1].velocity
    }

    /// Calls `f` with the time of every turning point of the plane at `side_m` between `from_s` and `to_s`.
    pub fn for_turning_points(&self, side_m: f64, from_s: f64, to_s: f64, mut f: impl FnMut(f64)) {
        for (index, piece) in self.pieces().iter().enumerate() {
            let end_s = self.pieces().get(index + 1).map_or(f64::INFINITY, |next| next.start_s);
            let still_s = piece.start_s - piece.velocity.at_side_m_s(side_m) / piece.gain.at_side_m_s(side_m);
            if still_s > from_s.max(piece.start_s) && still_s < to_s.min(end_s) {
                f(still_s);
            }
        }
    }

    /// The same profile until `s`, and constant from then on; pieces that are over by `now_s` are dropped.
    pub fn until(&self, now_s: f64, s: f64) -> SpeedProfile {
        let first = self.pieces().iter().rposition(|piece| piece.start_s <= now_s).unwrap_or(0);
        let mut profile = SpeedProfile { pieces: [Piece::default(); PIECES], count: 0 };
        for piece in self.pieces()[first..].iter().take_while(|piece| piece.start_s < s) {
            profile.pieces[profile.count] = *piece;
            profile.count += 1;
        }
        if profile.count == 0 {
            profile.pieces[0] = self.pieces[first];
            profile.count = 1;
        }
        profile.hold(s);
        profile
    }

    /// Adds a ramp from the end of the last one to `velocity`, `duration_s` long. False if there is no room for it.
    #[must_use]
    pub fn ramp_to(&mut self, velocity: Velocity, duration_s: f64) -> bool {
        if self.count + 1 >= PIECES {
            return false;
        }
        let last = &mut self.pieces[self.count - 1];
        if duration_s <= 0.0 {
            last.velocity = velocity;
            return true;
        }
        let end_s = last.start_s + duration_s;
        last.gain = (velocity - last.velocity) * (1.0 / duration_s);
        self.hold(end_s);
        self.pieces[self.count - 1].velocity = velocity;
        true
    }

    /// Delays the end of the last ramp until `s`.
    #[must_use]
    pub fn wait_until(&mut self, s: f64) -> bool {
        if self.count + 1 >= PIECES {
            return false;
        }
        if s > self.settled_s() {
            self.hold(s);
        }
        true
    }

    /// Adds a piece from `s` on that keeps the velocity reached there.
    fn hold(&mut self, s: f64) {
        let last = self.pieces[self.count - 1];
        let held = Piece {
            start_s: s,
            velocity: last.velocity_at(s),
            gain: Velocity::STILL,
            distance_m: last.distance_m(s),
            turn_rad: last.turn_rad(s),
        };
        if self.count < PIECES {
            self.pieces[self.count] = held;
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile() -> SpeedProfile {
        let start = Velocity { speed_m_s: 0.4, yaw_rate_rad_s: -0.2 };
        let mut profile = SpeedProfile::constant(start).until(0.0, 1.0);
        assert!(profile.ramp_to(Velocity { speed_m_s: -0.5, yaw_rate_rad_s: 0.3 }, 2.0));
        assert!(profile.wait_until(4.0));
        assert!(profile.ramp_to(Velocity { speed_m_s: 1.0, yaw_rate_rad_s: 0.0 }, 0.5));
        profile
    }

    #[test]
    fn distance_is_the_integral_of_speed_and_nothing_jumps() {
        let (profile, dt, side) = (profile(), 1e-4, 0.3);
        let mut way = 0.0;
        for step in 0..60_000 {
            let s = f64::from(step) * dt;
            let middle = profile.velocity_at(s + 0.5 * dt);
            way += middle.at_side_m_s(side) * dt;
            assert!((way - profile.distance_at_side_m(s + dt, side)).abs() < 1e-7, "at {s} s");
            // 1.3 m/s in half a second is the steepest.
            let change = profile.velocity_at(s + dt).speed_m_s - profile.velocity_at(s).speed_m_s;
            assert!(change.abs() <= 3.0 * dt * (1.0 + 1e-6), "at {s} s");
        }
        assert_eq!(profile.settled(), Velocity { speed_m_s: 1.0, yaw_rate_rad_s: 0.0 });
        assert!((profile.settled_s() - 4.5).abs() < 1e-12);
    }

    #[test]
    fn turning_points_are_where_the_direction_reverses() {
        let profile = profile();
        let mut found = Vec::new();
        profile.for_turning_points(0.0, 0.0, 10.0, |s| found.push(s));
        // 0.4 m/s less 0.45 a second from 1 s on; -0.5 m/s more 3 a second from 4 s on.
        let expected = [1.0 + 0.4 / 0.45, 4.0 + 0.5 / 3.0];
        assert_eq!(found.len(), 2);
        assert!(found.iter().zip(expected).all(|(s, expected)| (s - expected).abs() < 1e-12));
    }

    #[test]
    fn kept_parts_of_a_profile_stay_exactly_equal() {
        let whole = profile();
        let kept = whole.until(3.5, 4.2);
        for s in [3.5, 3.9, 4.0, 4.1, 4.2] {
            assert!((kept.distance_at_side_m(s, 0.1) - whole.distance_at_side_m(s, 0.1)).abs() < 1e-15);
            assert!((kept.turn_rad(s) - whole.turn_rad(s)).abs() < 1e-15);
        }
        assert_eq!(kept.settled(), whole.velocity_at(4.2));
    }
}
