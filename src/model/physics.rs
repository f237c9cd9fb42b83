//! The simulated robot apart from its buses: a body under gravity on the ground.

use glam::DVec3;

/// The body that carries a simulated robot's joints. Hardware has its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Physics {
    /// Time step of the simulated body, ms, 1 or 2; the servos' own is 1.
    pub step_ms: u32,
    /// Inertia of rotor and gears at the shaft, kg m^2, which replaces the servo models' own.
    pub rotor_inertia_kg_m2: Option<f64>,
    /// Edges of the trunk's box, centred on the trunk's centre of mass, m; `None` if the trunk is bolted
    /// down.
    pub trunk_box_m: Option<DVec3>,
    /// Radius of every link outside arms, m.
    pub link_radius_m: f64,
    /// Viscous friction of every joint, in addition to its servo's friction, N m s/rad.
    pub viscosity_nm_s: f64,
    /// Stiffness and damping of the stops beyond the ranges of joints and ball joints, N m/rad and N m s/rad.
    pub stop: (f64, f64),
    /// The ground it stands on.
    pub ground: Ground,
}

/// The ground: a plane through the start, and blocks on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Coulomb friction between ground and robot.
    pub friction: f64,
    /// Slope, rad: it rises in the direction `uphill_rad`.
    pub slope_rad: f64,
    /// Direction uphill, rad from x to the left.
    pub uphill_rad: f64,
    /// Steps across the robot's way.
    pub steps: Vec<Step>,
}

/// A block across the whole way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Position of its near edge, m along x from the start.
    pub at_m: f64,
    /// Length along x, m.
    pub length_m: f64,
    /// Height, m.
    pub height_m: f64,
}

/// The foot at a chain's end, in its last link. Its axes are the body frame's when all of the chain's angles are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Foot {
    /// A round sole across the leg: a rod along y with round ends, centred on the tip.
    Round {
        /// Radius, m.
        radius_m: f64,
        /// Distance between the centres of its round ends, m.
        width_m: f64,
    },
    /// A flat sole: a box.
    Plate {
        /// Edges along x, y and z, m.
        size_m: DVec3,
        /// Its centre from the tip, m.
        middle_m: DVec3,
    },
}

impl Foot {
    /// Distance of the sole below the tip, with the leg at angle 0, m.
    pub fn below_tip_m(&self) -> f64 {
        match self {
            Foot::Round { radius_m, .. } => *radius_m,
            Foot::Plate { size_m, middle_m } => 0.5 * size_m.z - middle_m.z,
        }
    }
}
