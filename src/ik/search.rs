//! The search for the nearest pose on any branch, where the one that was followed misses the target.
//!
//! The pose that is followed is the nearest of its neighbourhood; limits make other neighbourhoods, and the
//! true nearest pose may be in one of those. So the box of the joints' ranges is cut into cells once, when the
//! solver is made, each with some sample poses, many of them on limits, as nearest poses are. A search
//! finishes from the sample of each cell whose tip is nearest to the target. Poses, cells and starts are the
//! same for the same chain; the work is bounded.

use super::REACHED_M;
use super::chain::{ChainSolver, Hinge};
use super::geometry::{Geometry, Vector};
use super::pose::Pose;

/// Cells of the box.
const CELLS: usize = 16;
/// Sample poses in all cells together.
const SAMPLES: usize = 512;
/// Samples are drawn from ranges this much wider at either end, as a share, and brought back onto the limits.
const BEYOND: f64 = 0.25;
/// Most joints that all starts of one search have together: long chains start from fewer cells.
const JOINTS_MAX: usize = 64;

/// Poses whose distances differ by less are equally near, m per metre of chain.
const SAME_SHARE: f64 = 1e-6;

/// Sample poses of a chain, cell by cell.
#[derive(Debug, Clone)]
pub(super) struct Search<G: Geometry> {
    /// Joint angles of all samples, rad, a pose after the other.
    angles: Vec<f64>,
    /// Tip of each sample.
    tips: Vec<G::Vector>,
    /// Where each cell's samples end.
    ends: Vec<usize>,
    /// The best start of each cell: squared distance, and which sample.
    starts: Vec<(f64, usize)>,
    /// The best pose found.
    best: Vec<f64>,
}

impl<G: Geometry> Search<G> {
    pub(super) fn new(geometry: &G, hinges: &[Hinge<G>]) -> Search<G> {
        let count = hinges.len();
        let samples = samples_of(count);
        let cells = cells_of(&samples);
        let mut pose = Pose::new(count);
        let mut search = Search {
            angles: Vec::new(),
            tips: Vec::new(),
            ends: Vec::new(),
            starts: Vec::new(),
            best: vec![0.0; count],
        };
        for cell in 0..CELLS {
            for (sample, _) in samples.iter().zip(&cells).filter(|(_, of)| **of == cell) {
                let angles: Vec<f64> = sample
                    .iter()
                    .zip(hinges)
                    .map(|(share, hinge)| (1.0 - share) * hinge.range_rad.0 + share * hinge.range_rad.1)
                    .collect();
                pose.set(geometry, hinges, &angles);
                search.angles.extend_from_slice(&angles);
                search.tips.push(pose.tip);
            }
            search.ends.push(search.tips.len());
        }
        search.starts = vec![(0.0, 0); CELLS];
        search
    }

    /// Each cell's sample with the nearest tip, nearest first.
    fn choose_starts(&mut self, target: G::Vector) {
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
    /// Leaves in `pose` the nearest pose found, if it is nearer to `target` than `pose` was by more than a
    /// reached target may miss; says whether it is. Of those equally near, the one with the least way from
    /// `from`.
    pub(super) fn search(&mut self, target: G::Vector, from: &[f64]) -> bool {
        let count = self.hinges.len();
        let followed_m = self.pose.distance_m(target);
        let same_m = SAME_SHARE * self.length_m;
        let mut is_new_branch = false;
        let mut nearest_m = followed_m - REACHED_M;
        let mut least_way_rad = f64::INFINITY;
        self.keep();
        self.search.choose_starts(target);
        for index in 0..CELLS.min(JOINTS_MAX.div_ceil(count)) {
            let (square, sample) = self.search.starts[index];
            if square.is_infinite() {
                break;
            }
            let angles = &self.search.angles[sample * count..(sample + 1) * count];
            self.pose.set(&self.geometry, &self.hinges, angles);
            self.descend(target);
            let distance_m = self.pose.distance_m(target);
            let way_rad = self.pose.way_rad(from);
            let is_as_near = is_new_branch && distance_m <= nearest_m + same_m;
            if distance_m < nearest_m - same_m || (is_as_near && way_rad < least_way_rad) {
                is_new_branch = true;
                least_way_rad = way_rad;
                self.keep();
            }
            nearest_m = nearest_m.min(distance_m);
        }
        self.pose.set(&self.geometry, &self.hinges, &self.search.best);
        is_new_branch
    }

    /// Notes the pose as the best so far.
    fn keep(&mut self) {
        for (kept, joint) in self.search.best.iter_mut().zip(&self.pose.joints) {
            *kept = joint.angle_rad;
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

/// Which cell each sample is in: that of the nearest of [`CELLS`] samples chosen far from one another.
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
