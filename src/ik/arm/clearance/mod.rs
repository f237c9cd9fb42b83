//! Keeps arms at a distance from each other and from the base, whatever motion is asked for.
//!
//! Input: the desired angles of the arms. Output: the same angles, unless arms would come too near to each other.
//! The nearer two arms are, the slower they may approach: their distance falls exponentially to the least permitted
//! and never below. The resulting deviation of an arm fades again when the way is free. The checks cover the arms'
//! links, skin to skin, except the root group of one against the root group of another, which are neighbours in any
//! pose; and the outer two groups of each arm against the base, a sphere.
//!
//! Never allocates after construction.

mod guarded;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::model::{GROUPS, Robot, TentacleMotion};
use guarded::{GuardedArm, Near};

/// Largest rate at which the distance above the least may fall, as a share of it, 1/s.
const APPROACH_S: f64 = 5.0;
/// Rate at which an arm's deviation fades, as a share of it, 1/s.
const RETURN_S: f64 = 2.0;
/// Margin on the permitted distance, as a share of it: safety may hold back single joints, so that an arm
/// turns slightly differently from what was checked here.
const RESERVE_SHARE: f64 = 0.25;
/// Most passes over all pairs in one cycle, and most corrections: each correction takes some tens of
/// microseconds, and the loop has milliseconds.
const PASSES: u32 = 8;
const CORRECTIONS_MAX: u64 = 48;
/// Distances that fall short by no more than this are accepted, m.
const GOOD_M: f64 = 1e-6;

/// Keeps arms apart.
#[derive(Debug, Clone)]
pub struct Clearance {
    arms: Vec<GuardedArm>,
    /// Centre and radius, m.
    base: Option<(DVec3, f64)>,
    distance_m: f64,
    period_s: f64,
    /// Mode of the last cycle; `None` if the arms were limp.
    last: Option<Mode>,
    corrections: u64,
}

/// Source of the angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Strokes: arms that are too near to each other move apart.
    Strokes,
    /// A pose: arms that are too near, as they may be where they hung, just do not come nearer.
    Pose,
}

impl Clearance {
    /// The clearance for the arms of `robot`.
    pub fn new(robot: &Robot, tentacle: &TentacleMotion) -> Clearance {
        Clearance {
            arms: tentacle.arms.iter().map(|arm| GuardedArm::new(robot, arm)).collect(),
            base: tentacle.base_radius_m.map(|radius_m| (robot.trunk_center_m, radius_m)),
            distance_m: (1.0 + RESERVE_SHARE) * tentacle.clearance_m,
            period_s: robot.period_s(),
            last: None,
            corrections: 0,
        }
    }

    /// Number of corrections so far that moved two arms, or an arm and the base, apart.
    pub fn corrections(&self) -> u64 {
        self.corrections
    }

    /// The first arm, by its index among the arms, that is nearer to an earlier one, or to the base (`None`),
    /// than permitted at these `angles` of all joints, rad; and by how much, m.
    pub fn too_near(&mut self, angles: &[f64]) -> Option<(usize, Option<usize>, f64)> {
        self.arms.iter_mut().for_each(|arm| arm.begin(angles));
        let distance_m = self.distance_m / (1.0 + RESERVE_SHARE);
        let pairs = || (0..GROUPS).flat_map(|group| (0..GROUPS).map(move |others| (group, others))).skip(1);
        for (index, arm) in self.arms.iter().enumerate() {
            for (other_index, other) in self.arms[..index].iter().enumerate() {
                let least_m = distance_m + arm.radius_m + other.radius_m;
                let is_m = pairs()
                    .map(|(group, others)| arm.nearest(group, other, others).now_m)
                    .fold(f64::INFINITY, f64::min);
                if is_m < least_m {
                    return Some((index, Some(other_index), least_m - is_m));
                }
            }
            let Some((center, radius_m)) = self.base else { continue };
            let least_m = distance_m + arm.radius_m + radius_m;
            let is_m =
                (1..GROUPS).map(|group| arm.nearest_to(group, center).now_m).fold(f64::INFINITY, f64::min);
            if is_m < least_m {
                return Some((index, None, least_m - is_m));
            }
        }
        None
    }

    /// To be called while the arms are limp, or their joints turn one by one: the next motion begins where
    /// they are.
    pub fn pass(&mut self) {
        self.last = None;
    }

    /// Turns the desired `angles` of all joints (rad) in this cycle into those to send.
    pub fn keep(&mut self, mode: Mode, angles: &mut [f64]) {
        for arm in &mut self.arms {
            match self.last {
                None => arm.begin(angles),
                // A pose begins where the joints are, not where their goals were.
                Some(last) => arm.advance(angles, last == mode, RETURN_S * self.period_s),
            }
        }
        if self.last.is_some() {
            self.part(mode);
        }
        self.last = Some(mode);
        for arm in &mut self.arms {
            arm.commit(angles);
        }
    }

    fn part(&mut self, mode: Mode) {
        let most = self.corrections + CORRECTIONS_MAX;
        for _ in 0..PASSES {
            let before = self.corrections;
            let mut corrections = before;
            self.visit_pairs(
                |a, b, near, short_m| {
                    if corrections < most {
                        near.part(a, b, short_m);
                    }
                    corrections += 1;
                },
                mode,
                GOOD_M,
            );
            self.corrections = corrections.min(most);
            if corrections == before {
                return;
            }
            if corrections > most {
                break;
            }
        }
        // If that did not help, an arm that is too near stops as fast as its joints may: then distances hardly change.
        for _ in 0..=self.arms.len() {
            let mut is_good = true;
            let tolerance_m = 0.1 * self.distance_m + GOOD_M;
            self.visit_pairs(
                |a, b, _, _| {
                    is_good = false;
                    a.stay();
                    if let Some(b) = b {
                        b.stay();
                    }
                },
                mode,
                tolerance_m,
            );
            if is_good {
                return;
            }
        }
    }

    /// Calls `visit` for each two groups (or a group and the base) that come too near by more than
    /// `tolerance_m`, with their nearest points and the missing distance, m.
    fn visit_pairs(
        &mut self,
        mut visit: impl FnMut(&mut GuardedArm, Option<&mut GuardedArm>, Near, f64),
        mode: Mode,
        tolerance_m: f64,
    ) {
        let share = APPROACH_S * self.period_s;
        for index in 0..self.arms.len() {
            let (before, rest) = self.arms.split_at_mut(index);
            let Some((arm, _)) = rest.split_first_mut() else { continue };
            for other in before {
                let least_m = self.distance_m + arm.radius_m + other.radius_m;
                for (group, others) in (0..GROUPS).flat_map(|a| (0..GROUPS).map(move |b| (a, b))).skip(1) {
                    if !arm.comes_near(group, other, others, least_m, share) {
                        continue;
                    }
                    let near = arm.nearest(group, other, others);
                    if let Some(short_m) = short_m(near, least_m, share, mode).filter(|m| *m > tolerance_m) {
                        visit(arm, Some(&mut *other), near, short_m);
                    }
                }
            }
            let Some((center, radius_m)) = self.base else { continue };
            let least_m = self.distance_m + arm.radius_m + radius_m;
            for group in 1..GROUPS {
                let near = arm.nearest_to(group, center);
                if let Some(short_m) = short_m(near, least_m, share, mode).filter(|m| *m > tolerance_m) {
                    visit(arm, None, near, short_m);
                }
            }
        }
    }
}

/// Missing distance, m: the distance may fall by this `share` of its excess over the least.
fn short_m(near: Near, least_m: f64, share: f64, mode: Mode) -> Option<f64> {
    let above_m = near.before_m - least_m;
    let goes_apart = above_m > 0.0 || mode == Mode::Strokes;
    let wanted_m = if goes_apart { near.before_m - share * above_m } else { near.before_m };
    (near.now_m < wanted_m).then_some(wanted_m - near.now_m)
}
