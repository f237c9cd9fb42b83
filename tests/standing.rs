//! Sharing the weight against a solver of others' making, with levers found by turning each joint a little; and that it
//! allocates nothing. Costs some seconds.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic; figures are for people")]

mod common;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use common::shipped;
use glam::{DQuat, DVec3};
use hippocamp::model::Robot;
use hippocamp::standing::{Sole, Standing, TrunkMotion};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const G: f64 = 9.806_65;
const FRICTION: f64 = 0.8;
const POSTURES: u32 = 1000;
/// A joint is turned by so much either way to see what that moves, rad.
const TURN: f64 = 1e-5;

fn soles(robot: &Robot) -> Vec<Sole> {
    let points_m = vec![DVec3::Y * 0.015, DVec3::Y * -0.015];
    (0..robot.chains.len()).map(|chain| Sole { chain, points_m: points_m.clone(), radius_m: 0.01 }).collect()
}

/// What the reference knows: potential energy of the links, and where the soles' points are.
struct Reference<'r> {
    robot: &'r Robot,
    gravity: DVec3,
    up: DVec3,
}

impl Reference<'_> {
    /// Height times weight of all links, J.
    fn energy(&self, angles: &[f64]) -> f64 {
        let mut sum = 0.0;
        for chain in &self.robot.chains {
            let places = self.robot.places_in_body(chain, angles[chain.joints.clone()].iter().copied());
            for (place, joint) in self.robot.joints_of(chain).iter().enumerate() {
                // The shipped horses' links have their mass in their middle.
                sum -= joint.mass_kg * self.gravity.dot(0.5 * (places[place] + places[place + 1]));
            }
        }
        sum
    }

    fn center(&self, angles: &[f64]) -> (f64, DVec3) {
        let mut mass = self.robot.trunk_mass_kg;
        let mut moment = self.robot.trunk_center_m * mass;
        for chain in &self.robot.chains {
            let places = self.robot.places_in_body(chain, angles[chain.joints.clone()].iter().copied());
            for (place, joint) in self.robot.joints_of(chain).iter().enumerate() {
                mass += joint.mass_kg;
                moment += joint.mass_kg * 0.5 * (places[place] + places[place + 1]);
            }
        }
        (mass, moment / mass)
    }

    /// Middles of the round soles: the joints turn about y, along which the points lie.
    fn points(&self, angles: &[f64]) -> Vec<DVec3> {
        let tips = self
            .robot
            .chains
            .iter()
            .map(|chain| self.robot.tip_in_body(chain, angles[chain.joints.clone()].iter().copied()));
        tips.flat_map(|tip| [tip + DVec3::Y * 0.015, tip - DVec3::Y * 0.015]).collect()
    }

    /// What moves when each joint turns: the change of energy, and of each point.
    fn turns(&self, angles: &[f64]) -> Vec<(f64, Vec<DVec3>)> {
        (0..angles.len())
            .map(|joint| {
                let at = |turn: f64| {
                    let mut angles = angles.to_vec();
                    angles[joint] += turn;
                    (self.energy(&angles), self.turned_points(&angles, joint, turn))
                };
                let ((more, ahead), (less, behind)) = (at(TURN), at(-TURN));
                let ways = ahead.iter().zip(&behind).map(|(a, b)| (*a - *b) / (2.0 * TURN)).collect();
                ((more - less) / (2.0 * TURN), ways)
            })
            .collect()
    }

    /// The points of the links that touch the ground: below the soles' middles, and fixed to the link as it turns.
    fn turned_points(&self, angles: &[f64], joint: usize, turn: f64) -> Vec<DVec3> {
        let turned = DQuat::from_axis_angle(DVec3::Y, turn) * (-self.up * 0.01);
        let points = self.points(angles);
        let of_chain = |index: usize| self.robot.chains[index / 2].joints.contains(&joint);
        let below = |index: usize| if of_chain(index) { turned } else { -self.up * 0.01 };
        points.into_iter().enumerate().map(|(index, point)| point + below(index)).collect()
    }

    /// The least sum of squared torques, N^2 m^2; none where no forces inside the cones hold the trunk.
    fn least(&self, angles: &[f64]) -> Option<f64> {
        let along = (DVec3::X - self.up * self.up.x).normalize();
        let across = self.up.cross(along);
        let edges = [along, -along, across, -across].map(|side| self.up + FRICTION * side);
        let (mass, center) = self.center(angles);
        let (points, turns) = (self.turned_points(angles, usize::MAX, 0.0), self.turns(angles));
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

fn posture(robot: &Robot, random: &mut Pcg64Mcg) -> (Vec<f64>, TrunkMotion) {
    let angles = robot.joints.iter().map(|joint| chance(random, joint.range_rad)).collect();
    let trunk = TrunkMotion {
        roll_rad: chance(random, (-0.2, 0.2)),
        pitch_rad: chance(random, (-0.2, 0.2)),
        acceleration_m_s2: DVec3::new(chance(random, (-1.0, 1.0)), chance(random, (-1.0, 1.0)), 0.0),
    };
    (angles, trunk)
}

#[test]
fn joint_torque_is_within_a_percent_of_the_least_there_is() {
    let robot = shipped("horse.toml");
    let mut standing = Standing::new(&robot, &soles(&robot), FRICTION);
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let (mut worst, mut compared) = (0.0_f64, 0);
    for _ in 0..POSTURES {
        let (angles, trunk) = posture(&robot, &mut random);
        let to_level = DQuat::from_rotation_y(trunk.pitch_rad) * DQuat::from_rotation_x(trunk.roll_rad);
        let gravity = to_level.inverse() * (-DVec3::Z * G - trunk.acceleration_m_s2);
        let reference = Reference { robot: &robot, gravity, up: to_level.inverse() * DVec3::Z };
        standing.solve(&angles, &trunk, &[1.0; 4]);
        let Some(least) = reference.least(&angles) else {
            assert!(
                standing.miss_share() > 1e-4,
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
        "{compared} of {POSTURES} postures can stand; at worst {:.3} % off the reference",
        100.0 * worst
    );
    assert!(compared > POSTURES / 2);
}

#[test]
fn sharing_allocates_nothing() {
    let robot = shipped("horse.toml");
    let mut standing = Standing::new(&robot, &soles(&robot), FRICTION);
    let mut random = Pcg64Mcg::seed_from_u64(8);
    let postures: Vec<_> = (0..100).map(|_| posture(&robot, &mut random)).collect();
    let loads = [[1.0; 4], [0.0, 1.0, 0.5, 1.0], [0.0; 4]];
    assert_no_alloc(|| {
        for (angles, trunk) in &postures {
            loads.iter().for_each(|loads| standing.solve(angles, trunk, loads));
        }
    });
}
