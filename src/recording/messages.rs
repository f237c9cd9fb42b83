//! The messages of a recording, field by field as their schemas have them.
//!
//! Lengths in m, angles in rad, times in the unit of the name. A field that is not known is left out.

use std::borrow::Cow;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::orders::OrderFields;
use crate::motion::Activity;
use crate::signals::{self, Aim, Feedback, Permission, Told};
use crate::units::Time;

/// Seconds and nanoseconds, as Foxglove has them.
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

/// Place and rotation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Place.
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

/// Head of a ROS message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header<'a> {
    /// When.
    pub stamp: Stamp,
    /// In which frame.
    pub frame_id: Cow<'a, str>,
}

/// `sensor_msgs/JointState`: arrays of one length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointState<'a> {
    /// When.
    pub header: Header<'a>,
    /// Joints.
    pub name: Vec<Cow<'a, str>>,
    /// Angles, rad.
    pub position: Vec<f64>,
    /// Speeds, rad/s; empty for goals.
    pub velocity: Vec<f64>,
    /// Torques, N m: the load as the servo estimates it, or the limit of a goal.
    pub effort: Vec<f64>,
}

/// `hippocamp.Servos`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Servos<'a> {
    /// When.
    pub timestamp: Stamp,
    /// Joints that have a servo.
    pub servos: Vec<Servo<'a>>,
}

/// One servo in one exchange, in its own units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Servo<'a> {
    /// Name of the joint it turns.
    pub joint: Cow<'a, str>,
    /// What it was told; left out when it was told to be limp, or nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal: Option<GoalRegisters>,
    /// True if nothing was said to it, so that it keeps what it was told last.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_kept: bool,
    /// How its reply came.
    pub result: SlotResult,
    /// The reply, if it was good, in the servo's own counts and units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reply: Option<Feedback>,
    /// What it answered, if it was asked something in the place of that.
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

/// How a reply came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SlotResult {
    /// In time and whole.
    Fresh,
    /// In time and whole, and dropped, since no servo can have measured what it said.
    Implausible,
    /// In time and whole, and no feedback: an answer.
    Told,
    /// Not at all.
    Missing,
    /// Damaged.
    Corrupt,
}

/// `hippocamp.Feet`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Feet<'a> {
    /// When.
    pub timestamp: Stamp,
    /// The tip of each chain.
    pub feet: Vec<Foot<'a>>,
}

/// One chain's tip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Foot<'a> {
    /// Name of the chain.
    pub chain: Cow<'a, str>,
    /// Where inverse kinematics was to bring it; left out when joint angles were asked for, or nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_in_body: Option<Vector3>,
    /// The same in the world; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_in_world: Option<Vector3>,
    /// Where it is by the measured joints; left out until all of the chain's have been heard.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_in_body: Option<Vector3>,
    /// The same in the world, as if the trunk were where it is planned to be; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_in_world: Option<Vector3>,
    /// What inverse kinematics left, m; left out where it is infinite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_m: Option<f64>,
    /// The walker's plan for it; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan: Option<FootPlan>,
}

/// A foot's plan: see [`crate::signals::FootTarget`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FootPlan {
    /// Planned place.
    pub in_world: Vector3,
    /// Ahead of the neutral foot point.
    pub excursion_m: f64,
    /// Way of its leg's plane since the walk began.
    pub plane_way_m: f64,
    /// True in the air.
    pub is_swing: bool,
    /// Largest acceleration of the swing.
    pub swing_acceleration_m_s2: f64,
}

/// `hippocamp.Imu`: see [`crate::signals::ImuReading`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Imu {
    /// When.
    pub timestamp: Stamp,
    /// True once the unit has been heard.
    pub is_known: bool,
    /// True where what it said was recent enough to act on.
    pub is_acted_on: bool,
    /// Time since it was measured, s.
    pub age_s: f64,
    /// Attitude of the trunk.
    pub roll_rad: f64,
    /// See `roll_rad`.
    pub pitch_rad: f64,
    /// See `roll_rad`.
    pub yaw_rad: f64,
    /// Turn rate of the trunk.
    pub rate_rad_s: Vector3,
    /// Acceleration less gravity.
    pub specific_force_m_s2: Vector3,
    /// Measurements dropped so far.
    #[serde(default)]
    pub implausible: u64,
}

/// `foxglove.PoseInFrame`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PoseInFrame<'a> {
    /// When.
    pub timestamp: Stamp,
    /// In which frame.
    pub frame_id: Cow<'a, str>,
    /// Where.
    pub pose: Pose,
}

/// `hippocamp.TrueBody`: see [`signals::TrueBody`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrueBody {
    /// When.
    pub timestamp: Stamp,
    /// Place and turn of the body frame in the world.
    pub pose: Pose,
    /// Velocity of its origin, m/s.
    pub velocity: Vector3,
    /// Height of its origin above the ground's plane, m.
    pub height_m: f64,
    /// Force of the ground on the trunk, N.
    pub trunk_contact_n: f64,
    /// The trunk lies on the ground or is turned over.
    pub is_fallen: bool,
}

impl TrueBody {
    /// Of `body` at `timestamp`.
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
    /// When.
    pub timestamp: Stamp,
    /// What the operator wanted.
    #[serde(flatten)]
    pub order: OrderFields,
    /// What the robot was doing.
    pub activity: Activity,
    /// What the generator asked for.
    pub aim: Aim,
    /// Planned speed, m/s.
    pub speed_m_s: f64,
    /// What safety permits from now on.
    pub permission: Permission,
    /// True if motion time stood still this cycle.
    pub is_held: bool,
    /// Joints that were told something else than was asked.
    pub interventions: u32,
    /// The joint that was taken out of service in this cycle, if one was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outage: Option<Outage>,
}

/// A joint that the robot goes on without: see [`crate::signals::Outage`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outage {
    /// Name of the joint.
    pub joint: String,
    /// It did not follow its goal.
    pub is_jam: bool,
    /// Why its servo raises an alarm, a bit a reason; 0 where it did not say.
    pub alarms: u8,
}

/// `hippocamp.Buses`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Buses<'a> {
    /// When.
    pub timestamp: Stamp,
    /// Each bus.
    pub buses: Vec<Bus<'a>>,
}

/// One bus: see [`super::BusSample`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bus<'a> {
    /// Name.
    pub name: Cow<'a, str>,
    /// Time of the exchange.
    pub exchange_ns: u64,
    /// Replies missing since the start.
    pub missing: u64,
    /// Replies damaged since the start.
    pub corrupt: u64,
    /// Whether its port was gone.
    pub is_gone: bool,
}

/// `hippocamp.Loop`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Loop {
    /// When.
    pub timestamp: Stamp,
    /// Cycles before it.
    pub cycle: u64,
    /// When the cycle began, on the run's clock.
    pub began_ns: u64,
    /// Time since the cycle before began, dropped ones included.
    pub gap_ns: u64,
    /// How late it began.
    pub late_ns: u64,
    /// Computing.
    pub work_ns: u64,
    /// The exchange on all buses.
    pub exchange_ns: u64,
}

/// `foxglove.FrameTransforms`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameTransforms<'a> {
    /// Each transform.
    pub transforms: Vec<FrameTransform<'a>>,
}

/// `foxglove.FrameTransform`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameTransform<'a> {
    /// When.
    pub timestamp: Stamp,
    /// From.
    pub parent_frame_id: Cow<'a, str>,
    /// To.
    pub child_frame_id: Cow<'a, str>,
    /// The child's origin in the parent.
    pub translation: Vector3,
    /// The child's rotation in the parent.
    pub rotation: Quaternion,
}
