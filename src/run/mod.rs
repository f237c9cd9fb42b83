//! A whole run: finds the servos, repeats the cycle at its rate, and ends in the robot's safe stop.
//!
//! The ports provide the clock and the waiting; orders come from the caller's [`Operator`], and every cycle goes to the
//! caller's [observers](Observer); neither may block. Whatever ends the loop, even a panic, the servos end in the stop
//! action.

mod cycle;
mod end;
mod reported;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use crate::bus::{Buses, Ports, StartError};
use crate::model::{Robot, StopAction};
use crate::motion::{Activity, Order};
use crate::observe::{CycleRecord, End, Observer, Outcome};
use crate::plan::RunPlan;
use crate::signals::Status;
use crate::units::Time;
pub use cycle::Cycle;
pub use reported::{run, run_observed};

/// A cycle that begins more than this share of a period after its deadline counts as late.
pub const LATE_SHARE: f64 = 0.1;
/// The final goals are sent for at least this many cycles, in case one is lost.
const LAST_CYCLES: u32 = 5;
/// How long a servo may stay unheard at the end before the end says that it may still have torque, s.
const LAST_PATIENCE_S: f64 = 1.0;

/// The operator gives the orders.
pub trait Operator {
    /// Receives, before the loop, a remark about the servos that does not prevent a start.
    fn hear(&mut self, _note: &str) {}

    /// The present order. The loop calls this once a cycle, so it must not block or allocate.
    fn order(&mut self, status: &Status) -> Order;

    /// The outcome of a run that this operator stopped, and the reason, in words.
    fn why_stopped(&self) -> (Outcome, &'static str) {
        (Outcome::Completed, "stopped by the operator")
    }

    /// Called when the loop is over and the servos have its last goals.
    fn loop_ended(&mut self) {}
}

impl<F: FnMut(&Status) -> Order> Operator for F {
    fn order(&mut self, status: &Status) -> Order {
        self(status)
    }
}

/// The cause of the end of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum EndCause {
    PlanDone,
    Operator,
    /// An observer, by its index, and its objection.
    Observer(usize, &'static str),
}

/// Runs `robot` on `ports` until the plan is done, or until `operator`, safety or an observer stops it. An observer that
/// objects stops the robot as an operator would.
fn run_to_end<P: Ports>(
    robot: &Robot,
    plan: &RunPlan,
    ports: P,
    observers: &mut [&mut dyn Observer],
    mut operator: impl Operator,
) -> Result<End, StartError> {
    let buses = find_servos(robot, ports, &mut operator)?;
    let mut cycle = Cycle::new(robot, plan.motion.clone(), plan.method, plan.move_for_s, buses);
    let end = perform(robot, &mut cycle, (plan.done(), robot.stop_action), observers, &mut operator);
    Ok(end)
}

/// The buses of `robot` with all its servos found, limp, and their watchdogs ready for the loop to come.
pub(crate) fn find_servos<P: Ports>(
    robot: &Robot,
    ports: P,
    operator: &mut impl Operator,
) -> Result<Buses<P>, StartError> {
    let mut buses = Buses::new(robot, ports);
    buses.prepare(robot)?;
    buses.notes().iter().for_each(|note| operator.hear(note));
    buses.arm_watchdogs(robot)?;
    Ok(buses)
}

/// Repeats the cycle until it is done or stopped, and survives its panics. `done` is the reason of the planned end, and
/// `stop_action` that of a panic. The operator hears of the end when all servos have received it; the observers once
/// nothing talks to the servos any more.
pub(crate) fn perform<P: Ports>(
    robot: &Robot,
    cycle: &mut Cycle<'_, P>,
    (done, stop_action): (&str, StopAction),
    observers: &mut [&mut dyn Observer],
    operator: &mut impl Operator,
) -> End {
    let start = cycle.now();
    let ended = catch_unwind(AssertUnwindSafe(|| repeat(robot, cycle, start, observers, operator)));
    let mut objector = None;
    let (outcome, reason, is_heard) = match ended {
        Ok(cause) => {
            let (worse, is_heard) = end::judge(robot, cycle);
            let (outcome, reason) = worse.unwrap_or_else(|| match cause {
                EndCause::PlanDone => (Outcome::Completed, done.to_owned()),
                EndCause::Operator => {
                    let (outcome, reason) = operator.why_stopped();
                    (outcome, reason.to_owned())
                }
                EndCause::Observer(index, objection) => {
                    objector = Some(index);
                    (Outcome::Failed, format!("stopped because {objection}"))
                }
            });
            (outcome, reason, is_heard)
        }
        // The motion can no longer be trusted to end by itself.
        Err(_) => end::after_panic(cycle, stop_action),
    };
    operator.loop_ended();
    let duration = cycle.now().since(start);
    // Nothing talks to the servos from here on; a robot that holds its pose must keep holding it.
    cycle.buses_mut().disarm_watchdogs();
    let mut end = End {
        outcome,
        reason,
        is_heard,
        duration,
        cycles: cycle.cycles(),
        late_cycles: cycle.stopwatch().late_cycles(),
        loop_times: cycle.stopwatch().report(),
        facts: cycle.record().facts,
        buses: cycle.buses_mut().statistics().map(Into::into).collect(),
        recording: None,
    };
    for (index, observer) in observers.iter_mut().enumerate() {
        observer.end(&mut end, objector == Some(index));
    }
    end
}

/// Repeats the cycle on absolute deadlines until the stop action is complete; returns what caused the stop.
fn repeat<P: Ports>(
    robot: &Robot,
    cycle: &mut Cycle<'_, P>,
    start: Time,
    observers: &mut [&mut dyn Observer],
    operator: &mut impl Operator,
) -> EndCause {
    let period = Duration::from_secs_f64(robot.period_s());
    let mut deadline = start;
    let mut cause = EndCause::PlanDone;
    let mut last_cycles = 0;
    loop {
        cycle.begin(deadline);
        let mut objections = observers.iter().map(|observer| observer.objection()).enumerate();
        let objection = objections.find_map(|(index, objection)| Some((index, objection?)));
        let time_s = cycle.now().since(start).as_secs_f64();
        let late_cycles = cycle.stopwatch().late_cycles();
        let status = status(robot, &cycle.record());
        let objection_words = objection.map(|(_, words)| words);
        let status = Status { time_s, late_cycles, objection: objection_words, ..status };
        let mut wanted = operator.order(&status);
        if wanted.is_stop() {
            if cause == EndCause::PlanDone {
                cause = EndCause::Operator;
            }
        } else if let Some((index, words)) = objection {
            wanted = Order::Stop;
            // The objection did not cause an end that was planned.
            if cause == EndCause::PlanDone && status.activity != Activity::Done {
                cause = EndCause::Observer(index, words);
            }
        }
        cycle.step(wanted);
        for observer in &mut *observers {
            observer.observe(&CycleRecord { status, ..cycle.record() });
            cycle.end_stage(observer.stage());
        }
        cycle.end();
        let record = cycle.record();
        if end::is_unstable(&record) {
            return cause;
        }
        if record.facts.activity == Activity::Done {
            last_cycles += 1;
            let since_s = f64::from(last_cycles) * robot.period_s();
            // Every servo has answered an exchange that sent it the last goals.
            let is_heard = record.state.joints.iter().all(|joint| joint.age_s < since_s - robot.period_s());
            if last_cycles >= LAST_CYCLES && (is_heard || since_s >= LAST_PATIENCE_S) {
                return cause;
            }
        }
        // Deadlines that have already passed are skipped; the loop does not catch up on them.
        let now = cycle.now();
        deadline = deadline + period;
        while now.since(deadline) > period {
            deadline = deadline + period;
        }
    }
}

/// The status that an operator sees after the cycle of this `record`.
fn status(robot: &Robot, record: &CycleRecord<'_>) -> Status {
    let (facts, state) = (&record.facts, record.state);
    let known = || state.joints.iter().filter(|joint| joint.is_known);
    Status {
        activity: facts.activity,
        gait: facts.gait,
        stroke: facts.stroke,
        speed_m_s: facts.speed_m_s,
        yaw_rate_rad_s: facts.yaw_rate_rad_s,
        permission: state.permission,
        frozen: state.is_out.iter().filter(|is_out| **is_out).count(),
        outage: state.outage,
        hottest_c: known().map(|joint| joint.temperature_c).fold(0.0, f64::max),
        lowest_v: known().map(|joint| joint.voltage_v).fold(f64::INFINITY, f64::min),
        is_imu_lost: robot.imu.is_some() && !state.body.is_known,
        ..Status::LIMP
    }
}
