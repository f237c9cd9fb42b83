//! Converts radians to servo counts and back; the only place that does.
//!
//! A [`Command`] from safety becomes [`Goals`] for the buses; replies become joint states.

use crate::model::{Robot, Servo};
use crate::safety::{Command, JointCommand};
use crate::signals::{Feedback, JointState, Question, ServoGoal};

/// One goal per joint, in servo counts. Only [`goals`] makes them, and only from what safety let through:
///
/// ```compile_fail,E0451
/// use hippocamp::counts::Goals;
/// let forged = Goals { servos: vec![] };
/// ```
#[derive(Debug)]
pub struct Goals {
    servos: Vec<ServoGoal>,
    restart: Option<usize>,
    question: Option<(usize, Question)>,
}

impl Goals {
    /// All joints of `robot` limp.
    pub fn limp(robot: &Robot) -> Goals {
        Goals { servos: vec![ServoGoal::Limp; robot.joints.len()], restart: None, question: None }
    }

    /// One goal per joint, in the robot's order.
    pub fn servos(&self) -> &[ServoGoal] {
        &self.servos
    }

    /// The joint whose servo should restart, if any; it is limp.
    pub fn restart(&self) -> Option<usize> {
        self.restart
    }

    /// The question asked in this cycle instead of feedback, if any, and a joint on the bus to ask.
    pub fn question(&self) -> Option<(usize, Question)> {
        self.question
    }
}

/// Writes into `goals` the counts for `command`. A joint without a servo stays limp.
pub fn goals(robot: &Robot, command: &Command, goals: &mut Goals) {
    goals.restart = command.restart();
    goals.question = command.question();
    for ((goal, joint), command) in goals.servos.iter_mut().zip(&robot.joints).zip(command.joints()) {
        *goal = match (&joint.servo, command) {
            (Some(servo), &JointCommand::Goal { angle_rad, torque_share }) => ServoGoal::Move {
                position: nearest_count(servo, angle_rad),
                torque_limit: torque_limit(servo, torque_share),
            },
            (Some(_), JointCommand::Keep) => ServoGoal::Keep,
            _ => ServoGoal::Limp,
        };
    }
}

/// The count nearest to the joint angle `rad`, inside the servo's own range.
#[allow(clippy::cast_possible_truncation, reason = "clamped to the servo's count range first")]
fn nearest_count(servo: &Servo, rad: f64) -> i32 {
    let (low, high) = servo.model.count_range;
    servo.count_of(rad).round().clamp(f64::from(low), f64::from(high)) as i32
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the register's range first"
)]
fn torque_limit(servo: &Servo, share: f64) -> u16 {
    let full = f64::from(servo.model.torque_limit_full);
    (share * full).round().clamp(0.0, full) as u16
}

/// The joint's state from its servo's latest reply.
pub fn measured(servo: &Servo, reply: &Feedback) -> JointState {
    let direction = if servo.reversed { -1.0 } else { 1.0 };
    JointState {
        is_known: true,
        age_s: 0.0,
        is_damaged: false,
        position_rad: servo.angle_of(f64::from(reply.position)),
        speed_rad_s: servo.speed_of(reply.speed),
        load_share: direction * f64::from(reply.load) * servo.model.load_unit_share,
        voltage_v: f64::from(reply.voltage_decivolt) * 0.1,
        temperature_c: f64::from(reply.temperature_c),
        alarms: reply.alarms,
        ..JointState::default()
    }
}
