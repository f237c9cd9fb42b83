//! A limb that ends in a sole: joint angles from the sole's position and orientation.
//!
//! Input: desired position of the tip and orientation of the last link, and the angles of the last solution.
//! Output: the angles and the remaining error. The method is damped least squares on position and orientation
//! together; an angle counts as the distance it moves the end of a lever. Joints that a step would push past
//! a limit are held there, and the others take the step (as in [`super::finish`]). Works on any hinges; six
//! of which no two are parallel reach every orientation. Never allocates after construction.

use glam::{DQuat, DVec3};

use super::Solution;
use crate::model::{Chain, Joint};

/// Most steps in one solution. On a path two are enough.
const STEPS_MAX: u32 = 12;
/// Largest turn of one joint in one step, rad.
const TURN_MAX_RAD: f64 = 0.3;
/// Length of the lever that turns an angle into a distance, m per metre of limb.
const LEVER_SHARE: f64 = 0.25;
/// The solver stops at this error, m per metre of limb.
const TOLERANCE_SHARE: f64 = 1e-8;
/// Damping at the start, per square metre of limb; then its least and largest value.
const DAMPING_START: f64 = 1e-8;
const DAMPING_MIN: f64 = 1e-12;
const DAMPING_MAX: f64 = 1.0;

/// Target of a sole, body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoleTarget {
    /// Position of the tip, m.
    pub place: DVec3,
    /// Rotation of the last link from its orientation at angle 0 of all joints.
    pub turn: DQuat,
}

/// Solver for one limb, with storage for its pose.
#[derive(Debug, Clone)]
pub struct SoleSolver {
    root_m: DVec3,
    root_rotation: DQuat,
    hinges: Vec<Hinge>,
    tip: DVec3,
    turn: DQuat,
    length_m: f64,
    lever_m: f64,
}

#[derive(Debug, Clone, Copy)]
struct Hinge {
    axis: DVec3,
    link_m: DVec3,
    range_rad: (f64, f64),
    angle: f64,
    place: DVec3,
    /// Its axis, body frame.
    direction: DVec3,
    /// Angle before the step, and the turn of the step, rad.
    before: f64,
    turn: f64,
    is_free: bool,
}

/// Position and orientation together, six numbers, m.
type Six = [f64; 6];

impl SoleSolver {
    /// A solver for `chain`; its `joints` stay within the range for goals.
    pub fn new(chain: &Chain, joints: &[Joint]) -> SoleSolver {
        let hinge = |joint: &Joint| Hinge {
            axis: joint.axis,
            link_m: joint.link_m,
            range_rad: joint.goal_range_rad(),
            angle: 0.0,
            place: DVec3::ZERO,
            direction: DVec3::ZERO,
            before: 0.0,
            turn: 0.0,
            is_free: true,
        };
        let length_m = chain.length_m(joints);
        SoleSolver {
            root_m: chain.root_m,
            root_rotation: chain.root_rotation,
            hinges: joints.iter().map(hinge).collect(),
            tip: chain.root_m,
            turn: DQuat::IDENTITY,
            length_m,
            lever_m: LEVER_SHARE * length_m,
        }
    }

    /// Turns `angles` (rad, root first, one per joint; on entry the previous solution) so that the sole comes
    /// as near as possible to `target`. The residual contains both the tip's distance and the missing
    /// rotation, as the distance at the end of a lever a quarter as long as the limb. A target or angle that
    /// is not finite changes nothing and returns an infinite residual.
    pub fn solve(&mut self, target: SoleTarget, angles: &mut [f64]) -> Solution {
        let is_finite = target.place.is_finite() && target.turn.is_finite();
        if !is_finite || angles.len() != self.hinges.len() || !angles.iter().all(|angle| angle.is_finite()) {
            return Solution { residual_m: f64::INFINITY, ..Solution::default() };
        }
        for (hinge, angle) in self.hinges.iter_mut().zip(angles.iter()) {
            hinge.angle = angle.clamp(hinge.range_rad.0, hinge.range_rad.1);
        }
        self.place();
        let mut miss = self.miss(target);
        let mut damping = DAMPING_START;
        for _ in 0..STEPS_MAX {
            let left = norm(&miss);
            if left <= TOLERANCE_SHARE * self.length_m || damping > DAMPING_MAX {
                break;
            }
            self.step(&miss, damping * self.length_m * self.length_m);
            let new = self.miss(target);
            if norm(&new) < left {
                miss = new;
                damping = (damping * 0.1).max(DAMPING_MIN);
            } else {
                self.hinges.iter_mut().for_each(|hinge| hinge.angle = hinge.before);
                self.place();
                damping *= 100.0;
            }
        }
        let mut saturated = 0;
        for (angle, hinge) in angles.iter_mut().zip(&self.hinges) {
            *angle = hinge.angle;
            saturated += u32::from(hinge.angle <= hinge.range_rad.0 || hinge.angle >= hinge.range_rad.1);
        }
        Solution { residual_m: norm(&miss), saturated, is_new_branch: false }
    }

    /// Residual of `target` at `angles`, as in [`SoleSolver::solve`], m.
    pub fn residual_m(&mut self, target: SoleTarget, angles: &[f64]) -> f64 {
        for (hinge, angle) in self.hinges.iter_mut().zip(angles) {
            hinge.angle = *angle;
        }
        self.place();
        norm(&self.miss(target))
    }

    /// Positions and axes from the angles: forward kinematics.
    fn place(&mut self) {
        let (mut place, mut rotation) = (self.root_m, self.root_rotation);
        for hinge in &mut self.hinges {
            hinge.place = place;
            hinge.direction = rotation * hinge.axis;
            rotation *= DQuat::from_axis_angle(hinge.axis, hinge.angle);
            place += rotation * hinge.link_m;
        }
        self.tip = place;
        self.turn = rotation * self.root_rotation.inverse();
    }

    fn miss(&self, target: SoleTarget) -> Six {
        let place = target.place - self.tip;
        let turn = target.turn * self.turn.inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let turn = turn.to_scaled_axis() * self.lever_m;
        [place.x, place.y, place.z, turn.x, turn.y, turn.z]
    }

    /// One damped step that reduces `miss`.
    fn step(&mut self, miss: &Six, damping: f64) {
        for hinge in &mut self.hinges {
            hinge.before = hinge.angle;
            hinge.is_free = true;
            hinge.turn = 0.0;
        }
        let mut wanted = *miss;
        // Each pass holds at least one more joint at a limit.
        for _ in 0..=self.hinges.len() {
            let multiplier = self.multiplier(&wanted, damping);
            let mut is_settled = true;
            let columns = self.hinges.iter().map(|hinge| self.column(hinge));
            let largest = self
                .hinges
                .iter()
                .zip(columns)
                .filter(|(hinge, _)| hinge.is_free)
                .fold(0.0_f64, |largest, (_, column)| largest.max(dot(&column, &multiplier).abs()));
            let share = if largest > TURN_MAX_RAD { TURN_MAX_RAD / largest } else { 1.0 };
            for place in 0..self.hinges.len() {
                let hinge = self.hinges[place];
                if !hinge.is_free {
                    continue;
                }
                let column = self.column(&hinge);
                let turn = share * dot(&column, &multiplier);
                let to = hinge.before + turn;
                let held = to.clamp(hinge.range_rad.0, hinge.range_rad.1);
                let hinge = &mut self.hinges[place];
                hinge.turn = held - hinge.before;
                if (held - to).abs() > 0.0 {
                    hinge.is_free = false;
                    is_settled = false;
                    for (wanted, column) in wanted.iter_mut().zip(column) {
                        *wanted -= column * hinge.turn;
                    }
                }
            }
            if is_settled {
                break;
            }
        }
        for hinge in &mut self.hinges {
            hinge.angle = hinge.before + hinge.turn;
        }
        self.place();
    }

    /// Derivative of position and orientation with respect to a hinge, m/rad.
    fn column(&self, hinge: &Hinge) -> Six {
        let place = hinge.direction.cross(self.tip - hinge.place);
        let turn = hinge.direction * self.lever_m;
        [place.x, place.y, place.z, turn.x, turn.y, turn.z]
    }

    /// The x of (J J^T + damping) x = wanted over the free joints; each joint turns by its column times x.
    fn multiplier(&self, wanted: &Six, damping: f64) -> Six {
        let mut normal = [[0.0; 6]; 6];
        for hinge in self.hinges.iter().filter(|hinge| hinge.is_free) {
            let column = self.column(hinge);
            for (row, a) in normal.iter_mut().zip(column) {
                for (entry, b) in row.iter_mut().zip(column) {
                    *entry += a * b;
                }
            }
        }
        for (place, row) in normal.iter_mut().enumerate() {
            row[place] += damping;
        }
        solved(normal, *wanted)
    }
}

/// Solves a positive definite system by Cholesky decomposition.
fn solved(mut a: [[f64; 6]; 6], mut x: Six) -> Six {
    for row in 0..6 {
        for column in 0..=row {
            let sum = (0..column).fold(a[row][column], |sum, k| sum - a[row][k] * a[column][k]);
            a[row][column] =
                if column < row { sum / a[column][column] } else { sum.max(f64::MIN_POSITIVE).sqrt() };
        }
    }
    for row in 0..6 {
        x[row] = (0..row).fold(x[row], |sum, k| sum - a[row][k] * x[k]) / a[row][row];
    }
    for row in (0..6).rev() {
        x[row] = (row + 1..6).fold(x[row], |sum, k| sum - a[k][row] * x[k]) / a[row][row];
    }
    x
}

fn dot(a: &Six, b: &Six) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &Six) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::model::Robot;

    fn figure() -> Robot {
        crate::config::parse(include_str!("../../config/figure.toml"), "figure.toml").unwrap().robot
    }

    /// Position and orientation from the model's own forward kinematics.
    fn sole(robot: &Robot, leg: usize, angles: &[f64]) -> SoleTarget {
        let chain = &robot.chains[leg];
        let turn =
            robot.joints_of(chain).iter().zip(angles).fold(chain.root_rotation, |turn, (joint, angle)| {
                turn * DQuat::from_axis_angle(joint.axis, *angle)
            });
        SoleTarget {
            place: robot.tip_in_body(chain, angles.iter().copied()),
            turn: turn * chain.root_rotation.inverse(),
        }
    }

    #[test]
    fn a_thousand_soles_are_reached_from_near_by() {
        let robot = figure();
        let mut source = Pcg64Mcg::seed_from_u64(7);
        let mut share = move || (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        for leg in robot.motion.figure().unwrap().legs {
            let chain = &robot.chains[leg];
            let joints = robot.joints_of(chain);
            let mut solver = SoleSolver::new(chain, joints);
            for _ in 0..500 {
                // A random pose well inside the ranges, knees bent; start from up to 6 degrees beside it.
                let goal: Vec<f64> = joints
                    .iter()
                    .map(|joint| {
                        let (low, high) = joint.goal_range_rad();
                        low + (0.15 + 0.7 * share()) * (high - low)
                    })
                    .collect();
                let target = sole(&robot, leg, &goal);
                let mut angles: Vec<f64> = goal.iter().map(|angle| angle + 0.2 * share() - 0.1).collect();
                let solution = solver.solve(target, &mut angles);
                assert!(solution.residual_m < 1e-7, "{} m left of {goal:?}", solution.residual_m);
                let found = sole(&robot, leg, &angles);
                assert!(found.place.distance(target.place) < 1e-7);
                assert!(found.turn.angle_between(target.turn) < 1e-5);
            }
        }
    }

    #[test]
    fn out_of_reach_the_residual_is_reported_and_ranges_hold() {
        let robot = figure();
        let leg = robot.motion.figure().unwrap().legs[0];
        let chain = &robot.chains[leg];
        let joints = robot.joints_of(chain);
        let mut solver = SoleSolver::new(chain, joints);
        let mut angles = vec![0.4, 0.0, 0.0, 0.8, 0.4, 0.0];
        // 30 mm lower than the leg's length.
        let place = chain.root_m + DVec3::new(0.0, 0.0, -0.242);
        for _ in 0..20 {
            solver.solve(SoleTarget { place, turn: DQuat::IDENTITY }, &mut angles);
        }
        let solution = solver.solve(SoleTarget { place, turn: DQuat::IDENTITY }, &mut angles);
        assert!((0.02..0.04).contains(&solution.residual_m), "{}", solution.residual_m);
        for (joint, angle) in joints.iter().zip(&angles) {
            let (low, high) = joint.goal_range_rad();
            assert!((low..=high).contains(angle), "{} at {angle}", joint.name);
        }
        let before = angles.clone();
        let turn = DQuat::IDENTITY;
        let nowhere = solver.solve(SoleTarget { place: DVec3::splat(f64::NAN), turn }, &mut angles);
        assert!(nowhere.residual_m.is_infinite() && angles == before);
    }
}
