//! From replies to the state of the robot. After a lost reply the last one stands, and ages.

mod legs;
mod plausible;

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3, EulerRot};

use crate::counts;
use crate::model::Robot;
use crate::signals::{BodyEstimate, ImuReading, JointState, ServoAnswer, Slot, State};
pub use legs::Legs;
use plausible::Filter;

/// Turns the replies of one robot into its state.
#[derive(Debug, Clone)]
pub struct Estimator {
    filters: Vec<Filter>,
}

impl Estimator {
    /// An estimator for `robot`, from which no reply has come yet.
    pub fn new(robot: &Robot) -> Estimator {
        Estimator { filters: robot.joints.iter().map(|joint| Filter::new(joint, &robot.safety)).collect() }
    }

    /// Updates `state` with the replies of a cycle that began `gap_s` after the one before, one slot per joint, and
    /// with the last reading of the inertial measurement unit. A reply that cannot be a measurement counts as
    /// damaged.
    pub fn update(&mut self, robot: &Robot, gap_s: f64, slots: &[Slot], imu: &ImuReading, state: &mut State) {
        update_body(robot, imu, &mut state.body);
        let joints = state.joints.iter_mut().zip(&robot.joints).zip(&mut self.filters);
        for (((known, joint), filter), slot) in joints.zip(slots) {
            filter.age(gap_s);
            (known.has_torque, known.held_goal_rad, known.is_implausible) = (None, None, false);
            known.age_s += gap_s;
            match (slot, &joint.servo) {
                (Slot::Fresh(reply), Some(servo)) => {
                    let measured = counts::measured(servo, reply);
                    if !filter.accepts(&measured) {
                        (known.is_implausible, known.is_damaged) = (true, true);
                        continue;
                    }
                    // If replies do not give the cause of an alarm, the last answer stands until the alarm is over.
                    let told = if measured.alarms == 0 { 0 } else { known.alarm_causes };
                    let alarm_causes =
                        if servo.model.registers.tells_alarms { measured.alarms } else { told };
                    *known = JointState { alarm_causes, ..measured };
                }
                (Slot::Answered(told), Some(servo)) => match *told {
                    ServoAnswer::Torque(has_torque) => known.has_torque = Some(has_torque),
                    ServoAnswer::Alarms(causes) => known.alarm_causes = causes,
                    ServoAnswer::Goal(counts) => {
                        known.held_goal_rad = Some(servo.angle_of(f64::from(counts)))
                    }
                },
                _ => known.is_damaged |= *slot == Slot::Corrupt,
            }
        }
        note_starts(robot, state);
    }
}

fn update_body(robot: &Robot, imu: &ImuReading, body: &mut BodyEstimate) {
    body.is_known = robot.imu.as_ref().is_some_and(|settings| imu.is_known && imu.age_s <= settings.stale_s);
    if !body.is_known {
        (body.roll_rad, body.pitch_rad, body.rate_rad_s) = (0.0, 0.0, DVec3::ZERO);
        return;
    }
    // The trunk has turned further since the measurement.
    let then = DQuat::from_euler(EulerRot::ZYX, imu.yaw_rad, imu.pitch_rad, imu.roll_rad);
    let now = then * DQuat::from_scaled_axis(imu.rate_rad_s * imu.age_s);
    let (yaw_rad, pitch_rad, roll_rad) = now.to_euler(EulerRot::ZYX);
    (body.pitch_rad, body.roll_rad, body.rate_rad_s) = (pitch_rad, roll_rad, imu.rate_rad_s);
    let start_rad = *body.yaw_start_rad.get_or_insert(yaw_rad);
    // Yaw counts whole turns.
    body.yaw_rad += (yaw_rad - start_rad - body.yaw_rad + PI).rem_euclid(TAU) - PI;
}

/// Updates `state` of a robot without buses: every joint is at its goal, or, if nothing is known of it yet, in
/// the middle of its range; the trunk is level and still.
pub fn at_goals(robot: &Robot, state: &mut State) {
    for ((known, joint), goal_rad) in state.joints.iter_mut().zip(&robot.joints).zip(&state.goal_rad) {
        let position_rad = if known.is_known { *goal_rad } else { joint.middle_rad() };
        *known = JointState {
            is_known: true,
            position_rad,
            speed_rad_s: (position_rad - known.position_rad) * robot.rate_hz,
            voltage_v: robot.voltage_min_v(joint),
            ..JointState::default()
        };
    }
    state.body.is_known = true;
    note_starts(robot, state);
}

/// Notes where goals would start, should torque come on.
fn note_starts(robot: &Robot, state: &mut State) {
    for ((start_rad, joint), known) in state.start_rad.iter_mut().zip(&robot.joints).zip(&state.joints) {
        *start_rad = joint.start_goal_rad(known.position_rad);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use std::path::Path;

    use super::*;
    use crate::config;

    #[test]
    fn the_estimate_extrapolates_the_rotation_between_measurements_and_counts_whole_turns() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/horse.toml");
        let robot = config::load(&path).unwrap().robot;
        let mut state = State::new(&robot);
        let mut imu = ImuReading { is_known: true, age_s: 0.01, yaw_rad: 3.0, ..ImuReading::default() };
        imu.roll_rad = 0.1;
        imu.rate_rad_s.x = 2.0;
        let mut estimator = Estimator::new(&robot);
        estimator.update(&robot, 0.01, &[], &imu, &mut state);
        assert!((state.body.roll_rad - 0.12).abs() < 1e-12 && state.body.yaw_rad.abs() < 1e-12);
        (imu.roll_rad, imu.rate_rad_s.x) = (0.0, 0.0);
        // Twice round to the left, in steps that the unit reports from -pi to pi.
        for step in 1..=20 {
            let yaw = 3.0 + f64::from(step) * 0.2 * PI;
            imu.yaw_rad = (yaw + PI).rem_euclid(TAU) - PI;
            estimator.update(&robot, 0.01, &[], &imu, &mut state);
        }
        assert!((state.body.yaw_rad - 2.0 * TAU).abs() < 1e-9, "{}", state.body.yaw_rad);
        imu.age_s = 1.0;
        estimator.update(&robot, 0.01, &[], &imu, &mut state);
        assert!(!state.body.is_known && state.body.roll_rad.abs() <= 0.0);
    }
}
