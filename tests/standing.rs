//! Weight sharing compared with a third-party solver, with levers from small joint rotations; and that it allocates
//! nothing. Takes some seconds.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic; figures are for people")]

mod common;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use common::in_physics;
use glam::{DQuat, DVec3};
use hippocamp::model::{Joint, Robot};
use hippocamp::standing::{Sole, Standing, TrunkMotion};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const G: f64 = 9.806_65;
const FRICTION: f64 = 0.8;
const POSTURES: u32 = 1000;
/// Step of a joint to either side for numerical differentiation, rad.
const TURN: f64 = 1e-5;

/// The state of the reference: positions of the links.
struct Reference<'r> {
    robot: &'r Robot,
    soles: Vec<Sole>,
    gravity: DVec3,
    up: DVec3,
}

impl Reference<'_> {
    /// Centre of each link's mass, and place and turn of each chain's last link at its tip.
    fn links(&self, angles: &[f64]) -> (Vec<DVec3>, Vec<(DVec3, DQuat)>) {
        let (mut centers, mut tips) = (Vec::new(), Vec::new());
        for chain in &self.robot.chains {
            let (mut place, mut turn) = (chain.root_m, chain.root_rotation);
            for (joint, angle) in self.robot.joints_of(chain).iter().zip(&angles[chain.joints.clone()]) {
                turn *= DQuat::from_axis_angle(joint.axis, *angle);
                centers.push(place + turn * joint.center_m);
                place += turn * joint.link_m;
            }
            tips.push((place, turn));
        }
        (centers, tips)
    }

    /// Height times weight of all links, J.
    fn energy(&self, angles: &[f64]) -> f64 {
        let weights = self.links(angles).0.into_iter().zip(&self.robot.joints);
        weights.map(|(center, joint)| -joint.mass_kg * self.gravity.dot(center)).sum()
    }

    fn center(&self, angles: &[f64]) -> (f64, DVec3) {
        let mut mass = self.robot.trunk_mass_kg;
        let mut moment = self.robot.trunk_center_m * mass;
        for (center, joint) in self.links(angles).0.into_iter().zip(&self.robot.joints) {
            mass += joint.mass_kg;
            moment += joint.mass_kg * center;
        }
        (mass, moment / mass)
    }

    /// The points of the soles that touch the ground when the joints are at `touching`, fixed to their links and moved
    /// with them to `angles`.
    fn points(&self, touching: &[f64], angles: &[f64]) -> Vec<DVec3> {
        let ((_, then), (_, now)) = (self.links(touching), self.links(angles));
        let of_sole = |sole: &Sole| {
            let ((_, turn_then), (place, turn)) = (then[sole.chain], now[sole.chain]);
            let below = turn * (turn_then.inverse() * (-self.up * sole.radius_m));
            sole.points_m.iter().map(|point| place + turn * *point + below).collect::<Vec<_>>()
        };
        self.soles.iter().flat_map(of_sole).collect()
    }

    /// The change of energy, and of each point, when each joint turns.
    fn turns(&self, angles: &[f64]) -> Vec<(f64, Vec<DVec3>)> {
        (0..angles.len())
            .map(|joint| {
                let at = |turn: f64| {
                    let mut turned = angles.to_vec();
                    turned[joint] += turn;
                    (self.energy(&turned), self.points(angles, &turned))
                };
                let ((more, ahead), (less, behind)) = (at(TURN), at(-TURN));
                let ways = ahead.iter().zip(&behind).map(|(a, b)| (*a - *b) / (2.0 * TURN)).collect();
                ((more - less) / (2.0 * TURN), ways)
            })
            .collect()
    }

    /// The least sum of squared torques, N^2 m^2; none where no forces inside the cones hold the trunk.
    fn least(&self, angles: &[f64]) -> Option<f64> {
        let along = (DVec3::X - self.up * self.up.x).normalize();
        let across = self.up.cross(along);
        let edges = [along, -along, across, -across].map(|side| self.up + FRICTION * side);
        let (mass, center) = self.center(angles);
        let (points, turns) = (self.points(angles, angles), self.turns(angles));
        let (joints, columns) = (angles.len(), 4 * points.len());
        // Unknowns: torques, then shares of the edges. Rows: joints, force and moment of the trunk, shares >= 0.
        let mut rows = vec![vec![0.0; joints + columns]; joints + 6 + columns];
        let mut right = vec![0.0; joints + 6 + columns];
        for (joint, (energy, ways)) in turns.iter().enumerate() {
            rows[joint][joint] = 1.0;
            right[joint] = *energy;
            for (column, share) in (0..columns).zip(joints..) {
                rows[joint][share] = ways[column / 4].dot(edges[column % 4]);
            }
        }
        let weight = self.gravity * mass;
        let burden = [weight, center.cross(weight)];
        for axis in 0..6 {
            right[joints + axis] = -burden[axis / 3][axis % 3];
            for column in 0..columns {
                let (point, edge) = (points[column / 4], edges[column % 4]);
                rows[joints + axis][joints + column] = [edge, point.cross(edge)][axis / 3][axis % 3];
            }
        }
        for column in 0..columns {
            rows[joints + 6 + column][joints + column] = -1.0;
        }
        let mut squares = vec![vec![0.0; joints + columns]; joints + columns];
        (0..joints).for_each(|joint| squares[joint][joint] = 2.0);
        let cones = [SupportedConeT::ZeroConeT(joints + 6), SupportedConeT::NonnegativeConeT(columns)];
        let settings = DefaultSettingsBuilder::default().verbose(false).build().unwrap();
        let (squares, rows) = (CscMatrix::from(&squares), CscMatrix::from(&rows));
        let linear = vec![0.0; joints + columns];
        let mut solver = DefaultSolver::new(&squares, &linear, &rows, &right, &cones, settings).unwrap();
        solver.solve();
        (solver.solution.status == SolverStatus::Solved).then_some(solver.solution.obj_val)
    }
}

fn chance(random: &mut Pcg64Mcg, (low, high): (f64, f64)) -> f64 {
    low + (high - low) * f64::from(random.next_u32()) / f64::from(u32::MAX)
}

/// A posture within `share` of the ranges round `middle` (rad), on ground that is not quite level.
fn posture(robot: &Robot, random: &mut Pcg64Mcg, middle: &[f64], share: f64) -> (Vec<f64>, TrunkMotion) {
    let angle = |(joint, middle): (&Joint, &f64)| {
        let (low, high) = joint.range_rad;
        (middle + share * chance(random, (low - middle, high - middle))).clamp(low, high)
    };
    let angles = robot.joints.iter().zip(middle).map(angle).collect();
    let trunk = TrunkMotion {
        roll_rad: share * chance(random, (-0.2, 0.2)),
        pitch_rad: share * chance(random, (-0.2, 0.2)),
        acceleration_m_s2: share * DVec3::new(chance(random, (-1.0, 1.0)), chance(random, (-1.0, 1.0)), 0.0),
    };
    (angles, trunk)
}

/// Compares as many postures within `share` of the ranges round `middle` as can stand with the reference.
fn compare(robot: &Robot, middle: &[f64], share: f64) {
    let soles = Sole::all_of(robot);
    let mut standing = Standing::new(robot, &soles, FRICTION);
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let (mut worst, mut compared, mut drawn) = (0.0_f64, 0, 0);
    while compared < POSTURES {
        drawn += 1;
        assert!(drawn < 4 * POSTURES, "{compared} of {drawn} can stand");
        let (angles, trunk) = posture(robot, &mut random, middle, share);
        let to_level = DQuat::from_rotation_y(trunk.pitch_rad) * DQuat::from_rotation_x(trunk.roll_rad);
        let gravity = to_level.inverse() * (-DVec3::Z * G - trunk.acceleration_m_s2);
        let up = to_level.inverse() * DVec3::Z;
        let reference = Reference { robot, soles: soles.clone(), gravity, up };
        standing.solve(&angles, &trunk, &vec![1.0; robot.chains.len()]);
        let Some(least) = reference.least(&angles) else {
            // Some are short of it by a millionth of the weight.
            assert!(
                standing.miss_share() > 1e-7,
                "no forces hold this trunk, yet nothing is amiss: {angles:?}"
            );
            continue;
        };
        let found: f64 = standing.torques_nm().iter().map(|torque| torque * torque).sum();
        assert!(standing.miss_share() < 2e-3, "{} of the weight hangs in the air", standing.miss_share());
        worst = worst.max((found / least - 1.0).abs());
        assert!((found / least - 1.0).abs() < 0.01, "{found} beside {least} N^2 m^2: {angles:?} {trunk:?}");
        compared += 1;
    }
    println!(
        "{}: {compared} of {drawn} postures can stand; at worst {:.3} % off the reference",
        robot.name,
        100.0 * worst
    );
}

#[test]
fn joint_torque_is_within_a_percent_of_the_minimum() {
    let horse = in_physics("horse.toml");
    let middle: Vec<f64> = horse.joints.iter().map(Joint::middle_rad).collect();
    compare(&horse, &middle, 1.0);
    // A figure whose weight is not over its feet falls with any torques: half of these do.
    let figure = in_physics("figure.toml");
    compare(&figure, &vec![0.0; figure.joints.len()], 0.5);
}

#[test]
fn sharing_allocates_nothing() {
    let robot = in_physics("horse.toml");
    let mut standing = Standing::new(&robot, &Sole::all_of(&robot), FRICTION);
    let mut random = Pcg64Mcg::seed_from_u64(8);
    let middle: Vec<f64> = robot.joints.iter().map(Joint::middle_rad).collect();
    let postures: Vec<_> = (0..100).map(|_| posture(&robot, &mut random, &middle, 1.0)).collect();
    let loads = [[1.0; 4], [0.0, 1.0, 0.5, 1.0], [0.0; 4]];
    assert_no_alloc(|| {
        for (angles, trunk) in &postures {
            loads.iter().for_each(|loads| standing.solve(angles, trunk, loads));
        }
    });
}
