//! Arms that move like an octopus' (Ishizuka 2008): what a robot file says of them beyond their joints.
//!
//! The frame of an arm's chain: x along the stretched arm from root to tip, y to its left, z up.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::Bending;

/// Settings of a rig of arms.
#[derive(Debug, Clone, PartialEq)]
pub struct TentacleMotion {
    /// The arms, in file order; one is a tentacle, eight are an octopus.
    pub arms: Vec<ArmSettings>,
    /// What carries the arms' weight.
    pub carrier: Carrier,
    /// Share of the arms' weight that it carries, 0 to 1; the servos carry the rest.
    pub carried_share: f64,
    /// Time of one walking, swimming or swaying stroke at tempo 1, s.
    pub stroke_time_s: f64,
    /// How strokes go from one key angle to the next.
    pub between: Between,
    /// How an arm is bent so that its groups end where the stroke has them.
    pub bending: Bending,
    /// Most that is added to each key angle by chance, either way, so that arms differ, rad (thesis 3.4).
    pub variation_rad: f64,
    /// Chance of the variation.
    pub seed: u64,
    /// Where a tip reaches for while the operator does not say, body frame, m.
    pub reach_in_body: Option<DVec3>,
    /// Radius of the base, a ball round the trunk's centre, that arms keep clear of, m.
    pub base_radius_m: Option<f64>,
    /// Distance that arms keep from each other and from the base, skin to skin, m.
    pub clearance_m: f64,
    /// Mean load of an arm's outer joints on a pole it holds, as a share of stall torque.
    pub grip_share: f64,
    /// What to wind round while the operator does not say.
    pub pole: Option<Pole>,
    /// Where a tip goes along while the operator does not say.
    pub path: Option<Box<TipPath>>,
}

/// One arm: a chain that is an arm ([`super::ArmGeometry`]), and its part in the motion.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSettings {
    /// Its chain, index into [`crate::model::Robot::chains`].
    pub chain: usize,
    /// Hinges a joint, 2 or 3: lift (positive up, about -y), sweep (positive to the left, about z) and, of three, twist
    /// (about x).
    pub hinges: usize,
    /// Place of the arm on its side of an octopus, 1 (front) to 4 (rear): its part in a walk (thesis 2.2).
    pub role: u8,
    /// Turn of the plane of walking strokes about the arm, rad: 0 is left-right, as the thesis has it, a right angle
    /// is up-down.
    pub stroke_plane_rad: f64,
    /// Radius of the arm, skin included, m.
    pub radius_m: f64,
    /// Lift of every joint where the arm is parked, rad.
    pub park_lift_rad: f64,
}

/// What carries an arm's weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    /// Nothing but its servos.
    Servos,
    /// Water: it floats.
    Water,
    /// A counterweight, a spring or strings.
    Counterweight,
}

/// A cylinder without ends, to wind round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// A point on its axis, body frame, m.
    pub point_in_body: DVec3,
    /// Direction of its axis, body frame; any length but 0.
    pub axis: DVec3,
    /// Radius, m.
    pub radius_m: f64,
}

/// Most places a path leads through: one is part of an order, which is copied from cycle to cycle.
pub const WAYPOINTS_MAX: usize = 6;

/// A way for a tip: through places, at a speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipPath {
    waypoints_in_body: [DVec3; WAYPOINTS_MAX],
    count: usize,
    speed_m_s: f64,
}

/// What makes a path none.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum PathError {
    /// Too few places or too many.
    #[error("a path leads through 2 to {WAYPOINTS_MAX} places, not {0}")]
    Count(usize),
    /// A number that is none, or no speed.
    #[error("the places of a path are finite, and its speed is above 0")]
    Number,
}

impl TipPath {
    /// The path through these `waypoints_in_body` (body frame, m), in their order, at `speed_m_s`.
    ///
    /// # Errors
    /// What makes it none.
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

    /// The places, body frame, m.
    pub fn waypoints(&self) -> &[DVec3] {
        &self.waypoints_in_body[..self.count]
    }

    /// How fast the tip goes, m/s.
    pub fn speed_m_s(&self) -> f64 {
        self.speed_m_s
    }
}

/// What lies between key poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Between {
    /// Straight lines, as in the thesis, rounded off at each key so that the speed does not leap.
    Linear,
    /// The periodic cubic through the same poses, whose speed and acceleration are continuous.
    #[default]
    Smooth,
}
