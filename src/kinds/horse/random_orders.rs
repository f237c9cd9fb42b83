//! Commands at random, for campaigns.

use crate::kinds::TOO_MUCH;
use crate::motion::horse::HorsePlan;
use crate::motion::{Command, GaitChoice, Posture};
use crate::random::RandomStream;

/// Any gait, speed, turn and posture, some beyond what the robot can do.
pub(super) fn command(chance: &mut RandomStream, plan: &HorsePlan) -> Command {
    let gait = match chance.below(plan.settings.gaits.len() + 2) {
        0 => GaitChoice::Stand,
        1 => GaitChoice::Auto,
        gait => GaitChoice::Gait(gait - 2),
    };
    let top_m_s = plan.top_speed_m_s(gait);
    let turns = chance.is(0.4);
    let yaw_max_rad_s = if turns { TOO_MUCH * plan.settings.yaw_rate_max_rad_s } else { 0.0 };
    let posture = if chance.is(0.3) {
        Posture {
            rise_m: chance.between(-0.05, 0.05),
            pitch_rad: chance.between(-0.4, 0.4),
            roll_rad: chance.between(-0.4, 0.4),
            sway_m: chance.between(-0.05, 0.05),
        }
    } else {
        Posture::default()
    };
    Command {
        gait,
        speed_m_s: top_m_s * chance.between(-0.6, TOO_MUCH),
        yaw_rate_rad_s: chance.between(-yaw_max_rad_s, yaw_max_rad_s),
        posture,
    }
}
