//! The way a robot went while it walked, beside the way it was asked to go.

use glam::{DQuat, DVec3, EulerRot};
use serde::Serialize;

use crate::observe::CycleRecord;

/// A way over the ground, as the trunk is turned at each moment.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct GroundPath {
    /// Mean speed forward over the time of walking, m/s.
    pub speed_m_s: f64,
    /// Turn to the left, degrees; whole turns count.
    pub turn_deg: f64,
    /// Way to the left, m.
    pub side_m: f64,
    /// Way forward, m.
    pub distance_m: f64,
}

/// Adds up a way from places and yaws, cycle by cycle.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    /// Place (m) and yaw (rad) in the cycle before.
    last: Option<(DVec3, f64)>,
    forward_m: f64,
    side_m: f64,
    turn_rad: f64,
}

impl Sum {
    fn add(&mut self, place_m: DVec3, yaw_rad: f64) {
        if let Some((last_m, last_rad)) = self.last {
            let distance_m = DQuat::from_rotation_z(-yaw_rad) * (place_m - last_m);
            self.forward_m += distance_m.x;
            self.side_m += distance_m.y;
            let turn_rad = (yaw_rad - last_rad).rem_euclid(std::f64::consts::TAU);
            self.turn_rad +=
                if turn_rad > std::f64::consts::PI { turn_rad - std::f64::consts::TAU } else { turn_rad };
        }
        self.last = Some((place_m, yaw_rad));
    }

    fn way(&self, walked_s: f64) -> GroundPath {
        GroundPath {
            speed_m_s: self.forward_m / walked_s,
            turn_deg: self.turn_rad.to_degrees(),
            side_m: self.side_m,
            distance_m: self.forward_m,
        }
    }
}

/// How much of a way that goes to and fro was reached: both add up without their signs cancelling.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Followed {
    /// What was asked for, in either direction.
    pub asked: f64,
    /// What was reached in the direction asked for at each moment.
    pub reached: f64,
}

impl Followed {
    fn add(&mut self, asked: f64, reached: f64) {
        self.asked += asked.abs();
        if asked.abs() > 0.0 {
            self.reached += reached * asked.signum();
        }
    }
}

/// A robot's walking in one run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WalkTotals {
    /// How long, s.
    pub time_s: f64,
    /// The way it was asked to go, and the way it went.
    pub asked: GroundPath,
    /// See `asked`.
    pub reached: GroundPath,
    /// Way forward and backward, m.
    pub forward_m: Followed,
    /// Turns to either side, rad.
    pub turn_rad: Followed,
    /// Share of the time in which all feet were planned to be off the ground.
    pub flight_share: f64,
}

/// Both ways of one run.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ways {
    asked: Sum,
    reached: Sum,
    forward_m: Followed,
    turn_rad: Followed,
    /// What the estimate adds up to, m: hardware knows velocities, no places.
    estimated_m: DVec3,
    walked_s: f64,
    /// How much of that all feet were planned to be off the ground, s.
    flown_s: f64,
}

impl Ways {
    /// Looks at a cycle in which the robot walks.
    pub(super) fn observe(&mut self, record: &CycleRecord<'_>) {
        let targets = record.targets;
        let before = (self.asked, self.reached);
        self.asked.add(targets.trunk_in_world, yaw_rad(targets.trunk_orientation));
        match &record.facts.truth {
            Some(truth) => self.reached.add(truth.position_m, yaw_rad(truth.orientation)),
            None => {
                let body = &record.state.body;
                self.estimated_m +=
                    DQuat::from_rotation_z(body.yaw_rad) * body.velocity_m_s * record.facts.dt_s;
                self.reached.add(self.estimated_m, body.yaw_rad);
            }
        }
        self.forward_m
            .add(self.asked.forward_m - before.0.forward_m, self.reached.forward_m - before.1.forward_m);
        self.turn_rad.add(self.asked.turn_rad - before.0.turn_rad, self.reached.turn_rad - before.1.turn_rad);
        self.walked_s += record.facts.dt_s;
        let feet = targets.feet();
        if !feet.is_empty() && feet.iter().all(|foot| foot.is_swing) {
            self.flown_s += record.facts.dt_s;
        }
    }

    /// What comes next does not follow on the last cycle.
    pub(super) fn pause(&mut self) {
        (self.asked.last, self.reached.last) = (None, None);
    }

    /// `None` if it did not walk.
    pub(super) fn report(&self) -> Option<WalkTotals> {
        (self.walked_s > 0.0).then(|| WalkTotals {
            time_s: self.walked_s,
            asked: self.asked.way(self.walked_s),
            reached: self.reached.way(self.walked_s),
            forward_m: self.forward_m,
            turn_rad: self.turn_rad,
            flight_share: self.flown_s / self.walked_s,
        })
    }
}

fn yaw_rad(turn: DQuat) -> f64 {
    turn.to_euler(EulerRot::ZYX).0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a circle to the left, 1 m round, then 1 m to the right of where the trunk then points.
    #[test]
    fn a_curve_counts_as_forward_distance_and_whole_turns_count() {
        let mut sum = Sum::default();
        for step in 0..=1000 {
            let angle = f64::from(step) / 1000.0 * 2.5 * std::f64::consts::TAU;
            sum.add(DVec3::new(angle.sin(), 1.0 - angle.cos(), 0.0), angle);
        }
        let way = sum.way(10.0);
        assert!((way.turn_deg - 900.0).abs() < 1e-6, "{way:?}");
        assert!(
            (way.distance_m - 2.5 * std::f64::consts::TAU).abs() < 1e-3 && way.side_m.abs() < 0.2,
            "{way:?}"
        );
        assert!((way.speed_m_s - way.distance_m / 10.0).abs() < 1e-12);
    }
}
