//! The messages of a recording, field by field as in their schemas: each is made from a sample, and read back into one.
//!
//! Lengths in m, angles in rad, times in the unit that the name gives. An unknown field is left out.

mod body;
mod feet;
mod joints;
mod motion;
mod servos;
mod timing;

use std::borrow::Cow;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::model::Robot;
use crate::units::Time;
pub use body::{FrameTransform, FrameTransforms, Imu, PoseInFrame, TrueBody};
pub use feet::{Feet, Foot, FootPlan};
pub use joints::JointState;
pub use motion::{Motion, Outage};
pub use servos::{GoalRegisters, Servo, Servos, SlotResult};
pub use timing::{Bus, Buses, Loop};

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

fn joint_named(robot: &Robot, name: &str) -> Result<usize, String> {
    let found = robot.joints.iter().position(|joint| joint.name == name);
    found.ok_or_else(|| format!("the robot has no joint {name}"))
}
