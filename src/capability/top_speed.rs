//! The fastest each gait can go: by the legs' reach, and by the servos' speed.

use crate::ik::{Limbs, Method};
use crate::model::Robot;
use crate::motion::horse::{HorsePlan, Walk};
use crate::signals::{Aim, JointTargets, Targets};

/// How fast a gait can go, and what stops it from going faster.
#[derive(Debug, Clone, PartialEq)]
pub struct TopSpeed {
    /// Limit by the half-excursion of the legs, m/s.
    pub by_reach_m_s: f64,
    /// Limit by the joint speed and acceleration limits, m/s; not above the former.
    pub by_servos_m_s: f64,
    /// The joint that limits it, index into the robot's joints; none if the reach does.
    pub joint: Option<usize>,
}

impl TopSpeed {
    /// The speed the robot is held to, m/s.
    pub fn m_s(&self) -> f64 {
        self.by_reach_m_s.min(self.by_servos_m_s)
    }
}

/// Shares of the joint limits a steady stride may use: the rest is for starting and stopping, and for
/// peaks of acceleration that fall between the cycles looked at here but not between those of a run.
const RATE_SHARE: f64 = 0.97;
const ACCELERATION_SHARE: f64 = 0.75;
/// Halvings of the search for the speed the servos can do: 0.1 % of the speed by reach.
const HALVINGS: u32 = 10;

/// Top speed of `plan`'s gait.
pub fn of_gait(robot: &Robot, plan: &HorsePlan) -> TopSpeed {
    let by_reach_m_s = plan.top_speed_by_reach_m_s();
    let (mut low, mut high) = (0.0, by_reach_m_s);
    let mut joint = None;
    if let Some(limiting) = overloaded_joint(robot, plan, high) {
        joint = Some(limiting);
        for _ in 0..HALVINGS {
            let speed = 0.5 * (low + high);
            match overloaded_joint(robot, plan, speed) {
                Some(limiting) => (high, joint) = (speed, Some(limiting)),
                None => low = speed,
            }
        }
    } else {
        low = high;
    }
    TopSpeed { by_reach_m_s, by_servos_m_s: low, joint }
}

/// The joint that comes nearest to its limits in a steady stride at `speed_m_s`, if it passes them.
fn overloaded_joint(robot: &Robot, plan: &HorsePlan, speed_m_s: f64) -> Option<usize> {
    let dt_s = robot.period_s();
    let period_s = plan.gait.period_s(plan.settings.swing_time_s);
    let mut walk = Walk::cruising(plan, speed_m_s);
    let mut limbs = Limbs::new(robot, Method::CcdThenFinish);
    let (mut targets, mut joints) = (Targets::new(robot), JointTargets::new(robot));
    targets.aim = Aim::Tips;
    targets.posture_pull = crate::motion::posture_pull(dt_s);
    joints.angles_rad.copy_from_slice(&plan.sit_pose_rad);
    let mut speeds: Vec<f64> = vec![0.0; robot.joints.len()];
    let mut worst = (1.0, None);
    let mut cycle = 0_u32;
    // Two strides to settle, one to measure.
    while f64::from(cycle) * dt_s < 3.0 * period_s {
        let s = f64::from(cycle) * dt_s;
        let before = joints.angles_rad.clone();
        walk.advance(s);
        walk.write(plan, s, plan.settings.stand_height_m, &mut targets);
        limbs.solve(&targets, &mut joints);
        for (index, joint) in robot.joints.iter().enumerate() {
            let speed = (joints.angles_rad[index] - before[index]) / dt_s;
            let acceleration = (speed - speeds[index]) / dt_s;
            speeds[index] = speed;
            if s >= 2.0 * period_s {
                let rate = RATE_SHARE * robot.safety.rate_share * joint.no_load_speed_rad_s();
                let share = speed.abs() / rate;
                let share = if rate.is_finite() {
                    share.max(acceleration.abs() / (ACCELERATION_SHARE * robot.safety.acceleration_rad_s2))
                } else {
                    0.0
                };
                if share > worst.0 {
                    worst = (share, Some(index));
                }
            }
        }
        cycle += 1;
    }
    worst.1
}
