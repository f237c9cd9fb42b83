//! Goals of a robot on its feet keep to the pace of its joints.
//!
//! Input: joint angles with the corrections of balance and sag in them, and the last goals. Output: the offsets of
//! [`JointTargets::offset_rad`], shortened so that no joint is asked to turn or to speed up more than safety permits.
//! The planned feet keep these limits, but two things do not: feedback on a trunk that a touch-down has jolted, and a
//! joint that meets the end of its range, whose speed the others of its leg have to take over at once. A pose that
//! follows finds joints that still turn, and they come to rest at their pace, too. Safety must not be the stage that
//! limits them.

use crate::model::{Pace, Robot};
use crate::signals::{JointTargets, Permission, State, Targets};

/// The pace of one robot's joints.
#[derive(Debug, Clone)]
pub struct Pacing {
    paces: Vec<Pace>,
    /// Range of the goals of each joint, rad.
    ranges_rad: Vec<(f64, f64)>,
    /// The goal before the last one, rad, a value per joint.
    before_rad: Vec<f64>,
    /// True from the first cycle on feet until every joint has arrived in the pose that follows.
    is_pacing: bool,
}

/// A goal this near its pose has arrived, rad.
const ARRIVED_RAD: f64 = 1e-9;

impl Pacing {
    /// The pace of the joints of `robot`.
    pub fn new(robot: &Robot) -> Pacing {
        let pace = |joint: &crate::model::Joint| Pace {
            rate_rad_s: robot.safety.rate_share * joint.no_load_speed_rad_s(),
            acceleration_rad_s2: robot.safety.acceleration_rad_s2,
        };
        Pacing {
            paces: robot.joints.iter().map(pace).collect(),
            ranges_rad: robot.joints.iter().map(crate::model::Joint::goal_range_rad).collect(),
            before_rad: vec![0.0; robot.joints.len()],
            is_pacing: false,
        }
    }

    /// Shortens the corrections of this cycle, `dt_s` after the last one.
    pub fn step(&mut self, dt_s: f64, targets: &Targets, state: &State, joints: &mut JointTargets) {
        let is_on_feet = !targets.feet().is_empty();
        self.is_pacing =
            (is_on_feet || self.is_pacing && !joints.is_limp) && state.permission == Permission::Move;
        let mut has_arrived = true;
        let all = self.paces.iter().zip(&mut self.before_rad).zip(&state.goal_rad).enumerate();
        for (index, ((pace, before_rad), goal_rad)) in all {
            let speed_rad_s = (goal_rad - *before_rad) / dt_s;
            *before_rad = *goal_rad;
            let way_rad = joints.angles_rad[index] + joints.offset_rad[index] - goal_rad;
            if self.is_pacing && way_rad.is_finite() && !state.is_out[index] {
                let step_rad = pace.speed_towards(way_rad, speed_rad_s, dt_s) * dt_s;
                let (low_rad, high_rad) = self.ranges_rad[index];
                let paced_rad = (goal_rad + step_rad).clamp(low_rad.min(*goal_rad), high_rad.max(*goal_rad));
                joints.offset_rad[index] = paced_rad - joints.angles_rad[index];
                has_arrived &= joints.offset_rad[index].abs() <= ARRIVED_RAD;
            }
        }
        self.is_pacing &= is_on_feet || !has_arrived;
    }
}
