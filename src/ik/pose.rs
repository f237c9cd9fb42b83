//! The pose of a chain: each joint's angle with its sine and cosine, its position and its axis.

use super::chain::ChainSolver;
use super::geometry::{Geometry, Vector};

/// A hinge and its present state in the solution. One record per joint, so that a pass over a short chain
/// stays in one piece of memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct PosedJoint<G: Geometry> {
    // Fixed.
    pub(super) hinge: G::Hinge,
    pub(super) range_rad: (f64, f64),
    pub(super) stiffness: f64,
    pub(super) neutral_rad: f64,
    // The pose.
    pub(super) angle: Angle,
    pub(super) place: G::Vector,
    pub(super) axis: G::Axis,
    // The step.
    /// Derivative of the tip with respect to the joint, m/rad: its column of the Jacobian.
    pub(super) column: G::Vector,
    pub(super) turn_rad: f64,
    /// The part of the turn towards the neutral posture.
    pub(super) pull_rad: f64,
    /// False if a limit holds the joint.
    pub(super) is_free: bool,
}

/// An angle, rad, with its sine and cosine.
#[derive(Debug, Clone, Copy)]
pub(super) struct Angle {
    pub(super) rad: f64,
    pub(super) sine: f64,
    pub(super) cosine: f64,
}

impl Angle {
    pub(super) const ZERO: Angle = Angle { rad: 0.0, sine: 0.0, cosine: 1.0 };

    pub(super) fn of(rad: f64) -> Angle {
        let (sine, cosine) = rad.sin_cos();
        Angle { rad, sine, cosine }
    }

    /// Sets the angle to `rad`: the present one turned by the angle with this sine and cosine.
    #[inline]
    pub(super) fn turn_to(&mut self, rad: f64, sine: f64, cosine: f64) {
        *self = Angle {
            rad,
            sine: self.sine * cosine + self.cosine * sine,
            cosine: self.cosine * cosine - self.sine * sine,
        };
    }
}

impl<G: Geometry> PosedJoint<G> {
    pub(super) fn new(hinge: G::Hinge, range_rad: (f64, f64), stiffness: f64, neutral_rad: f64) -> Self {
        PosedJoint {
            hinge,
            range_rad,
            stiffness,
            neutral_rad,
            angle: Angle::ZERO,
            place: G::Vector::default(),
            axis: G::Axis::default(),
            column: G::Vector::default(),
            turn_rad: 0.0,
            pull_rad: 0.0,
            is_free: true,
        }
    }

    /// Places the joint at `place`, on a link with this orientation; returns end and orientation of its own link.
    #[inline]
    fn put(&mut self, place: G::Vector, rotation: G::Rotation) -> (G::Vector, G::Rotation) {
        self.place = place;
        self.axis = G::axis(rotation, self.hinge);
        let rotation = G::turned(rotation, self.axis, self.angle.sine, self.angle.cosine);
        (place + G::link(rotation, self.hinge), rotation)
    }

    /// True if the joint is at a limit of its range.
    #[inline]
    pub(super) fn is_at_limit(&self) -> bool {
        self.angle.rad <= self.range_rad.0 || self.angle.rad >= self.range_rad.1
    }

    /// True if the angle `rad` is in the range.
    #[inline]
    pub(super) fn holds(&self, rad: f64) -> bool {
        self.range_rad.0 <= rad && rad <= self.range_rad.1
    }

    /// The angle `rad` limited to the range.
    #[inline]
    pub(super) fn held(&self, rad: f64) -> f64 {
        rad.clamp(self.range_rad.0, self.range_rad.1)
    }
}

impl<G: Geometry> ChainSolver<G> {
    /// Sets the angles and everything computed from them.
    pub(super) fn set_pose(&mut self, angles: &[f64]) {
        for (joint, &angle) in self.joints.iter_mut().zip(angles) {
            joint.angle = Angle::of(joint.held(angle));
        }
        self.place();
    }

    /// Computes positions and axes from sines and cosines: forward kinematics.
    #[inline]
    pub(super) fn place(&mut self) {
        let (mut place, mut rotation) = self.geometry.root();
        for joint in &mut self.joints {
            (place, rotation) = joint.put(place, rotation);
        }
        self.tip = place;
    }

    /// Turns each joint by its turn in this step, which is at most [`SMALL_TURN_RAD`].
    #[inline]
    pub(super) fn take_step(&mut self) {
        let (mut place, mut rotation) = self.geometry.root();
        for joint in &mut self.joints {
            let (sine, cosine) = small_turn(joint.turn_rad);
            joint.angle.turn_to(joint.held(joint.angle.rad + joint.turn_rad), sine, cosine);
            (place, rotation) = joint.put(place, rotation);
        }
        self.tip = place;
    }

    /// Returns to the pose before the step.
    pub(super) fn take_step_back(&mut self) {
        for joint in &mut self.joints {
            let (sine, cosine) = small_turn(joint.turn_rad);
            joint.angle.turn_to(joint.held(joint.angle.rad - joint.turn_rad), -sine, cosine);
        }
        self.place();
    }

    /// Computes the derivative of the tip with respect to each joint.
    #[inline]
    pub(super) fn differentiate(&mut self) {
        for joint in &mut self.joints {
            joint.column = G::motion(joint.axis, self.tip - joint.place);
        }
    }

    /// Distance from the tip to `target`, m.
    #[inline]
    pub(super) fn distance_m(&self, target: G::Vector) -> f64 {
        let miss = target - self.tip;
        miss.dot(miss).sqrt()
    }

    /// The largest turn of a joint from the angles `from`, rad.
    pub(super) fn way_rad(&self, from: &[f64]) -> f64 {
        let ways = self.joints.iter().zip(from).map(|(joint, from)| (joint.angle.rad - from).abs());
        ways.fold(0.0, f64::max)
    }
}

/// Largest turn for which [`small_turn`] is accurate, rad.
pub(super) const SMALL_TURN_RAD: f64 = 0.25;

/// Sine and cosine of a turn of at most [`SMALL_TURN_RAD`], to 1e-14, by Taylor series: several times as fast
/// as the general functions.
#[inline]
pub(super) fn small_turn(turn_rad: f64) -> (f64, f64) {
    const SINE: [f64; 4] = [1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0];
    const COSINE: [f64; 5] = [-1.0 / 3_628_800.0, 1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5];
    let square = turn_rad * turn_rad;
    let series = |terms: &[f64]| terms.iter().fold(0.0, |sum, term| sum * square + term);
    (turn_rad + turn_rad * square * series(&SINE), 1.0 + square * series(&COSINE))
}
