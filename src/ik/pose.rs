//! A pose of a chain: angles with their sines and cosines, places and axes.

use super::chain::Hinge;
use super::geometry::{Geometry, Vector};

/// One joint as a pose has it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PosedJoint<V, A> {
    pub(super) angle_rad: f64,
    sine: f64,
    cosine: f64,
    pub(super) place: V,
    pub(super) axis: A,
}

/// All joints, and the tip.
#[derive(Debug, Clone)]
pub(super) struct Pose<G: Geometry> {
    pub(super) joints: Vec<PosedJoint<G::Vector, G::Axis>>,
    pub(super) tip: G::Vector,
}

impl<G: Geometry> Pose<G> {
    pub(super) fn new(count: usize) -> Pose<G> {
        Pose { joints: vec![PosedJoint::default(); count], tip: G::Vector::default() }
    }

    /// Sets the angles, and all that follows from them.
    pub(super) fn set(&mut self, geometry: &G, hinges: &[Hinge<G>], angles: &[f64]) {
        for (joint, &angle_rad) in self.joints.iter_mut().zip(angles) {
            joint.angle_rad = angle_rad;
            (joint.sine, joint.cosine) = angle_rad.sin_cos();
        }
        self.place(geometry, hinges);
    }

    /// Places and axes from sines and cosines: forward kinematics.
    pub(super) fn place(&mut self, geometry: &G, hinges: &[Hinge<G>]) {
        let (mut place, mut rotation) = geometry.root();
        for (joint, hinge) in self.joints.iter_mut().zip(hinges) {
            joint.place = place;
            joint.axis = G::axis(rotation, hinge.shape);
            rotation = G::turned(rotation, joint.axis, joint.sine, joint.cosine);
            place = place + G::link(rotation, hinge.shape);
        }
        self.tip = place;
    }

    /// From the tip to `target`.
    pub(super) fn miss(&self, target: G::Vector) -> G::Vector {
        target - self.tip
    }

    /// Distance from the tip to `target`, m.
    pub(super) fn distance_m(&self, target: G::Vector) -> f64 {
        let miss = self.miss(target);
        miss.dot(miss).sqrt()
    }

    /// The largest turn of a joint from the angles `from`, rad.
    pub(super) fn way_rad(&self, from: &[f64]) -> f64 {
        let ways = self.joints.iter().zip(from).map(|(joint, from)| (joint.angle_rad - from).abs());
        ways.fold(0.0, f64::max)
    }
}

impl<V, A> PosedJoint<V, A> {
    /// Turned to `angle_rad`, by the angle of this sine and cosine; place and axis stay behind.
    pub(super) fn turn(&mut self, angle_rad: f64, sine: f64, cosine: f64) {
        self.angle_rad = angle_rad;
        (self.sine, self.cosine) =
            (self.sine * cosine + self.cosine * sine, self.cosine * cosine - self.sine * sine);
    }
}

/// Largest turn [`small_turn`] is exact for, rad.
pub(super) const SMALL_TURN_RAD: f64 = 0.25;

/// Sine and cosine of a turn of at most [`SMALL_TURN_RAD`], to the last digit or two: Taylor series, whose
/// next terms are below 3e-18. A quarter of the time of the general functions.
pub(super) fn small_turn(turn_rad: f64) -> (f64, f64) {
    const SINE: [f64; 5] = [-1.0 / 39_916_800.0, 1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0];
    const COSINE: [f64; 6] =
        [1.0 / 479_001_600.0, -1.0 / 3_628_800.0, 1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5];
    let square = turn_rad * turn_rad;
    let series = |terms: &[f64]| terms.iter().fold(0.0, |sum, term| sum * square + term);
    (turn_rad + turn_rad * square * series(&SINE), 1.0 + square * series(&COSINE))
}
