//! The buffers that the pipeline's stages hand to each other, and the stage that computes each.
//!
//! Each buffer gets its size from the robot once; one stage writes into it and the next one reads it. Its `clone_from`
//! copies into memory that is there, which the derived one of the standard library does not. Frames:
//! `_in_body` is the trunk's frame. `_in_world` is the ground's frame, in which the plan begins at x = 0. In both,
//! x points forward, y left and z up, in metres. Joint arrays are in the order of [`Robot::joints`], radians.

mod activity;
mod order;
mod status;
mod targets;

use educe::Educe;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::model::Robot;
pub use activity::Activity;
pub use order::{Command, GaitChoice, Order, Place, Posture, Stroke, StrokeCommand};
pub use status::Status;
pub use targets::{Aim, ArmAim, ArmTarget, FeetMut, FootTarget, Targets, Wanted};

/// The joint targets that inverse kinematics computes.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct JointTargets {
    /// True if no torque is requested; the angles mean nothing then.
    pub is_limp: bool,
    /// The one joint that should have torque; `None` if all should.
    pub only: Option<usize>,
    /// Requested share of the permitted torque, one value per joint, 0 to 1.
    pub torque_shares: Vec<f64>,
    /// True while a servo that has tripped may be restarted.
    pub may_restart: bool,
    /// The first joint whose requested target is not a finite number.
    pub not_finite: Option<usize>,
    /// Joint angles, rad.
    pub angles_rad: Vec<f64>,
    /// Offset added to each angle to make the goal, rad: so that the joint stands at its angle under load, and so that
    /// the goal keeps to the pace of the joint.
    pub offset_rad: Vec<f64>,
    /// Distance of each chain's tip from its target, m; 0 if the target is a pose.
    pub residual_m: Vec<f64>,
    /// Largest distance of an arm's group ends from their targets, per chain, m; 0 if the targets are others.
    pub group_residual_m: Vec<f64>,
    /// Number of each chain's joints that are at a limit of their range; 0 if the target is a pose.
    pub saturated: Vec<u32>,
}

/// How far the robot may move, as safety decided in the last cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Permission {
    /// No fault.
    #[default]
    Move,
    /// A fault is present: stand still and wait for it to clear.
    Hold,
    /// The fault did not clear: take the stop action.
    Stop,
}

/// The feedback. The estimator computes it, except for `goal_rad`, `permission`, `is_out` and `outage`, which
/// safety writes.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct State {
    /// State of each joint as last received.
    pub joints: Vec<JointState>,
    /// The last goals that safety passed on, rad; valid only once torque has been on.
    pub goal_rad: Vec<f64>,
    /// Where the goals of each joint start if its torque comes on now, rad ([`crate::model::Joint::start_goal_rad`]).
    pub start_rad: Vec<f64>,
    /// Safety's permission.
    pub permission: Permission,
    /// Joints whose servo has tripped: they stay without torque, and their goals follow their positions.
    pub is_out: Vec<bool>,
    /// The joint that was taken out of service in this cycle, if any; at most one per cycle.
    pub outage: Option<Outage>,
    /// Orientation and motion of the trunk.
    pub body: BodyEstimate,
}

/// The last reading of the trunk's inertial measurement unit (IMU), rotated from its mounting to the body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImuReading {
    /// True once the IMU has been heard.
    pub is_known: bool,
    /// Time since the measurement, s.
    pub age_s: f64,
    /// Angular velocity of the trunk about its x, y and z axes, rad/s.
    pub rate_rad_s: DVec3,
    /// Acceleration minus gravity, body frame, m/s^2; (0, 0, 9.81) level and at rest.
    pub specific_force_m_s2: DVec3,
    /// Roll, rad: about x, positive lowers the right side.
    pub roll_rad: f64,
    /// Pitch, rad: about y, positive lowers the nose.
    pub pitch_rad: f64,
    /// Yaw, rad: about z, positive to the left; its zero is the IMU's own.
    pub yaw_rad: f64,
    /// Number of measurements since the run began that passed their checksums but were dropped as impossible
    /// for a trunk.
    pub implausible: u64,
}

/// Orientation and motion of the trunk, as far as the robot can tell.
#[derive(Debug, PartialEq, Default, Educe)]
#[educe(Clone)]
pub struct BodyEstimate {
    /// True while the IMU's reading is recent enough to act on. Otherwise the robot counts as level and still.
    pub is_known: bool,
    /// Present roll, pitch and yaw, rad (as in [`ImuReading`]); the zero of yaw is the IMU's own.
    pub roll_rad: f64,
    /// See `roll_rad`.
    pub pitch_rad: f64,
    /// See `roll_rad`.
    pub yaw_rad: f64,
    /// The IMU's yaw when it was first heard, rad, the zero of `yaw_rad`; `None` before that.
    pub yaw_start_rad: Option<f64>,
    /// Angular velocity, body frame, rad/s.
    pub rate_rad_s: DVec3,
    /// Velocity of the body frame's origin, body frame, m/s.
    pub velocity_m_s: DVec3,
    /// True for each chain whose tip stands on the ground.
    pub is_in_contact: Vec<bool>,
}

impl BodyEstimate {
    /// Angle of the trunk's up from the world's, rad, 0 to pi.
    pub fn tilt_rad(&self) -> f64 {
        (self.roll_rad.cos() * self.pitch_rad.cos()).clamp(-1.0, 1.0).acos()
    }
}

/// True motion of a simulated robot, whatever its own sensors say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueBody {
    /// Origin of the body frame, m. The world's origin, here and below, is on the ground under the start.
    pub position_m: DVec3,
    /// Rotation from the body frame to the world.
    pub orientation: DQuat,
    /// Velocity of the body frame's origin, m/s.
    pub velocity_m_s: DVec3,
    /// Height of that origin above the ground's plane, m.
    pub height_m: f64,
    /// Force of the ground on the trunk, N.
    pub trunk_contact_n: f64,
    /// True if the trunk lies on the ground or is turned over.
    pub is_fallen: bool,
    /// True once the simulated body is unstable: its numbers have grown without bound, and mean nothing.
    pub is_unstable: bool,
}

/// One joint as its servo last reported it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    /// True once the servo has been heard.
    pub is_known: bool,
    /// Time since the servo was last heard, s.
    pub age_s: f64,
    /// True if the servo has sent damaged replies since then.
    pub is_damaged: bool,
    /// Joint angle, rad.
    pub position_rad: f64,
    /// Joint speed, rad/s.
    pub speed_rad_s: f64,
    /// Load as a share of stall torque, -1 to 1.
    pub load_share: f64,
    /// Supply voltage, V.
    pub voltage_v: f64,
    /// Temperature, degrees Celsius.
    pub temperature_c: f64,
    /// The servo's alarm bits, as received with its replies.
    pub alarms: u8,
    /// Causes of the alarm, if known: bits of [`crate::model::Registers::alarm_status`]. 0 while there is no
    /// alarm or the servo has not reported its cause.
    pub alarm_causes: u8,
    /// The servo's torque enable, valid in the cycle after it was read ([`Question::Torque`]).
    pub has_torque: Option<bool>,
    /// The goal position that the servo holds, rad, valid in the cycle after it was read ([`Question::Goal`]).
    pub held_goal_rad: Option<f64>,
    /// True if the last reply passed its checksum but was dropped because no servo can have measured it.
    pub is_implausible: bool,
}

/// A question to all servos of one bus, which replaces their feedback for one cycle: feedback does not
/// contain the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// Whether they have torque: a servo that has restarted has none.
    Torque,
    /// The causes of their alarms.
    Alarms,
    /// Their goal positions: after a silence it is unknown which of the goals sent to a servo it received.
    Goal,
}

/// One servo's answer to a [`Question`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ServoAnswer {
    /// Whether the servo has torque.
    Torque(bool),
    /// The causes of its alarm: bits of [`crate::model::Registers::alarm_status`].
    Alarms(u8),
    /// The goal position it holds, counts.
    Goal(i32),
}

/// A joint that was just taken out of service; the robot continues without it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outage {
    /// The joint.
    pub joint: usize,
    /// The cause.
    pub cause: OutageCause,
}

/// Reasons why a joint is left without torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutageCause {
    /// Its servo raised an alarm: the causes, as in [`ServoAnswer::Alarms`]; 0 if the servo did not report them.
    Alarm(u8),
    /// It did not follow its goal.
    Jam,
}

/// The command to one servo in this cycle, in its own counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ServoGoal {
    /// Torque off.
    #[default]
    Limp,
    /// Torque on.
    Move {
        /// Goal position, counts.
        position: i32,
        /// Torque limit, in units of [`crate::model::ServoModel::torque_limit_full`].
        torque_limit: u16,
    },
    /// Send nothing: the servo keeps its last command. A servo that is silent may have restarted; it must not
    /// find a goal at full torque when it wakes.
    Keep,
}

/// A servo's reply, in its own counts and register units; [`crate::counts`] turns it into SI units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Feedback {
    /// Present position, counts; already sign-decoded.
    pub position: i32,
    /// Present speed, the model's speed unit; already sign-decoded.
    pub speed: i32,
    /// Present load (Feetech: 0.1 % of full duty; Dynamixel: the model's current unit); sign-decoded.
    pub load: i32,
    /// Supply voltage, units of 0.1 V.
    pub voltage_decivolt: u16,
    /// Temperature, degrees Celsius.
    pub temperature_c: u8,
    /// Alarm bits in the reply: Feetech's status byte; Dynamixel's alert bit (0x80).
    pub alarms: u8,
}

/// The result of one exchange for one servo. Each servo has its own slot: a lost reply never discards the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Slot {
    /// A valid reply from this exchange.
    Fresh(Feedback),
    /// The answer to a question that replaced the feedback.
    Answered(ServoAnswer),
    /// A reply that failed its checksum or had the wrong shape.
    Corrupt,
    /// No reply before the deadline.
    #[default]
    Missing,
}

impl Slot {
    /// True if a valid reply came.
    pub fn is_good(&self) -> bool {
        matches!(self, Slot::Fresh(_) | Slot::Answered(_))
    }
}

impl JointTargets {
    /// Joint targets of a limp `robot`.
    pub fn new(robot: &Robot) -> JointTargets {
        JointTargets {
            is_limp: true,
            only: None,
            torque_shares: vec![1.0; robot.joints.len()],
            may_restart: false,
            not_finite: None,
            angles_rad: vec![0.0; robot.joints.len()],
            offset_rad: vec![0.0; robot.joints.len()],
            residual_m: vec![0.0; robot.chains.len()],
            group_residual_m: vec![0.0; robot.chains.len()],
            saturated: vec![0; robot.chains.len()],
        }
    }
}

impl State {
    /// The state before any servo has been heard.
    pub fn new(robot: &Robot) -> State {
        State {
            joints: vec![JointState::default(); robot.joints.len()],
            goal_rad: vec![0.0; robot.joints.len()],
            start_rad: vec![0.0; robot.joints.len()],
            permission: Permission::Move,
            is_out: vec![false; robot.joints.len()],
            outage: None,
            body: BodyEstimate { is_in_contact: vec![false; robot.chains.len()], ..BodyEstimate::default() },
        }
    }

    /// True if every servo was heard in the last exchange.
    pub fn is_fresh(&self) -> bool {
        self.joints.iter().all(|joint| joint.is_known && joint.age_s <= 0.0)
    }

    /// True once every servo has been heard.
    pub fn is_known(&self) -> bool {
        self.joints.iter().all(|joint| joint.is_known)
    }
}
