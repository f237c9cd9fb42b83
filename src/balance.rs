//! Feedback from the trunk's attitude and angular velocity that keeps a robot on its feet.
//!
//! Input: the generator's foot targets, and the state of the trunk. Output: the foot targets, corrected. If
//! the trunk tips over to a side, the legs on the rising side become shorter and those on the sinking side
//! longer, so that it turns more slowly. If it is off its heading, the steps become longer on one side and
//! shorter on the other. If the trunk's state is unknown, there is no correction.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, EulerRot};

use crate::model::{BalanceSettings, Robot};
use crate::signals::{State, Targets};

/// Time in which the feedback fades in and out, s.
const FADE_S: f64 = 0.5;
/// Time constant of the corrections, s: the trunk's rates arrive in steps, several per cycle or one every few
/// cycles.
const SMOOTHING_S: f64 = 0.015;
/// Largest raising or lowering of a foot, as a share of the height of its leg's root above it.
const RAISE_SHARE: f64 = 0.1;
/// Largest relative change of the length of a step: the reach that a leg has left at normal speeds.
const STEP_SHARE: f64 = 0.1;
/// Steps slower than this are not corrected, m/s.
const SLOWEST_M_S: f64 = 0.01;

/// The feedback of one robot.
#[derive(Debug, Clone)]
pub struct Balance {
    settings: Option<BalanceSettings>,
    /// Position of each leg's root, body frame, m.
    roots_m: Vec<DVec3>,
    /// Correction of each foot's height, m.
    raised_m: Vec<f64>,
    /// Share of the feedback that is applied, 0 to 1.
    share: f64,
    /// The trunk's yaw when the plan's yaw is 0, rad.
    heading_rad: f64,
}

impl Balance {
    /// The feedback for `robot`. It does nothing if the file has no `[balance]`, or if the feet bear no weight.
    pub fn new(robot: &Robot) -> Balance {
        Balance {
            settings: robot.balance.filter(|_| robot.bears_weight),
            roots_m: robot.chains.iter().map(|chain| chain.root_m).collect(),
            raised_m: vec![0.0; robot.chains.len()],
            share: 0.0,
            heading_rad: 0.0,
        }
    }

    /// Corrects the tips of `targets` for this cycle, `dt_s` after the last one; `speed_m_s` is the trunk's
    /// planned speed.
    pub fn step(&mut self, dt_s: f64, speed_m_s: f64, state: &State, targets: &mut Targets) {
        let Some(settings) = self.settings else { return };
        let planned_orientation = targets.trunk_orientation;
        let Some((feet, tips_in_body)) = targets.walking_tips_mut() else {
            self.share = 0.0;
            self.raised_m.fill(0.0);
            return;
        };
        let body = &state.body;
        let (planned_rad, ..) = planned_orientation.to_euler(EulerRot::ZYX);
        if self.share <= 0.0 {
            self.heading_rad = body.yaw_rad - planned_rad;
        }
        let step = if body.is_known { dt_s } else { -dt_s } / FADE_S;
        self.share = (self.share + step).clamp(0.0, 1.0);
        // While the trunk's state is unknown, the trunk counts as level and still.
        let numbers = [body.rate_rad_s.x, body.rate_rad_s.y, body.yaw_rad];
        let is_known = body.is_known && numbers.iter().all(|number| number.is_finite());
        let (rate, yaw_rad) = if is_known {
            (body.rate_rad_s, body.yaw_rad)
        } else {
            (DVec3::ZERO, planned_rad + self.heading_rad)
        };
        let off_rad = (yaw_rad - planned_rad - self.heading_rad + PI).rem_euclid(TAU) - PI;
        let faster_m_s = self.share * settings.heading_m_s * off_rad;
        let longer = if speed_m_s.abs() > SLOWEST_M_S { faster_m_s / speed_m_s } else { 0.0 };
        let longer = longer.clamp(-STEP_SHARE, STEP_SHARE);
        let pace = 1.0 - (-dt_s / SMOOTHING_S).exp();
        for foot in feet {
            let chain = foot.chain;
            let (Some(root), Some(raised_m), Some(tip)) =
                (self.roots_m.get(chain), self.raised_m.get_mut(chain), tips_in_body.get_mut(chain))
            else {
                continue;
            };
            let raise_m = settings.roll_rate_s * rate.x * root.y - settings.pitch_rate_s * rate.y * root.x;
            let most_m = RAISE_SHARE * (root.z - tip.z).abs();
            *raised_m += pace * (self.share * raise_m.clamp(-most_m, most_m) - *raised_m);
            tip.z += *raised_m;
            tip.x += foot.excursion_m * longer * if root.y > 0.0 { 1.0 } else { -1.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use std::path::Path;

    use super::*;
    use crate::config;
    use crate::signals::FootTarget;

    const LEFT_HIND: usize = 0;
    const LEFT_FORE: usize = 1;
    const RIGHT_HIND: usize = 2;

    /// Foot positions with the feedback fully faded in, of a robot that goes ahead at 0.1 m/s with the
    /// trunk's state set by `turn`.
    fn moved(turn: impl Fn(&mut State)) -> Vec<DVec3> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/horse.toml");
        let robot = config::load(&path).unwrap().robot;
        let mut balance = Balance::new(&robot);
        let (mut targets, mut state) = (Targets::new(&robot), State::new(&robot));
        let foot = |chain| FootTarget { chain, excursion_m: 0.02, ..FootTarget::default() };
        targets.set_tips().feet.extend((0..4).map(foot));
        let feet: Vec<DVec3> = robot.chains.iter().map(|chain| chain.root_m - DVec3::Z * 0.19).collect();
        state.body.is_known = true;
        for cycle in 0..100 {
            targets.recorded_mut().1.tips_in_body.copy_from_slice(&feet);
            if cycle > 0 {
                turn(&mut state);
            }
            balance.step(0.01, 0.1, &state, &mut targets);
        }
        (0..4).map(|leg| targets.tip_in_body(leg).unwrap() - feet[leg]).collect()
    }

    #[test]
    fn legs_are_shorter_where_the_trunk_rises() {
        // The right side sinks.
        let feet = moved(|state| state.body.rate_rad_s.x = 0.5);
        assert!((feet[LEFT_HIND].z - 0.1 * 0.5 * 0.06).abs() < 1e-9, "{feet:?}");
        assert!((feet[RIGHT_HIND].z + 0.1 * 0.5 * 0.06).abs() < 1e-9, "{feet:?}");
        // The nose sinks.
        let feet = moved(|state| state.body.rate_rad_s.y = 0.5);
        assert!((feet[LEFT_FORE].z + 0.05 * 0.5 * 0.085).abs() < 1e-9, "{feet:?}");
        assert!((feet[LEFT_HIND].z - 0.05 * 0.5 * 0.085).abs() < 1e-9, "{feet:?}");
        // No foot moves by more than a tenth of its leg.
        let feet = moved(|state| state.body.rate_rad_s.x = 1e3);
        assert!((feet[LEFT_HIND].z - 0.019).abs() < 1e-9, "{feet:?}");
    }

    #[test]
    fn a_robot_turned_to_the_left_takes_longer_steps_on_the_left() {
        let feet = moved(|state| state.body.yaw_rad = TAU + 0.03);
        // 0.2 m/s per radian are 6 mm/s of 100.
        assert!((feet[LEFT_FORE].x - 0.06 * 0.02).abs() < 1e-9, "{feet:?}");
        assert!((feet[RIGHT_HIND].x + 0.06 * 0.02).abs() < 1e-9, "{feet:?}");
    }

    #[test]
    fn unknown_attitude_moves_no_foot() {
        let feet = moved(|state| {
            state.body.is_known = false;
            state.body.rate_rad_s.x = 0.5;
        });
        assert!(feet.iter().all(|moved| moved.length() <= 0.0), "{feet:?}");
        let feet = moved(|state| state.body.rate_rad_s.x = f64::NAN);
        assert!(feet.iter().all(|moved| moved.length() <= 0.0), "{feet:?}");
    }
}
