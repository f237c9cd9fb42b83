//! Goal registers and measured joints, checked against ranges and rates.

use super::report::JointsReport;
use crate::bus::{ServoGoal, Slot};
use crate::model::Robot;
use crate::observe::CycleRecord;
use crate::signals::ServoAnswer;

#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    /// The goal register, counts, as far as it is known; `None` while limp.
    goal: Option<i32>,
    /// The last goal that was sent, with torque or without; `None` while limp.
    sent: Option<i32>,
    /// Measured angle in the cycle before, rad.
    position_rad: Option<f64>,
    /// True once the joint was measured inside its range.
    was_inside: bool,
}

#[derive(Debug)]
pub(super) struct JointObserver {
    seen: Vec<Seen>,
    report: JointsReport,
}

impl JointObserver {
    pub(super) fn new(robot: &Robot) -> JointObserver {
        JointObserver { seen: vec![Seen::default(); robot.joints.len()], report: JointsReport::default() }
    }

    pub(super) fn report(&self) -> JointsReport {
        self.report
    }

    pub(super) fn note_gap(&mut self) {
        self.seen.iter_mut().for_each(|seen| (seen.goal, seen.sent, seen.position_rad) = (None, None, None));
    }

    pub(super) fn observe(&mut self, robot: &Robot, record: &CycleRecord<'_>) {
        for (index, joint) in robot.joints.iter().enumerate() {
            let Some(servo) = &joint.servo else { continue };
            let (measured, seen) = (&record.state.joints[index], &mut self.seen[index]);
            let (low, high) = joint.range_rad;
            let outside_of = |angle_rad: f64| (low - angle_rad).max(angle_rad - high);
            let overshoot_rad = outside_of(measured.position_rad);
            // The encoder itself cannot resolve half a count.
            seen.was_inside |= measured.is_known && overshoot_rad <= 0.5 * servo.count_rad();
            if seen.was_inside {
                self.report.range_overshoot_max_deg =
                    self.report.range_overshoot_max_deg.max(overshoot_rad.to_degrees());
            }
            match record.slots[index] {
                // A servo's own report outranks what was sent.
                Slot::Answered(ServoAnswer::Goal(held)) => seen.goal = seen.goal.map(|_| held),
                Slot::Answered(ServoAnswer::Torque(false)) => seen.goal = None,
                _ => {}
            }
            let sent = seen.sent;
            let goal = match record.goals[index] {
                // A goal that is not sent again does not change.
                ServoGoal::Limp => {
                    seen.sent = None;
                    None
                }
                ServoGoal::Keep => continue,
                ServoGoal::Move { position, torque_limit } => {
                    // Without torque no goal turns the joint.
                    if torque_limit == 0 {
                        seen.goal = None;
                    }
                    seen.sent = Some(position);
                    Some(position)
                }
            };
            if let Some(goal) = goal {
                let angle_rad = servo.angle_of(f64::from(goal));
                self.report.tracking_error_max_deg = self
                    .report
                    .tracking_error_max_deg
                    .max((angle_rad - measured.position_rad).abs().to_degrees());
                // Torque comes on at the joint's angle in the cycle before.
                let goal_rad = seen.goal.map(|goal| servo.angle_of(f64::from(goal)));
                let before_rad = goal_rad.or(seen.position_rad).unwrap_or(measured.position_rad);
                // A limp joint may move a little towards its range after its first goal was chosen.
                let sent_rad = sent.map_or(before_rad, |sent| servo.angle_of(f64::from(sent)));
                let outside_before_rad = outside_of(before_rad).max(outside_of(sent_rad));
                // Only a joint that starts outside its range may be outside, on its way in.
                let outside_rad = outside_of(angle_rad);
                let is_on_the_way_in = outside_rad <= outside_before_rad;
                if outside_rad > 1e-9 && !is_on_the_way_in {
                    self.report.range_violations += 1;
                }
                if let Some(before) = seen.goal {
                    let rate_rad_s = robot.safety.rate_share * servo.model.no_load_speed_rad_s;
                    // Rounding to counts may add up to one count.
                    let allowed = rate_rad_s * record.facts.dt_s / servo.count_rad() + 1.0;
                    if (f64::from(goal) - f64::from(before)).abs() > allowed + 1e-9 {
                        self.report.rate_violations += 1;
                    }
                }
            }
            (seen.goal, seen.position_rad) = (goal, Some(measured.position_rad));
        }
    }
}
