//! The robot's reaction to a fall: the stage between the operator's motion and inverse kinematics.
//!
//! Input: orientation and motion of the trunk, the joints, and the operator's order. Output: who is in
//! control, and in a fall [`Targets`] that replace the generator's. The four kinds of motion of a paper on
//! falling human figures are its states (section 2); docs/falls.md draws them:
//!
//! ```text
//!            leans          reaction time over       certain
//! Steady ------------> Pushed ------------> Recovering ----> Falling
//!   ^  ^                  |  certain: Falling   |               | key poses done
//!   |  +------------------+---------------------+               v
//!   |        calm again                                      Settling
//!   |                                                           | at rest
//!   |   up                  knows a way up                      v
//!   +--------- GettingUp <----------------------------------- Lying
//!                  | ordered to stop (rolled over: Settling)    | else
//!                  +------------------> LettingGo <-------------+
//!                                           v
//!                                          Limp (stays, and says so)
//! ```
//! `Pushed` and `Recovering` are the operator's motion with its usual balance; they are separate from
//! `Steady` only for the reports. With [`ReflexMode::Passive`] the reflex leaves `Falling` at once, and
//! `Settling` has no torque; with [`ReflexMode::Off`] a fall is only recorded. Falls count from the time the
//! robot is first on its feet until it is limp.

mod detect;
mod report;
#[cfg(test)]
mod tests;

use crate::model::{FallDirection, GetUp, KeyPose, Lying, ReflexMode, ReflexSettings, Robot};
use crate::motion::{Activity, Order};
use crate::signals::{Permission, State, Targets};
pub use report::{FallOutcome, ReflexReport};

/// A push begins at this share of a certain fall, and ends after `CALM_S` (s) below `CALM_SHARE`.
const PUSHED_SHARE: f64 = 0.5;
const CALM_SHARE: f64 = 0.3;
const CALM_S: f64 = 0.3;
/// Time from a push to the reaction: a person's postural reaction, s (Horak and Nashner 1986: 73 to 110 ms).
const REACTION_S: f64 = 0.1;
/// A fall ends after this time even without a sign that the robot is at rest, s.
const SETTLE_MAX_S: f64 = 4.0;
/// Joints are at rest while they turn slower than this, rad/s.
const JOINT_REST_RAD_S: f64 = 0.5;
/// How far a goal may lead its joint in a fall, share of the permitted tracking error: a leg that the ground
/// holds up must not count as a fault then.
const AHEAD_SHARE: f64 = 0.85;

/// The stage that makes the targets of this cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// The generator.
    Operator,
    /// The reflex: it has written the targets, and the generator stands still.
    Reflex,
    /// The generator again, from the last goals, with torque on and the robot ready to rise.
    Returned,
}

/// The robot's phase between standing and down. `since_s` is the time in this phase.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Active-intentional: the operator's motion.
    Steady,
    /// Passive-unintentional: just after a push.
    Pushed { since_s: f64 },
    /// Passive-intentional: trying to keep its balance.
    Recovering { calm_s: f64 },
    /// Active-unintentional: the reference motion for its direction.
    Falling { since_s: f64, direction: FallDirection },
    /// The joints give way.
    Settling { since_s: f64, still_s: f64 },
    /// At rest, with torque unchanged.
    Lying,
    /// The torque rises, then the robot goes through the key poses of this way up, an index.
    GettingUp { since_s: f64, way: usize },
    /// The torque falls to zero.
    LettingGo { since_s: f64 },
    /// Limp, permanently.
    Limp,
}

/// Watches the trunk, and is in control during a fall.
#[derive(Debug, Clone)]
pub struct Reflex<'r> {
    settings: Option<&'r ReflexSettings>,
    phase: Phase,
    /// True from when the robot is on its feet until it is limp.
    is_armed: bool,
    /// With the reflex off, a fall is recorded once and not again before it has passed.
    is_noted: bool,
    /// Pose at the start of the present motion, rad.
    start_pose_rad: Vec<f64>,
    torque_ramp_s: f64,
    ahead_rad: f64,
    /// Number of attempts to get up.
    tries: u32,
    report: ReflexReport,
}

impl<'r> Reflex<'r> {
    /// The reflex of a limp `robot`. It never acts if the robot's file has no settings for falls.
    pub fn new(robot: &'r Robot) -> Reflex<'r> {
        Reflex {
            settings: robot.reflex.as_ref(),
            phase: Phase::Steady,
            is_armed: false,
            is_noted: false,
            start_pose_rad: vec![0.0; robot.joints.len()],
            torque_ramp_s: robot.safety.torque_ramp_s,
            ahead_rad: AHEAD_SHARE * robot.safety.tracking_error_rad,
            tries: 0,
            report: ReflexReport::default(),
        }
    }

    /// Checks the robot `dt_s` after the last call, while the operator's motion does `activity` and has the
    /// order `order`, and writes the targets if the reflex is in control.
    pub fn step(
        &mut self,
        dt_s: f64,
        order: Order,
        activity: Activity,
        state: &State,
        targets: &mut Targets,
    ) -> Control {
        let Some(settings) = self.settings else { return Control::Operator };
        self.is_armed = match activity {
            Activity::Standing | Activity::Walking => true,
            Activity::Limp | Activity::Done | Activity::Rising | Activity::Jogging => false,
            _ => self.is_armed,
        };
        let was_getting_up = matches!(self.phase, Phase::GettingUp { .. });
        let must_end = order.is_stop() || state.permission == Permission::Stop;
        self.phase = self.next(dt_s, must_end, state, settings, targets);
        if self.is_in_charge() {
            self.write(state, settings, targets);
            Control::Reflex
        } else if was_getting_up {
            self.is_armed = false;
            Control::Returned
        } else {
            Control::Operator
        }
    }

    fn is_in_charge(&self) -> bool {
        !matches!(self.phase, Phase::Steady | Phase::Pushed { .. } | Phase::Recovering { .. })
    }

    fn next(
        &mut self,
        dt_s: f64,
        must_end: bool,
        state: &State,
        settings: &ReflexSettings,
        targets: &Targets,
    ) -> Phase {
        match self.phase {
            Phase::Steady | Phase::Pushed { .. } | Phase::Recovering { .. } => {
                self.watch(dt_s, state, settings, targets)
            }
            Phase::Falling { since_s, direction } => {
                let since_s = since_s + dt_s;
                let end_s = keys_of(settings, direction).last().map_or(0.0, |key| key.at_s);
                if settings.mode != ReflexMode::Reflex || since_s >= end_s {
                    Phase::Settling { since_s: 0.0, still_s: 0.0 }
                } else {
                    Phase::Falling { since_s, direction }
                }
            }
            Phase::Settling { since_s, still_s } => {
                let since_s = since_s + dt_s;
                let still_s = if is_still(state, settings) { still_s + dt_s } else { 0.0 };
                if still_s >= settings.rest_s || since_s >= SETTLE_MAX_S {
                    Phase::Lying
                } else {
                    Phase::Settling { since_s, still_s }
                }
            }
            Phase::Lying => {
                let lying = detect::lying(&state.body);
                self.report.lying = lying;
                let way = way_up(settings, lying).filter(|_| !must_end);
                take_pose(&mut self.start_pose_rad, state);
                match way {
                    Some(way) if self.tries < settings.get_ups_max => {
                        self.tries += 1;
                        Phase::GettingUp { since_s: 0.0, way }
                    }
                    _ => Phase::LettingGo { since_s: 0.0 },
                }
            }
            Phase::GettingUp { .. } if must_end => {
                self.start_pose_rad.copy_from_slice(&state.goal_rad);
                Phase::LettingGo { since_s: 0.0 }
            }
            // Wait for a servo that is silent, or for safety's hold to end.
            Phase::GettingUp { .. } if state.permission == Permission::Hold => self.phase,
            Phase::GettingUp { since_s, way } => {
                let since_s = since_s + dt_s;
                let keys = settings.get_ups.get(way).map_or(&[][..], |way| &way.keys);
                let end_s = self.torque_ramp_s + keys.last().map_or(0.0, |key| key.at_s);
                if since_s >= end_s && detect::lying(&state.body) != Some(Lying::Upright) {
                    // The robot rolled over on the way, or its attitude is unknown.
                    Phase::Settling { since_s: 0.0, still_s: 0.0 }
                } else if since_s >= end_s {
                    self.report.got_up += 1;
                    self.report.outcome = FallOutcome::GotUp;
                    Phase::Steady
                } else {
                    Phase::GettingUp { since_s, way }
                }
            }
            Phase::LettingGo { since_s } if since_s >= self.torque_ramp_s => {
                self.report.outcome = FallOutcome::LiesLimp;
                Phase::Limp
            }
            Phase::LettingGo { since_s } => Phase::LettingGo { since_s: since_s + dt_s },
            Phase::Limp => Phase::Limp,
        }
    }

    /// Watches for a fall while the robot is on its feet, and measures how near it is to one.
    fn watch(&mut self, dt_s: f64, state: &State, settings: &ReflexSettings, targets: &Targets) -> Phase {
        if !self.is_armed {
            return Phase::Steady;
        }
        let share = detect::share(&settings.detector, &state.body, targets);
        if share >= 1.0 {
            let direction = detect::direction(&state.body);
            if !self.is_noted {
                self.report.falls += 1;
                self.report.direction = Some(direction);
                self.report.outcome = FallOutcome::Falling;
            }
            if settings.mode != ReflexMode::Off {
                self.start_pose_rad.copy_from_slice(&state.goal_rad);
                return Phase::Falling { since_s: 0.0, direction };
            }
            self.is_noted = true;
        }
        match self.phase {
            Phase::Steady if share >= PUSHED_SHARE => Phase::Pushed { since_s: 0.0 },
            Phase::Pushed { since_s } if since_s < REACTION_S => Phase::Pushed { since_s: since_s + dt_s },
            Phase::Pushed { .. } => Phase::Recovering { calm_s: 0.0 },
            Phase::Recovering { calm_s } if share < CALM_SHARE && calm_s + dt_s >= CALM_S => {
                if self.is_noted {
                    self.report.outcome = FallOutcome::KeptItsFeet;
                }
                self.is_noted = false;
                Phase::Steady
            }
            Phase::Recovering { calm_s } => {
                Phase::Recovering { calm_s: if share < CALM_SHARE { calm_s + dt_s } else { 0.0 } }
            }
            unchanged => unchanged,
        }
    }

    fn write(&self, state: &State, settings: &ReflexSettings, targets: &mut Targets) {
        targets.set_pose();
        targets.may_restart = false;
        let is_passive = settings.mode == ReflexMode::Passive;
        match self.phase {
            Phase::Limp => targets.set_limp(),
            Phase::Settling { .. } | Phase::Lying if is_passive => targets.set_limp(),
            Phase::LettingGo { .. } if is_passive => targets.set_limp(),
            Phase::Falling { since_s, direction } => {
                let keys = keys_of(settings, direction);
                targets.torque_share = self.write_keys(keys, since_s, targets);
                self.stay_near(state, targets);
                if targets.torque_share <= 0.0 {
                    targets.set_limp();
                }
            }
            Phase::GettingUp { since_s, way } => {
                let from_share = if is_passive { 0.0 } else { settings.passive_torque_share };
                let rise = since_s / self.torque_ramp_s;
                if rise < 1.0 {
                    targets.set_pose().copy_from_slice(&self.start_pose_rad);
                    targets.torque_share = from_share + (1.0 - from_share) * rise;
                } else {
                    let keys = settings.get_ups.get(way).map_or(&[][..], |GetUp { keys, .. }| keys);
                    targets.torque_share = self.write_keys(keys, since_s - self.torque_ramp_s, targets);
                }
            }
            Phase::LettingGo { since_s } => {
                targets.set_pose().copy_from_slice(&self.start_pose_rad);
                let left = 1.0 - (since_s / self.torque_ramp_s).min(1.0);
                targets.torque_share = settings.passive_torque_share * left;
            }
            // Goals follow the joints, one cycle behind: the position servo then acts as a damper only.
            _ => {
                for (angle, joint) in targets.set_pose().iter_mut().zip(&state.joints) {
                    *angle = joint.position_rad;
                }
                targets.torque_share = settings.passive_torque_share;
            }
        }
    }

    /// Writes the pose at `since_s` on the way from the start pose through `keys`; returns the torque share there.
    fn write_keys(&self, keys: &[KeyPose], since_s: f64, targets: &mut Targets) -> f64 {
        let next = keys.iter().position(|key| since_s < key.at_s).unwrap_or(keys.len().saturating_sub(1));
        let Some(to) = keys.get(next) else {
            targets.set_pose().copy_from_slice(&self.start_pose_rad);
            return 1.0;
        };
        let (from_s, from_rad) = match next.checked_sub(1).and_then(|before| keys.get(before)) {
            Some(before) => (before.at_s, &before.angles_rad),
            None => (0.0, &self.start_pose_rad),
        };
        let share = ((since_s - from_s) / (to.at_s - from_s)).clamp(0.0, 1.0);
        for ((angle, from), to) in targets.set_pose().iter_mut().zip(from_rad).zip(&to.angles_rad) {
            *angle = from + share * (to - from);
        }
        to.torque_share
    }

    /// Keeps every goal near its joint, so that a leg that meets the ground does not keep pushing against it.
    fn stay_near(&self, state: &State, targets: &mut Targets) {
        for (angle, joint) in targets.set_pose().iter_mut().zip(&state.joints) {
            if joint.position_rad.is_finite() {
                *angle =
                    angle.clamp(joint.position_rad - self.ahead_rad, joint.position_rad + self.ahead_rad);
            }
        }
    }

    /// The robot's activity, if the reflex determines it.
    pub fn activity(&self) -> Option<Activity> {
        match self.phase {
            Phase::Steady | Phase::Pushed { .. } | Phase::Recovering { .. } => None,
            Phase::Falling { .. } | Phase::Settling { .. } => Some(Activity::Falling),
            Phase::Lying | Phase::LettingGo { .. } => Some(Activity::Lying),
            Phase::GettingUp { .. } => Some(Activity::Rising),
            Phase::Limp => Some(Activity::Done),
        }
    }

    /// The robot's kind of motion: one of the paper's four, or one that follows them.
    pub fn kind(&self) -> &'static str {
        match self.phase {
            Phase::Steady => "steady",
            Phase::Pushed { .. } => "pushed",
            Phase::Recovering { .. } => "recovering",
            Phase::Falling { .. } => "falling",
            Phase::Settling { .. } => "settling",
            Phase::Lying => "lying",
            Phase::GettingUp { .. } => "getting up",
            Phase::LettingGo { .. } => "letting go",
            Phase::Limp => "limp",
        }
    }

    /// Falls so far; `None` if the robot's file has no settings for them.
    pub fn report(&self) -> Option<ReflexReport> {
        self.settings.is_some().then_some(self.report)
    }
}

fn keys_of(settings: &ReflexSettings, direction: FallDirection) -> &[KeyPose] {
    settings.falls.get(direction as usize).map_or(&[], Vec::as_slice)
}

/// The way up from this attitude.
fn way_up(settings: &ReflexSettings, lying: Option<Lying>) -> Option<usize> {
    let lying = lying?;
    settings.get_ups.iter().position(|way| way.lying == lying)
}

fn is_still(state: &State, settings: &ReflexSettings) -> bool {
    let is_quiet = state.joints.iter().all(|joint| joint.speed_rad_s.abs() < JOINT_REST_RAD_S);
    // Without the IMU only the joints can show rest.
    let is_turning =
        detect::is_known(&state.body) && state.body.rate_rad_s.length() >= settings.rest_rate_rad_s;
    is_quiet && !is_turning
}

fn take_pose(pose_rad: &mut [f64], state: &State) {
    for (angle, joint) in pose_rad.iter_mut().zip(&state.joints) {
        *angle = joint.position_rad;
    }
}
