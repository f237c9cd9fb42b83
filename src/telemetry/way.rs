//! The way a robot went while it walked, beside the way it was asked to go.

use glam::{DQuat, DVec3, EulerRot};
use serde::Serialize;

use super::CycleRecord;

/// A way over the ground, as the trunk is turned at each moment.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Way {
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
            let way_m = DQuat::from_rotation_z(-yaw_rad) * (place_m - last_m);
            self.forward_m += way_m.x;
            self.side_m += way_m.y;
            let turn_rad = (yaw_rad - last_rad).rem_euclid(std::f64::consts::TAU);
            self.turn_rad +=
                if turn_rad > std::f64::consts::PI { turn_rad - std::f64::consts::TAU } else { turn_rad };
        }
        self.last = Some((place_m, yaw_rad));
    }

    fn way(&self, walked_s: f64) -> Way {
        Way {
            speed_m_s: self.forward_m / walked_s,
            turn_deg: self.turn_rad.to_degrees(),
            side_m: self.side_m,
            distance_m: self.forward_m,
        }
    }
}

/// Both ways of one run.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ways {
    asked: Sum,
    reached: Sum,
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
        self.asked.add(targets.trunk_in_world, yaw_rad(targets.trunk_turn));
        match &record.truth {
            Some(truth) => self.reached.add(truth.position_m, yaw_rad(truth.turn)),
            None => {
                let body = &record.state.body;
                self.estimated_m += DQuat::from_rotation_z(body.yaw_rad) * body.velocity_m_s * record.dt_s;
                self.reached.add(self.estimated_m, body.yaw_rad);
            }
        }
        self.walked_s += record.dt_s;
        let feet = &targets.feet;
        if !feet.is_empty() && feet.iter().all(|foot| foot.is_swing) {
            self.flown_s += record.dt_s;
        }
    }

    /// Share of the time of walking in which all feet were planned to be off the ground.
    pub(super) fn flight_share(&self) -> f64 {
        if self.walked_s > 0.0 { self.flown_s / self.walked_s } else { 0.0 }
    }

    /// What comes next does not follow on the last cycle.
    pub(super) fn pause(&mut self) {
        (self.asked.last, self.reached.last) = (None, None);
    }

    /// How long it walked, s, and the ways asked for and reached; none if it did not walk.
    pub(super) fn report(&self) -> Option<(f64, Way, Way)> {
        (self.walked_s > 0.0)
            .then(|| (self.walked_s, self.asked.way(self.walked_s), self.reached.way(self.walked_s)))
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
    fn a_curve_is_all_way_forward_and_whole_turns_count() {
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
