//! The robot's masses and joints at their positions: levers, and the torques that hold the limbs up.

use std::ops::Range;

use glam::{DQuat, DVec3};

use super::{Chain, Robot};

/// Smallest reference length, m.
const LEAST_SIZE_M: f64 = 0.1;

/// The constant data of a joint.
#[derive(Debug, Clone, Copy)]
struct Hinge {
    axis: DVec3,
    link_m: DVec3,
    center_m: DVec3,
    mass_kg: f64,
}

#[derive(Debug, Clone)]
struct Limb {
    root_m: DVec3,
    root_turn: DQuat,
    joints: Range<usize>,
}

/// A robot of hinges in one posture. Body frame throughout. Arms on tendons count as weightless: their
/// winches turn no link.
#[derive(Debug, Clone)]
pub struct Posture {
    trunk: (f64, DVec3),
    limbs: Vec<Limb>,
    hinges: Vec<Hinge>,
    /// Position and axis of each joint, and position of its link's mass.
    places: Vec<DVec3>,
    axes: Vec<DVec3>,
    centers: Vec<DVec3>,
    tips: Vec<(DVec3, DQuat)>,
    /// Mass of the whole robot, kg, and its centre, m.
    whole: (f64, DVec3),
    size_m: f64,
}

impl Posture {
    /// The posture of `robot`, not bent yet.
    pub fn new(robot: &Robot) -> Posture {
        let limb = |chain: &Chain| Limb {
            root_m: chain.root_m,
            root_turn: chain.root_rotation,
            joints: if chain.tendons.is_some() { 0..0 } else { chain.joints.clone() },
        };
        let joints = robot.joints.len();
        let (low, high) = robot.root_extent();
        Posture {
            trunk: (robot.trunk_mass_kg, robot.trunk_center_m),
            limbs: robot.chains.iter().map(limb).collect(),
            hinges: robot
                .joints
                .iter()
                .map(|joint| Hinge {
                    axis: joint.axis,
                    link_m: joint.link_m,
                    center_m: joint.center_m,
                    mass_kg: joint.mass_kg,
                })
                .collect(),
            places: vec![DVec3::ZERO; joints],
            axes: vec![DVec3::ZERO; joints],
            centers: vec![DVec3::ZERO; joints],
            tips: vec![(DVec3::ZERO, DQuat::IDENTITY); robot.chains.len()],
            whole: (robot.trunk_mass_kg, robot.trunk_center_m),
            size_m: (high - low).length().max(LEAST_SIZE_M),
        }
    }

    /// Bends all joints to `angles_rad`.
    pub fn bend(&mut self, angles_rad: &[f64]) {
        let (mut mass_kg, mut moment) = (self.trunk.0, self.trunk.1 * self.trunk.0);
        for (limb, tip) in self.limbs.iter().zip(&mut self.tips) {
            let (mut place, mut turn) = (limb.root_m, limb.root_turn);
            for joint in limb.joints.clone() {
                let hinge = &self.hinges[joint];
                self.places[joint] = place;
                self.axes[joint] = turn * hinge.axis;
                turn *= DQuat::from_axis_angle(hinge.axis, angles_rad[joint]);
                self.centers[joint] = place + turn * hinge.center_m;
                mass_kg += hinge.mass_kg;
                moment += self.centers[joint] * hinge.mass_kg;
                place += turn * hinge.link_m;
            }
            *tip = (place, turn);
        }
        self.whole = (mass_kg, if mass_kg > 0.0 { moment / mass_kg } else { DVec3::ZERO });
    }

    /// Writes the torque with which every joint holds its limb against `gravity` (m/s^2), with no contact.
    pub fn hold(&self, gravity: DVec3, torques_nm: &mut [f64]) {
        torques_nm.fill(0.0);
        for limb in &self.limbs {
            let (mut mass_kg, mut moment) = (0.0, DVec3::ZERO);
            for joint in limb.joints.clone().rev() {
                mass_kg += self.hinges[joint].mass_kg;
                moment += self.centers[joint] * self.hinges[joint].mass_kg;
                let about_joint = moment - self.places[joint] * mass_kg;
                torques_nm[joint] = -self.axes[joint].dot(about_joint.cross(gravity));
            }
        }
    }

    /// Torque about `joint` of a unit force at `place_m`, along each axis.
    pub fn lever(&self, joint: usize, place_m: DVec3) -> DVec3 {
        self.axes[joint].cross(place_m - self.places[joint])
    }

    /// The joints of a chain that turn links.
    pub fn joints_of(&self, chain: usize) -> Range<usize> {
        self.limbs[chain].joints.clone()
    }

    /// Position and orientation of a chain's tip.
    pub fn tip(&self, chain: usize) -> (DVec3, DQuat) {
        self.tips[chain]
    }

    /// Mass of the whole robot, kg, and its centre, m.
    pub fn mass(&self) -> (f64, DVec3) {
        self.whole
    }

    /// A reference length, m.
    pub fn size_m(&self) -> f64 {
        self.size_m
    }
}
