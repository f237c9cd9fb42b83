//! Runs that end in a report.

use super::{Operator, run_to_end};
use crate::bus::{Ports, StartError};
use crate::model::Robot;
use crate::motion::Order;
use crate::observe::Observer;
use crate::plan::RunPlan;
use crate::signals::Status;
use crate::telemetry::{Report, Telemetry};

/// Runs `robot` on `ports` until the plan is done or `order` or safety stops it.
///
/// The loop calls `order` once a cycle with the status; it must not block.
///
/// # Errors
/// [`StartError`] when a servo of the robot file does not answer or is another one; then no torque was on.
pub fn run<P: Ports>(
    robot: &Robot,
    plan: RunPlan,
    ports: P,
    order: impl FnMut(&Status) -> Order,
) -> Result<Report, StartError> {
    run_observed(robot, &plan, ports, &mut [], order)
}

/// Like [`run`], driven by an `operator`, with `observers` beside the one that makes the report. If one of them objects,
/// the robot stops as an operator would stop it: the run has lost its purpose.
///
/// # Errors
/// The same as [`run`].
pub fn run_observed<P: Ports>(
    robot: &Robot,
    plan: &RunPlan,
    ports: P,
    observers: &mut [&mut dyn Observer],
    operator: impl Operator,
) -> Result<Report, StartError> {
    let mut telemetry = Telemetry::new(robot);
    let mut all: Vec<&mut dyn Observer> = vec![&mut telemetry];
    for observer in observers {
        all.push(&mut **observer);
    }
    let end = run_to_end(robot, plan, ports, &mut all, operator)?;
    Ok(telemetry.report(plan, end))
}
