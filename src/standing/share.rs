//! Non-negative least squares by an active set that starts from the last solution.
//!
//! Of all shares x >= 0, it finds the one with the least `1/2 x^T H x + c^T x` (Lawson and Hanson, Solving
//! Least Squares Problems, 1974, chapter 23: algorithm NNLS, here on the normal equations). The balance of
//! the trunk is a term of the sum with a weight so large that its error is negligible: if the feet cannot
//! carry the trunk as asked, they carry it as nearly as they can.

use glam::DVec3;

use super::BALANCE_WEIGHT;

/// Largest downhill slope that is accepted at the solution, in the problem's units.
const FLAT: f64 = 1e-9;
/// Smallest pivot.
const LEAST_PIVOT: f64 = 1e-12;
/// Most changes of the active set, as a multiple of the number of columns.
const CHANGES: usize = 3;

/// The problem, its storage, and its last solution.
#[derive(Debug, Clone)]
pub(super) struct Sharing {
    columns: usize,
    /// The whole of H, and c.
    h: Vec<f64>,
    c: Vec<f64>,
    /// Columns that may be used; unused ones are 0.
    allowed: Vec<bool>,
    wrenches: Vec<[DVec3; 2]>,
    burden: [DVec3; 2],
    x: Vec<f64>,
    /// Columns above 0, in the order of the rows of their Cholesky factor, and how many of its rows are valid.
    free: Vec<usize>,
    is_free: Vec<bool>,
    factor: Vec<f64>,
    factored: usize,
    z: Vec<f64>,
}

impl Sharing {
    pub(super) fn new(columns: usize) -> Sharing {
        Sharing {
            columns,
            h: vec![0.0; columns * columns],
            c: vec![0.0; columns],
            allowed: vec![false; columns],
            wrenches: vec![[DVec3::ZERO; 2]; columns],
            burden: [DVec3::ZERO; 2],
            x: vec![0.0; columns],
            free: Vec::with_capacity(columns),
            is_free: vec![false; columns],
            factor: vec![0.0; columns * columns],
            factored: 0,
            z: vec![0.0; columns],
        }
    }

    /// Begins a new problem with the force and moment that the columns must balance.
    pub(super) fn begin(&mut self, burden: [DVec3; 2]) {
        self.burden = burden;
        self.h.fill(0.0);
    }

    /// Sets a column: force and moment of one unit, whether it may be used, and the cost of its square. All
    /// columns are set, in order.
    pub(super) fn set_column(&mut self, column: usize, is_allowed: bool, wrench: [DVec3; 2], cost: f64) {
        self.allowed[column] = is_allowed;
        self.wrenches[column] = wrench;
        let dot = |a: [DVec3; 2], b: [DVec3; 2]| a[0].dot(b[0]) + a[1].dot(b[1]);
        for other in 0..=column {
            self.h[column * self.columns + other] = BALANCE_WEIGHT * dot(wrench, self.wrenches[other]);
        }
        self.h[column * self.columns + column] += cost;
        self.c[column] = BALANCE_WEIGHT * dot(wrench, self.burden);
    }

    /// Adds to H at a row and a column; only the lower half counts.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        if column <= row {
            self.h[row * self.columns + column] += value;
        }
    }

    /// Adds to c.
    pub(super) fn pull(&mut self, row: usize, value: f64) {
        self.c[row] += value;
    }

    /// The solution: one share per column.
    pub(super) fn answer(&self) -> &[f64] {
        &self.x
    }

    /// Finds the solution, starting from the last one.
    pub(super) fn solve(&mut self) {
        self.factored = 0;
        self.free.clear();
        for column in 0..self.columns {
            self.is_free[column] = self.allowed[column] && self.x[column] > 0.0;
            if self.is_free[column] {
                self.free.push(column);
            } else {
                self.x[column] = 0.0;
            }
        }
        for _ in 0..CHANGES * self.columns.max(1) {
            if !self.descend() {
                continue;
            }
            let Some(steepest) = self.steepest() else { break };
            self.free.push(steepest);
            self.is_free[steepest] = true;
        }
    }

    /// Moves to the minimum over the free columns, or on the way there to where the first of them becomes 0
    /// and stops being free. True if it reached the minimum.
    fn descend(&mut self) -> bool {
        self.factorise();
        self.substitute();
        let mut way = 1.0;
        let mut first = None;
        for (place, column) in self.free.iter().enumerate() {
            let (now, then) = (self.x[*column], self.z[place]);
            if then > 0.0 {
                continue;
            }
            let until = if now > 0.0 { now / (now - then) } else { 0.0 };
            if until < way {
                (way, first) = (until, Some(place));
            }
        }
        for (place, column) in self.free.iter().enumerate() {
            self.x[*column] += way * (self.z[place] - self.x[*column]);
        }
        let Some(first) = first else { return true };
        let column = self.free.remove(first);
        self.is_free[column] = false;
        self.x[column] = 0.0;
        self.factored = self.factored.min(first);
        false
    }

    /// The column at 0 with the steepest descent.
    fn steepest(&self) -> Option<usize> {
        let mut steepest = (-FLAT, None);
        for column in (0..self.columns).filter(|column| self.allowed[*column] && !self.is_free[*column]) {
            let slope = self.c[column]
                + self.free.iter().map(|free| self.h_at(column, *free) * self.x[*free]).sum::<f64>();
            if slope < steepest.0 {
                steepest = (slope, Some(column));
            }
        }
        steepest.1
    }

    fn h_at(&self, row: usize, column: usize) -> f64 {
        self.h[row.max(column) * self.columns + row.min(column)]
    }

    /// Recomputes the invalid rows of the Cholesky factor of H over the free columns.
    fn factorise(&mut self) {
        let n = self.columns;
        for row in self.factored..self.free.len() {
            for column in 0..=row {
                let (before, of_row) = self.factor.split_at(row * n);
                let known =
                    if column == row { &of_row[..column] } else { &before[column * n..column * n + column] };
                let dot: f64 = known.iter().zip(&of_row[..column]).map(|(a, b)| a * b).sum();
                let rest = self.h_at(self.free[row], self.free[column]) - dot;
                self.factor[row * n + column] = if column == row {
                    rest.max(LEAST_PIVOT).sqrt()
                } else {
                    rest / self.factor[column * n + column]
                };
            }
        }
        self.factored = self.free.len();
    }

    /// The minimum over the free columns, regardless of signs.
    fn substitute(&mut self) {
        let (n, count) = (self.columns, self.free.len());
        for row in 0..count {
            let known: f64 = (0..row).map(|k| self.factor[row * n + k] * self.z[k]).sum();
            self.z[row] = (-self.c[self.free[row]] - known) / self.factor[row * n + row];
        }
        for row in (0..count).rev() {
            let known: f64 = (row + 1..count).map(|k| self.factor[k * n + row] * self.z[k]).sum();
            self.z[row] = (self.z[row] - known) / self.factor[row * n + row];
        }
    }
}
