//! A whole run: finds the servos, repeats the cycle at its rate, ends in the robot's safe stop, and reports.
//!
//! The ports provide the clock and the waiting; orders come in and status goes out through the caller's
//! [`Operator`], which must not block. Whatever ends the loop, even a panic, the servos end in the stop
//! action.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use crate::bus::{Buses, Ports, StartError};
use crate::cycle::Cycle;
use crate::model::{Robot, StopAction};
use crate::motion::horse::Drive;
use crate::motion::{Activity, Order};
use crate::plan::RunPlan;
use crate::recording::Recorder;
use crate::signals::{JointState, Permission, ServoGoal, Status};
use crate::telemetry::{JointsReport, Outcome, Report, Verdict};
use crate::units::Time;

/// A cycle that begins more than this share of a period after its deadline counts as late.
pub const LATE_SHARE: f64 = 0.1;
/// The final goals are sent for at least this many cycles, in case one is lost.
const LAST_CYCLES: u32 = 5;
/// How long a servo may stay unheard at the end before the report says that it may still have torque, s.
const LAST_PATIENCE_S: f64 = 1.0;

/// The operator gives the orders and watches the run.
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
    run_recorded(robot, plan, ports, None, order)
}

/// Like [`run`], driven by an `operator`; every cycle goes to the `recorder`, which is finished once the robot has
/// stopped. If the recording breaks off, the robot stops as an operator would stop it: a run that was to be
/// recorded has lost its purpose. If the disk is only slow, the recording misses cycles and the robot continues.
///
/// # Errors
/// The same as [`run`].
pub fn run_recorded<P: Ports>(
    robot: &Robot,
    plan: RunPlan,
    ports: P,
    mut recorder: Option<Recorder>,
    mut operator: impl Operator,
) -> Result<Report, StartError> {
    let buses = find_servos(robot, ports, &mut operator)?;
    let (gait, speed_m_s) = plan.motion.gait().map(|(gait, speed_m_s)| (gait.to_owned(), speed_m_s)).unzip();
    let done = plan.motion.done();
    let driver = plan.driver;
    let mut cycle = Cycle::new(robot, plan.motion, plan.method, plan.move_for_s, buses);
    let start = cycle.buses_mut().ports_mut().now();

    let End { outcome, mut reason, is_heard } =
        perform(robot, &mut cycle, start, done, &mut recorder, &mut operator);
    let duration = cycle.buses_mut().ports_mut().now().since(start);
    // Nothing talks to the servos from here on; a robot that holds its pose must keep holding it.
    cycle.buses_mut().disarm_watchdogs();
    let (cycles, late_cycles, safety_interventions) = cycle.telemetry().totals();
    let recording = recorder.map(|recorder| {
        let entries = [
            ("outcome", outcome.name().to_owned()),
            ("reason", reason.clone()),
            ("duration_s", duration.as_secs_f64().to_string()),
            ("cycles", cycles.to_string()),
            ("late_cycles", late_cycles.to_string()),
        ];
        recorder.finish(entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
    });
    if let Some(error) = recording.as_ref().and_then(|recording| recording.error.as_ref())
        && reason == RECORDING_LOST
    {
        reason = format!("{reason}: {error}");
    }
    let walked = cycle.telemetry().walked();
    let report = Report {
        robot: robot.name.clone(),
        driver,
        gait,
        speed_m_s,
        duration_s: duration.as_secs_f64(),
        cycles,
        late_cycles,
        outcome,
        reason,
        verdict: Verdict::Good,
        findings: Vec::new(),
        walked_s: walked.map(|walked| walked.time_s),
        asked: walked.map(|walked| walked.asked),
        reached: walked.map(|walked| walked.reached),
        is_end_heard: is_heard,
        safety_interventions,
        held_cycles: cycle.telemetry().held_cycles(),
        loop_times: cycle.telemetry().loop_report(),
        joints: cycle.telemetry().joints_report(),
        feet: cycle.telemetry().feet_report(),
        body: cycle.telemetry().body_report(),
        arms: cycle.telemetry().arms_report(),
        imu: cycle.telemetry().imu_report(),
        falls: cycle.reflex().report(),
        arm_yields: robot.yielding.map(|_| cycle.yielding().times()),
        outages: cycle.telemetry().outage_reports(robot),
        servo_restarts: cycle.safety().restarts(),
        buses: cycle.telemetry().bus_reports(robot, duration, cycle.buses().statistics()),
        recording,
    };
    Ok(report.judged(robot, walked))
}

/// Why a run without its recording ends; the cause of the break is known once the recording is finished.
const RECORDING_LOST: &str = "stopped because the recording broke off";

/// What caused a stop before the plan was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stopper {
    Nobody,
    Operator,
    /// The recording broke off.
    Recording,
}

/// End of the loop.
pub(crate) struct End {
    pub(crate) outcome: Outcome,
    pub(crate) reason: String,
    /// True if every servo has heard the end.
    pub(crate) is_heard: bool,
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

/// Repeats the cycle until it is done or stopped, and survives its panics. Returns the outcome and the reason;
/// `done` is that of the planned end. The operator hears of the end when all servos have received it.
pub(crate) fn perform<P: Ports>(
    robot: &Robot,
    cycle: &mut Cycle<'_, P>,
    start: Time,
    done: &str,
    recorder: &mut Option<Recorder>,
    operator: &mut impl Operator,
) -> End {
    let ended = catch_unwind(AssertUnwindSafe(|| repeat(robot, cycle, start, recorder, operator)));
    let end = match ended {
        Ok(stopper) => {
            let planned = match stopper {
                Stopper::Nobody => (Outcome::Completed, done),
                Stopper::Operator => operator.why_stopped(),
                Stopper::Recording => (Outcome::Failed, RECORDING_LOST),
            };
            verdict(robot, cycle, planned)
        }
        Err(_) => {
            // The motion can no longer be trusted to end by itself, and a single jogged joint always ends limp.
            let is_jog = cycle.generator().jog().is_some();
            let is_to_hold = !is_jog && robot.stop_action == StopAction::Hold;
            let is_heard = is_to_hold || cycle.buses_mut().limp();
            let mut reason =
                "the loop panicked: this is a defect of the program, please report it".to_owned();
            if !is_heard {
                reason +=
                    "; not all servos were heard afterwards, and some may still have torque: cut their power";
            }
            End { outcome: Outcome::Failed, reason, is_heard }
        }
    };
    operator.loop_ended();
    end
}

/// Repeats the cycle on absolute deadlines until the stop action is complete; returns what caused the stop.
fn repeat<P: Ports>(
    robot: &Robot,
    cycle: &mut Cycle<'_, P>,
    start: Time,
    recorder: &mut Option<Recorder>,
    operator: &mut impl Operator,
) -> Stopper {
    let period = Duration::from_secs_f64(robot.period_s());
    let late = period.mul_f64(LATE_SHARE);
    let mut deadline = start;
    let mut stopper = Stopper::Nobody;
    let mut last_cycles = 0;
    loop {
        cycle.buses_mut().ports_mut().wait_until(deadline);
        let woke = cycle.buses_mut().ports_mut().now();
        let lateness = woke.since(deadline);
        cycle.telemetry_mut().begin_cycle(deadline, woke);
        cycle
            .telemetry_mut()
            .note_lateness(u64::try_from(lateness.as_micros()).unwrap_or(u64::MAX), lateness > late);
        let is_recording_lost = recorder.as_ref().is_some_and(Recorder::is_lost);
        let mut wanted = operator.order(&status(robot, cycle, start, is_recording_lost));
        if wanted.is_stop() {
            if stopper == Stopper::Nobody {
                stopper = Stopper::Operator;
            }
        } else if is_recording_lost {
            wanted = Order::Stop;
            // The lost recording did not cause an end that was planned.
            if stopper == Stopper::Nobody && cycle.activity() != Activity::Done {
                stopper = Stopper::Recording;
            }
        }
        cycle.step(wanted);
        if let Some(recorder) = recorder {
            recorder.record(&cycle.record(), cycle.times(), lateness, cycle.buses().statistics());
        }
        cycle.end_cycle();
        if cycle.activity() == Activity::Done {
            last_cycles += 1;
            let since_s = f64::from(last_cycles) * robot.period_s();
            // Every servo has answered an exchange that sent it the last goals.
            let is_heard = cycle.state().joints.iter().all(|joint| joint.age_s < since_s - robot.period_s());
            if last_cycles >= LAST_CYCLES && (is_heard || since_s >= LAST_PATIENCE_S) {
                return stopper;
            }
        }
        // Deadlines that have already passed are skipped; the loop does not catch up on them.
        let now = cycle.buses_mut().ports_mut().now();
        deadline = deadline + period;
        while now.since(deadline) > period {
            deadline = deadline + period;
        }
    }
}

fn status<P: Ports>(robot: &Robot, cycle: &mut Cycle<'_, P>, start: Time, is_recording_lost: bool) -> Status {
    let time_s = cycle.buses_mut().ports_mut().now().since(start).as_secs_f64();
    let known = || cycle.state().joints.iter().filter(|joint| joint.is_known);
    let drive = cycle.generator().drive();
    Status {
        time_s,
        activity: cycle.activity(),
        gait: drive.and_then(Drive::gait),
        stroke: cycle.generator().stroke(),
        yaw_rate_rad_s: drive.map_or(0.0, |drive| drive.rates().yaw_rate_rad_s),
        speed_m_s: cycle.generator().speed_m_s(),
        permission: cycle.state().permission,
        frozen: cycle.state().is_out.iter().filter(|is_out| **is_out).count(),
        outage: cycle.state().outage,
        late_cycles: cycle.telemetry().totals().1,
        hottest_c: known().map(|joint| joint.temperature_c).fold(0.0, f64::max),
        lowest_v: known().map(|joint| joint.voltage_v).fold(f64::INFINITY, f64::min),
        is_imu_lost: robot.imu.is_some() && !cycle.state().body.is_known,
        is_recording_lost,
    }
}

/// The end of a loop: `planned`, unless safety or the servos say otherwise.
fn verdict<P: Ports>(robot: &Robot, cycle: &mut Cycle<'_, P>, planned: (Outcome, &str)) -> End {
    let lost = may_have_torque(robot, cycle);
    let is_heard = lost.is_empty();
    if !is_heard {
        cycle.buses_mut().limp_unheard();
    }
    let (outcome, reason) = if cycle.state().permission == Permission::Stop {
        let why = cycle.safety().cause().map_or_else(String::new, |finding| finding.describe(robot));
        let mut reasons = vec![why];
        reasons.extend(cycle.buses().strangers());
        reasons.extend((!lost.is_empty()).then_some(lost));
        (Outcome::StoppedBySafety, reasons.join("; "))
    } else if !lost.is_empty() {
        (Outcome::Failed, lost)
    } else if let Some(falls) = cycle.reflex().report().filter(|_| cycle.reflex().is_down()) {
        (Outcome::Fallen, format!("{falls}: set it on its feet and start it again"))
    } else if planned.0 == Outcome::Completed && cycle.telemetry().lies_fallen() {
        (Outcome::Fallen, "it fell and did not get up: set it on its feet and start it again".to_owned())
    } else {
        (planned.0, planned.1.to_owned())
    };
    let (outcome, reason) = match violations(cycle.telemetry().joints_report()) {
        Some(violations) => (Outcome::Failed, format!("{violations}; {reason}")),
        None => (outcome, reason),
    };
    End { outcome, reason, is_heard }
}

/// Goals that safety must never let through, in words; `None` if there were no such goals.
fn violations(joints: JointsReport) -> Option<String> {
    let JointsReport { range_violations, rate_violations, .. } = joints;
    let is_any = range_violations + rate_violations > 0;
    is_any.then(|| {
        format!(
            "{range_violations} goals were outside their range and {rate_violations} too fast: this is a defect of the \
             program, please report it with the robot file"
        )
    })
}

/// The servos that did not hear the end, in words; empty if all did, or if torque was meant to stay on.
fn may_have_torque<P: Ports>(robot: &Robot, cycle: &Cycle<'_, P>) -> String {
    if cycle.goals().servos().iter().any(|goal| *goal != ServoGoal::Limp) {
        return String::new();
    }
    let states = &cycle.state().joints;
    let is_lost = |state: &JointState| state.is_known && state.age_s > robot.safety.coast_s;
    let mut lost = Vec::new();
    for (index, bus) in robot.buses.iter().enumerate() {
        let on_bus = || {
            let all = robot.joints.iter().zip(states);
            all.filter_map(|(joint, state)| {
                Some((joint, joint.servo.filter(|servo| servo.bus == index)?, state))
            })
        };
        if on_bus().all(|(_, _, state)| is_lost(state)) {
            lost.push(format!("all servos on bus {}", bus.name));
        } else {
            let each = on_bus().filter(|(_, _, state)| is_lost(state));
            lost.extend(
                each.map(|(joint, servo, _)| format!("{} ({} on bus {})", joint.name, servo.id, bus.name)),
            );
        }
    }
    match lost.is_empty() {
        true => String::new(),
        false => {
            format!("not heard at the end, and may still have torque: {}; cut their power", lost.join(", "))
        }
    }
}
