//! The messages of a recording, field by field as in their schemas.
//!
//! Lengths in m, angles in rad, times in the unit that the name gives. An unknown field is left out.

use std::borrow::Cow;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::orders::OrderFields;
use crate::motion::Activity;
use crate::signals::{self, Aim, Feedback, Permission, Told};
use crate::units::Time;

/// Seconds and nanoseconds, as Foxglove defines them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Stamp {
    /// Whole seconds.
    pub sec: u64,
    /// The rest, nanoseconds.
    pub nsec: u32,
}

impl From<Time> for Stamp {
    fn from(time: Time) -> Stamp {
        let since = std::time::Duration::from_nanos(time.0);
        Stamp { sec: since.as_secs(), nsec: since.subsec_nanos() }
    }
}

/// A vector.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Vector3 {
    /// Forward.
    pub x: f64,
    /// Left.
    pub y: f64,
    /// Up.
    pub z: f64,
}

impl From<DVec3> for Vector3 {
    fn from(v: DVec3) -> Vector3 {
        Vector3 { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Vector3> for DVec3 {
    fn from(v: Vector3) -> DVec3 {
        DVec3::new(v.x, v.y, v.z)
    }
}

/// A rotation as a unit quaternion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the parts of a quaternion")]
pub struct Quaternion {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub w: f64,
}

impl From<Quaternion> for DQuat {
    fn from(q: Quaternion) -> DQuat {
        DQuat::from_xyzw(q.x, q.y, q.z, q.w)
    }
}

impl From<DQuat> for Quaternion {
    fn from(q: DQuat) -> Quaternion {
        Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }
    }
}

/// Position and rotation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position.
    pub position: Vector3,
    /// Rotation.
    pub orientation: Quaternion,
}

impl Pose {
    /// At `position`, not turned.
    pub fn at(position: DVec3) -> Pose {
        Pose::turned(position, DQuat::IDENTITY)
    }

    /// At `position`, turned by `turn`.
    pub fn turned(position: DVec3, turn: DQuat) -> Pose {
        Pose { position: position.into(), orientation: turn.into() }
    }
}

/// Header of a ROS message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header<'a> {
    /// Time of the message.
    pub stamp: Stamp,
    /// Frame of the message.
    pub frame_id: Cow<'a, str>,
}

/// `sensor_msgs/JointState`: all arrays have the same length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointState<'a> {
    /// Time and frame.
    pub header: Header<'a>,
    /// Names of the joints.
    pub name: Vec<Cow<'a, str>>,
    /// Angles, rad.
    pub position: Vec<f64>,
    /// Velocities, rad/s; empty for goals.
    pub velocity: Vec<f64>,
    /// Torques, N m: the load as the servo estimates it, or the torque limit of a goal.
    pub effort: Vec<f64>,
}

/// `hippocamp.Servos`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Servos<'a> {
    /// Time of the message.
    pub timestamp: Stamp,
    /// The servo of each joint that has one.
    pub servos: Vec<Servo<'a>>,
}

/// One servo in one exchange, in the servo's own units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Servo<'a> {
    /// Name of the joint that the servo turns.
    pub joint: Cow<'a, str>,
    /// The goal sent to it; left out if it was sent none or was made limp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal: Option<GoalRegisters>,
    /// True if nothing was sent to it, so that it keeps its last goal.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_kept: bool,
    /// Whether and how its reply arrived.
    pub result: SlotResult,
    /// The reply, if it was good, in the servo's own counts and units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reply: Option<Feedback>,
    /// The answer, if it was asked a question instead of feedback.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub told: Option<Told>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde wants a reference")]
fn is_false(is_it: &bool) -> bool {
    !is_it
}

/// Goal registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct GoalRegisters {
    /// Goal position, counts.
    pub position: i32,
    /// Torque limit, the register's unit.
    pub torque_limit: u16,
}

/// Whether and how a reply arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SlotResult {
    /// In time and complete.
    Fresh,
    /// In time and complete, but dropped, since no servo can have measured these values.
    Implausible,
    /// In time and complete: an answer to a question, not feedback.
    Told,
    /// No reply.
    Missing,
    /// A damaged reply.
    Corrupt,
}

/// `hippocamp.Feet`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Feet<'a> {
    /// Time of the message.
    pub timestamp: Stamp,
    /// The tip of each chain.
    pub feet: Vec<Foot<'a>>,
}

/// One chain's tip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Foot<'a> {
    /// Name of the chain.
    pub chain: Cow<'a, str>,
    /// Target of inverse kinematics; left out if the generator asked for joint angles, or for nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_in_body: Option<Vector3>,
    /// The same target in the world; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_in_world: Option<Vector3>,
    /// Position from the measured joints; left out until all joints of the chain have been heard.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_in_body: Option<Vector3>,
    /// The same in the world, with the trunk at its planned place; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_in_world: Option<Vector3>,
    /// Residual of inverse kinematics, m; left out if it is infinite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_m: Option<f64>,
    /// The walker's plan for the foot; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan: Option<FootPlan>,
}

/// A foot's plan: see [`crate::signals::FootTarget`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FootPlan {
    /// Planned position in the world.
    pub in_world: Vector3,
    /// Distance ahead of the neutral foot point.
    pub excursion_m: f64,
    /// Distance that the plane of its leg has covered since the walk began.
    pub plane_way_m: f64,
    /// True in swing.
    pub is_swing: bool,
    /// Largest acceleration of the swing.
    pub swing_acceleration_m_s2: f64,
}

/// `hippocamp.Imu`: see [`crate::signals::ImuReading`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Imu {
    /// Time of the message.
    pub timestamp: Stamp,
    /// True once the unit has sent a measurement.
    pub is_known: bool,
    /// True if its measurement was recent enough to act on.
    pub is_acted_on: bool,
    /// Age of the measurement, s.
    pub age_s: f64,
    /// Attitude of the trunk.
    pub roll_rad: f64,
    /// See `roll_rad`.
    pub pitch_rad: f64,
    /// See `roll_rad`.
    pub yaw_rad: f64,
    /// Turn rate of the trunk.
    pub rate_rad_s: Vector3,
    /// Acceleration minus gravity.
    pub specific_force_m_s2: Vector3,
    /// Measurements dropped as implausible so far.
    #[serde(default)]
    pub implausible: u64,
}

/// `foxglove.PoseInFrame`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PoseInFrame<'a> {
    /// Time of the message.
    pub timestamp: Stamp,
    /// Frame of the pose.
    pub frame_id: Cow<'a, str>,
    /// The pose.
    pub pose: Pose,
}

/// `hippocamp.TrueBody`: see [`signals::TrueBody`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrueBody {
    /// Time of the message.
    pub timestamp: Stamp,
    /// Position and orientation of the body frame in the world.
    pub pose: Pose,
    /// Velocity of its origin, m/s.
    pub velocity: Vector3,
    /// Height of its origin above the ground's plane, m.
    pub height_m: f64,
    /// Force of the ground on the trunk, N.
    pub trunk_contact_n: f64,
    /// True if the trunk lies on the ground or is turned over.
    pub is_fallen: bool,
}

impl TrueBody {
    /// The message for `body` at `timestamp`.
    pub fn new(body: &signals::TrueBody, timestamp: Stamp) -> TrueBody {
        TrueBody {
            timestamp,
            pose: Pose::turned(body.position_m, body.turn),
            velocity: body.velocity_m_s.into(),
            height_m: body.height_m,
            trunk_contact_n: body.trunk_contact_n,
            is_fallen: body.is_fallen,
        }
    }
}

impl From<TrueBody> for signals::TrueBody {
    fn from(body: TrueBody) -> signals::TrueBody {
        signals::TrueBody {
            position_m: body.pose.position.into(),
            turn: body.pose.orientation.into(),
            velocity_m_s: body.velocity.into(),
            height_m: body.height_m,
            trunk_contact_n: body.trunk_contact_n,
            is_fallen: body.is_fallen,
        }
    }
}

/// `hippocamp.Motion`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Time of the message.
    pub timestamp: Stamp,
    /// The operator's order.
    #[serde(flatten)]
    pub order: OrderFields,
    /// The robot's activity.
    pub activity: Activity,
    /// The generator's aim.
    pub aim: Aim,
    /// Planned speed, m/s.
    pub speed_m_s: f64,
    /// What safety permits from now on.
    pub permission: Permission,
    /// True if motion time stood still in this cycle.
    pub is_held: bool,
    /// Joints whose goal safety changed.
    pub interventions: u32,
    /// The joint that was taken out of service in this cycle, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outage: Option<Outage>,
}

/// A joint that the robot continues without: see [`crate::signals::Outage`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outage {
    /// Name of the joint.
    pub joint: String,
    /// True if the joint did not follow its goal.
    pub is_jam: bool,
    /// Causes of the servo's alarm, one bit each; 0 if the servo did not report them.
    pub alarms: u8,
}

/// `hippocamp.Buses`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Buses<'a> {
    /// Time of the message.
    pub timestamp: Stamp,
    /// All buses.
    pub buses: Vec<Bus<'a>>,
}

/// One bus: see [`crate::observe::BusFacts`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bus<'a> {
    /// Name.
    pub name: Cow<'a, str>,
    /// Duration of the exchange.
    pub exchange_ns: u64,
    /// Replies missing since the start.
    pub missing: u64,
    /// Corrupt replies since the start.
    pub corrupt: u64,
    /// True if its port was gone.
    pub is_gone: bool,
}

/// `hippocamp.Loop`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Loop {
    /// Time of the message.
    pub timestamp: Stamp,
    /// Number of cycles before this one.
    pub cycle: u64,
    /// When the cycle began, on the run's clock.
    pub began_ns: u64,
    /// Time since the previous cycle began, dropped cycles included.
    pub gap_ns: u64,
    /// How late the cycle began.
    pub late_ns: u64,
    /// Time spent computing.
    pub work_ns: u64,
    /// Time spent in the exchange on all buses.
    pub exchange_ns: u64,
}

/// `foxglove.FrameTransforms`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameTransforms<'a> {
    /// All transforms.
    pub transforms: Vec<FrameTransform<'a>>,
}

/// `foxglove.FrameTransform`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameTransform<'a> {
    /// Time of the transform.
    pub timestamp: Stamp,
    /// Name of the parent frame.
    pub parent_frame_id: Cow<'a, str>,
    /// Name of the child frame.
    pub child_frame_id: Cow<'a, str>,
    /// The child's origin in the parent.
    pub translation: Vector3,
    /// The child's rotation in the parent.
    pub rotation: Quaternion,
}
