//! A robot's body as plain data: the links that carry its shafts, and the ground it stands on.

use super::mass::Mass;

/// A robot: a trunk, chains of links that hang on it, and the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyConfig {
    /// The trunk that all chains hang on.
    pub trunk: Trunk,
    /// The chains, each from the trunk outwards.
    pub chains: Vec<Chain>,
    /// The ground it stands on.
    pub ground: Ground,
    /// Torques that act in every joint beside its servo's.
    pub joints: JointMechanics,
    /// Motor steps in one step of the body, 1 to 4; a larger number is faster and coarser.
    pub motor_steps: u32,
}

/// Torques that act in every joint beside its servo's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMechanics {
    /// Torque lost for each unit of speed, N m s/rad, not negative.
    pub viscosity_nm_s: f64,
    /// Stiffness and damping of stops, N m/rad and N m s/rad, not negative. A stop pushes back but never
    /// pulls.
    pub stop: (f64, f64),
}

impl Default for JointMechanics {
    /// No viscosity; a stalled servo can push a few degrees into a stop.
    fn default() -> JointMechanics {
        JointMechanics { viscosity_nm_s: 0.0, stop: (60.0, 0.3) }
    }
}

/// Limit on how far hinges in one place may swing and twist together; beyond it a stop pushes back.
#[derive(Debug, Clone, PartialEq)]
pub struct BallStop {
    /// The last of the hinges, which carries the link: its index among the chain's links.
    pub last: usize,
    /// How many hinges there are, 2 or 3.
    pub hinges: usize,
    /// Corners of a region, going round it: swing across the link's rest direction X (y and z of its axis, times
    /// the sine of half its angle), and lowest and highest twist about X, rad.
    pub corners: Vec<([f64; 2], (f64, f64))>,
}

/// The trunk. Its frame: x forward, y left, z up.
#[derive(Debug, Clone, PartialEq)]
pub struct Trunk {
    /// Bolted to the world, in the air: arms on a base.
    pub is_fixed: bool,
    /// Mass, kg, above 0.
    pub mass_kg: f64,
    /// Centre of its mass, m.
    pub center_m: [f64; 3],
    /// Middle of the box that the trunk is, m.
    pub box_middle_m: [f64; 3],
    /// Edges of that box, m, above 0. The trunk has the inertia of a full box of this size.
    pub box_size_m: [f64; 3],
}

/// A limb.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Position of the first joint, trunk's frame, m.
    pub root_m: [f64; 3],
    /// Rotation from the chain's own frame to the trunk's: unit quaternion x, y, z, w.
    pub root_rotation: [f64; 4],
    /// Share of its weight that something outside carries (water, a counterweight), 0 to 1.
    pub carried_share: f64,
    /// Its links.
    pub links: Vec<Link>,
    /// Its ball joints.
    pub balls: Vec<BallStop>,
    /// The foot at its tip, if it has one.
    pub foot: Option<Foot>,
}

/// A hinge and the link behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Rotation axis in the frame of the link before it, unit length; positive turns are right-handed.
    pub axis: [f64; 3],
    /// Vector to the next hinge or the tip at angle 0, in its own frame, m; may be 0 except in the last link.
    pub end_m: [f64; 3],
    /// Its mass, above 0, in its own frame.
    pub mass: Mass,
    /// Radius of the round rod that stands for the link, m, above 0: used for its contact with the ground.
    pub radius_m: f64,
    /// Lowest and highest angle, rad, between mechanical stops.
    pub stops_rad: (f64, f64),
    /// The servo that turns it.
    pub servo: ShaftLink,
}

/// The shaft that turns a hinge, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftLink {
    /// Its index among all servos, bus by bus in the order of configuration.
    pub shaft: usize,
    /// Angle of the shaft at the hinge's angle 0, rad, from encoder count 0 on.
    pub zero_rad: f64,
    /// True if the count falls when the hinge turns in the positive direction.
    pub is_reversed: bool,
    /// Inertia of rotor and gears at the shaft, kg m^2, above 0; replaces the servo model's.
    pub rotor_inertia_kg_m2: Option<f64>,
}

/// The foot of a chain, in its last link. Its axes are the trunk's when all of the chain's angles are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Foot {
    /// A round sole across the leg: a capsule along y, centred on the tip.
    Round {
        /// Radius, m, above 0.
        radius_m: f64,
        /// Distance between the middles of its round ends, m, not negative.
        width_m: f64,
    },
    /// A flat sole: a box.
    Plate {
        /// Edges along x, y and z, m, above 0.
        size_m: [f64; 3],
        /// Its middle from the tip, m.
        middle_m: [f64; 3],
    },
}

/// The ground: a plane, and blocks on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Coulomb friction between ground and robot, not negative.
    pub friction: f64,
    /// Slope, rad; it rises towards `uphill_rad`.
    pub slope_rad: f64,
    /// Direction uphill, rad from x to the left.
    pub uphill_rad: f64,
    /// Steps across the robot's path.
    pub steps: Vec<Step>,
}

impl Default for Ground {
    /// Level, friction 0.8: rubber on a dry floor.
    fn default() -> Ground {
        Ground { friction: 0.8, slope_rad: 0.0, uphill_rad: 0.0, steps: Vec::new() }
    }
}

/// A block across the whole path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Where it begins, m along x from the start.
    pub at_m: f64,
    /// How long it is along x, m, above 0.
    pub length_m: f64,
    /// How high, m, above 0.
    pub height_m: f64,
}

/// A value that no body can have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("body: {what}: expected {expected}")]
pub struct BodyError {
    /// The part, and its value.
    pub what: String,
    /// What was expected there.
    pub expected: &'static str,
}

impl Trunk {
    /// Its mass, in its frame: that of a full box.
    pub fn mass(&self) -> Mass {
        Mass::cuboid(self.mass_kg, self.center_m, self.box_size_m)
    }
}

impl BodyConfig {
    /// Total mass, kg.
    pub fn mass_kg(&self) -> f64 {
        let links = self.chains.iter().flat_map(|chain| &chain.links);
        self.trunk.mass_kg + links.map(|link| link.mass.mass_kg).sum::<f64>()
    }

    /// Checks that every value is possible.
    pub(super) fn check(&self) -> Result<(), BodyError> {
        let positive = |what: &str, value: f64| {
            let is_good = value.is_finite() && value > 0.0;
            let error = || BodyError { what: format!("{what} {value}"), expected: "a number above 0" };
            is_good.then_some(()).ok_or_else(error)
        };
        positive("mass of the trunk", self.trunk.mass_kg)?;
        self.trunk.box_size_m.iter().try_for_each(|size| positive("edge of the trunk", *size))?;
        for (place, chain) in self.chains.iter().enumerate() {
            for (joint, link) in chain.links.iter().enumerate() {
                positive(&format!("radius of link {joint} of chain {place}"), link.radius_m)?;
                if let Some(inertia) = link.servo.rotor_inertia_kg_m2 {
                    positive(&format!("rotor inertia of link {joint} of chain {place}"), inertia)?;
                }
                let numbers = link.axis.iter().chain(&link.end_m).chain(&link.mass.center_m);
                let mut above_zero = link.mass.principal_kg_m2.iter().chain([&link.mass.mass_kg]);
                if !numbers.chain(above_zero.clone()).all(|number| number.is_finite())
                    || !above_zero.all(|number| *number > 0.0)
                {
                    let what = format!("link {joint} of chain {place}");
                    return Err(BodyError {
                        what,
                        expected: "finite numbers, and a mass with inertia above 0",
                    });
                }
            }
            for ball in &chain.balls {
                let is_good = (2..=3).contains(&ball.hinges)
                    && (ball.hinges - 1..chain.links.len()).contains(&ball.last)
                    && ball.corners.len() >= 3;
                if !is_good {
                    let what = format!("ball joint at link {} of chain {place}", ball.last);
                    return Err(BodyError {
                        what,
                        expected: "2 or 3 hinges of the chain, and 3 corners or more",
                    });
                }
            }
            match &chain.foot {
                Some(Foot::Round { radius_m, .. }) => {
                    positive(&format!("radius of the foot of chain {place}"), *radius_m)?;
                }
                Some(Foot::Plate { size_m, .. }) => size_m
                    .iter()
                    .try_for_each(|size| positive(&format!("edge of the foot of chain {place}"), *size))?,
                None => {}
            }
        }
        if !(1..=4).contains(&self.motor_steps) {
            let what = format!("{} motor steps in one of the body", self.motor_steps);
            return Err(BodyError { what, expected: "1 to 4" });
        }
        for step in &self.ground.steps {
            positive("length of a step", step.length_m)?;
            positive("height of a step", step.height_m)?;
        }
        if !(self.ground.friction.is_finite() && self.ground.friction >= 0.0) {
            let what = format!("friction {}", self.ground.friction);
            return Err(BodyError { what, expected: "a number, 0 or more" });
        }
        Ok(())
    }
}
