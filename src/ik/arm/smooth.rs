//! The smooth rule: of all poses that bring the ends to their targets, the one with the least sum of squared bends.
//!
//! Each step is bounded, damped least squares, as in the finish of a leg: the least turns that bring the ends
//! to their targets, and a share of the way to the resting bend if that moves no end. Repeated, or cycle by
//! cycle on a path, it ends where no pose bends less.
//!
//! Targets in a plane have many poses in that plane from which no small change within it bends less; from
//! nearly all of them a change out of the plane does. The resting bend is therefore not straight but a slight
//! screw, from which arcs roll over to the side that bends least, as they do in a real arm.

use glam::DVec3;

use super::super::finish::TURN_MAX_RAD;
use super::pose::{Ball, Pose};

/// Most ends with a target of their own.
pub(super) const ENDS_MAX: usize = 3;
pub(super) const ROWS: usize = 3 * ENDS_MAX;

/// Bend of each joint of the resting arm, rad.
const REST_BEND_RAD: f64 = 0.03;
/// Rotation of the plane of that bend from joint to joint, rad.
const REST_SCREW_RAD: f64 = 1.0;

/// Size of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    /// Share of the way to the resting bend, if that moves no end.
    pub(super) pull: f64,
    /// Damping, as a share of the mean of the normal matrix' diagonal.
    pub(super) damping: f64,
}

/// Ends with targets: the number of links before each, and its target, m.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ends {
    pub(super) count: usize,
    pub(super) links: [usize; ENDS_MAX],
    pub(super) places: [DVec3; ENDS_MAX],
}

/// The lower half of a symmetric matrix, and a right-hand side.
pub(super) struct System {
    pub(super) matrix: [[f64; ROWS]; ROWS],
    pub(super) right: [f64; ROWS],
    pub(super) rows: usize,
}

/// Bends of joint `index` of the resting arm in its two directions, rad.
pub(super) fn rest_bend(index: usize) -> (f64, f64) {
    let (sine, cosine) = (REST_SCREW_RAD * index as f64).sin_cos();
    (REST_BEND_RAD * sine, REST_BEND_RAD * cosine)
}

impl Ends {
    pub(super) fn push(&mut self, links: usize, place: DVec3) {
        self.links[self.count] = links;
        self.places[self.count] = place;
        self.count += 1;
    }

    /// The largest distance of an end from its target, m.
    pub(super) fn miss_m(&self, pose: &Pose) -> f64 {
        let misses = (0..self.count).map(|end| self.places[end].distance_squared(pose.end(self.links[end])));
        misses.fold(0.0, f64::max).sqrt()
    }
}

impl Pose {
    /// Takes the step that brings `ends` to their targets. Returns the largest turn it wanted, rad.
    pub(super) fn step(&mut self, ends: &Ends, pace: Pace) -> f64 {
        for hinge in &mut self.hinges {
            hinge.is_free = true;
            hinge.pull_rad = pace.pull * (hinge.rest_rad - hinge.angle.rad);
        }
        let mut largest_rad = self.choose_step(ends, pace.damping);
        // Each pass holds at least one more hinge.
        while !self.hold_at_limits(largest_rad) {
            largest_rad = self.choose_step(ends, pace.damping);
        }
        self.take_step();
        largest_rad
    }

    /// Chooses the turns of the free hinges: each turns by its pull, and by the effect of the forces on the ends.
    fn choose_step(&mut self, ends: &Ends, damping: f64) -> f64 {
        let count = ends.count;
        let mut system = System::new(3 * count);
        let mut tips = [DVec3::ZERO; ENDS_MAX];
        for (end, tip) in tips.iter_mut().enumerate().take(count) {
            *tip = self.end(ends.links[end]);
            system.right[3 * end..3 * end + 3].copy_from_slice(&(ends.places[end] - *tip).to_array());
        }
        let mut first_end = 0;
        for (index, ball) in self.balls.iter().enumerate() {
            while first_end < count && ends.links[first_end] <= index {
                first_end += 1;
            }
            for hinge in &self.hinges[ball.first..ball.end] {
                let mut column = [0.0; ROWS];
                for end in first_end..count {
                    let motion = hinge.direction.cross(tips[end] - hinge.place);
                    column[3 * end..3 * end + 3].copy_from_slice(&motion.to_array());
                }
                let known_rad = if hinge.is_free { hinge.pull_rad } else { hinge.turn_rad };
                system.add(&column, 3 * first_end, known_rad, hinge.is_free);
            }
        }
        let forces = system.solve(damping);
        let forces: [DVec3; ENDS_MAX] =
            std::array::from_fn(|end| DVec3::from_slice(&forces[3 * end..3 * end + 3]));
        let mut largest_rad: f64 = 0.0;
        first_end = 0;
        for (index, ball) in self.balls.iter().enumerate() {
            while first_end < count && ends.links[first_end] <= index {
                first_end += 1;
            }
            for hinge in self.hinges[ball.first..ball.end].iter_mut().filter(|hinge| hinge.is_free) {
                hinge.turn_rad = hinge.pull_rad;
                for end in first_end..count {
                    hinge.turn_rad += hinge.direction.cross(tips[end] - hinge.place).dot(forces[end]);
                }
                largest_rad = largest_rad.max(hinge.turn_rad.abs());
            }
        }
        largest_rad
    }

    /// Puts the hinges that would pass a limit on it; false if there were any: the others must then be chosen
    /// again. The free hinges turn by no more than the small-angle arithmetic permits.
    fn hold_at_limits(&mut self, largest_rad: f64) -> bool {
        let share = (TURN_MAX_RAD / largest_rad).min(1.0);
        let mut is_settled = true;
        for ball in 0..self.balls.len() {
            is_settled &= !self.hold_in_range(ball, share);
        }
        for hinge in self.hinges.iter_mut().filter(|hinge| hinge.is_free) {
            let wanted_rad = hinge.angle.rad + share * hinge.turn_rad;
            if !hinge.holds(wanted_rad) {
                hinge.is_free = false;
                hinge.turn_rad = hinge.held(wanted_rad) - hinge.angle.rad;
                is_settled = false;
            }
        }
        if is_settled && share < 1.0 {
            self.hinges.iter_mut().filter(|hinge| hinge.is_free).for_each(|hinge| hinge.turn_rad *= share);
        }
        is_settled
    }

    /// Holds the hinges of joint `ball` if this share of their turns would leave their shared range; returns
    /// true if so.
    fn hold_in_range(&mut self, ball: usize, share: f64) -> bool {
        let Ball { first, end, range: Some(range) } = &self.balls[ball] else { return false };
        let (first, end) = (*first, *end);
        if !self.hinges[first..end].iter().any(|hinge| hinge.is_free) {
            return false;
        }
        let mut angles = [0.0; 3];
        let angles = &mut angles[..end - first];
        for (angle, hinge) in angles.iter_mut().zip(&self.hinges[first..end]) {
            let share = if hinge.is_free { share } else { 1.0 };
            *angle = hinge.held(hinge.angle.rad + share * hinge.turn_rad);
        }
        if !range.bring_in(angles) {
            return false;
        }
        for (hinge, angle) in self.hinges[first..end].iter_mut().zip(angles) {
            hinge.is_free = false;
            hinge.turn_rad = hinge.held(*angle) - hinge.angle.rad;
        }
        true
    }
}

impl System {
    /// An empty system of this many rows.
    pub(super) fn new(rows: usize) -> System {
        System { matrix: [[0.0; ROWS]; ROWS], right: [0.0; ROWS], rows }
    }

    /// Adds a hinge that moves the rows from `from` on by `column`, and turns by a known `known_rad` of its own.
    #[inline]
    pub(super) fn add(&mut self, column: &[f64; ROWS], from: usize, known_rad: f64, is_free: bool) {
        for row in from..self.rows {
            self.right[row] -= column[row] * known_rad;
            if is_free {
                for other in from..=row {
                    self.matrix[row][other] += column[row] * column[other];
                }
            }
        }
    }

    /// The solution, by Cholesky decomposition; zero if there is none.
    #[expect(clippy::needless_range_loop, reason = "rows and columns of one matrix")]
    #[inline]
    pub(super) fn solve(mut self, damping: f64) -> [f64; ROWS] {
        let (matrix, x, rows) = (&mut self.matrix, &mut self.right, self.rows);
        let trace: f64 = (0..rows).map(|row| matrix[row][row]).sum();
        let damping = damping * trace / rows as f64 + f64::MIN_POSITIVE;
        for row in 0..rows {
            matrix[row][row] += damping;
            for column in 0..=row {
                let mut sum = matrix[row][column];
                for before in 0..column {
                    sum -= matrix[row][before] * matrix[column][before];
                }
                // The diagonal holds the reciprocal.
                matrix[row][column] =
                    if column < row { sum * matrix[column][column] } else { 1.0 / sum.sqrt() };
            }
            let mut sum = x[row];
            for before in 0..row {
                sum -= matrix[row][before] * x[before];
            }
            x[row] = sum * matrix[row][row];
        }
        for row in (0..rows).rev() {
            let mut sum = x[row];
            for after in row + 1..rows {
                sum -= matrix[after][row] * x[after];
            }
            x[row] = sum * matrix[row][row];
        }
        if x.iter().all(|value| value.is_finite()) { *x } else { [0.0; ROWS] }
    }
}
