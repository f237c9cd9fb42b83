//! Posture of the trunk over the feet, and the transition from one posture to the next.

use glam::{DQuat, DVec3};

use crate::motion::Posture;

/// Fastest change of height, shares of the standing height per second.
const RISE_RATE: f64 = 0.2;
/// Fastest change of pitch and roll, rad/s.
const TILT_RATE_RAD_S: f64 = 0.2;
/// Time constant that rounds the corners of a change, s.
const ROUNDING_S: f64 = 0.15;
/// A posture has reached its goal once it is this close in time at those rates, s.
const THERE_S: f64 = 1e-7;

/// The present posture, on its straight way to a goal: at a constant rate, with rounded corners, so that no
/// velocity jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PostureTransition {
    stand_height_m: f64,
    goal: Posture,
    /// Moves straight to the goal at a constant rate.
    lead: Posture,
    /// Follows the lead.
    now: Posture,
}

impl PostureTransition {
    pub(super) fn level(stand_height_m: f64) -> PostureTransition {
        let level = Posture::default();
        PostureTransition { stand_height_m, goal: level, lead: level, now: level }
    }

    pub(super) fn now(&self) -> Posture {
        self.now
    }

    pub(super) fn goal(&self) -> Posture {
        self.goal
    }

    /// The two postures from which the way to a new goal would start.
    pub(super) fn way_begins(&self) -> [Posture; 2] {
        [self.now, self.lead]
    }

    pub(super) fn aim_for(&mut self, goal: Posture) {
        self.goal = goal;
    }

    /// True once the trunk is level at its standing height and will stay so.
    pub(super) fn is_level(&self) -> bool {
        let level = Posture::default();
        self.goal == level && self.now == level
    }

    pub(super) fn advance(&mut self, dt_s: f64) {
        let length_rate = RISE_RATE * self.stand_height_m;
        let duration_s = |from: Posture, to: Posture| {
            let turn = (to.pitch_rad - from.pitch_rad).abs().max((to.roll_rad - from.roll_rad).abs());
            let way = (to.rise_m - from.rise_m).abs().max((to.sway_m - from.sway_m).abs());
            (turn / TILT_RATE_RAD_S).max(way / length_rate)
        };
        let left_s = duration_s(self.lead, self.goal);
        self.lead = if left_s <= dt_s { self.goal } else { self.lead.towards(self.goal, dt_s / left_s) };
        self.now = self.now.towards(self.lead, 1.0 - (-dt_s / ROUNDING_S).exp());
        if self.lead == self.goal && duration_s(self.now, self.goal) < THERE_S {
            self.now = self.goal;
        }
    }
}

/// Height of the trunk above the ground that a leg's foot stands on, and its trunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrunkPose {
    /// Height of the trunk's middle, m.
    pub height_m: f64,
    /// Pitch, nose down, rad.
    pub pitch_rad: f64,
    /// Roll, left side up, rad.
    pub roll_rad: f64,
}

impl TrunkPose {
    /// Rotation of the trunk relative to level, without its heading.
    pub fn tilt(&self) -> DQuat {
        DQuat::from_rotation_y(self.pitch_rad) * DQuat::from_rotation_x(self.roll_rad)
    }

    /// Position in the body frame of a foot `forward_m` ahead of the trunk's middle and `up_m` above the
    /// ground, level, in the plane `side_m` to the left of the trunk's own middle plane, m. The plane leans
    /// with the trunk: in a roll the foot is where the plane meets that height.
    pub fn tip_in_body(&self, forward_m: f64, up_m: f64, side_m: f64) -> DVec3 {
        let (pitch_sine, pitch_cosine) = self.pitch_rad.sin_cos();
        let (roll_sine, roll_cosine) = self.roll_rad.sin_cos();
        let below_m = up_m - self.height_m;
        let along_m = forward_m * pitch_cosine - below_m * pitch_sine;
        let across_m = forward_m * pitch_sine + below_m * pitch_cosine;
        DVec3::new(along_m, side_m, (across_m - side_m * roll_sine) / roll_cosine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaning_trunk_leaves_its_feet_where_they_are() {
        for (pitch_rad, roll_rad) in [(0.0, 0.0), (0.2, 0.0), (0.0, -0.15), (-0.2, 0.1)] {
            let trunk = TrunkPose { height_m: 0.19, pitch_rad, roll_rad };
            for (forward, up, side) in [(0.1, 0.0, 0.06), (-0.15, 0.012, -0.06)] {
                let tip = trunk.tip_in_body(forward, up, side);
                let level = trunk.tilt() * tip;
                assert!((level.x - forward).abs() < 1e-15, "forward at {pitch_rad}, {roll_rad}");
                assert!((level.z - (up - 0.19)).abs() < 1e-15, "height at {pitch_rad}, {roll_rad}");
                assert!((tip.y - side).abs() < 1e-15, "the leg's plane is the trunk's");
            }
        }
    }

    #[test]
    fn a_posture_is_reached_without_a_jump_of_velocity() {
        let mut transition = PostureTransition::level(0.19);
        let goal = Posture { rise_m: -0.02, pitch_rad: 0.1, roll_rad: -0.05, sway_m: 0.0 };
        transition.aim_for(goal);
        let (dt, mut before, mut speed_before) = (0.01, transition.now(), 0.0);
        for cycle in 0..500 {
            if cycle == 30 {
                transition.aim_for(Posture { rise_m: 0.01, ..goal });
            }
            transition.advance(dt);
            let speed = (transition.now().rise_m - before.rise_m) / dt;
            // The lead reverses at once; the time constant turns this into an acceleration.
            let bound = 2.0 * RISE_RATE * 0.19 / ROUNDING_S;
            assert!((speed - speed_before).abs() <= bound * dt, "cycle {cycle}");
            (before, speed_before) = (transition.now(), speed);
        }
        assert_eq!(transition.now(), Posture { rise_m: 0.01, ..goal });
        transition.aim_for(Posture::default());
        for _ in 0..500 {
            transition.advance(dt);
        }
        assert!(transition.is_level());
    }
}
