//! A robot on legs from limp to limp: up, on its feet, down.

use glam::{DQuat, EulerRot};

use super::curves::smooth_step;
use super::ends::Ends;
use super::{Activity, Order, pose_change, posture_pull};
use crate::model::{Robot, StopAction};
use crate::signals::{Aim, Permission, State, Targets};

/// Time to rise from sitting to standing, and to sit down again, s.
const RISE_S: f64 = 1.5;
/// Time to stand before it does anything, and after, s.
pub(super) const STAND_S: f64 = 0.3;

/// How long the trunk's attitude is to be known again before the robot goes as fast as before, s.
const HEARD_S: f64 = 1.0;

/// What a robot does on its feet, and how it is put there.
pub trait OnFeet {
    /// What an operator can ask of it.
    type Command: Copy;

    /// What it is to do that has been on its feet for `since_s`; none to come to a stand and stop. Told no more than to
    /// go, it does what was planned for `move_for_s`.
    fn command(&self, order: Order, since_s: f64, move_for_s: f64) -> Option<Self::Command>;

    /// Goes on by `dt_s`, as `command` says; without one, to its stand.
    fn step(&mut self, dt_s: f64, state: &State, command: Option<Self::Command>);

    /// Stands as it stood up, as if it had never done anything.
    fn stand_anew(&mut self);

    /// True once it stands as it stood up, and will go on to.
    fn is_standing(&self) -> bool;

    /// What it is doing.
    fn activity(&self) -> Activity;

    /// How long it stands still once it has risen, s, before it counts as on its feet: whoever holds it sets it down.
    fn set_down_s(&self) -> f64 {
        0.0
    }

    /// Joint angles of the sitting robot, rad.
    fn sit_pose_rad(&self) -> &[f64];

    /// Height of the body above the ground, sitting and standing, m.
    fn heights_m(&self) -> (f64, f64);

    /// Goes no faster than this share of its top speed from now on; of no matter to what does not walk.
    fn limit_speed(&mut self, _share: f64) {}

    /// Writes the targets for a body whose posture begins `height_m` above the ground.
    fn write(&self, height_m: f64, targets: &mut Targets);
}

/// Where the robot is between limp and limp. `from` fields are motion time, s.
///
/// ```text
/// Limp -> TorqueUp -> Gather -> Rise -> OnFeet -> Sink -> LetGo -> Done
///            |           |        |        |        |       |
///            +-----------+--------+--------+--------+--> Fold
///              safety takes the robot off its feet (permission Stop), or StopAtOnce; before OnFeet, any stop
/// ```
/// After a fall it begins anew with `Gather`.
/// `Gather` and `Fold` go to the sitting pose joint by joint; the feet carry the robot from `Rise` to
/// `Sink`. What it does on its feet is the [`OnFeet`]'s. The [`Ends`] (`Limp`, `TorqueUp`, `LetGo`, `Done`) are those of
/// every motion. With the stop action `hold` the robot stays as it is instead of sinking or folding: `Held`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Ends(Ends),
    Gather { from: f64, duration: f64 },
    Rise { from: f64 },
    OnFeet { from: f64, is_ending: bool, standing_since: Option<f64> },
    Sink { from: f64 },
    Fold { from: f64, duration: f64 },
    Held,
}

/// Makes the targets of a robot that stands up, moves on its feet and stops.
#[derive(Debug, Clone)]
pub struct LeggedGenerator<D> {
    drive: D,
    phase: Phase,
    /// Motion time, s: stands still while safety holds.
    now_s: f64,
    /// Pose a change of pose began at, rad.
    start_pose_rad: Vec<f64>,
    /// How the trunk was to lean when it began, and where level is from there: world frame.
    start_turns: (DQuat, DQuat),
    move_for_s: f64,
    torque_ramp_s: f64,
    slow_rate_rad_s: f64,
    stop_action: StopAction,
    /// Share of its top speed without feedback of the trunk's attitude; none where there never is any.
    lost_speed_share: Option<f64>,
    /// How long that has been there without a break, s.
    heard_for_s: f64,
}

impl<D: OnFeet> LeggedGenerator<D> {
    /// A limp robot that will do what `drive` has planned for `move_for_s` once ordered to.
    pub fn new(robot: &Robot, drive: D, move_for_s: f64) -> LeggedGenerator<D> {
        LeggedGenerator {
            drive,
            start_pose_rad: vec![0.0; robot.joints.len()],
            start_turns: (DQuat::IDENTITY, DQuat::IDENTITY),
            phase: Phase::Ends(Ends::Limp),
            now_s: 0.0,
            move_for_s,
            torque_ramp_s: robot.safety.torque_ramp_s,
            slow_rate_rad_s: robot.safety.slow_rate_rad_s,
            stop_action: robot.stop_action,
            lost_speed_share: robot.imu.as_ref().map(|imu| imu.lost_speed_share),
            heard_for_s: 0.0,
        }
    }

    /// Advances motion time by `dt_s` (unless held) and writes the targets for now.
    pub fn step(&mut self, dt_s: f64, state: &State, order: Order, targets: &mut Targets) {
        if state.permission == Permission::Hold {
            return;
        }
        self.now_s += dt_s;
        targets.posture_pull = posture_pull(dt_s);
        if !matches!(self.phase, Phase::Fold { .. }) {
            let (yaw_rad, ..) = targets.trunk_turn.to_euler(EulerRot::ZYX);
            self.start_turns = (targets.trunk_turn, DQuat::from_rotation_z(yaw_rad));
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

    /// A robot that cannot feel how its trunk lies goes slower; and as before once that has been felt for a while, so that
    /// one that is heard off and on does not change its speed all the time.
    fn slow_down_unheard(&mut self, dt_s: f64, state: &State) {
        let Some(share) = self.lost_speed_share else { return };
        self.heard_for_s = if state.body.is_known { self.heard_for_s + dt_s } else { 0.0 };
        let is_heard = self.heard_for_s >= HEARD_S;
        self.drive.limit_speed(if is_heard { 1.0 } else { share });
    }

    /// Goes to the sitting pose from the last goals, and rises.
    pub fn begin_anew(&mut self, state: &State) {
        self.drive.stand_anew();
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        self.phase = Phase::Gather { from: self.now_s, duration: self.gather_duration_s() };
    }

    fn change_phase(&mut self, state: &State, order: Order) {
        let now = self.now_s;
        let wants_stop = order.is_stop();
        let must_fold = state.permission == Permission::Stop || order == Order::StopAtOnce;
        let must_end = wants_stop || must_fold;
        // A fold once begun is not begun again.
        if must_fold && !matches!(self.phase, Phase::Ends(_) | Phase::Fold { .. } | Phase::Held) {
            self.phase = self.fold(state);
            return;
        }
        let phase = self.phase;
        self.phase = match phase {
            Phase::Ends(Ends::TorqueUp { .. }) if must_end => self.fold(state),
            Phase::Ends(end) => {
                match end.next(now, self.torque_ramp_s, must_end, state, &mut self.start_pose_rad) {
                    Some(end) => Phase::Ends(end),
                    None => Phase::Gather { from: now, duration: self.gather_duration_s() },
                }
            }
            Phase::Rise { from } if wants_stop && now >= from + RISE_S => self.stop_from_stand(state),
            Phase::Gather { .. } | Phase::Rise { .. } if wants_stop => self.fold(state),
            Phase::Gather { from, duration } if now >= from + duration => Phase::Rise { from: now },
            Phase::Rise { from } if now >= from + RISE_S + self.drive.set_down_s() => {
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

    fn let_go(&mut self, state: &State) -> Phase {
        Phase::Ends(Ends::let_go(self.now_s, 1.0, state, &mut self.start_pose_rad))
    }

    fn stop_from_stand(&mut self, state: &State) -> Phase {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        match self.stop_action {
            StopAction::Hold => Phase::Held,
            StopAction::SitThenLimp => Phase::Sink { from: self.now_s },
        }
    }

    /// The stop action from whatever pose the robot is in.
    fn fold(&mut self, state: &State) -> Phase {
        self.start_pose_rad.copy_from_slice(&state.goal_rad);
        match self.stop_action {
            StopAction::Hold => Phase::Held,
            StopAction::SitThenLimp => Phase::Fold { from: self.now_s, duration: self.gather_duration_s() },
        }
    }

    /// Time for every joint to go from the start pose to the sitting pose at the slow rate, s.
    fn gather_duration_s(&self) -> f64 {
        pose_change::duration_s(&self.start_pose_rad, self.drive.sit_pose_rad(), self.slow_rate_rad_s)
    }

    fn write_targets(&mut self, targets: &mut Targets) {
        let now = self.now_s;
        targets.torque_share = match self.phase {
            Phase::Ends(end) => end.torque_share(now, self.torque_ramp_s),
            _ => 1.0,
        };
        let (sit_m, stand_m) = self.drive.heights_m();
        match self.phase {
            Phase::Ends(end) if end.is_limp() => {
                targets.aim = Aim::Limp;
                targets.feet.clear();
            }
            Phase::Ends(_) | Phase::Held => self.write_pose(0.0, targets),
            Phase::Gather { from, duration } => {
                self.write_pose(smooth_step((now - from) / duration), targets);
            }
            Phase::Fold { from, duration } => {
                let share = smooth_step((now - from) / duration);
                self.write_pose(share, targets);
                // A trunk that leant is level once its joints are as in sitting.
                let (leaning, level) = self.start_turns;
                targets.trunk_turn = leaning.slerp(level, share);
            }
            Phase::Rise { from } => {
                self.drive.write(sit_m + (stand_m - sit_m) * smooth_step((now - from) / RISE_S), targets);
            }
            Phase::Sink { from } => {
                self.drive.write(stand_m + (sit_m - stand_m) * smooth_step((now - from) / RISE_S), targets);
            }
            Phase::OnFeet { .. } => self.drive.write(stand_m, targets),
        }
    }

    /// The pose `share` of the way from the start pose to the sitting pose.
    fn write_pose(&self, share: f64, targets: &mut Targets) {
        pose_change::write(&self.start_pose_rad, self.drive.sit_pose_rad(), share, targets);
    }

    /// True where it lets go of its joints, as it was to, or has.
    pub fn is_letting_go(&self) -> bool {
        matches!(self.phase, Phase::Ends(Ends::LetGo { .. } | Ends::Done))
    }

    /// What the robot is doing.
    pub fn activity(&self) -> Activity {
        match self.phase {
            Phase::Ends(end) => end.activity(Activity::Rising),
            Phase::Gather { .. } | Phase::Rise { .. } => Activity::Rising,
            Phase::OnFeet { is_ending: true, .. } | Phase::Sink { .. } | Phase::Fold { .. } => {
                Activity::Stopping
            }
            Phase::OnFeet { .. } => self.drive.activity(),
            Phase::Held => Activity::Done,
        }
    }

    /// What carries it while it is on its feet.
    pub fn drive(&self) -> &D {
        &self.drive
    }
}
