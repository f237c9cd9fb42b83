//! A robot on legs from limp to limp: it rises, acts on its feet, and goes down.

use glam::{DQuat, EulerRot};

use super::curves::smooth_step;
use super::horse::Drive;
pub use super::legged_motion::LeggedMotion;
use super::rise::{self, FailedRise, RiseWatch};
use super::torque_phase::TorquePhase;
use super::{Activity, Generate, Order, pose_change, posture_pull};
use crate::model::{Joint, Robot, StopAction};
use crate::signals::{Permission, State, Targets};

/// Time to rise from sitting to standing, and to sit down again, s.
const RISE_S: f64 = 1.5;
/// Legs with no lower joint further than this from its place are folded, rad.
const FOLDED_RAD: f64 = 0.03;
/// How much longer each move takes on a further try to rise.
const CAREFUL: f64 = 2.0;
/// Time to lie limp before such a try, s: until the robot is still, and at most.
const LIE_S: f64 = 1.0;
const LIE_MAX_S: f64 = 5.0;
/// Time to stand before and after it acts, s.
pub(super) const STAND_S: f64 = 0.3;

/// Time for which the trunk's attitude must be known again before the robot goes as fast as before, s.
const HEARD_S: f64 = 1.0;

/// Phase of the robot between limp and limp. `from` fields are motion time, s.
///
/// ```text
/// Limp -> TorqueUp -> FoldLegs -> Gather -> Rise -> OnFeet -> Sink -> LetGo -> Done
///            |           |        |        |        |       |
///            +-----------+--------+--------+--------+--> Fold
///              safety takes the robot off its feet (permission Stop), or StopAtOnce; before OnFeet, any stop
/// ```
/// If the trunk tips over in `Gather` or `Rise`, the robot lies down (`LieDown`) and tries again: from `Limp`, more slowly
/// and from a lower pose; or it is `Done`, if that was its last try.
/// After a fall it restarts with `Gather`. `Gather` and `Fold` go to the sitting pose joint by joint; the
/// feet carry the robot from `Rise` to `Sink`. The [`LeggedMotion`] decides the motion on its feet. The [`TorquePhase`]
/// (`Limp`, `TorqueUp`, `LetGo`, `Done`) are those of every motion. With the stop action `hold` the robot
/// stays as it is instead of sinking or folding: `Held`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Torque(TorquePhase),
    LieDown { from: f64, end: TorquePhase },
    FoldLegs { from: f64, duration: f64 },
    Gather { from: f64, duration: f64 },
    Rise { from: f64 },
    OnFeet { from: f64, is_ending: bool, standing_since: Option<f64> },
    Sink { from: f64 },
    Fold { from: f64, duration: f64 },
    Held,
}

/// Generates the targets of a robot that stands up, moves on its feet and stops.
#[derive(Debug, Clone)]
pub struct LeggedGenerator<D> {
    drive: D,
    phase: Phase,
    /// Motion time, s; does not advance while safety holds.
    now_s: f64,
    /// Pose at the start of the present change of pose, rad.
    start_pose_rad: Vec<f64>,
    /// Pose with its lower joints folded, rad.
    folded_rad: Vec<f64>,
    /// True for each joint in the lower half of its leg.
    is_lower: Vec<bool>,
    /// Range of each joint's goals, rad.
    goal_ranges_rad: Vec<(f64, f64)>,
    watch: RiseWatch,
    /// Planned rotation of the trunk at that start, and the level rotation with the same heading: world frame.
    start_turns: (DQuat, DQuat),
    move_for_s: f64,
    torque_ramp_s: f64,
    slow_rate_rad_s: f64,
    stop_action: StopAction,
    /// Share of its top speed without feedback of the trunk's attitude; `None` if it never has any.
    lost_speed_share: Option<f64>,
    /// Time for which that feedback has been present without a break, s.
    heard_for_s: f64,
}

impl<D: LeggedMotion> LeggedGenerator<D> {
    /// A limp robot that, once ordered, carries out the plan of `drive` for `move_for_s`.
    pub fn new(robot: &Robot, drive: D, move_for_s: f64) -> LeggedGenerator<D> {
        LeggedGenerator {
            drive,
            start_pose_rad: vec![0.0; robot.joints.len()],
            folded_rad: vec![0.0; robot.joints.len()],
            is_lower: lower_joints(robot),
            goal_ranges_rad: robot.joints.iter().map(Joint::goal_range_rad).collect(),
            watch: RiseWatch::default(),
            start_turns: (DQuat::IDENTITY, DQuat::IDENTITY),
            phase: Phase::Torque(TorquePhase::Limp),
            now_s: 0.0,
            move_for_s,
            torque_ramp_s: robot.safety.torque_ramp_s,
            slow_rate_rad_s: robot.safety.slow_rate_rad_s,
            stop_action: robot.stop_action,
            lost_speed_share: robot.imu.as_ref().map(|imu| imu.lost_speed_share),
            heard_for_s: 0.0,
        }
    }

    /// Slows the robot down while the trunk's attitude is unknown. It goes as fast as before once the attitude has
    /// been known for a while, so that an IMU that drops in and out does not change the speed all the time.
    fn slow_down_unheard(&mut self, dt_s: f64, state: &State) {
        let Some(share) = self.lost_speed_share else { return };
        self.heard_for_s = if state.body.is_known { self.heard_for_s + dt_s } else { 0.0 };
        let is_heard = self.heard_for_s >= HEARD_S;
        self.drive.limit_speed(if is_heard { 1.0 } else { share });
    }

    fn change_phase(&mut self, state: &State, order: Order) {
        let now = self.now_s;
        let wants_stop = order.is_stop();
        let must_fold = state.permission == Permission::Stop || order == Order::StopAtOnce;
        let must_end = wants_stop || must_fold;
        // A fold that has begun must not restart.
        if must_fold && !matches!(self.phase, Phase::Torque(_) | Phase::Fold { .. } | Phase::Held) {
            self.phase = self.fold(state);
            return;
        }
        if self.ends_try(state) {
            self.phase = self.lie_down(state);
            return;
        }
        let phase = self.phase;
        self.phase = match phase {
            Phase::Torque(TorquePhase::TorqueUp { .. }) if must_end => self.fold(state),
            Phase::Torque(end) => self.next_of_torque(end, must_end, state),
            Phase::LieDown { from, .. } if self.has_lain(from, state) => {
                let is_over = must_end || self.watch.failed().is_some();
                Phase::Torque(if is_over { TorquePhase::Done } else { TorquePhase::Limp })
            }
            Phase::LieDown { from, end } => {
                let next = end.next(now, self.torque_ramp_s, must_end, state, &mut self.start_pose_rad);
                Phase::LieDown { from, end: next.unwrap_or(end) }
            }
            Phase::Rise { from } if wants_stop && now >= from + self.rise_s() => self.stop_from_stand(state),
            Phase::FoldLegs { .. } | Phase::Gather { .. } | Phase::Rise { .. } if wants_stop => {
                self.fold(state)
            }
            Phase::FoldLegs { from, duration } if now >= from + duration => {
                self.start_pose_rad.copy_from_slice(&self.folded_rad);
                Phase::Gather { from: now, duration: self.gather_duration_s() }
            }
            Phase::Gather { from, duration } if now >= from + duration => Phase::Rise { from: now },
            Phase::Rise { from } if now >= from + self.rise_s() + self.drive.set_down_s() => {
                self.watch.stands();
                Phase::OnFeet { from: now, is_ending: false, standing_since: None }
            }
            Phase::OnFeet { standing_since: Some(since), .. } if now >= since + STAND_S => {
                self.stop_from_stand(state)
            }
            Phase::Sink { from } if now >= from + RISE_S => self.let_go(state),
            Phase::Fold { from, duration } if now >= from + duration => self.let_go(state),
            unchanged => unchanged,
        };
    }

    /// The phase after `end`.
    fn next_of_torque(&mut self, end: TorquePhase, must_end: bool, state: &State) -> Phase {
        let next = end.next(self.now_s, self.torque_ramp_s, must_end, state, &mut self.start_pose_rad);
        let Some(end) = next else { return self.fold_or_gather() };
        if end == TorquePhase::Limp {
            self.watch.lies(state);
        }
        if self.watch.is_careful() {
            // A joint that has had torque gave way, and its goals stay inside its range.
            for (angle, (low, high)) in self.start_pose_rad.iter_mut().zip(&self.goal_ranges_rad) {
                *angle = angle.clamp(*low, *high);
            }
        }
        Phase::Torque(end)
    }

    /// True if the trunk tips over on the way up, or cannot be lifted.
    fn ends_try(&mut self, state: &State) -> bool {
        if self.drive.crouch().is_none() {
            return false;
        }
        match self.phase {
            Phase::FoldLegs { .. } | Phase::Rise { .. } => self.watch.tips_over(state),
            Phase::Gather { from, duration } if self.now_s >= from + duration => self.watch.is_tilted(state),
            Phase::Gather { .. } => self.watch.tips_over(state),
            _ => false,
        }
    }

    /// True if the robot has lain limp and still since it began to lie down.
    fn has_lain(&self, from: f64, state: &State) -> bool {
        let limp_s = self.now_s - from - self.torque_ramp_s;
        limp_s >= LIE_MAX_S || limp_s >= LIE_S && rise::is_still(state)
    }

    fn lie_down(&mut self, state: &State) -> Phase {
        let end = TorquePhase::let_go(self.now_s, 1.0, state, &mut self.start_pose_rad);
        Phase::LieDown { from: self.now_s, end }
    }

    /// The first move of a robot that has just been given torque. Legs that fold their lower joints first do not lift the
    /// trunk on the way to the low pose.
    fn fold_or_gather(&mut self) -> Phase {
        let from = self.now_s;
        if self.drive.crouch().is_none() {
            return Phase::Gather { from, duration: self.gather_duration_s() };
        }
        let mut furthest_rad = 0.0_f64;
        for (index, start_rad) in self.start_pose_rad.iter().enumerate() {
            let (low, high) = self.goal_ranges_rad[index];
            let to_rad =
                if self.is_lower[index] { self.low_pose().1[index] } else { start_rad.clamp(low, high) };
            self.folded_rad[index] = to_rad;
            furthest_rad = furthest_rad.max((to_rad - start_rad).abs());
        }
        if furthest_rad < FOLDED_RAD {
            return Phase::Gather { from, duration: self.gather_duration_s() };
        }
        Phase::FoldLegs { from, duration: self.duration_s(&self.folded_rad) }
    }

    /// The pose from which the feet lift the body, rad, and its height then, m.
    fn low_pose(&self) -> (f64, &[f64]) {
        let crouch = self.drive.crouch().filter(|_| self.watch.is_careful());
        crouch.unwrap_or((self.drive.heights_m().0, self.drive.sit_pose_rad()))
    }

    /// Time to rise, s.
    fn rise_s(&self) -> f64 {
        if self.watch.is_careful() { CAREFUL * RISE_S } else { RISE_S }
    }

    fn let_go(&mut self, state: &State) -> Phase {
        Phase::Torque(TorquePhase::let_go(self.now_s, 1.0, state, &mut self.start_pose_rad))
    }

    fn stop_from_stand(&mut self, state: &State) -> Phase {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        match self.stop_action {
            StopAction::Hold => Phase::Held,
            StopAction::SitThenLimp => Phase::Sink { from: self.now_s },
        }
    }

    /// Begins the stop action from the present pose.
    fn fold(&mut self, state: &State) -> Phase {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        match self.stop_action {
            StopAction::Hold => Phase::Held,
            StopAction::SitThenLimp => Phase::Fold { from: self.now_s, duration: self.gather_duration_s() },
        }
    }

    /// Time for every joint to move from the start pose to the low pose, s.
    fn gather_duration_s(&self) -> f64 {
        self.duration_s(self.low_pose().1)
    }

    /// Time for every joint to move from the start pose to `pose_rad` at the slow rate, s.
    fn duration_s(&self, pose_rad: &[f64]) -> f64 {
        let share = if self.watch.is_careful() { CAREFUL } else { 1.0 };
        share * pose_change::duration_s(&self.start_pose_rad, pose_rad, self.slow_rate_rad_s)
    }

    fn write_targets(&mut self, targets: &mut Targets) {
        let now = self.now_s;
        targets.torque_share = match self.phase {
            Phase::Torque(end) | Phase::LieDown { end, .. } => end.torque_share(now, self.torque_ramp_s),
            _ => 1.0,
        };
        let (sit_m, stand_m) = self.drive.heights_m();
        match self.phase {
            Phase::Torque(end) | Phase::LieDown { end, .. } if end.is_limp() => targets.set_limp(),
            Phase::Torque(_) | Phase::LieDown { .. } | Phase::Held => self.write_pose(0.0, targets),
            Phase::FoldLegs { from, duration } => {
                let share = smooth_step((now - from) / duration);
                pose_change::write(&self.start_pose_rad, &self.folded_rad, share, targets);
            }
            Phase::Gather { from, duration } => {
                self.write_pose(smooth_step((now - from) / duration), targets);
            }
            Phase::Fold { from, duration } => {
                let share = smooth_step((now - from) / duration);
                self.write_pose(share, targets);
                // A trunk that leant is level once its joints are in the sitting pose.
                let (leaning, level) = self.start_turns;
                targets.trunk_orientation = leaning.slerp(level, share);
            }
            Phase::Rise { from } => {
                let low_m = self.low_pose().0;
                let share = smooth_step((now - from) / self.rise_s());
                self.drive.write(low_m + (stand_m - low_m) * share, targets);
            }
            Phase::Sink { from } => {
                self.drive.write(stand_m + (sit_m - stand_m) * smooth_step((now - from) / RISE_S), targets);
            }
            Phase::OnFeet { .. } => self.drive.write(stand_m, targets),
        }
    }

    /// Writes the pose `share` of the way from the start pose to the low pose.
    fn write_pose(&self, share: f64, targets: &mut Targets) {
        pose_change::write(&self.start_pose_rad, self.low_pose().1, share, targets);
    }
}

/// True for each joint in the lower half of its chain: its last joint, of two or three.
fn lower_joints(robot: &Robot) -> Vec<bool> {
    let mut is_lower = vec![false; robot.joints.len()];
    for chain in &robot.chains {
        let lower = chain.joints.start + chain.joints.len().div_ceil(2)..chain.joints.end;
        is_lower[lower].fill(true);
    }
    is_lower
}

impl<D: LeggedMotion> Generate for LeggedGenerator<D> {
    fn step(&mut self, dt_s: f64, state: &State, order: Order, targets: &mut Targets) {
        if state.permission == Permission::Hold {
            return;
        }
        self.now_s += dt_s;
        targets.posture_pull = posture_pull(dt_s);
        if !matches!(self.phase, Phase::Fold { .. }) {
            let (yaw_rad, ..) = targets.trunk_orientation.to_euler(EulerRot::ZYX);
            self.start_turns = (targets.trunk_orientation, DQuat::from_rotation_z(yaw_rad));
        }
        self.change_phase(state, order);
        self.slow_down_unheard(dt_s, state);
        if let Phase::OnFeet { from, is_ending, standing_since } = &mut self.phase {
            let command = self.drive.command(order, self.now_s - *from, self.move_for_s);
            self.drive.step(dt_s, state, command);
            *is_ending = command.is_none();
            let is_over = *is_ending && self.drive.is_standing();
            *standing_since = is_over.then_some(standing_since.unwrap_or(self.now_s));
        }
        self.write_targets(targets);
    }

    fn restart(&mut self, state: &State) {
        self.drive.reset_to_stand();
        self.watch.give_over();
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        self.phase = Phase::Gather { from: self.now_s, duration: self.gather_duration_s() };
    }

    fn activity(&self) -> Activity {
        match self.phase {
            Phase::Torque(end) => end.activity(Activity::Rising),
            Phase::LieDown { .. } if self.watch.failed().is_some() => Activity::Stopping,
            Phase::LieDown { .. } | Phase::FoldLegs { .. } | Phase::Gather { .. } | Phase::Rise { .. } => {
                Activity::Rising
            }
            Phase::OnFeet { is_ending: true, .. } | Phase::Sink { .. } | Phase::Fold { .. } => {
                Activity::Stopping
            }
            Phase::OnFeet { .. } => self.drive.activity(),
            Phase::Held => Activity::Done,
        }
    }

    fn is_letting_go(&self) -> bool {
        matches!(
            self.phase,
            Phase::Torque(TorquePhase::LetGo { .. } | TorquePhase::Done) | Phase::LieDown { .. }
        )
    }

    fn failed_rise(&self) -> Option<FailedRise> {
        self.watch.failed()
    }

    fn speed_m_s(&self) -> f64 {
        self.drive.speed_m_s()
    }

    fn pose(&self) -> Option<usize> {
        self.drive.pose()
    }

    fn drive(&self) -> Option<&Drive> {
        self.drive.drive()
    }
}
