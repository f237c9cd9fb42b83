//! From replies to what is known of the robot. A lost reply leaves the last one standing, and ageing.

mod legs;

use crate::counts;
use crate::model::Robot;
use crate::signals::{JointState, Slot, State, Told};
pub use legs::Legs;

/// Updates `state` with the replies of a cycle that began `gap_s` after the one before; one slot a joint.
pub fn update(robot: &Robot, gap_s: f64, slots: &[Slot], state: &mut State) {
    for ((known, joint), slot) in state.joints.iter_mut().zip(&robot.joints).zip(slots) {
        known.has_torque = None;
        match (slot, &joint.servo) {
            (Slot::Fresh(reply), Some(servo)) => {
                let measured = counts::measured(servo, reply);
                // Where replies do not say why there is an alarm, what was told stands until the alarm is over.
                let told = if measured.alarms == 0 { 0 } else { known.alarm_causes };
                let alarm_causes = if servo.model.registers.tells_alarms { measured.alarms } else { told };
                *known = JointState { alarm_causes, ..measured };
            }
            (Slot::Told(told), Some(_)) => {
                known.age_s += gap_s;
                match *told {
                    Told::Torque(has_torque) => known.has_torque = Some(has_torque),
                    Told::Alarms(causes) => known.alarm_causes = causes,
                }
            }
            _ => {
                known.age_s += gap_s;
                known.is_damaged |= *slot == Slot::Corrupt;
            }
        }
    }
}

/// Updates `state` where there are no buses: every joint is at its goal, and one of which nothing is known yet in
/// the middle of its range.
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
}
