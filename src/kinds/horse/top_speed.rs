//! The top speed of each gait, limited by the legs' reach and by the servos' speed.

use super::cruise::cruise;
use crate::model::{Gait, Robot};
use crate::motion::horse::HorsePlan;

/// Top speed of a gait, and what limits it.
#[derive(Debug, Clone, PartialEq)]
pub struct TopSpeed {
    /// Limit from the half-excursion of the legs, m/s.
    pub by_reach_m_s: f64,
    /// Limit from the joint speed and acceleration limits, m/s; not above the other limit.
    pub by_servos_m_s: f64,
    /// The joint that limits it, index into the robot's joints; `None` if the reach does.
    pub joint: Option<usize>,
    /// The lower of both limits when going backwards, m/s, 0 or more.
    pub backward_m_s: f64,
}

impl TopSpeed {
    /// The top speed forward, m/s.
    pub fn m_s(&self) -> f64 {
        self.by_reach_m_s.min(self.by_servos_m_s)
    }
}

/// Shares of the joint limits that a steady stride may use: the rest is for starting and stopping, and for
/// peaks of acceleration that fall between the cycles checked here but not between those of a run.
const RATE_SHARE: f64 = 0.93;
const ACCELERATION_SHARE: f64 = 0.7;
/// Number of speeds tried, and the final accuracy, as a share of the speed by reach.
const TRIES: u32 = 12;
const FOUND: f64 = 1e-3;

/// Strides checked: the last is measured, those before it let the pose settle.
const STRIDES: f64 = 3.0;
/// Most steps in which they are checked: a swing has fifty of them even in the slowest possible gait.
const STEPS_MAX: f64 = 3000.0;

/// Top speeds of the gaits of `plan`.
pub fn of_gaits(robot: &Robot, plan: &HorsePlan) -> Vec<TopSpeed> {
    let gaits = &plan.settings.gaits;
    let mut found: Vec<TopSpeed> = Vec::with_capacity(gaits.len());
    for (index, gait) in gaits.iter().enumerate() {
        // One leg alone does not depend on the phase offsets: gaits that differ in nothing else have the same
        // speed.
        let same = |other: &Gait| {
            other.duty_factor.to_bits() == gait.duty_factor.to_bits()
                && other.vertical_oscillation == gait.vertical_oscillation
        };
        let top = match gaits[..index].iter().position(same) {
            Some(known) => found[known].clone(),
            None => of_gait(robot, plan, index),
        };
        found.push(top);
    }
    found
}

fn of_gait(robot: &Robot, plan: &HorsePlan, gait: usize) -> TopSpeed {
    let by_reach_m_s = plan.top_speed_by_reach_m_s(gait, plan.reach.level.half_excursion_m);
    let (by_servos_m_s, joint) = by_servos(robot, plan, gait, by_reach_m_s);
    let (backward_m_s, _) = by_servos(robot, plan, gait, -by_reach_m_s);
    TopSpeed { by_reach_m_s, by_servos_m_s, joint, backward_m_s: backward_m_s.abs() }
}

/// The top speed that the servos allow in the direction of `by_reach_m_s`, up to it, and the joint that limits it.
fn by_servos(robot: &Robot, plan: &HorsePlan, gait: usize, by_reach_m_s: f64) -> (f64, Option<usize>) {
    let (mut low, mut high) = (0.0, by_reach_m_s);
    let (mut load, mut joint) = largest_load(robot, plan, gait, by_reach_m_s);
    if load <= 1.0 {
        return (by_reach_m_s, None);
    }
    let mut speed = by_reach_m_s;
    for _ in 0..TRIES {
        // The load grows roughly as the speed does; if it does not, halving finds the limit.
        let guess = 0.9995 * speed / load;
        let is_between = (guess - low) * (high - guess) > 0.0;
        speed = if is_between { guess } else { 0.5 * (low + high) };
        let limiting;
        (load, limiting) = largest_load(robot, plan, gait, speed);
        if load > 1.0 {
            (high, joint) = (speed, limiting);
        } else {
            low = speed;
        }
        if (high - low).abs() <= FOUND * by_reach_m_s.abs() {
            break;
        }
    }
    (low, joint)
}

/// Load of the most loaded joint in a steady stride at `speed_m_s`, as a share of its limit, and the joint.
fn largest_load(robot: &Robot, plan: &HorsePlan, gait: usize, speed_m_s: f64) -> (f64, Option<usize>) {
    let period_s = plan.settings.gaits[gait].period_s(plan.settings.swing_time_s);
    let robot = &robot.with_period_of_at_least(STRIDES * period_s / STEPS_MAX);
    let dt_s = robot.period_s();
    let mut speeds: Vec<f64> = vec![0.0; robot.joints.len()];
    let mut before = plan.sit_pose_rad.clone();
    let mut worst = (0.0, None);
    let times = (0_u32..).map(|cycle| f64::from(cycle) * dt_s).take_while(|s| *s < STRIDES * period_s);
    cruise(robot, plan, (gait, speed_m_s), dt_s, times, |s, _, angles_rad| {
        for (index, joint) in robot.joints.iter().enumerate() {
            let speed = (angles_rad[index] - before[index]) / dt_s;
            let acceleration = (speed - speeds[index]) / dt_s;
            speeds[index] = speed;
            if s >= (STRIDES - 1.0) * period_s {
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
        before.copy_from_slice(angles_rad);
    });
    worst
}
