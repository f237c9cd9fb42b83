//! The outcome of a loop that is over, if safety, a fall or silent servos make it worse than planned.

use super::Cycle;
use crate::bus::Ports;
use crate::model::{Robot, StopAction};
use crate::observe::{CycleRecord, Outcome};
use crate::reflex::FallOutcome;
use crate::signals::{JointState, Permission, ServoGoal};

/// The reason of a run whose simulated body is unstable.
const UNSTABLE: &str = "the simulated body is unstable: its numbers grew without bound; this is a fault of the simulation, \
                        not of the robot or its servos: please report it with the robot file (a smaller step_ms, a \
                        larger rotor_inertia_kg_m2 or a weaker push may avoid it)";

/// Outcome and reason, if safety, a fall or silent servos determine them; and true if every servo has heard the end.
pub(super) fn judge<P: Ports>(robot: &Robot, cycle: &mut Cycle<'_, P>) -> (Option<(Outcome, String)>, bool) {
    let record = cycle.record();
    if is_unstable(&record) {
        return (Some((Outcome::Failed, UNSTABLE.to_owned())), true);
    }
    let lost = may_have_torque(robot, &record);
    let is_heard = lost.is_empty();
    let fallen = record.facts.falls.filter(|falls| falls.outcome == FallOutcome::LiesLimp);
    let failed_rise = record.facts.failed_rise;
    let stopped = (record.state.permission == Permission::Stop)
        .then(|| record.facts.cause.map_or_else(String::new, |finding| finding.describe(robot)));
    if !is_heard {
        cycle.buses_mut().limp_unheard();
    }
    let worse = if let Some(why) = stopped {
        let mut reasons = vec![why];
        reasons.extend(cycle.buses_mut().strangers());
        reasons.extend((!is_heard).then_some(lost));
        Some((Outcome::StoppedBySafety, reasons.join("; ")))
    } else if !is_heard {
        Some((Outcome::Failed, lost))
    } else if let Some(rise) = failed_rise {
        let words = format!(
            "it could not rise, and lies: its trunk tilted {:.0} degrees, in {} tries; set it down level with its legs \
             free and its feet below it, and start it again",
            rise.tilt_rad.to_degrees(),
            rise.tries
        );
        Some((Outcome::Fallen, words))
    } else {
        fallen.map(|falls| (Outcome::Fallen, format!("{falls}: set it on its feet and start it again")))
    };
    (worse, is_heard)
}

/// True if the numbers of the simulated body mean nothing any more.
pub(super) fn is_unstable(record: &CycleRecord<'_>) -> bool {
    record.facts.truth.is_some_and(|body| body.is_unstable)
}

/// Outcome and reason after a panic of the loop, and true if every servo has heard the end. Takes the torque off unless
/// `stop_action` is [`StopAction::Hold`].
pub(super) fn after_panic<P: Ports>(
    cycle: &mut Cycle<'_, P>,
    stop_action: StopAction,
) -> (Outcome, String, bool) {
    let is_heard = stop_action == StopAction::Hold || cycle.buses_mut().limp();
    let mut reason = "the loop panicked: this is a defect of the program, please report it".to_owned();
    if !is_heard {
        reason += "; not all servos were heard afterwards, and some may still have torque: cut their power";
    }
    (Outcome::Failed, reason, is_heard)
}

/// The servos that did not hear the end, in words; empty if all did, or if torque was meant to stay on.
fn may_have_torque(robot: &Robot, record: &CycleRecord<'_>) -> String {
    if record.goals.iter().any(|goal| *goal != ServoGoal::Limp) {
        return String::new();
    }
    let is_lost = |state: &JointState| state.is_known && state.age_s > robot.safety.coast_s;
    let mut lost = Vec::new();
    for (index, bus) in robot.buses.iter().enumerate() {
        let on_bus = || {
            let all = robot.joints.iter().zip(&record.state.joints);
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
