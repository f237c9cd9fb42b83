//! From replies to what is known of the robot. A lost reply leaves the last one standing, and ageing.

mod legs;

use glam::{DQuat, DVec3, EulerRot};

use crate::counts;
use crate::model::Robot;
use crate::signals::{BodyEstimate, ImuReading, JointState, Slot, State};
pub use legs::Legs;

/// Updates `state` with the replies of a cycle that began `gap_s` after the one before, one slot a joint, and with what
/// the inertial measurement unit last said.
pub fn update(robot: &Robot, gap_s: f64, slots: &[Slot], imu: &ImuReading, state: &mut State) {
    update_body(robot, imu, &mut state.body);
    for ((known, joint), slot) in state.joints.iter_mut().zip(&robot.joints).zip(slots) {
        match (slot, &joint.servo) {
            (Slot::Fresh(reply), Some(servo)) => *known = counts::measured(servo, reply),
            _ => {
                known.age_s += gap_s;
                known.is_damaged |= *slot == Slot::Corrupt;
            }
        }
    }
}

fn update_body(robot: &Robot, imu: &ImuReading, body: &mut BodyEstimate) {
    body.is_known = robot.imu.as_ref().is_some_and(|settings| imu.is_known && imu.age_s <= settings.stale_s);
    if !body.is_known {
        (body.roll_rad, body.pitch_rad, body.rate_rad_s) = (0.0, 0.0, DVec3::ZERO);
        return;
    }
    // It has turned on since that was measured.
    let then = DQuat::from_euler(EulerRot::ZYX, imu.yaw_rad, imu.pitch_rad, imu.roll_rad);
    let now = then * DQuat::from_scaled_axis(imu.rate_rad_s * imu.age_s);
    (body.yaw_rad, body.pitch_rad, body.roll_rad) = now.to_euler(EulerRot::ZYX);
    body.rate_rad_s = imu.rate_rad_s;
}

/// Updates `state` where there are no buses: every joint is at its goal, and one of which nothing is known yet in
/// the middle of its range; the trunk lies level and still.
pub fn at_goals(robot: &Robot, state: &mut State) {
    for ((known, joint), goal_rad) in state.joints.iter_mut().zip(&robot.joints).zip(&state.goal_rad) {
        let position_rad = if known.is_known { *goal_rad } else { joint.middle_rad() };
        *known = JointState {
            is_known: true,
            position_rad,
            speed_rad_s: (position_rad - known.position_rad) * robot.rate_hz,
            voltage_v: robot.safety.voltage_v,
            ..JointState::default()
        };
    }
    state.body.is_known = true;
}
