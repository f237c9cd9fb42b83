//! Inverse kinematics of an octopus arm. Input: positions along it. Output: joint angles and the remaining error.
//!
//! The ends of the groups should reach their pseudo-targets, the tip a point, or the ends of all links given
//! positions. There are two rules for how an arm bends on the way: the thesis' cyclic coordinate descent,
//! group by group, each hinge by its ratio (Ishizuka 2008, 3.1.2 and 3.2), and the smooth rule ([`smooth`]).
//! On a path a solution follows from the last pose; a new motion starts from arcs ([`arcs`]). Never allocates
//! after construction.

mod arcs;
mod clearance;
mod follow;
mod groups;
mod hand_over;
mod hinge_ranges;
mod pose;
mod sections;
mod smooth;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::model::{ArmGeometry, Bending, Chain, GROUPS, Joint};
use crate::signals::{ArmAim, ArmTarget};
use arcs::SIDES;
pub use clearance::{Clearance, Mode};
pub use hand_over::HandOver;
use pose::Pose;
pub use sections::SectionSolver;
use smooth::{Ends, Pace};

/// A step on the path of a stroke. The damping lets the arm pass without a jump through straight, where it
/// cannot follow exactly: the ends then miss their positions by up to half a hundredth of the arm.
const STROKE: Pace = Pace { pull: 0.5, damping: 1e-3 };
/// A step on the path of a tip, which the bends need not follow at once.
const REACH: Pace = Pace { pull: 0.05, damping: 1e-5 };
/// A step from a first guess.
const SETTLE: Pace = Pace { pull: 0.3, damping: 1e-5 };
/// A step that only brings the ends to their positions.
const CORRECT: Pace = Pace { pull: 0.0, damping: 1e-6 };
/// Steps per second on a path: at a lower loop rate each cycle takes more steps, so that the bends keep up.
const STEPS_HZ: f64 = 100.0;
/// Largest number of corrections of a tip in one solution.
const CORRECTIONS_MAX: u32 = 6;
/// Largest number of steps from a first guess.
const STEPS_MAX: u32 = 40;
/// A guess is settled when no hinge turns by more than this, rad.
const SETTLED_RAD: f64 = 1e-3;
/// The thesis' rule stops when the end of a group is this close, m per metre of arm.
const NEAR_SHARE: f64 = 1e-3;
/// Ends count as reached when they are this close, m per metre of arm.
const REACHED_SHARE: f64 = 1e-5;
/// A stroke can begin once its ends are this close, m per metre of arm.
const STARTED_SHARE: f64 = 5e-3;

/// Remaining error of a solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ArmSolution {
    /// Distance from the tip to its target, m.
    pub tip_residual_m: f64,
    /// Largest distance of an end from its target, the tip's included, m.
    pub residual_m: f64,
    /// Number of hinges at a limit of their range.
    pub saturated: u32,
}

/// Solver for one arm, with storage for its intermediate results.
#[derive(Debug, Clone)]
pub struct ArmSolver {
    bending: Bending,
    pose: Pose,
    group_links: [usize; GROUPS],
    length_m: f64,
    steps: u32,
    /// Positions for a first guess.
    places: Vec<DVec3>,
    /// The best pose so far, rad.
    best: Vec<f64>,
}

impl ArmSolver {
    /// A solver for `arm`, which is `chain` with its `joints`. It bends by the rule `bending` and runs once
    /// in `period_s`.
    pub fn new(
        arm: &ArmGeometry,
        chain: &Chain,
        joints: &[Joint],
        bending: Bending,
        period_s: f64,
    ) -> ArmSolver {
        ArmSolver {
            bending,
            pose: Pose::new(arm, chain, joints),
            group_links: std::array::from_fn(|group| arm.joints_to_end(group)),
            length_m: arm.length_m(),
            steps: (1..).find(|steps| f64::from(*steps) >= 0.99 * STEPS_HZ * period_s).unwrap_or(1),
            places: vec![DVec3::ZERO; arm.joints.len()],
            best: vec![0.0; joints.len()],
        }
    }

    /// Turns `angles` (rad, one per hinge, root first; on entry the last solution) towards `target`. If the
    /// motion `is_new` it does not follow from them: the solver looks for the least bent pose anywhere.
    ///
    /// A target that is not finite changes nothing and returns an infinite residual.
    pub fn solve(&mut self, target: &ArmTarget, is_new: bool, angles: &mut [f64]) -> ArmSolution {
        debug_assert_eq!(angles.len(), self.pose.hinges.len());
        if !is_finite(target) || angles.iter().any(|angle| !angle.is_finite()) {
            return ArmSolution { residual_m: f64::INFINITY, tip_residual_m: f64::INFINITY, saturated: 0 };
        }
        let solution = match target.aim {
            ArmAim::Places => {
                self.pose.follow(&target.places_in_body, target.faced_in_body);
                self.places_left(&target.places_in_body)
            }
            ArmAim::Ends | ArmAim::Tip | ArmAim::TipAlong => {
                let ends = self.ends_of(target);
                self.solve_ends(&ends, target.aim, is_new, angles);
                let tip_residual_m = self.pose.tip.distance(ends.places[ends.count - 1]);
                ArmSolution { tip_residual_m, residual_m: ends.miss_m(&self.pose), saturated: 0 }
            }
        };
        self.pose.copy_to(angles);
        let at_limits = self.pose.hinges.iter().map(|hinge| u32::from(hinge.is_at_limit()));
        ArmSolution { saturated: at_limits.sum(), ..solution }
    }

    fn solve_ends(&mut self, ends: &Ends, aim: ArmAim, is_new: bool, angles: &[f64]) {
        match (is_new, aim, self.bending) {
            // Sines and cosines drift if they are only ever updated; each solution recomputes one.
            (false, ..) if self.pose.is_at(angles) => self.pose.renew_next(),
            (false, ..) => self.pose.set(angles),
            // From a straight arm, coordinate descent finds no way to a position straight ahead.
            (true, ArmAim::Ends, Bending::Ccd) => self.pose.rest(),
            // A stroke continues from a pose where it can begin.
            (true, ArmAim::Ends, _) => self.start(ends, STARTED_SHARE * self.length_m, angles),
            (true, ..) => self.start(ends, REACHED_SHARE * self.length_m, angles),
        }
        match (aim, self.bending) {
            (ArmAim::Ends, Bending::Ccd) => self.pose.sweep_groups(ends, NEAR_SHARE * self.length_m),
            (ArmAim::Ends, Bending::Smooth) => {
                for _ in 0..self.steps {
                    self.pose.step(ends, STROKE);
                }
            }
            _ => {
                self.pose.step(ends, REACH);
                self.correct(ends);
            }
        }
    }

    /// Finds a pose that reaches the target, from arcs, the least bent first, or from the present pose; the
    /// nearest one if none reaches it.
    fn start(&mut self, ends: &Ends, reached_m: f64, angles: &[f64]) {
        let mut nearest_m = f64::INFINITY;
        let mut tried = [false; SIDES];
        for _ in 0..=1 << ends.count {
            match self.least_bent(ends, &tried) {
                Some(sides) => {
                    tried[sides] = true;
                    self.pose.lay_arcs(ends, sides, &mut self.places);
                    self.pose.follow(&self.places, None);
                }
                None => self.pose.set(angles),
            }
            self.settle(ends);
            let miss_m = ends.miss_m(&self.pose);
            if miss_m < nearest_m {
                nearest_m = miss_m;
                self.pose.copy_to(&mut self.best);
            }
            if miss_m <= reached_m {
                return;
            }
        }
        self.pose.set(&self.best);
    }

    /// Among the untried sides, the one to which arcs bend least.
    fn least_bent(&mut self, ends: &Ends, tried: &[bool; SIDES]) -> Option<usize> {
        let mut least = (f64::INFINITY, None);
        for (sides, _) in tried.iter().enumerate().take(1 << ends.count).filter(|(_, tried)| !**tried) {
            let cost = self.pose.lay_arcs(ends, sides, &mut self.places);
            if cost < least.0 {
                least = (cost, Some(sides));
            }
        }
        least.1
    }

    /// Steps until nothing improves, then brings the ends to their positions.
    fn settle(&mut self, ends: &Ends) {
        for _ in 0..STEPS_MAX {
            if self.pose.step(ends, SETTLE) < SETTLED_RAD {
                break;
            }
        }
        self.correct(ends);
    }

    fn correct(&mut self, ends: &Ends) {
        for _ in 0..CORRECTIONS_MAX {
            if ends.miss_m(&self.pose) <= REACHED_SHARE * self.length_m {
                return;
            }
            self.pose.step(ends, CORRECT);
        }
    }

    fn ends_of(&self, target: &ArmTarget) -> Ends {
        let [.., tip] = target.ends_in_body;
        let links = self.pose.balls.len();
        let mut ends = Ends::default();
        match target.aim {
            ArmAim::Ends => {
                for (group_links, place) in self.group_links.iter().zip(target.ends_in_body) {
                    ends.push(*group_links, place);
                }
            }
            ArmAim::TipAlong => {
                let direction = target.direction_in_body.normalize_or_zero();
                ends.push(links - 1, tip - direction * self.pose.link_m(links - 1));
                ends.push(links, tip);
            }
            ArmAim::Tip | ArmAim::Places => ends.push(links, tip),
        }
        ends
    }

    fn places_left(&self, places: &[DVec3]) -> ArmSolution {
        let miss = |links: usize| places[links - 1].distance(self.pose.end(links));
        let links = places.len();
        ArmSolution {
            tip_residual_m: miss(links),
            residual_m: (1..=links).map(miss).fold(0.0, f64::max),
            saturated: 0,
        }
    }
}

fn is_finite(target: &ArmTarget) -> bool {
    match target.aim {
        ArmAim::Ends => target.ends_in_body.iter().all(|place| place.is_finite()),
        ArmAim::Tip => target.ends_in_body[GROUPS - 1].is_finite(),
        ArmAim::TipAlong => {
            target.ends_in_body[GROUPS - 1].is_finite() && target.direction_in_body.is_finite()
        }
        ArmAim::Places => target.places_in_body.iter().all(|place| place.is_finite()),
    }
}
