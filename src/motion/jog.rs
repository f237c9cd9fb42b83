//! One joint turns slowly to an angle, stays there for a moment and is let go; all others stay limp.

use super::curves::{SMOOTH_STEP_SLOPE_MAX, smooth_step};
use super::torque_phase::TorquePhase;
use super::{Activity, Generate, Order};
use crate::model::Robot;
use crate::signals::{Permission, State, Targets};

/// Shortest time for the turn, s.
const TURN_MIN_S: f64 = 0.5;

/// Phase of the joint between limp and limp. `from` fields are motion time, s.
///
/// ```text
/// Limp -> TorqueUp -> Turn -> Hold -> LetGo -> Done
///            |          |       |       ^
///            +----------+-------+-------+   any order to stop, or permission Stop
/// ```
/// The [`TorquePhase`] (`Limp`, `TorqueUp`, `LetGo`, `Done`) are those of every motion.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Torque(TorquePhase),
    Turn { from: f64, duration: f64 },
    Hold { from: f64 },
}

/// Makes the targets of a robot that moves only one joint.
#[derive(Debug, Clone)]
pub struct Jog {
    joint: usize,
    goal_rad: f64,
    phase: Phase,
    /// Time for which the joint is held at its goal, s: its measurement then shows where it came to rest.
    hold_s: f64,
    /// Motion time, s; does not advance while safety holds.
    now_s: f64,
    /// Angle of every joint when the turn, or the letting go, began, rad.
    start_pose_rad: Vec<f64>,
    measured_rad: Option<f64>,
    torque_ramp_s: f64,
    slow_rate_rad_s: f64,
}

impl Jog {
    /// A limp robot whose joint number `joint` will turn to `goal_rad`, limited to the range for goals, and
    /// stay there for `hold_s`. An angle that is not finite means the middle of that range.
    pub fn new(robot: &Robot, joint: usize, goal_rad: f64, hold_s: f64) -> Jog {
        let of = &robot.joints[joint];
        let (low, high) = of.goal_range_rad();
        Jog {
            joint,
            goal_rad: if goal_rad.is_finite() { goal_rad.clamp(low, high) } else { of.middle_rad() },
            phase: Phase::Torque(TorquePhase::Limp),
            hold_s,
            now_s: 0.0,
            start_pose_rad: vec![0.0; robot.joints.len()],
            measured_rad: None,
            torque_ramp_s: robot.safety.torque_ramp_s,
            slow_rate_rad_s: robot.safety.slow_rate_rad_s,
        }
    }

    /// Goal of the joint, rad.
    pub fn goal_rad(&self) -> f64 {
        self.goal_rad
    }

    /// Position of the joint when its torque began to fall, rad; `None` before that, and if it never had torque.
    pub fn measured_rad(&self) -> Option<f64> {
        self.measured_rad
    }

    fn change_phase(&mut self, state: &State, order: Order) {
        let now = self.now_s;
        let must_end = order.is_stop() || state.permission == Permission::Stop;
        self.phase = match self.phase {
            Phase::Torque(TorquePhase::TorqueUp { from }) if must_end => {
                self.let_go(((now - from) / self.torque_ramp_s).min(1.0), state)
            }
            Phase::Torque(end) => {
                match end.next(now, self.torque_ramp_s, must_end, state, &mut self.start_pose_rad) {
                    Some(end) => Phase::Torque(end),
                    None => Phase::Turn { from: now, duration: self.turn_duration_s() },
                }
            }
            Phase::Turn { .. } if must_end => self.let_go(1.0, state),
            Phase::Turn { from, duration } if now >= from + duration => Phase::Hold { from: now },
            Phase::Hold { from } if must_end || now >= from + self.hold_s => self.let_go(1.0, state),
            unchanged => unchanged,
        };
    }

    fn let_go(&mut self, share: f64, state: &State) -> Phase {
        self.measured_rad = Some(state.joints[self.joint].position_rad);
        Phase::Torque(TorquePhase::let_go(self.now_s, share, state, &mut self.start_pose_rad))
    }

    /// Duration of the turn at no more than the slow rate, s.
    fn turn_duration_s(&self) -> f64 {
        let turn_rad = (self.goal_rad - self.start_pose_rad[self.joint]).abs();
        (SMOOTH_STEP_SLOPE_MAX * turn_rad / self.slow_rate_rad_s).max(TURN_MIN_S)
    }

    fn write_targets(&self, targets: &mut Targets) {
        targets.torque_share = match self.phase {
            Phase::Torque(end) => end.torque_share(self.now_s, self.torque_ramp_s),
            Phase::Turn { .. } | Phase::Hold { .. } => 1.0,
        };
        let share = match self.phase {
            Phase::Torque(end) if end.is_limp() => {
                targets.set_limp();
                return;
            }
            Phase::Torque(_) => 0.0,
            Phase::Turn { from, duration } => smooth_step((self.now_s - from) / duration),
            Phase::Hold { .. } => 1.0,
        };
        let pose_rad = targets.set_joint(self.joint);
        pose_rad.copy_from_slice(&self.start_pose_rad);
        let angle = &mut pose_rad[self.joint];
        *angle += share * (self.goal_rad - *angle);
    }
}

impl Generate for Jog {
    fn step(&mut self, dt_s: f64, state: &State, order: Order, targets: &mut Targets) {
        if state.permission == Permission::Hold && !order.is_stop() {
            return;
        }
        self.now_s += dt_s;
        self.change_phase(state, order);
        self.write_targets(targets);
    }

    fn activity(&self) -> Activity {
        match self.phase {
            Phase::Torque(end) => end.activity(Activity::Jogging),
            Phase::Turn { .. } | Phase::Hold { .. } => Activity::Jogging,
        }
    }

    /// A single joint that has lost its torque stays where it is.
    fn restart(&mut self, _state: &State) {}

    fn jog(&self) -> Option<&Jog> {
        Some(self)
    }
}
