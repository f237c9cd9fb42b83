//! Tendon drives: arms whose sections are bent by cords on winches instead of by a servo in every joint.
//!
//! A section is a row of joints that share one bend and its direction. Four cords run along it, two above and
//! below for lift and two to the left and right for sweep, through holes in plates on either side of each
//! joint, and end at the section's last plate. A winch pulls one cord of a pair in by as much as it lets the
//! other out. Cords to farther sections run through the nearer ones, so the nearer bends change their
//! lengths, too; this module compensates that.
//!
//! Input: bends. Output: turns of the winches, and back, and how slack the cords are. All in the arm's frame:
//! lift is positive up, sweep to the left.

use glam::{DQuat, DVec3};
use thiserror::Error;

use super::GROUPS;

/// Largest number of iterations to find a section's bend from its winches.
const NEWTON_STEPS: u32 = 8;
/// A bend found from winches is limited to this multiple of its section's largest.
const MOST_SHARE: f64 = 2.0;
/// Step of the numerical derivative, rad.
const DERIVATIVE_STEP_RAD: f64 = 1e-6;

/// Bend of a section: the sum over its joints, rad.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SectionBend {
    /// Up.
    pub lift: f64,
    /// To the left.
    pub sweep: f64,
}

impl SectionBend {
    /// The bend in the same direction, limited to `most_rad`.
    fn within(self, most_rad: f64) -> SectionBend {
        let share = (most_rad / self.lift.hypot(self.sweep)).min(1.0);
        SectionBend { lift: share * self.lift, sweep: share * self.sweep }
    }
}

/// A row of joints that bend together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Number of joints.
    pub joints: usize,
    /// Length of the link after each joint, m.
    pub link_m: f64,
    /// Distance of its own cords from the middle of the arm, m.
    pub cord_radius_m: f64,
    /// Rotation of its cords about the arm, so that they pass between those of other sections: the first cord
    /// is this far from up towards the right, rad.
    pub cord_turn_rad: f64,
    /// Distance between the plates on either side of a joint, m.
    pub gap_m: f64,
    /// Radius of its winches' spools, to the middle of the cord, m.
    pub spool_radius_m: f64,
    /// Largest bend in one direction, rad.
    pub bend_max_rad: f64,
}

impl Section {
    /// Rotation of each of its joints at this bend: lift, then sweep, in equal shares.
    fn joint_turn(&self, bend: SectionBend) -> DQuat {
        let share = 1.0 / self.joints as f64;
        DQuat::from_rotation_y(-share * bend.lift) * DQuat::from_rotation_z(share * bend.sweep)
    }
}

/// A joint of a bent arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TendonJoint {
    /// Its section.
    pub section: usize,
    /// Its position, m.
    pub place: DVec3,
    /// Orientation of the link before it.
    pub before: DQuat,
    /// End of its link, m.
    pub end: DVec3,
    /// Orientation of its link.
    pub after: DQuat,
}

/// The drive of one arm, root section first.
#[derive(Debug, Clone, PartialEq)]
pub struct TendonDrive {
    sections: Vec<Section>,
    /// Stretch of each cord when the arm is straight, m.
    pretension_m: f64,
}

/// Reasons why a drive cannot work.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum TendonError {
    /// Wrong number of sections.
    #[error("an arm on tendons has {GROUPS} sections, not {0}")]
    Sections(usize),
    /// An invalid length.
    #[error("section {0}: joints, links, radii and gaps are above 0, and a gap is at most a link long")]
    Size(usize),
    /// Cords that would hang loose.
    #[error(
        "section {section}: bent by {bend_deg:.0} degrees, its cords would be {slack_mm:.2} mm slack beyond the \
         pretension of {pretension_mm:.2} mm, and {limit_mm:.2} mm are allowed: allow less bend or more pretension"
    )]
    Slack {
        /// The section, counted from 0 at the root.
        section: usize,
        /// Its largest bend, degrees.
        bend_deg: f64,
        /// Its slack, mm.
        slack_mm: f64,
        /// Stretch of the cords, mm.
        pretension_mm: f64,
        /// Permitted slack, mm.
        limit_mm: f64,
    },
}

impl TendonDrive {
    /// The drive of these sections, root first. The cords are stretched by `pretension_m` when the arm is
    /// straight and may nowhere be slack by more than `slack_max_m` when each section is at its largest bend,
    /// all the same way.
    pub fn new(
        sections: Vec<Section>,
        pretension_m: f64,
        slack_max_m: f64,
    ) -> Result<TendonDrive, TendonError> {
        if sections.len() != GROUPS {
            return Err(TendonError::Sections(sections.len()));
        }
        for (index, section) in sections.iter().enumerate() {
            let lengths = [
                section.link_m,
                section.cord_radius_m,
                section.gap_m,
                section.spool_radius_m,
                section.bend_max_rad,
            ];
            let are_good = lengths.iter().all(|length| *length > 0.0 && length.is_finite());
            if section.joints == 0 || !are_good || section.gap_m > section.link_m {
                return Err(TendonError::Size(index));
            }
        }
        let drive = TendonDrive { sections, pretension_m };
        let bent: Vec<SectionBend> = drive
            .sections
            .iter()
            .map(|section| SectionBend { lift: section.bend_max_rad, sweep: 0.0 })
            .collect();
        for section in 0..drive.sections.len() {
            let slack_m = drive.slack_m(section, &bent);
            if slack_m > slack_max_m {
                return Err(TendonError::Slack {
                    section,
                    bend_deg: drive.sections[section].bend_max_rad.to_degrees(),
                    slack_mm: 1e3 * slack_m,
                    pretension_mm: 1e3 * pretension_m,
                    limit_mm: 1e3 * slack_max_m,
                });
            }
        }
        Ok(drive)
    }

    /// The sections, root first.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Number of links in all sections.
    pub fn links(&self) -> usize {
        self.sections.iter().map(|section| section.joints).sum()
    }

    /// Length of the straight arm, m.
    pub fn length_m(&self) -> f64 {
        self.sections.iter().map(|section| section.joints as f64 * section.link_m).sum()
    }

    /// Writes the turns of the winches, rad, two a section, lift before sweep; positive pulls the upper or the left
    /// cord in.
    pub fn winches_rad(&self, bends: &[SectionBend], winches: &mut [f64]) {
        for (section, pair) in winches.chunks_mut(2).enumerate().take(self.sections.len()) {
            pair.copy_from_slice(&self.pair_rad(section, bends));
        }
    }

    /// Writes the bends that these turns of the winches (rad) make: first the root section's, then the next
    /// one's, whose cords the root's bend changes, and so on. If no bend matches, as a limp winch may stand,
    /// it writes one that is close.
    pub fn bends(&self, winches: &[f64], bends: &mut [SectionBend]) {
        for (section, pair) in winches.chunks(2).enumerate().take(self.sections.len()) {
            let Section { cord_radius_m, spool_radius_m, cord_turn_rad, .. } = self.sections[section];
            bends[section] = SectionBend::default();
            let own = if section > 0 { self.pair_rad(section, bends) } else { [0.0; 2] };
            // Close enough to a circular arc to start from.
            let ratio = spool_radius_m / cord_radius_m;
            let (sine, cosine) = cord_turn_rad.sin_cos();
            let (up, left) = (ratio * (pair[0] - own[0]), ratio * (pair[1] - own[1]));
            let most_rad = MOST_SHARE * self.sections[section].bend_max_rad;
            bends[section] =
                SectionBend { lift: up * cosine + left * sine, sweep: left * cosine - up * sine }
                    .within(most_rad);
            for _ in 0..NEWTON_STEPS {
                let SectionBend { lift, sweep } = bends[section];
                let now = self.pair_rad(section, bends);
                bends[section].lift = lift + DERIVATIVE_STEP_RAD;
                let by_lift = self.pair_rad(section, bends);
                bends[section] = SectionBend { lift, sweep: sweep + DERIVATIVE_STEP_RAD };
                let by_sweep = self.pair_rad(section, bends);
                let slope = |of: [f64; 2], row: usize| (of[row] - now[row]) / DERIVATIVE_STEP_RAD;
                let [a, b, c, d] =
                    [slope(by_lift, 0), slope(by_sweep, 0), slope(by_lift, 1), slope(by_sweep, 1)];
                let (miss_up, miss_left) = (pair[0] - now[0], pair[1] - now[1]);
                let scale = 1.0 / (a * d - b * c);
                let next = SectionBend {
                    lift: lift + scale * (d * miss_up - b * miss_left),
                    sweep: sweep + scale * (a * miss_left - c * miss_up),
                };
                // Stop if the step is not finite.
                let has_next = next.lift.is_finite() && next.sweep.is_finite();
                bends[section] = if has_next { next.within(most_rad) } else { SectionBend { lift, sweep } };
                if !has_next {
                    break;
                }
                if miss_up.abs() + miss_left.abs() < 1e-12 {
                    break;
                }
            }
        }
    }

    /// Calls `visit` for each joint, root first, with its position, the orientation of the link before it,
    /// and the end and orientation of its own link. The arm starts at `root`, on a base rotated by
    /// `rotation`. Returns the tip.
    pub fn walk(
        &self,
        root: DVec3,
        rotation: DQuat,
        bends: &[SectionBend],
        mut visit: impl FnMut(TendonJoint),
    ) -> DVec3 {
        let (mut place, mut before) = (root, rotation);
        for (index, (section, bend)) in self.sections.iter().zip(bends).enumerate() {
            let turn = section.joint_turn(*bend);
            for _ in 0..section.joints {
                let after = before * turn;
                let end = place + after * DVec3::X * section.link_m;
                visit(TendonJoint { section: index, place, before, end, after });
                (place, before) = (end, after);
            }
        }
        place
    }

    /// Slack of the slackest of the four cords of `section`, beyond their stretch, m; negative if all are
    /// taut. Both cords of a pair are slack together: the winch lets one out by as much as it pulls the other
    /// in, and both need less where plates tilt.
    pub fn slack_m(&self, section: usize, bends: &[SectionBend]) -> f64 {
        let pairs = [0, 1].map(|pair| {
            let [near, far] = self.changes_m(section, pair, bends);
            -0.5 * (near + far)
        });
        pairs[0].max(pairs[1]) - self.pretension_m
    }

    /// Turns of the two winches of `section`, rad.
    fn pair_rad(&self, section: usize, bends: &[SectionBend]) -> [f64; 2] {
        [0, 1].map(|pair| {
            let [near, far] = self.changes_m(section, pair, bends);
            0.5 * (far - near) / self.sections[section].spool_radius_m
        })
    }

    /// Extra length that the two cords of a pair of `section` need compared with the straight arm, m: lift,
    /// upper first, or sweep, left first.
    fn changes_m(&self, section: usize, pair: usize, bends: &[SectionBend]) -> [f64; 2] {
        let Section { cord_radius_m, cord_turn_rad, .. } = self.sections[section];
        let (sine, cosine) = cord_turn_rad.sin_cos();
        let (up, left) =
            (DVec3::new(0.0, -sine, cosine) * cord_radius_m, DVec3::new(0.0, cosine, sine) * cord_radius_m);
        let hole = if pair == 0 { up } else { left };
        let mut changes_m = [0.0; 2];
        for (nearer, bend) in self.sections[..=section].iter().zip(bends) {
            let turn = nearer.joint_turn(*bend);
            for (change_m, hole) in changes_m.iter_mut().zip([hole, -hole]) {
                let half = DVec3::X * 0.5 * nearer.gap_m;
                let length_m = (turn * (hole + half)).distance(hole - half);
                *change_m += nearer.joints as f64 * (length_m - nearer.gap_m);
            }
        }
        changes_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section(cord_turn_rad: f64) -> Section {
        Section {
            joints: 4,
            link_m: 0.03,
            cord_radius_m: 0.012,
            cord_turn_rad,
            gap_m: 0.012,
            spool_radius_m: 0.01,
            bend_max_rad: 1.6,
        }
    }

    fn drive() -> TendonDrive {
        TendonDrive::new(vec![section(0.0), section(0.5), section(1.0)], 0.002, 0.02).unwrap()
    }

    #[test]
    fn a_small_bend_pulls_a_cord_by_radius_times_bend() {
        let drive = drive();
        let mut winches = [0.0; 6];
        let up = SectionBend { lift: 1e-4, sweep: 0.0 };
        drive.winches_rad(&[up, SectionBend::default(), SectionBend::default()], &mut winches);
        // 0.012 m of lever on a spool of 0.01 m; for the farther cords, at 0.5 and 1 rad from up, the cosine
        // applies.
        for (winch, wanted) in winches.iter().zip([
            1.2e-4,
            0.0,
            1.2e-4 * 0.5_f64.cos(),
            1.2e-4 * 0.5_f64.sin(),
            1.2e-4 * 1.0_f64.cos(),
            1.2e-4 * 1.0_f64.sin(),
        ]) {
            assert!((winch - wanted).abs() < 1e-9, "{winches:?}");
        }
        drive.winches_rad(&[SectionBend { lift: 0.0, sweep: 1e-4 }; 1].repeat(3), &mut winches);
        assert!((winches[1] - 1.2e-4).abs() < 1e-9 && winches[0].abs() < 1e-9, "{winches:?}");
    }

    #[test]
    fn an_upright_bend_shortens_the_upper_cord_by_chords_across_the_plates() {
        // One joint between plates of gap g, bent by a: the cord at radius r is g cos(a/2) - 2 r sin(a/2) long.
        let drive = TendonDrive::new(vec![Section { joints: 1, ..section(0.0) }; 3], 0.0, 0.02).unwrap();
        let (gap_m, radius_m, bend) = (0.012, 0.012, 0.7_f64);
        let [upper, lower] = drive.changes_m(0, 0, &[SectionBend { lift: bend, sweep: 0.0 }]);
        let (sine, cosine) = (0.5 * bend).sin_cos();
        assert!((upper - (gap_m * cosine - 2.0 * radius_m * sine - gap_m)).abs() < 1e-12);
        assert!((lower - (gap_m * cosine + 2.0 * radius_m * sine - gap_m)).abs() < 1e-12);
        let slack_m = drive.slack_m(0, &[SectionBend { lift: bend, sweep: 0.0 }]);
        assert!((slack_m - gap_m * (1.0 - cosine)).abs() < 1e-12);
    }

    #[test]
    fn bends_come_back_from_the_winches_whatever_nearer_sections_do() {
        let drive = drive();
        let value = |step: u32, by: f64| 1.1 * (by * f64::from(step)).sin();
        for step in 0..500 {
            let bends = [(0.71, 1.3), (2.1, 0.37), (1.7, 3.3)]
                .map(|(lift, sweep)| SectionBend { lift: value(step, lift), sweep: value(step, sweep) });
            let (mut winches, mut again) = ([0.0; 6], [SectionBend::default(); 3]);
            drive.winches_rad(&bends, &mut winches);
            drive.bends(&winches, &mut again);
            for (bend, back) in bends.iter().zip(again) {
                assert!((bend.lift - back.lift).abs() < 1e-9, "{bends:?} became {again:?}");
                assert!((bend.sweep - back.sweep).abs() < 1e-9, "{bends:?} became {again:?}");
            }
        }
    }

    /// A limp winch may stand at an angle that no bend of the cords matches.
    #[test]
    fn impossible_winch_angles_still_give_a_bend() {
        let drive = drive();
        let mut bends = [SectionBend::default(); 3];
        for step in 0..20_000 {
            let winches: [f64; 6] =
                std::array::from_fn(|winch| 12.0 * (f64::from(step) * (0.37 + 0.71 * winch as f64)).sin());
            drive.bends(&winches, &mut bends);
            for (bend, section) in bends.iter().zip(drive.sections()) {
                let size_rad = bend.lift.hypot(bend.sweep);
                assert!(
                    size_rad <= MOST_SHARE * section.bend_max_rad * (1.0 + 1e-9),
                    "{winches:?}: {bends:?}"
                );
            }
        }
        drive.bends(&[f64::NAN; 6], &mut bends);
        drive.bends(&[0.1; 6], &mut bends);
        assert!(bends.iter().all(|bend| bend.lift.is_finite()), "what was no number is forgotten");
    }

    #[test]
    fn a_bend_of_a_nearer_section_does_not_change_a_farther_one() {
        let drive = drive();
        let far = SectionBend { lift: 0.5, sweep: -0.3 };
        let of = |near: SectionBend| {
            let (mut winches, mut bends) = ([0.0; 6], [SectionBend::default(); 3]);
            drive.winches_rad(&[near, SectionBend::default(), far], &mut winches);
            drive.bends(&winches, &mut bends);
            (winches, bends[2])
        };
        let (straight, _) = of(SectionBend::default());
        let (bent, still) = of(SectionBend { lift: 1.0, sweep: 0.4 });
        assert!((still.lift - far.lift).abs() < 1e-9 && (still.sweep - far.sweep).abs() < 1e-9);
        assert!((straight[5] - bent[5]).abs() > 1.0, "its winches make up for it: {straight:?}, {bent:?}");
    }

    #[test]
    fn slack_beyond_the_limit_is_refused() {
        let slack = TendonDrive::new(vec![section(0.0); 3], 0.0, 1e-4);
        assert!(matches!(slack, Err(TendonError::Slack { section: 0, .. })), "{slack:?}");
        // The third section's cords run through all twelve joints.
        let slack = TendonDrive::new(vec![section(0.0); 3], 0.002, 1e-4);
        assert!(matches!(slack, Err(TendonError::Slack { section: 2, .. })), "{slack:?}");
        assert!(TendonDrive::new(vec![section(0.0); 3], 0.004, 1e-4).is_ok());
        let none = Section { gap_m: 0.0, ..section(0.0) };
        assert_eq!(TendonDrive::new(vec![none; 3], 0.0, 1.0), Err(TendonError::Size(0)));
        assert_eq!(TendonDrive::new(vec![section(0.0)], 0.0, 1.0), Err(TendonError::Sections(1)));
    }
}
