//! `/imu`, `/trunk`, `/true_body` and `/tf`: how the trunk lies, as measured, planned and true.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::super::sample::Sample;
use super::super::scene::WORLD;
use super::{Pose, Quaternion, Stamp, Vector3};
use crate::signals::{self, ImuReading};

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

impl Imu {
    /// The message of `sample` at `timestamp`.
    pub(in crate::recording) fn of(sample: &Sample, timestamp: Stamp) -> Imu {
        let reading = &sample.facts.imu;
        Imu {
            timestamp,
            is_known: reading.is_known,
            is_acted_on: sample.state.body.is_known,
            age_s: reading.age_s,
            roll_rad: reading.roll_rad,
            pitch_rad: reading.pitch_rad,
            yaw_rad: reading.yaw_rad,
            rate_rad_s: reading.rate_rad_s.into(),
            specific_force_m_s2: reading.specific_force_m_s2.into(),
            implausible: reading.implausible,
        }
    }

    /// Puts what the message holds into `sample`.
    pub(in crate::recording) fn read_into(&self, sample: &mut Sample) {
        sample.facts.imu = ImuReading {
            is_known: self.is_known,
            age_s: self.age_s,
            rate_rad_s: self.rate_rad_s.into(),
            specific_force_m_s2: self.specific_force_m_s2.into(),
            roll_rad: self.roll_rad,
            pitch_rad: self.pitch_rad,
            yaw_rad: self.yaw_rad,
            implausible: self.implausible,
        };
        sample.state.body.is_known = self.is_acted_on;
    }
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

impl PoseInFrame<'_> {
    /// The planned trunk of `sample` at `timestamp`.
    pub(in crate::recording) fn of(sample: &Sample, timestamp: Stamp) -> PoseInFrame<'static> {
        PoseInFrame {
            timestamp,
            frame_id: WORLD.into(),
            pose: Pose::turned(sample.targets.trunk_in_world, sample.targets.trunk_orientation),
        }
    }

    /// Puts what the message holds into `sample`.
    pub(in crate::recording) fn read_into(&self, sample: &mut Sample) {
        sample.targets.trunk_in_world = self.pose.position.into();
        sample.targets.trunk_orientation = self.pose.orientation.into();
    }
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
            pose: Pose::turned(body.position_m, body.orientation),
            velocity: body.velocity_m_s.into(),
            height_m: body.height_m,
            trunk_contact_n: body.trunk_contact_n,
            is_fallen: body.is_fallen || body.is_unstable,
        }
    }
}

impl From<TrueBody> for signals::TrueBody {
    fn from(body: TrueBody) -> signals::TrueBody {
        signals::TrueBody {
            position_m: body.pose.position.into(),
            orientation: body.pose.orientation.into(),
            velocity_m_s: body.velocity.into(),
            height_m: body.height_m,
            trunk_contact_n: body.trunk_contact_n,
            is_fallen: body.is_fallen,
            is_unstable: false,
        }
    }
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
