//! Arms that move like those of an octopus (Ishizuka 2008): their settings in a robot file beyond their joints.
//!
//! The frame of an arm's chain: x along the stretched arm from root to tip, y to its left, z up.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::Bending;

/// Settings of a robot with arms.
#[derive(Debug, Clone, PartialEq)]
pub struct TentacleMotion {
    /// The arms, in file order; one is a tentacle, eight are an octopus.
    pub arms: Vec<ArmSettings>,
    /// Support of the arms' weight.
    pub carrier: WeightSupport,
    /// Share of the arms' weight that the support carries, 0 to 1; the servos carry the rest.
    pub carried_share: f64,
    /// Duration of one walking, swimming or swaying stroke at tempo 1, s.
    pub stroke_time_s: f64,
    /// Interpolation between a stroke's key angles.
    pub between: KeyInterpolation,
    /// Rule by which an arm bends so that its groups end at the stroke's positions.
    pub bending: Bending,
    /// Largest random offset of each key angle, in either direction, so that arms differ, rad (thesis 3.4).
    pub variation_rad: f64,
    /// Random seed of the variation.
    pub seed: u64,
    /// Point that a tip reaches for if the operator gives none, body frame, m.
    pub reach_in_body: Option<DVec3>,
    /// Radius of the base, a sphere round the trunk's centre, that arms avoid, m.
    pub base_radius_m: Option<f64>,
    /// Clearance that arms keep from each other and from the base, skin to skin, m.
    pub clearance_m: f64,
    /// Mean load of an arm's outer joints on a pole that it holds, as a share of stall torque.
    pub grip_share: f64,
    /// Pole to wind round if the operator gives none.
    pub pole: Option<Pole>,
    /// Path of a tip if the operator gives none.
    pub path: Option<Box<TipPath>>,
}

/// One arm: a chain that is an arm ([`super::ArmGeometry`]), and its role in the motion.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSettings {
    /// Its chain, index into [`crate::model::Robot::chains`].
    pub chain: usize,
    /// Hinges per joint, 2 or 3: lift (positive up, about -y), sweep (positive to the left, about z) and, if
    /// 3, twist (about x).
    pub hinges: usize,
    /// Position of the arm on its side of an octopus, 1 (front) to 4 (rear): its role in a walk (thesis 2.2).
    pub role: u8,
    /// Rotation of the plane of walking strokes about the arm, rad: 0 is left-right, as in the thesis; a
    /// right angle is up-down.
    pub stroke_plane_rad: f64,
    /// Radius of the arm, including its skin, m.
    pub radius_m: f64,
    /// Lift of every joint in the parked pose, rad.
    pub park_lift_rad: f64,
}

/// Support of an arm's weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightSupport {
    /// Its servos only.
    Servos,
    /// Water: it floats.
    Water,
    /// A counterweight, a spring or strings.
    Counterweight,
}

/// A cylinder of infinite length to wind round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// A point on its axis, body frame, m.
    pub point_in_body: DVec3,
    /// Direction of its axis, body frame; any length except 0.
    pub axis: DVec3,
    /// Radius, m.
    pub radius_m: f64,
}

/// Most waypoints of a path: a path is part of an order, which is copied in every cycle.
pub const WAYPOINTS_MAX: usize = 6;

/// A path of a tip: waypoints and a speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipPath {
    waypoints_in_body: [DVec3; WAYPOINTS_MAX],
    count: usize,
    speed_m_s: f64,
}

/// Reasons why a path is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum PathError {
    /// Too few or too many waypoints.
    #[error("a path leads through 2 to {WAYPOINTS_MAX} places, not {0}")]
    Count(usize),
    /// A number that is not finite, or a speed that is not positive.
    #[error("the places of a path are finite, and its speed is above 0")]
    Number,
}

impl TipPath {
    /// The path through these `waypoints_in_body` (body frame, m), in this order, at `speed_m_s`.
    ///
    /// # Errors
    /// If the path is invalid.
    pub fn new(waypoints_in_body: &[DVec3], speed_m_s: f64) -> Result<TipPath, PathError> {
        let count = waypoints_in_body.len();
        if !(2..=WAYPOINTS_MAX).contains(&count) {
            return Err(PathError::Count(count));
        }
        let are_finite = waypoints_in_body.iter().all(|waypoint| waypoint.is_finite());
        if !(are_finite && speed_m_s > 0.0 && speed_m_s.is_finite()) {
            return Err(PathError::Number);
        }
        let mut path = TipPath { waypoints_in_body: [DVec3::ZERO; WAYPOINTS_MAX], count, speed_m_s };
        path.waypoints_in_body[..count].copy_from_slice(waypoints_in_body);
        Ok(path)
    }

    /// The waypoints, body frame, m.
    pub fn waypoints(&self) -> &[DVec3] {
        &self.waypoints_in_body[..self.count]
    }

    /// Speed of the tip, m/s.
    pub fn speed_m_s(&self) -> f64 {
        self.speed_m_s
    }
}

/// Interpolation between key poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KeyInterpolation {
    /// Straight lines, as in the thesis, rounded at each key so that the speed does not jump.
    Linear,
    /// The periodic cubic through the same poses, whose speed and acceleration are continuous.
    #[default]
    Smooth,
}
