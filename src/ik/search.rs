//! The search for the nearest pose on any branch, for when the followed pose misses the target.
//!
//! The followed pose is the nearest of its neighbourhood; limits create other neighbourhoods, and the true
//! nearest pose may be in one of those. So the box of the joints' ranges is cut into cells once, when the
//! solver is made, each with some sample poses, many of them on limits, because nearest poses often are. A
//! search starts the finish from the sample in each cell whose tip is nearest to the target. Poses, cells and
//! starts are the same for the same chain; the work is bounded.

use super::REACHED_M;
use super::chain::ChainSolver;
use super::geometry::{Geometry, Vector};

/// Number of cells of the box.
const CELLS: usize = 16;
/// Number of sample poses in all cells together.
const SAMPLES: usize = 512;
/// Samples are drawn from ranges wider by this share at either end, and moved back onto the limits.
const BEYOND: f64 = 0.25;
/// Most joints in all starts of one search together: long chains start from fewer cells.
const JOINTS_MAX: usize = 64;

/// Poses whose distances differ by less than this count as equally near, m per metre of chain.
const SAME_SHARE: f64 = 1e-6;

/// Sample poses of a chain, cell by cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Search<V> {
    /// Joint angles of all samples, rad, one pose after the other.
    angles: Vec<f64>,
    /// Tip of each sample.
    tips: Vec<V>,
    /// Index after each cell's last sample.
    ends: Vec<usize>,
    /// The best start of each cell: squared distance, and index of the sample.
    starts: Vec<(f64, usize)>,
    /// The best pose found.
    best: Vec<f64>,
}

impl<V: Vector> Search<V> {
    /// Chooses each cell's sample with the nearest tip, nearest first.
    fn choose_starts(&mut self, target: V) {
        let mut begin = 0;
        for (start, &end) in self.starts.iter_mut().zip(&self.ends) {
            *start = (f64::INFINITY, begin);
            for index in begin..end {
                let miss = self.tips[index] - target;
                let square = miss.dot(miss);
                if square < start.0 {
                    *start = (square, index);
                }
            }
            begin = end;
        }
        self.starts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    }
}

impl<G: Geometry> ChainSolver<G> {
    /// Chooses the sample poses.
    pub(super) fn prepare_search(&mut self) {
        let samples = samples_of(self.joints.len());
        let cells = cells_of(&samples);
        let mut search = Search { starts: vec![(0.0, 0); CELLS], ..Search::default() };
        for cell in 0..CELLS {
            for (sample, _) in samples.iter().zip(&cells).filter(|(_, of)| **of == cell) {
                let ranges = self.joints.iter().map(|joint| joint.range_rad);
                let angles: Vec<f64> = sample
                    .iter()
                    .zip(ranges)
                    .map(|(share, (low, high))| low + share * (high - low))
                    .collect();
                self.set_pose(&angles);
                search.angles.extend(self.joints.iter().map(|joint| joint.angle.rad));
                search.tips.push(self.tip);
            }
            search.ends.push(search.tips.len());
        }
        search.best = vec![0.0; self.joints.len()];
        self.search = search;
    }

    /// Moves to the nearest pose found, if it is nearer to `target` than the present one by more than the
    /// tolerance for a reached target; returns true if so. Among equally near poses it takes the one with the
    /// least turn from the angles `from`.
    pub(super) fn search(&mut self, target: G::Vector, from: &[f64]) -> bool {
        let mut search = std::mem::take(&mut self.search);
        let is_found = self.search_among(&mut search, target, from);
        self.set_pose(&search.best);
        self.search = search;
        is_found
    }

    fn search_among(&mut self, search: &mut Search<G::Vector>, target: G::Vector, from: &[f64]) -> bool {
        let count = self.joints.len();
        let same_m = SAME_SHARE * self.length_m;
        let mut is_found = false;
        let mut nearest_m = self.distance_m(target) - REACHED_M;
        let mut least_way_rad = f64::INFINITY;
        self.copy_pose(&mut search.best);
        search.choose_starts(target);
        for &(_, sample) in search.starts.iter().take(JOINTS_MAX.div_ceil(count)) {
            self.set_pose(&search.angles[sample * count..(sample + 1) * count]);
            self.descend(target);
            let distance_m = self.distance_m(target);
            let way_rad = self.way_rad(from);
            let is_as_near = is_found && distance_m <= nearest_m + same_m;
            if distance_m < nearest_m - same_m || (is_as_near && way_rad < least_way_rad) {
                is_found = true;
                least_way_rad = way_rad;
                self.copy_pose(&mut search.best);
            }
            nearest_m = nearest_m.min(distance_m);
        }
        is_found
    }

    fn copy_pose(&self, angles: &mut [f64]) {
        for (angle, joint) in angles.iter_mut().zip(&self.joints) {
            *angle = joint.angle.rad;
        }
    }
}

/// Poses spread evenly over the box, as shares of each joint's range: an additive recurrence with the
/// powers of the root of x^(n + 1) = x + 1, which for one joint is the golden ratio.
fn samples_of(count: usize) -> Vec<Vec<f64>> {
    let power = 1.0 / (count as f64 + 1.0);
    let root = (0..64).fold(1.5_f64, |x, _| (1.0 + x).powf(power));
    let steps: Vec<f64> = (0..count)
        .scan(1.0, |step, _| {
            *step /= root;
            Some(*step)
        })
        .collect();
    let share = |sample: usize, step: f64| {
        let even = (step * (sample as f64 + 1.0)).fract();
        ((1.0 + 2.0 * BEYOND) * even - BEYOND).clamp(0.0, 1.0)
    };
    (0..SAMPLES).map(|sample| steps.iter().map(|step| share(sample, *step)).collect()).collect()
}

/// The cell of each sample: that of the nearest of [`CELLS`] samples chosen far from one another.
fn cells_of(samples: &[Vec<f64>]) -> Vec<usize> {
    let square = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let mut cells = vec![0; samples.len()];
    let mut nearest: Vec<f64> = samples.iter().map(|sample| square(sample, &samples[0])).collect();
    for cell in 1..CELLS {
        let center =
            (0..samples.len()).fold(0, |far, index| if nearest[index] > nearest[far] { index } else { far });
        for (index, sample) in samples.iter().enumerate() {
            let distance = square(sample, &samples[center]);
            if distance < nearest[index] {
                (nearest[index], cells[index]) = (distance, cell);
            }
        }
    }
    cells
}
