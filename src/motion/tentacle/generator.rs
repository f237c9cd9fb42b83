//! Arms from limp to limp: they wake where they hang, go to the parked pose, move by strokes, and park again.

use super::TentaclePlan;
use super::performer::Performer;
use crate::model::{Robot, StopAction};
use crate::motion::curves::smooth_step;
use crate::motion::torque_phase::TorquePhase;
use crate::motion::{Activity, Generate, Order, Stroke, StrokeCommand, pose_change, posture_pull};
use crate::signals::{Permission, State, Targets};

/// Phase of the arms between limp and limp. `from` fields are motion time, s.
///
/// ```text
/// Limp -> TorqueUp -> Gather -> Performing -> Fold -> LetGo -> Done
///            |           |          |          ^
///            +-----------+----------+----------+   permission Stop, or StopAtOnce; before Performing, any stop
/// ```
/// `Gather` and `Fold` go to the parked pose joint by joint. An arm that is wound round a pole does not fold,
/// because it would tear at the pole: it lets go where it is. The [`TorquePhase`] (`Limp`, `TorqueUp`, `LetGo`, `Done`)
/// are those of every motion. With the stop action `hold` the arms stay as they are instead of folding: `Held`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Torque(TorquePhase),
    Gather { from: f64, duration: f64 },
    Performing { from: f64, is_ending: bool },
    Fold { from: f64, duration: f64 },
    Held,
}

/// Makes the targets of arms.
#[derive(Debug)]
pub struct TentacleGenerator {
    plan: TentaclePlan,
    performer: Performer,
    phase: Phase,
    /// Motion time, s; does not advance while safety holds.
    now_s: f64,
    /// Pose at the start of the present change of pose, rad.
    start_pose_rad: Vec<f64>,
    perform_for_s: f64,
    torque_ramp_s: f64,
    slow_rate_rad_s: f64,
    stop_action: StopAction,
}

impl TentacleGenerator {
    /// Limp arms that, once ordered, move by `plan` for `perform_for_s`.
    pub fn new(robot: &Robot, plan: TentaclePlan, perform_for_s: f64) -> TentacleGenerator {
        TentacleGenerator {
            performer: Performer::new(robot, &plan),
            plan,
            phase: Phase::Torque(TorquePhase::Limp),
            now_s: 0.0,
            start_pose_rad: vec![0.0; robot.joints.len()],
            perform_for_s,
            torque_ramp_s: robot.safety.torque_ramp_s,
            slow_rate_rad_s: robot.safety.slow_rate_rad_s,
            stop_action: robot.stop_action,
        }
    }

    fn change_phase(&mut self, state: &State, order: Order) {
        let now = self.now_s;
        let must_fold = state.permission == Permission::Stop || order == Order::StopAtOnce;
        let must_end = order.is_stop() || must_fold;
        self.phase = match self.phase {
            Phase::Torque(TorquePhase::TorqueUp { .. }) if must_end => self.fold(state),
            Phase::Torque(end) => {
                match end.next(now, self.torque_ramp_s, must_end, state, &mut self.start_pose_rad) {
                    Some(end) => Phase::Torque(end),
                    None => Phase::Gather { from: now, duration: self.fold_duration_s() },
                }
            }
            Phase::Gather { .. } if must_end => self.fold(state),
            Phase::Gather { from, duration } if now >= from + duration => {
                Phase::Performing { from: now, is_ending: false }
            }
            Phase::Performing { .. } if must_fold => self.fold(state),
            Phase::Performing { is_ending: true, .. } if self.performer.is_still() => self.fold(state),
            Phase::Fold { from, duration } if now >= from + duration => {
                Phase::Torque(TorquePhase::let_go(now, 1.0, state, &mut self.start_pose_rad))
            }
            unchanged => unchanged,
        };
    }

    /// Begins the stop action from the present pose.
    fn fold(&mut self, state: &State) -> Phase {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        match self.stop_action {
            StopAction::Hold => Phase::Held,
            StopAction::SitThenLimp if self.performer.is_wound() => {
                Phase::Torque(TorquePhase::let_go(self.now_s, 1.0, state, &mut self.start_pose_rad))
            }
            StopAction::SitThenLimp => Phase::Fold { from: self.now_s, duration: self.fold_duration_s() },
        }
    }

    /// Time for every joint to move from the start pose to the parked pose at the slow rate, s.
    fn fold_duration_s(&self) -> f64 {
        pose_change::duration_s(&self.start_pose_rad, &self.plan.park_pose_rad, self.slow_rate_rad_s)
    }

    fn write_targets(&self, targets: &mut Targets) {
        targets.torque_share = match self.phase {
            Phase::Torque(end) => end.torque_share(self.now_s, self.torque_ramp_s),
            _ => 1.0,
        };
        match self.phase {
            Phase::Torque(end) if end.is_limp() => targets.set_limp(),
            Phase::Torque(_) | Phase::Held => self.write_pose(0.0, targets),
            Phase::Gather { from, duration } | Phase::Fold { from, duration } => {
                self.write_pose(smooth_step((self.now_s - from) / duration), targets);
            }
            Phase::Performing { .. } => self.performer.write(targets),
        }
    }

    /// Writes the pose `share` of the way from the start pose to the parked pose.
    fn write_pose(&self, share: f64, targets: &mut Targets) {
        pose_change::write(&self.start_pose_rad, &self.plan.park_pose_rad, share, targets);
    }
}

impl Generate for TentacleGenerator {
    fn step(&mut self, dt_s: f64, state: &State, order: Order, targets: &mut Targets) {
        if state.permission == Permission::Hold {
            return;
        }
        self.now_s += dt_s;
        targets.posture_pull = posture_pull(dt_s);
        targets.may_restart = self.activity() == Activity::Parked;
        self.change_phase(state, order);
        if let Phase::Performing { from, is_ending } = &mut self.phase {
            let command = command(order, self.now_s - *from, self.perform_for_s, self.plan.command);
            *is_ending = command.is_none();
            self.performer.step(dt_s, state, command.unwrap_or_default());
        }
        self.write_targets(targets);
    }

    fn restart(&mut self, state: &State) {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        self.phase = Phase::Gather { from: self.now_s, duration: self.fold_duration_s() };
    }

    fn activity(&self) -> Activity {
        match self.phase {
            Phase::Torque(end) => end.activity(Activity::Rising),
            Phase::Gather { .. } => Activity::Rising,
            Phase::Performing { is_ending: true, .. } => Activity::Stopping,
            Phase::Performing { .. } if self.performer.is_still() => {
                if self.performer.stroke() == Stroke::PARK.name {
                    Activity::Parked
                } else {
                    Activity::Standing
                }
            }
            Phase::Performing { .. } => Activity::Performing,
            Phase::Fold { .. } => Activity::Stopping,
            Phase::Held => Activity::Done,
        }
    }

    fn stroke(&self) -> Option<&'static str> {
        match self.phase {
            Phase::Performing { .. } => {
                Some(self.performer.stroke()).filter(|stroke| *stroke != Stroke::REST.name)
            }
            _ => None,
        }
    }
}

/// The command for arms that have been awake for `since_s`; `None` to go to rest and stop.
fn command(order: Order, since_s: f64, perform_for_s: f64, planned: StrokeCommand) -> Option<StrokeCommand> {
    match order {
        Order::Stop | Order::StopAtOnce => None,
        Order::Perform(command) => Some(command),
        // Arms do not walk and have no poses.
        Order::Drive(_) | Order::Take(_) => Some(StrokeCommand::of(Stroke::REST)),
        Order::Go if since_s < perform_for_s => Some(planned),
        Order::Go => None,
    }
}
