//! Turns one joint: finds the servos and repeats the cycle as in a run, but with another generator.
//!
//! Input: a robot, one of its joints, an angle. Output: where the joint went. All joints are limp afterwards,
//! whatever the reason for the end.

use crate::bus::{Buses, Ports, StartError};
use crate::ik::Method;
use crate::model::{Robot, StopAction};
use crate::motion::Jog;
use crate::observe::{End, Observer, Outcome};
use crate::run::{Cycle, Operator, find_servos, perform};
use crate::telemetry::Telemetry;

/// Time for which a joint is held at its goal, s.
const HOLD_S: f64 = 1.0;

/// Result of a jog.
#[derive(Debug, Clone, PartialEq)]
pub struct JogReport {
    /// Goal of the joint, within its range, rad.
    pub goal_rad: f64,
    /// Measured position when the joint was let go, rad; `None` if it never had torque.
    pub measured_rad: Option<f64>,
    /// Kind of end.
    pub outcome: Outcome,
    /// Reason for the end.
    pub reason: String,
    /// True if every servo has received the command to end.
    pub is_end_heard: bool,
}

/// Turns joint number `joint` of `robot` to `goal_rad`, limited to its range, holds it for a second and lets it go.
///
/// The `operator` is asked once per cycle. Any order to stop lets the joint go where it is; its torque falls
/// to zero over the robot's `torque_ramp_s`.
///
/// # Errors
/// [`StartError`] if a servo of the robot file does not answer or is of another model; no torque was on then.
pub fn jog<P: Ports>(
    robot: &Robot,
    joint: usize,
    goal_rad: f64,
    ports: P,
    mut operator: impl Operator,
) -> Result<JogReport, StartError> {
    let buses = find_servos(robot, ports, &mut operator)?;
    Ok(turn(robot, joint, goal_rad, HOLD_S, buses, &mut operator).0)
}

/// The same on `buses` whose servos were found and are limp with their watchdogs on; holds the joint for
/// `hold_s` and returns the buses.
pub(crate) fn turn<P: Ports>(
    robot: &Robot,
    joint: usize,
    goal_rad: f64,
    hold_s: f64,
    buses: Buses<P>,
    operator: &mut impl Operator,
) -> (JogReport, Buses<P>) {
    let jog = Jog::new(robot, joint, goal_rad, hold_s);
    let goal_rad = jog.goal_rad();
    let mut cycle = Cycle::with_generator(robot, jog.into(), Method::CcdThenFinish, buses);
    // A single joint always ends limp.
    let ends = ("turned and let go", StopAction::SitThenLimp);
    let observers: &mut [&mut dyn Observer] = &mut [&mut Telemetry::new(robot)];
    let End { outcome, reason, is_heard, .. } = perform(robot, &mut cycle, ends, observers, operator);
    let (generator, buses) = cycle.into_parts();
    let measured_rad = generator.jog().and_then(Jog::measured_rad);
    (JogReport { goal_rad, measured_rad, outcome, reason, is_end_heard: is_heard }, buses)
}
