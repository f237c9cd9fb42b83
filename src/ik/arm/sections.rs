//! Inverse kinematics of an arm on tendons: the bends of its sections that bring points along it nearest to
//! their targets, by damped least squares on lift and sweep of each section. Two bends cannot put the end of
//! a section anywhere: the solver returns the remaining error.

use glam::{DQuat, DVec3};

use super::smooth::{ROWS, System};
use super::{ArmSolution, is_finite};
use crate::model::tendon::{SectionBend, TendonDrive};
use crate::model::{Chain, GROUPS};
use crate::signals::{ArmAim, ArmTarget};

/// Most sections: as many as an arm has groups.
const SECTIONS_MAX: usize = GROUPS;
/// Cost of a bend of 1 rad, as a share of the cost of an end that is an arm's length off: it chooses among
/// bends that reach equally well.
const BEND_COST: f64 = 1e-6;
/// Steps on a path, and from each start of a new motion.
const STEPS: u32 = 3;
const STEPS_FROM_START: u32 = 40;
/// Damping at first, and damping at which the solver gives up, as a share of the mean of the matrix' diagonal.
const DAMPING_START: f64 = 1e-4;
const DAMPING_GIVE_UP: f64 = 1e3;
/// Largest change of a bend in one step, rad.
const TURN_MAX_RAD: f64 = 0.5;
/// Bend at a start, as a share of the largest.
const START_SHARE: f64 = 0.4;

type Bends = [SectionBend; SECTIONS_MAX];

/// Solver for one arm on tendons.
#[derive(Debug, Clone)]
pub struct SectionSolver {
    drive: TendonDrive,
    root_m: DVec3,
    root_rotation: DQuat,
    length_m: f64,
    /// Number of links up to the end of each section.
    section_links: [usize; SECTIONS_MAX],
    bends: Bends,
    /// Turns of the winches at these bends, rad.
    winches: [f64; 2 * SECTIONS_MAX],
    joints: Vec<Posed>,
    /// Ends with targets: the number of links before each, and its target, m.
    wanted: Vec<(usize, DVec3)>,
}

/// A joint, and how its section's bends move the links after it: each by the sum of shares of the joints up
/// to it, axes and moments about the origin.
#[derive(Debug, Clone, Copy, Default)]
struct Posed {
    end: DVec3,
    axes: [DVec3; 2],
    moments: [DVec3; 2],
}

impl SectionSolver {
    /// A solver for the arm of at most [`GROUPS`] sections that `drive` bends at the root of `chain`.
    pub fn new(drive: &TendonDrive, chain: &Chain) -> SectionSolver {
        let links = drive.links();
        let mut section_links = [links; SECTIONS_MAX];
        let mut end = 0;
        for (section, last) in drive.sections().iter().zip(&mut section_links) {
            end += section.joints;
            *last = end;
        }
        SectionSolver {
            length_m: drive.length_m(),
            drive: drive.clone(),
            root_m: chain.root_m,
            root_rotation: chain.root_rotation,
            section_links,
            bends: Bends::default(),
            winches: [0.0; 2 * SECTIONS_MAX],
            joints: vec![Posed::default(); links],
            wanted: Vec::with_capacity(links.max(GROUPS)),
        }
    }

    /// Turns the winches' `angles` (rad, lift and sweep of each section, root first; on entry the previous
    /// solution) towards `target`. For a motion that `is_new` it also starts from bends to all sides.
    ///
    /// A target or angle that is not finite changes nothing and returns an infinite residual.
    pub fn solve(&mut self, target: &ArmTarget, is_new: bool, angles: &mut [f64]) -> ArmSolution {
        if !is_finite(target) || angles.iter().any(|angle| !angle.is_finite()) {
            return ArmSolution { residual_m: f64::INFINITY, tip_residual_m: f64::INFINITY, saturated: 0 };
        }
        self.want(target);
        if angles.iter().zip(&self.winches).any(|(angle, winch)| angle.to_bits() != winch.to_bits()) {
            self.drive.bends(angles, &mut self.bends);
            self.hold();
        }
        if is_new {
            self.start();
        } else {
            self.descend(STEPS);
        }
        self.drive.winches_rad(&self.bends, &mut self.winches);
        angles.copy_from_slice(&self.winches[..angles.len()]);
        self.pose();
        let misses = self.wanted.iter().map(|(links, place)| self.joints[links - 1].end.distance(*place));
        let at_limit = |(bend, section): (&SectionBend, &crate::model::tendon::Section)| {
            u32::from(bend.lift.hypot(bend.sweep) >= section.bend_max_rad * (1.0 - 1e-9))
        };
        ArmSolution {
            tip_residual_m: misses.clone().next_back().unwrap_or(0.0),
            residual_m: misses.fold(0.0, f64::max),
            saturated: self.bends.iter().zip(self.drive.sections()).map(at_limit).sum(),
        }
    }

    fn want(&mut self, target: &ArmTarget) {
        let links = self.joints.len();
        let [.., tip] = target.ends_in_body;
        self.wanted.clear();
        match target.aim {
            ArmAim::Ends => self.wanted.extend(self.section_links.iter().copied().zip(target.ends_in_body)),
            ArmAim::Tip => self.wanted.push((links, tip)),
            ArmAim::TipAlong => {
                let last_m = self.drive.sections().last().map_or(0.0, |section| section.link_m);
                let direction = target.direction_in_body.normalize_or_zero();
                self.wanted.extend([(links - 1, tip - direction * last_m), (links, tip)]);
            }
            ArmAim::Places => self.wanted.extend((1..).zip(target.places_in_body.iter().copied())),
        }
    }

    /// Takes the best of the poses downhill from here and from bends to all sides.
    fn start(&mut self) {
        let mut best = (self.descend(STEPS_FROM_START), self.bends);
        for way in 0..4_u32 {
            for flips in 0..1_u32 << (SECTIONS_MAX - 1) {
                for (index, (bend, section)) in self.bends.iter_mut().zip(self.drive.sections()).enumerate() {
                    let is_flipped = index > 0 && flips >> (index - 1) & 1 == 1;
                    let size = if is_flipped { -START_SHARE } else { START_SHARE } * section.bend_max_rad;
                    // Slightly off the axes; otherwise a bend has no side to go to.
                    let (sine, cosine) = (f64::from(way) * std::f64::consts::FRAC_PI_2 + 0.2).sin_cos();
                    *bend = SectionBend { lift: size * cosine, sweep: size * sine };
                }
                let cost = self.descend(STEPS_FROM_START);
                if cost < best.0 {
                    best = (cost, self.bends);
                }
            }
        }
        self.bends = best.1;
    }

    /// Takes at most this many steps downhill; returns the remaining cost.
    fn descend(&mut self, steps: u32) -> f64 {
        let mut cost = self.pose();
        let mut damping = DAMPING_START;
        for _ in 0..steps {
            let before = self.bends;
            let turns = self.system().solve(damping);
            let largest_rad = turns.iter().fold(0.0_f64, |largest, turn| largest.max(turn.abs()));
            let share = (TURN_MAX_RAD / largest_rad).min(1.0);
            for (bend, turn) in self.bends.iter_mut().zip(turns.chunks(2)) {
                bend.lift += share * turn[0];
                bend.sweep += share * turn[1];
            }
            self.hold();
            let new = self.pose();
            if new < cost {
                let gain = cost - new;
                cost = new;
                damping *= 0.1;
                if gain < 1e-9 * cost {
                    break;
                }
            } else {
                self.bends = before;
                self.pose();
                damping *= 10.0;
                if damping > DAMPING_GIVE_UP {
                    break;
                }
            }
        }
        cost
    }

    /// Limits each bend to its section's largest.
    fn hold(&mut self) {
        for (bend, section) in self.bends.iter_mut().zip(self.drive.sections()) {
            let size_rad = bend.lift.hypot(bend.sweep);
            if size_rad > section.bend_max_rad {
                let share = section.bend_max_rad / size_rad;
                *bend = SectionBend { lift: share * bend.lift, sweep: share * bend.sweep };
            }
        }
    }

    /// Places the joints; returns the sum of the ends' squared errors and the cost of the bends.
    fn pose(&mut self) -> f64 {
        let (mut index, mut last) = (0, (usize::MAX, Posed::default()));
        let joints = &mut self.joints;
        let sections = self.drive.sections();
        let bends = &self.bends;
        self.drive.walk(self.root_m, self.root_rotation, bends, |joint| {
            let share = 1.0 / sections[joint.section].joints as f64;
            let lifted = DQuat::from_rotation_y(-share * bends[joint.section].lift);
            let axes = [joint.before * DVec3::NEG_Y, joint.before * (lifted * DVec3::Z)];
            let mut posed = if last.0 == joint.section { last.1 } else { Posed::default() };
            posed.end = joint.end;
            for (way, axis) in axes.into_iter().enumerate() {
                posed.axes[way] += share * axis;
                posed.moments[way] += share * axis.cross(joint.place);
            }
            joints[index] = posed;
            last = (joint.section, posed);
            index += 1;
        });
        let misses = self.wanted.iter().map(|(links, place)| joints[links - 1].end.distance_squared(*place));
        let bent = self.bends.iter().map(|bend| bend.lift * bend.lift + bend.sweep * bend.sweep);
        misses.sum::<f64>() + self.bend_cost() * bent.sum::<f64>()
    }

    fn bend_cost(&self) -> f64 {
        BEND_COST * self.length_m * self.length_m
    }

    /// The least-squares step of the bends.
    fn system(&self) -> System {
        let sections = self.drive.sections().len();
        let mut system = System::new(2 * sections);
        for (links, place) in &self.wanted {
            let end = self.joints[links - 1].end;
            let miss = (*place - end).to_array();
            let mut rows = [[0.0; ROWS]; 3];
            let mut begin = 0;
            for (section, &last) in self.section_links.iter().enumerate().take(sections) {
                if begin >= *links {
                    break;
                }
                let posed = &self.joints[last.min(*links) - 1];
                for way in 0..2 {
                    let motion = (posed.axes[way].cross(end) - posed.moments[way]).to_array();
                    for (row, value) in rows.iter_mut().zip(motion) {
                        row[2 * section + way] = value;
                    }
                }
                begin = last;
            }
            for (row, miss) in rows.iter().zip(miss) {
                system.add(row, 0, -miss, true);
            }
        }
        let cost = self.bend_cost();
        for (section, bend) in self.bends.iter().enumerate().take(sections) {
            for (way, angle) in [bend.lift, bend.sweep].into_iter().enumerate() {
                system.matrix[2 * section + way][2 * section + way] += cost;
                system.right[2 * section + way] -= cost * angle;
            }
        }
        system
    }
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::model::tendon::Section;

    fn arm() -> (SectionSolver, TendonDrive, Chain) {
        let section = |link_m: f64, cord_turn_rad: f64| Section {
            joints: 4,
            link_m,
            cord_radius_m: 0.012,
            cord_turn_rad,
            gap_m: 0.01,
            spool_radius_m: 0.01,
            bend_max_rad: 1.8,
        };
        let sections = vec![section(0.034, 0.0), section(0.032, 0.5), section(0.03, 1.0)];
        let drive = TendonDrive::new(sections, 0.002, 0.02).unwrap();
        let chain = Chain {
            name: String::new(),
            root_m: DVec3::new(0.1, -0.2, 0.3),
            root_rotation: DQuat::from_scaled_axis(DVec3::new(0.4, -0.9, 0.2)),
            joints: 0..6,
            tendons: Some(drive.clone()),
            foot: None,
        };
        (SectionSolver::new(&drive, &chain), drive, chain)
    }

    fn target(aim: ArmAim, drive: &TendonDrive, chain: &Chain, bends: &[SectionBend]) -> ArmTarget {
        let (mut places, mut direction) = (Vec::new(), DVec3::X);
        drive.walk(chain.root_m, chain.root_rotation, bends, |joint| {
            places.push(joint.end);
            direction = joint.after * DVec3::X;
        });
        ArmTarget {
            aim,
            ends_in_body: [places[3], places[7], places[11]],
            direction_in_body: direction,
            places_in_body: places,
            faced_in_body: None,
            change: 0,
        }
    }

    #[test]
    fn poses_the_arm_can_have_are_found() {
        let (mut solver, drive, chain) = arm();
        let mut source = Pcg64Mcg::seed_from_u64(5);
        let mut draw = move || 2.4 * ((source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
        for index in 0..200 {
            let bends: Vec<_> = (0..3).map(|_| SectionBend { lift: draw(), sweep: draw() }).collect();
            for aim in [ArmAim::Ends, ArmAim::Tip, ArmAim::TipAlong, ArmAim::Places] {
                let target = target(aim, &drive, &chain, &bends);
                let mut winches = [0.0; 6];
                let solution = solver.solve(&target, true, &mut winches);
                let mut found = [SectionBend::default(); 3];
                drive.bends(&winches, &mut found);
                let mut tip = DVec3::ZERO;
                drive.walk(chain.root_m, chain.root_rotation, &found, |joint| tip = joint.end);
                let miss_m = tip.distance(target.ends_in_body[2]);
                assert!(solution.residual_m < 2e-3 * drive.length_m(), "{aim:?} {index}: {solution:?}");
                assert!((miss_m - solution.tip_residual_m).abs() < 1e-9, "the residual is true");
            }
        }
    }

    #[test]
    fn bends_follow_a_path_and_stay_in_their_limits() {
        let (mut solver, drive, chain) = arm();
        let mut winches = [0.0; 6];
        let mut before: Option<[f64; 6]> = None;
        for step in 0..600 {
            let t = 0.01 * f64::from(step);
            let bends: Vec<_> = [1.0, 1.3, 1.9]
                .map(|rate| SectionBend { lift: 1.2 * (rate * t).sin(), sweep: 0.8 * (1.7 * rate * t).sin() })
                .into();
            // Half of the time further away than the arm can reach.
            let mut target = target(ArmAim::Ends, &drive, &chain, &bends);
            if step > 300 {
                target.ends_in_body =
                    target.ends_in_body.map(|end| chain.root_m + 1.2 * (end - chain.root_m));
            }
            let solution = solver.solve(&target, step == 0, &mut winches);
            assert!(step > 300 || solution.residual_m < 2e-3 * drive.length_m(), "{step}: {solution:?}");
            if let Some(before) = before {
                let largest = winches.iter().zip(before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(largest < 0.3 || step == 301, "{step}: a winch turns {largest} rad");
            }
            before = Some(winches);
        }
    }

    #[test]
    fn a_number_that_is_not_finite_changes_nothing() {
        let (mut solver, drive, chain) = arm();
        let mut target = target(ArmAim::Ends, &drive, &chain, &[SectionBend { lift: 0.3, sweep: 0.1 }; 3]);
        target.ends_in_body[0].x = f64::NAN;
        let mut winches = [0.25; 6];
        assert!(solver.solve(&target, true, &mut winches).residual_m.is_infinite());
        assert_eq!(winches.map(f64::to_bits), [0.25; 6].map(f64::to_bits));
    }
}
