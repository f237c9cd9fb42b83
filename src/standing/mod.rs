//! Standing: the torque that each joint must hold so that the robot keeps its posture.
//!
//! Input: joint angles, attitude and desired acceleration of the trunk, and how much of the weight each foot
//! may take. Output: joint torques and the ground's forces on the feet. It involves no servos and no time; it
//! serves a horse, a figure, and arms on a base, which stand on nothing.
//!
//! Inverse dynamics gives the generalised force that keeps the posture. Equation (1) of the source (a paper
//! on human figures that fall, 4.1) shares it out: `tau_G = H_C^T tau_C + H_J^T tau_J`. Contact forces supply
//! what they can and joint torques the rest, so that the sum of the squared joint torques is least. Contact
//! forces stay inside friction cones, each a pyramid of four edges. All bodies count as moving as one with
//! the trunk: no joint accelerations, and no velocity terms, which are small at these speeds.

mod pacing;
mod sag;
mod share;
#[cfg(test)]
mod tests;

use glam::{DQuat, DVec3};

use crate::model::{Chain, Foot, Posture, Robot};
pub use pacing::Pacing;
pub use sag::Sag;
use share::Sharing;

/// Standard gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.806_65;
/// Edges of a friction pyramid.
const EDGES: usize = 4;
/// Cost of a missing share of the weight on the trunk, relative to joint torque.
const BALANCE_WEIGHT: f64 = 1e7;
/// Cost of contact force itself, so that the feet do not press against each other without need. Small
/// compared with joint torque.
const FORCE_COST: f64 = 3e-6;
/// Approximate cost of contact force on a foot at half its load: it grows as the inverse square of the load.
const UNLOADED_COST: f64 = 0.1;
/// A foot with less than this share of its load carries nothing.
const LEAST_LOAD: f64 = 0.05;

/// Contact of a chain's tip with the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Sole {
    /// The chain, index into [`Robot::chains`].
    pub chain: usize,
    /// Centres of its round parts, or corners of its flat parts, from the tip, in the last link's frame, m.
    pub points_m: Vec<DVec3>,
    /// Distance of the ground below each of them, m: the radius of a round part, 0 for corners.
    pub radius_m: f64,
}

impl Sole {
    /// The soles of the feet of `robot`, in the order of its chains.
    pub fn all_of(robot: &Robot) -> Vec<Sole> {
        let sole = |(chain, limb): (usize, &Chain)| {
            let to_link = limb.root_rotation.inverse();
            let (points, radius_m) = match limb.foot? {
                Foot::Round { radius_m, width_m } => {
                    let side = DVec3::Y * (0.5 * width_m);
                    (if width_m > 0.0 { vec![side, -side] } else { vec![DVec3::ZERO] }, radius_m)
                }
                Foot::Plate { size_m, middle_m } => {
                    let half = 0.5 * size_m;
                    let corner = |x: f64, y: f64| middle_m + DVec3::new(x * half.x, y * half.y, -half.z);
                    (vec![corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(-1.0, -1.0)], 0.0)
                }
            };
            Some(Sole {
                chain,
                points_m: points.into_iter().map(|point| to_link * point).collect(),
                radius_m,
            })
        };
        robot.chains.iter().enumerate().filter_map(sole).collect()
    }
}

/// Attitude of the trunk and its desired acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TrunkMotion {
    /// Roll, rad: positive lowers the right side.
    pub roll_rad: f64,
    /// Pitch, rad: positive lowers the nose.
    pub pitch_rad: f64,
    /// Acceleration, in the level frame that shares the trunk's heading, m/s^2.
    pub acceleration_m_s2: DVec3,
}

/// One point of a sole.
#[derive(Debug, Clone, Copy)]
struct Point {
    chain: usize,
    from_tip_m: DVec3,
    radius_m: f64,
}

/// Distributes the weight of one robot. Allocated once; it starts each solution from the last one.
#[derive(Debug, Clone)]
pub struct Standing {
    posture: Posture,
    points: Vec<Point>,
    friction: f64,
    sharing: Sharing,
    /// For each column: the joints it turns, and the direction of its force.
    edges: Vec<DVec3>,
    places: Vec<DVec3>,
    hold_nm: Vec<f64>,
    torques_nm: Vec<f64>,
    forces_n: Vec<DVec3>,
    miss_share: f64,
}

impl Standing {
    /// A solver for `robot` on these `soles`, on ground with this Coulomb `friction`.
    pub fn new(robot: &Robot, soles: &[Sole], friction: f64) -> Standing {
        let point = |sole: &Sole, from_tip_m: &DVec3| Point {
            chain: sole.chain,
            from_tip_m: *from_tip_m,
            radius_m: sole.radius_m,
        };
        let points: Vec<Point> = soles
            .iter()
            .filter(|sole| sole.chain < robot.chains.len())
            .flat_map(|sole| sole.points_m.iter().map(move |from_tip_m| point(sole, from_tip_m)))
            .collect();
        let joints = robot.joints.len();
        Standing {
            posture: Posture::new(robot),
            sharing: Sharing::new(points.len() * EDGES),
            edges: vec![DVec3::ZERO; points.len() * EDGES],
            places: vec![DVec3::ZERO; points.len()],
            forces_n: vec![DVec3::ZERO; points.len()],
            points,
            friction,
            hold_nm: vec![0.0; joints],
            torques_nm: vec![0.0; joints],
            miss_share: 0.0,
        }
    }

    /// Computes torques and forces for joints at `angles_rad`. `loads` gives for each chain the fraction of
    /// its share of the weight that its foot takes, 0 (swing) to 1 (stance); the weight shifts smoothly in
    /// between. If no foot stands, the trunk counts as held from outside.
    pub fn solve(&mut self, angles_rad: &[f64], trunk: &TrunkMotion, loads: &[f64]) {
        let to_level = DQuat::from_rotation_y(trunk.pitch_rad) * DQuat::from_rotation_x(trunk.roll_rad);
        let gravity = to_level.inverse() * (-DVec3::Z * GRAVITY_M_S2 - trunk.acceleration_m_s2);
        let up = to_level.inverse() * DVec3::Z;
        self.posture.bend(angles_rad);
        self.posture.hold(gravity, &mut self.hold_nm);
        self.place_points(up);
        self.pose(gravity, loads);
        self.sharing.solve();
        self.read_off(gravity);
    }

    /// Torque of each joint's motor, N m, in the robot's order; positive right-handed about its axis.
    pub fn torques_nm(&self) -> &[f64] {
        &self.torques_nm
    }

    /// Force of the ground on each point of the soles, in their order, body frame, N.
    pub fn forces_n(&self) -> &[DVec3] {
        &self.forces_n
    }

    /// Positions of those points, body frame, m.
    pub fn places_m(&self) -> &[DVec3] {
        &self.places
    }

    /// Unsupported force and moment on the trunk, as a share of the weight and of the weight times a tenth of
    /// a metre or the robot's size: 0 if the feet can carry it as asked.
    pub fn miss_share(&self) -> f64 {
        self.miss_share
    }

    /// The robot's posture at the last solution.
    pub(crate) fn posture(&self) -> &Posture {
        &self.posture
    }

    fn place_points(&mut self, up: DVec3) {
        // Edges along and across the trunk, in the plane of the ground.
        let along = (DVec3::X - up * up.x).try_normalize().unwrap_or(DVec3::Y);
        let across = up.cross(along);
        for (index, point) in self.points.iter().enumerate() {
            let (tip, turn) = self.posture.tip(point.chain);
            self.places[index] = tip + turn * point.from_tip_m - up * point.radius_m;
            for (edge, side) in [along, -along, across, -across].into_iter().enumerate() {
                self.edges[index * EDGES + edge] = up + self.friction * side;
            }
        }
    }

    /// Sets up the problem: forces in units of the weight, lengths in units of the robot's size.
    fn pose(&mut self, gravity: DVec3, loads: &[f64]) {
        let load = |point: &Point| loads.get(point.chain).copied().unwrap_or(0.0).clamp(0.0, 1.0);
        let fullest = self.points.iter().map(load).fold(0.0, f64::max);
        let (mass_kg, center_m) = self.posture.mass();
        let weight_n = (mass_kg * gravity.length()).max(f64::MIN_POSITIVE);
        let size_m = self.posture.size_m();
        let down = gravity * (mass_kg / weight_n);
        self.sharing.begin([down, center_m.cross(down) / size_m]);
        for (index, point) in self.points.iter().enumerate() {
            let load = if fullest > 0.0 { load(point) / fullest } else { 0.0 };
            let is_loaded = load >= LEAST_LOAD;
            let cost = FORCE_COST + UNLOADED_COST * (1.0 / (load * load).max(1e-12) - 1.0);
            for edge in index * EDGES..(index + 1) * EDGES {
                let force = self.edges[edge];
                let wrench = [force, self.places[index].cross(force) / size_m];
                self.sharing.set_column(edge, is_loaded, wrench, cost);
            }
        }
        // Joint torques: columns interact only if their feet belong to the same chain.
        for (row, of_row) in self.points.iter().enumerate() {
            for (column, of_column) in self.points.iter().enumerate().take(row + 1) {
                if of_row.chain != of_column.chain {
                    continue;
                }
                for joint in self.posture.joints_of(of_row.chain) {
                    let lever = |index: usize| self.posture.lever(joint, self.places[index]) / size_m;
                    let (row_lever, column_lever) = (lever(row), lever(column));
                    for row_edge in row * EDGES..(row + 1) * EDGES {
                        let torque = -row_lever.dot(self.edges[row_edge]);
                        for column_edge in column * EDGES..(column + 1) * EDGES {
                            let other = -column_lever.dot(self.edges[column_edge]);
                            self.sharing.add(row_edge, column_edge, torque * other);
                        }
                        if row == column {
                            let held = self.hold_nm[joint] / (weight_n * size_m);
                            self.sharing.pull(row_edge, torque * held);
                        }
                    }
                }
            }
        }
    }

    fn read_off(&mut self, gravity: DVec3) {
        let (mass_kg, center_m) = self.posture.mass();
        let weight_n = mass_kg * gravity.length();
        let shares = self.sharing.answer();
        let is_finite = shares.iter().all(|share| share.is_finite());
        self.torques_nm.copy_from_slice(&self.hold_nm);
        let (mut force_n, mut moment_nm) = (gravity * mass_kg, center_m.cross(gravity * mass_kg));
        for (index, point) in self.points.iter().enumerate() {
            let edges = index * EDGES..(index + 1) * EDGES;
            let of_edges = edges.map(|edge| self.edges[edge] * shares[edge]).sum::<DVec3>();
            let force = if is_finite { of_edges * weight_n } else { DVec3::ZERO };
            self.forces_n[index] = force;
            force_n += force;
            moment_nm += self.places[index].cross(force);
            for joint in self.posture.joints_of(point.chain) {
                self.torques_nm[joint] -= self.posture.lever(joint, self.places[index]).dot(force);
            }
        }
        let size_m = self.posture.size_m();
        self.miss_share = force_n.length().max(moment_nm.length() / size_m) / weight_n.max(f64::MIN_POSITIVE);
    }
}
