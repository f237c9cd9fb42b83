//! One arm as its motions see it: its position, its groups, and its own strokes.

use glam::{DQuat, DVec3};

use super::TentaclePlan;
use super::key_stroke::Part;
use super::progress::RAMP_SHARE;
use super::pseudo_targets::{Turn, places};
use super::variation::Variation;
use super::winding::{Winding, least_radius_m};
use crate::model::tendon::SectionBend;
use crate::model::{ArmGeometry, ArmSettings, GROUPS, Joint, Pole, Robot, TendonDrive};
use crate::signals::{ArmAim, ArmTarget};

/// Largest speed of a tip along a path or after a point, arm lengths per s.
pub(super) const TIP_LENGTHS_S: f64 = 0.5;

/// Share of its joints' speed and acceleration limits that winding may use.
const WIND_SHARE: f64 = 0.5;
/// Fastest bend of a joint while an arm winds, in v / R, and its largest acceleration, in v^2 / (R l), for
/// links of length l.
const BEND_PEAK: f64 = 2.0;
const BEND_GAIN_PEAK: f64 = 8.0;

/// One arm.
#[derive(Debug, Clone)]
pub(super) struct ArmPlan {
    pub(super) chain: usize,
    pub(super) root_m: DVec3,
    root_rotation: DQuat,
    group_lengths_m: [f64; GROUPS],
    links_m: Vec<f64>,
    /// The tendon drive that bends it; `None` if each joint has its own servo.
    tendons: Option<TendonDrive>,
    /// The least radius it can bend to, m.
    least_radius_m: f64,
    pub(super) radius_m: f64,
    /// Its role among its neighbours, and its own random numbers, from the first on.
    pub(super) part: Part,
    pub(super) variation: Variation,
    /// Largest bending speed of its slowest joint while it winds, rad/s, and acceleration, rad/s^2.
    bend_rad_s: f64,
    bend_rad_s2: f64,
    /// Ends of its groups in the parked pose, body frame, m.
    pub(super) parked_in_body: [DVec3; GROUPS],
    /// The hinges of its outer two groups.
    pub(super) outer_hinges: std::ops::Range<usize>,
}

impl ArmPlan {
    /// The arm with this index and these settings; `None` if its chain is not an arm, which no robot file permits.
    pub(super) fn new(
        robot: &Robot,
        plan: &TentaclePlan,
        index: usize,
        arm: &ArmSettings,
    ) -> Option<ArmPlan> {
        let settings = &plan.settings;
        let chain = &robot.chains[arm.chain];
        let geometry = ArmGeometry::of(chain, robot.joints_of(chain)).ok()?;
        let angles = plan.park_pose_rad[chain.joints.clone()].iter().copied();
        let ends = robot.places_in_body(chain, angles);
        let part =
            Part { role: arm.role, is_right: chain.root_m.y < 0.0, walk_plane_rad: arm.stroke_plane_rad };
        let first_outer =
            geometry.joints.get(geometry.joints_to_end(0)).map_or(0, |joint| joint.hinges.start);
        let joints = robot.joints_of(chain);
        let no_load_rad_s = joints.iter().map(Joint::no_load_speed_rad_s).fold(f64::INFINITY, f64::min);
        // For each radian of a section's bend a winch turns by the ratio of the cord's lever to the spool's.
        let levers = chain.tendons.iter().flat_map(TendonDrive::sections);
        let gear = levers.map(|section| section.spool_radius_m / section.cord_radius_m).fold(1.0, f64::min);
        Some(ArmPlan {
            bend_rad_s: WIND_SHARE * robot.safety.rate_share * no_load_rad_s * gear,
            bend_rad_s2: WIND_SHARE * robot.safety.acceleration_rad_s2 * gear,
            chain: arm.chain,
            root_m: chain.root_m,
            root_rotation: chain.root_rotation,
            group_lengths_m: geometry.group_lengths_m(),
            links_m: geometry.joints.iter().map(|joint| joint.link_m).collect(),
            tendons: chain.tendons.clone(),
            least_radius_m: least_radius_m(chain.tendons.as_ref(), &geometry.joints, joints),
            radius_m: arm.radius_m,
            part,
            variation: Variation::new(settings.seed, index, settings.variation_rad),
            parked_in_body: std::array::from_fn(|group| {
                let joints = geometry.joints_to_end(group);
                // A link ends after its joint's last hinge; on tendons there are no hinges between.
                let hinges = geometry.joints[joints - 1].hinges.end;
                ends[if chain.tendons.is_some() { joints } else { hinges }]
            }),
            outer_hinges: chain.joints.start + first_outer..chain.joints.end,
        })
    }

    /// Length of the whole arm, m.
    pub(super) fn length_m(&self) -> f64 {
        self.group_lengths_m.iter().sum()
    }

    /// Lengths of its links from root to tip, m.
    pub(super) fn links_m(&self) -> impl Iterator<Item = f64> + Clone {
        self.links_m.iter().copied()
    }

    /// A point of the arm's own frame, m, in the body frame.
    pub(super) fn to_body(&self, in_arm: DVec3) -> DVec3 {
        self.root_m + self.root_rotation * in_arm
    }

    /// Aims the ends of its groups at pseudo-targets with these turns.
    pub(super) fn write_turns(&self, turns: [Turn; GROUPS], target: &mut ArmTarget) {
        target.ends_in_body = match &self.tendons {
            Some(drive) => self.section_ends_in_body(drive, turns),
            None => places(self.group_lengths_m, turns).map(|place| self.to_body(place)),
        };
    }

    /// Ends of the sections of an arm on tendons that bend by these turns: each section by its pseudo-target's
    /// turn, limited to its largest bend. Two bends per section can bring its end only to points on arcs: the
    /// thesis' spacings, meant for arms with a joint's kink between two groups, would be missed by half an arm.
    fn section_ends_in_body(&self, drive: &TendonDrive, turns: [Turn; GROUPS]) -> [DVec3; GROUPS] {
        let mut bends = [SectionBend::default(); GROUPS];
        for ((bend, section), turn) in bends.iter_mut().zip(drive.sections()).zip(turns) {
            let wanted = turn.angle() / section.bend_max_rad;
            let share = if wanted > 0.0 { wanted.tanh() / wanted } else { 1.0 };
            *bend = SectionBend { lift: share * turn.lift, sweep: share * turn.sweep };
        }
        let mut ends = [DVec3::ZERO; GROUPS];
        drive.walk(self.root_m, self.root_rotation, &bends, |joint| ends[joint.section] = joint.end);
        ends
    }

    /// Share of the arm that would lie on `pole`; `None` if it cannot wind round it.
    pub(super) fn contact_share(&self, pole: Pole) -> Option<f64> {
        let winding = self.winding(pole, 0.0)?.not_tighter_than(self.least_radius_m).ok()?;
        Some(winding.contact_share())
    }

    fn winding(&self, pole: Pole, squeeze_m: f64) -> Option<Winding> {
        let ahead = self.root_rotation * DVec3::X;
        Winding::new(self.root_m, ahead, self.links_m(), self.radius_m, pole, squeeze_m).ok()
    }

    /// Shortest time, s, in which it can wind round `pole` within its joints' limits. If the wound part of an
    /// arm grows at v on a radius R, each joint in turn bends by a link's share of the turn while v covers a
    /// link's length: it bends at v / R, and reaches that speed within a part of that time.
    pub(super) fn wind_time_s(&self, pole: Pole) -> f64 {
        let Some(winding) = self.winding(pole, 0.0) else { return 0.0 };
        let radius_m = winding.radius_m();
        let link_m = self.links_m().fold(f64::INFINITY, f64::min);
        let by_speed_m_s = self.bend_rad_s * radius_m / BEND_PEAK;
        let by_acceleration_m_s = (self.bend_rad_s2 * radius_m * link_m / BEND_GAIN_PEAK).sqrt();
        winding.length_m() / ((1.0 - RAMP_SHARE) * by_speed_m_s.min(by_acceleration_m_s))
    }

    /// Lays its links along and round the pole, with the share `wound` (0 to 1) of what can be wound.
    pub(super) fn write_winding(&self, pole: Pole, wound: f64, squeeze_m: f64, target: &mut ArmTarget) {
        let Some(winding) = self.winding(pole, squeeze_m) else { return };
        target.aim = ArmAim::Places;
        target.faced_in_body = Some([pole.point_in_body, pole.axis]);
        winding.write(wound * winding.length_m(), self.links_m(), &mut target.places_in_body);
    }
}

/// Index of the arm whose root is nearest to `place`, body frame, m.
pub(super) fn nearest(arms: &[ArmPlan], place: DVec3) -> usize {
    let distance = |arm: &ArmPlan| arm.root_m.distance(place);
    let nearest = arms.iter().enumerate().min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
    nearest.map_or(0, |(index, _)| index)
}
