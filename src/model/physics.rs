//! What a simulated robot has beside its buses: a body under gravity on the ground.

use glam::DVec3;

/// The body that carries a simulated robot's joints. Hardware has one of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Physics {
    /// Length of a step of the simulated body, ms, 1 or 2; the servos' own is 1.
    pub step_ms: u32,
    /// Inertia of rotor and gears at the shaft, kg m^2, in the place of the servo models' own.
    pub rotor_inertia_kg_m2: Option<f64>,
    /// Edges of the box that the trunk is, its middle the trunk's centre of mass, m; none where the trunk is bolted
    /// down.
    pub trunk_box_m: Option<DVec3>,
    /// Radius of every link that is not an arm's, m.
    pub link_radius_m: f64,
    /// Torque that every joint loses for each unit of speed, beside its servo's friction, N m s/rad.
    pub viscosity_nm_s: f64,
    /// Stiffness and damping of the stops behind the ranges of joints and ball joints, N m/rad and N m s/rad.
    pub stop: (f64, f64),
    /// What it stands on.
    pub ground: Ground,
}

/// The ground: a plane through the start, and blocks on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Coulomb friction between ground and robot.
    pub friction: f64,
    /// How steep it is, rad: uphill where `uphill_rad` points.
    pub slope_rad: f64,
    /// Direction uphill, rad from x to the left.
    pub uphill_rad: f64,
    /// Steps across the way.
    pub steps: Vec<Step>,
}

/// A block across the whole way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Where it begins, m along x from the start.
    pub at_m: f64,
    /// How long it is along x, m.
    pub length_m: f64,
    /// How high, m.
    pub height_m: f64,
}

/// What a chain stands on, in its last link. Its axes are the body frame's where all of the chain's angles are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Foot {
    /// A round sole across the leg: a rod along y with round ends, its middle the tip.
    Round {
        /// Radius, m.
        radius_m: f64,
        /// Between the middles of its round ends, m.
        width_m: f64,
    },
    /// A flat sole: a box.
    Plate {
        /// Edges along x, y and z, m.
        size_m: DVec3,
        /// Its middle from the tip, m.
        middle_m: DVec3,
    },
}

impl Foot {
    /// How far below the tip the sole is, the leg as at angle 0, m.
    pub fn below_tip_m(&self) -> f64 {
        match self {
            Foot::Round { radius_m, .. } => *radius_m,
            Foot::Plate { size_m, middle_m } => 0.5 * size_m.z - middle_m.z,
        }
    }
}
