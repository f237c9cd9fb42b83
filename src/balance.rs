//! Feedback that keeps a robot on its feet, by how its trunk lies and turns.
//!
//! Comes in: where the generator wants the feet, and what is known of the trunk. Goes out: the feet, moved. A trunk that
//! turns over to a side is met by shorter legs where it rises and longer ones where it sinks, so that it turns slower;
//! one that is off its heading by longer steps on one side and shorter ones on the other. Where the trunk's state is not
//! known, nothing is moved.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, EulerRot};

use crate::model::{BalanceSettings, Robot};
use crate::signals::{Aim, State, Targets};

/// Time in which the feedback comes in, and goes, s.
const FADE_S: f64 = 0.5;
/// Furthest a foot is raised or lowered, as a share of the height of its leg's root above it.
const RAISE_SHARE: f64 = 0.1;
/// Largest change of the length of a step, a share of it: what a leg's reach leaves at the speeds it is driven at.
const STEP_SHARE: f64 = 0.1;
/// Slower than this steps are not worth changing, m/s.
const SLOWEST_M_S: f64 = 0.01;

/// The feedback of one robot.
#[derive(Debug, Clone)]
pub struct Balance {
    settings: Option<BalanceSettings>,
    /// Place of each leg's root, body frame, m.
    roots_m: Vec<DVec3>,
    /// How much of it is in, 0 to 1.
    share: f64,
    /// The trunk's yaw where the plan's is 0, rad.
    heading_rad: f64,
}

impl Balance {
    /// Of `robot`. Nothing acts where the file says nothing of it, or of what it stands on.
    pub fn new(robot: &Robot) -> Balance {
        Balance {
            settings: robot.balance.filter(|_| robot.physics.is_some()),
            roots_m: robot.chains.iter().map(|chain| chain.root_m).collect(),
            share: 0.0,
            heading_rad: 0.0,
        }
    }

    /// Moves the tips of `targets` for this cycle, `dt_s` after the last one; the trunk is to go at `speed_m_s`.
    pub fn step(&mut self, dt_s: f64, speed_m_s: f64, state: &State, targets: &mut Targets) {
        let Some(settings) = self.settings else { return };
        if targets.aim != Aim::Tips || targets.feet.is_empty() {
            self.share = 0.0;
            return;
        }
        let body = &state.body;
        let (planned_rad, ..) = targets.trunk_turn.to_euler(EulerRot::ZYX);
        if self.share <= 0.0 {
            self.heading_rad = body.yaw_rad - planned_rad;
        }
        let step = if body.is_known { dt_s } else { -dt_s } / FADE_S;
        self.share = (self.share + step).clamp(0.0, 1.0);
        let numbers = [body.rate_rad_s.x, body.rate_rad_s.y, body.yaw_rad];
        if !body.is_known || !numbers.iter().all(|number| number.is_finite()) {
            return;
        }
        let off_rad = (body.yaw_rad - planned_rad - self.heading_rad + PI).rem_euclid(TAU) - PI;
        let faster_m_s = self.share * settings.heading_m_s * off_rad;
        let longer = if speed_m_s.abs() > SLOWEST_M_S { faster_m_s / speed_m_s } else { 0.0 };
        let longer = longer.clamp(-STEP_SHARE, STEP_SHARE);
        for foot in &targets.feet {
            let (Some(root), Some(tip)) =
                (self.roots_m.get(foot.chain), targets.tips_in_body.get_mut(foot.chain))
            else {
                continue;
            };
            let raise_m = settings.roll_rate_s * body.rate_rad_s.x * root.y
                - settings.pitch_rate_s * body.rate_rad_s.y * root.x;
            let most_m = RAISE_SHARE * (root.z - tip.z).abs();
            tip.z += self.share * raise_m.clamp(-most_m, most_m);
            tip.x += foot.excursion_m * longer * if root.y > 0.0 { 1.0 } else { -1.0 };
        }
    }
}
