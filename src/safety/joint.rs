//! What safety remembers about one joint, and where the joint's goals start.

use super::limiter::Limiter;
use super::servo_outage::ServoOutage;
use super::state_query::{GOAL_SLACK_RAD, QueriedState, StateQuery};
use crate::model::{Joint, SafetySettings};
use crate::signals::JointState;

#[derive(Debug)]
pub(super) struct JointSafety {
    pub(super) limiter: Limiter,
    /// True if its servo stops by itself when its bus is silent; it then holds another goal.
    has_watchdog: bool,
    /// Time since its torque came on, s; `None` while limp.
    pub(super) torque_on_s: Option<f64>,
    /// True once it has had torque in this run.
    has_started: bool,
    /// The lowest and the highest goal, rad, that its servo may hold: the last goal that a reply confirmed, and all
    /// goals sent since.
    pub(super) held_rad: (f64, f64),
    /// True if it, and every other servo of its bus, answered the exchange before the last.
    was_heard: bool,
    /// True from when its silent servo may have restarted until it is known whether it has.
    pub(super) is_lost: bool,
    /// Angle at which it was last heard before it was lost, rad.
    before_rad: f64,
    /// Answers of its servo to questions since it was heard again.
    pub(super) state_query: StateQuery,
    /// Outage of its servo, on a robot that may continue without a joint.
    pub(super) outage: ServoOutage,
}

impl JointSafety {
    pub(super) fn new(joint: &Joint, settings: &SafetySettings) -> JointSafety {
        JointSafety {
            limiter: Limiter::new(joint, settings),
            has_watchdog: joint.servo.is_some_and(|servo| servo.model.registers.bus_watchdog.is_some()),
            torque_on_s: None,
            has_started: false,
            held_rad: (0.0, 0.0),
            was_heard: false,
            is_lost: false,
            before_rad: 0.0,
            state_query: StateQuery::default(),
            outage: ServoOutage::NONE,
        }
    }

    /// Chooses the angle from which the next goal follows. When torque comes on, it is the measured angle. After a
    /// stall of the loop by `stall_s` it is the last goal, at rest: the servo has long arrived there. After a
    /// silence of the servo, or a stall in which its watchdog may have stopped it, it is the goal that the servo
    /// holds, or the measured angle if the servo has lost its torque. `is_bus_heard` says whether every servo of
    /// its bus answered the last exchange.
    pub(super) fn take_over(
        &mut self,
        stall_s: f64,
        settings: &SafetySettings,
        measured: &JointState,
        is_bus_heard: bool,
    ) {
        if self.torque_on_s.is_some() && !self.is_lost {
            self.note_sent(measured, is_bus_heard);
        }
        let may_have_stopped = self.has_watchdog && stall_s > settings.lost_after_s();
        if measured.age_s > settings.lost_after_s() || may_have_stopped && self.torque_on_s.is_some() {
            if !self.is_lost {
                self.before_rad = measured.position_rad;
            }
            (self.is_lost, self.state_query) = (true, StateQuery::default());
        } else if self.torque_on_s.is_none() {
            self.start_limp(measured);
        } else if self.is_lost {
            match self.state_query.take(measured, self.held_rad, self.before_rad) {
                None => {}
                Some(QueriedState::Limp) => self.start_limp(measured),
                Some(QueriedState::Holding(goal_rad)) => {
                    self.limiter.start_from(goal_rad);
                    self.hold_last_goal();
                    self.is_lost = false;
                }
            }
        } else if stall_s > settings.coast_s {
            self.limiter.rest_at_goal();
        }
    }

    /// Prepares for the first goal with torque.
    fn start_limp(&mut self, measured: &JointState) {
        self.is_lost = false;
        self.let_go(measured);
        self.hold_last_goal();
    }

    /// Without torque a joint has no goal, so the next goal starts from its measured angle. The first goal lies
    /// outside the range only if the joint was found far outside when the run began. A joint that is outside later,
    /// or only a little, gave way, and its goals stay inside.
    pub(super) fn let_go(&mut self, measured: &JointState) {
        self.torque_on_s = None;
        if self.has_started || self.limiter.is_almost_inside(measured.position_rad) {
            self.limiter.start_inside(measured.position_rad);
        } else {
            self.limiter.start_from(measured.position_rad);
        }
    }

    /// Notes that the servo holds the last goal and no other.
    fn hold_last_goal(&mut self) {
        (self.held_rad, self.was_heard) = ((self.limiter.goal_rad(), self.limiter.goal_rad()), true);
    }

    /// Adds `dt_s` with torque on; returns the time that torque has been on, s.
    pub(super) fn hold_torque(&mut self, dt_s: f64) -> f64 {
        let on_s = self.torque_on_s.map_or(0.0, |on_s| on_s + dt_s);
        (self.torque_on_s, self.has_started) = (Some(on_s), true);
        on_s
    }

    /// True if a goal can start from the measured angle of the limp joint.
    pub(super) fn can_start_from(&self, measured: &JointState) -> bool {
        self.torque_on_s.is_some()
            || self.limiter.has_counts_at(measured.position_rad)
                && (!self.has_started || self.limiter.is_between_stops(measured.position_rad))
    }

    /// True if the joint is returning to what is wanted, or it is still unknown what its servo holds.
    pub(super) fn is_waited_for(&self, measured: &JointState) -> bool {
        let is_asked = self.is_lost && (measured.age_s <= 0.0 || self.state_query.has_begun());
        self.torque_on_s.is_some() && (self.limiter.is_catching_up() || is_asked)
    }

    /// A servo that answers exchange after exchange holds the goal sent with the last one. The first answer after a
    /// silence proves less: the servo may have begun to hear between the goal and the question of one request. An
    /// answer also proves little while another servo of the bus owes one: the late answer may spoil the goals of
    /// all. If a servo reports its goal, the report is believed if that goal was sent.
    fn note_sent(&mut self, measured: &JointState, is_bus_heard: bool) {
        let goal_rad = self.limiter.goal_rad();
        let (low, high) = (self.held_rad.0.min(goal_rad), self.held_rad.1.max(goal_rad));
        let is_heard = measured.age_s <= 0.0;
        let said = measured
            .held_goal_rad
            .filter(|said| (low - GOAL_SLACK_RAD..=high + GOAL_SLACK_RAD).contains(said));
        self.held_rad = match (said, is_heard && self.was_heard) {
            (Some(said_rad), _) => (said_rad, said_rad),
            (None, true) => (goal_rad, goal_rad),
            (None, false) => (low, high),
        };
        self.was_heard = is_heard && is_bus_heard;
    }
}
