//! A horse from limp to limp: up, standing, walking, standing, down.

use super::{HorsePlan, Walk};
use crate::model::{Robot, StopAction};
use crate::motion::curves::{SMOOTH_STEP_SLOPE_MAX, smooth_step};
use crate::motion::{Activity, Order, posture_pull};
use crate::signals::{Aim, Permission, State, Targets};

/// Time to rise from sitting to standing, and to sit down again, s.
const RISE_S: f64 = 1.5;
/// Time to stand before walking, and after, s.
const STAND_S: f64 = 0.3;
/// Strides after which a walk that is to stop does so, even if a foot goes a little further than it should.
const STRIDES_TO_STOP: f64 = 3.0;
/// Shortest time for a change of pose, s.
const GATHER_MIN_S: f64 = 0.5;
/// Where the robot is between limp and limp. `from` fields are motion time, s.
///
/// ```text
/// Limp -> TorqueUp -> Gather -> Rise -> Stand -> Walk -> Settle -> Sink -> LetGo -> Done
///            |           |        |       |       |         |        |       |
///            +-----------+--------+-------+-------+---------+--------+--> Fold
///                    safety takes the robot off its feet (permission Stop), or StopAtOnce
/// ```
/// `Gather` and `Fold` go to the sitting pose joint by joint; the feet carry the robot from `Rise` to
/// `Sink`; in `LetGo` the torque falls to nothing. With the stop action `hold` the robot stays as it is instead
/// of sinking or folding.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Limp,
    TorqueUp { from: f64 },
    Gather { from: f64, duration: f64 },
    Rise { from: f64 },
    Stand { from: f64 },
    Walk { from: f64 },
    Settle { standing_since: Option<f64> },
    Sink { from: f64 },
    Fold { from: f64, duration: f64 },
    LetGo { from: f64 },
    Done { is_limp: bool },
}

/// Makes the targets of a horse that stands up, walks and stops.
#[derive(Debug, Clone)]
pub struct HorseGenerator {
    plan: HorsePlan,
    walk: Walk,
    phase: Phase,
    /// Motion time, s: stands still while safety holds.
    now_s: f64,
    /// Pose a change of pose began at, rad.
    start_pose_rad: Vec<f64>,
    walk_for_s: f64,
    start_ramp_s: f64,
    /// Since when the walk is to stop, s.
    stop_wanted_s: Option<f64>,
    torque_ramp_s: f64,
    slow_rate_rad_s: f64,
    stop_action: StopAction,
}

impl HorseGenerator {
    /// A limp robot that will walk as `plan` says for `walk_for_s` once ordered to.
    pub fn new(robot: &Robot, plan: HorsePlan, walk_for_s: f64) -> HorseGenerator {
        HorseGenerator {
            walk: Walk::standing(&plan),
            start_ramp_s: Walk::find_start_ramp_s(&plan),
            start_pose_rad: vec![0.0; robot.joints.len()],
            plan,
            phase: Phase::Limp,
            now_s: 0.0,
            walk_for_s,
            stop_wanted_s: None,
            torque_ramp_s: robot.safety.torque_ramp_s,
            slow_rate_rad_s: robot.safety.slow_rate_rad_s,
            stop_action: robot.stop_action,
        }
    }

    /// Advances motion time by `dt_s` (unless held) and writes the targets for now.
    pub fn step(&mut self, dt_s: f64, state: &State, order: Order, targets: &mut Targets) {
        if state.permission == Permission::Hold {
            return;
        }
        self.now_s += dt_s;
        targets.posture_pull = posture_pull(dt_s);
        self.change_phase(state, order);
        self.write_targets(targets);
    }

    fn change_phase(&mut self, state: &State, order: Order) {
        let now = self.now_s;
        let must_fold = state.permission == Permission::Stop || order == Order::StopAtOnce;
        if must_fold
            && !matches!(
                self.phase,
                Phase::Limp | Phase::Fold { .. } | Phase::LetGo { .. } | Phase::Done { .. }
            )
        {
            self.phase = self.fold(state);
            return;
        }
        let wants_stop = order.is_stop();
        let phase = self.phase;
        self.phase = match phase {
            Phase::Limp if wants_stop || state.permission == Permission::Stop => {
                Phase::Done { is_limp: true }
            }
            // A limp joint may be moved by hand: torque comes on only where it was heard to be just now.
            Phase::Limp if state.is_fresh() => {
                for (start, joint) in self.start_pose_rad.iter_mut().zip(&state.joints) {
                    *start = joint.position_rad;
                }
                Phase::TorqueUp { from: now }
            }
            Phase::TorqueUp { .. } | Phase::Gather { .. } if wants_stop => self.fold(state),
            Phase::TorqueUp { from } if now >= from + self.torque_ramp_s => {
                Phase::Gather { from: now, duration: self.gather_duration_s() }
            }
            Phase::Gather { from, duration } if now >= from + duration => Phase::Rise { from: now },
            Phase::Rise { from } if now >= from + RISE_S => Phase::Stand { from: now },
            Phase::Stand { .. } if wants_stop => self.stop_from_stand(state),
            Phase::Stand { from } if now >= from + STAND_S => {
                self.walk = Walk::begin(&self.plan, now, self.start_ramp_s);
                Phase::Walk { from: now }
            }
            Phase::Walk { from } if (wants_stop || now >= from + self.walk_for_s) && self.stops_walking() => {
                Phase::Settle { standing_since: None }
            }
            Phase::Settle { standing_since: None } if self.walk.is_standing(now) => {
                Phase::Settle { standing_since: Some(now) }
            }
            Phase::Settle { standing_since: Some(since) } if now >= since + STAND_S => {
                self.stop_from_stand(state)
            }
            Phase::Sink { from } if now >= from + RISE_S => self.let_go(state),
            Phase::Fold { from, duration } if now >= from + duration => self.let_go(state),
            Phase::LetGo { from } if now >= from + self.torque_ramp_s => Phase::Done { is_limp: true },
            unchanged => unchanged,
        };
    }

    /// Begins to stop if that can be done now; in the end it is done anyway.
    fn stops_walking(&mut self) -> bool {
        let since_s = *self.stop_wanted_s.get_or_insert(self.now_s);
        let period_s = self.plan.gait.period_s(self.plan.settings.swing_time_s);
        let must = self.now_s - since_s >= STRIDES_TO_STOP * period_s;
        self.walk.try_stop(&self.plan, self.now_s, must)
    }

    fn let_go(&mut self, state: &State) -> Phase {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        Phase::LetGo { from: self.now_s }
    }

    fn stop_from_stand(&mut self, state: &State) -> Phase {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        match self.stop_action {
            StopAction::Hold => Phase::Done { is_limp: false },
            StopAction::SitThenLimp => Phase::Sink { from: self.now_s },
        }
    }

    /// The stop action from whatever pose the robot is in.
    fn fold(&mut self, state: &State) -> Phase {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        match self.stop_action {
            StopAction::Hold => Phase::Done { is_limp: false },
            StopAction::SitThenLimp => Phase::Fold { from: self.now_s, duration: self.gather_duration_s() },
        }
    }

    /// Time for every joint to go from the start pose to the sitting pose at the slow rate, s.
    fn gather_duration_s(&self) -> f64 {
        let turns =
            self.start_pose_rad.iter().zip(&self.plan.sit_pose_rad).map(|(from, to)| (to - from).abs());
        (SMOOTH_STEP_SLOPE_MAX * turns.fold(0.0, f64::max) / self.slow_rate_rad_s).max(GATHER_MIN_S)
    }

    fn write_targets(&mut self, targets: &mut Targets) {
        let now = self.now_s;
        targets.torque_share = match self.phase {
            Phase::LetGo { from } => 1.0 - smooth_step((now - from) / self.torque_ramp_s),
            _ => 1.0,
        };
        let (sit_m, stand_m) = (self.plan.settings.sit_height_m, self.plan.settings.stand_height_m);
        match self.phase {
            Phase::Limp | Phase::Done { is_limp: true } => {
                targets.aim = Aim::Limp;
                targets.feet.clear();
            }
            Phase::TorqueUp { .. } | Phase::LetGo { .. } | Phase::Done { is_limp: false } => {
                self.write_pose(0.0, targets);
            }
            Phase::Gather { from, duration } | Phase::Fold { from, duration } => {
                self.write_pose(smooth_step((now - from) / duration), targets);
            }
            Phase::Rise { from } => {
                self.write_tips(sit_m + (stand_m - sit_m) * smooth_step((now - from) / RISE_S), targets);
            }
            Phase::Sink { from } => {
                self.write_tips(stand_m + (sit_m - stand_m) * smooth_step((now - from) / RISE_S), targets);
            }
            Phase::Stand { .. } | Phase::Walk { .. } | Phase::Settle { .. } => {
                self.write_tips(stand_m, targets)
            }
        }
    }

    /// The pose `share` of the way from the start pose to the sitting pose.
    fn write_pose(&self, share: f64, targets: &mut Targets) {
        targets.aim = Aim::Pose;
        targets.feet.clear();
        for ((angle, from), to) in
            targets.pose_rad.iter_mut().zip(&self.start_pose_rad).zip(&self.plan.sit_pose_rad)
        {
            *angle = from + share * (to - from);
        }
    }

    fn write_tips(&mut self, height_m: f64, targets: &mut Targets) {
        targets.aim = Aim::Tips;
        self.walk.advance(self.now_s);
        self.walk.write(&self.plan, self.now_s, height_m, targets);
    }

    /// What the robot is doing.
    pub fn activity(&self) -> Activity {
        match self.phase {
            Phase::Limp => Activity::Limp,
            Phase::TorqueUp { .. } | Phase::Gather { .. } | Phase::Rise { .. } => Activity::Rising,
            Phase::Stand { .. } => Activity::Standing,
            Phase::Walk { .. } => Activity::Walking,
            Phase::Settle { .. } | Phase::Sink { .. } | Phase::Fold { .. } | Phase::LetGo { .. } => {
                Activity::Stopping
            }
            Phase::Done { .. } => Activity::Done,
        }
    }

    /// Speed of the trunk the plan has now, m/s.
    pub fn speed_m_s(&self) -> f64 {
        self.walk.speed_m_s(self.now_s)
    }

    /// The gait it goes, index into [`crate::model::HorseMotion::gaits`]; none while it takes no steps.
    pub fn gait(&self) -> Option<usize> {
        if !matches!(self.phase, Phase::Walk { .. } | Phase::Settle { standing_since: None }) {
            return None;
        }
        self.plan.settings.gaits.iter().position(|gait| *gait == self.plan.gait)
    }

    /// Turn of the trunk the plan has now, rad/s, to the left.
    pub fn yaw_rate_rad_s(&self) -> f64 {
        0.0
    }
}
