//! `[[chain]]` and `[[chain.joint]]`: the limbs; and those that [`super::arms`] reads.

use glam::{DQuat, DVec3};

use super::number::Limits;
use super::reader::Section;
use super::servos::ServoPlaces;
use super::unique::Unique;
use super::{arms, ball, meters, physics};
use crate::model::{ArmSettings, Chain, Foot, Joint, TendonDrive, hinges_in_place, is_ball_joint};

/// How far from 1 the length of an axis may be; within, it is made exactly 1.
const AXIS_TOLERANCE: f64 = 1e-3;

/// A last link shorter than this has no direction worth the name.
const LINK_SHORTEST_MM: f64 = 1e-6;

/// Roots nearer to each other than this are one place: two servos do not fit.
const ROOTS_APART_MM: f64 = 1.0;

/// Most chains, and most joints of one: what is worked out of a robot when it loads grows with the square of its joints.
const CHAINS_MAX: usize = 32;
const JOINTS_MAX: usize = 32;

/// What could be read of a chain; `limb` only if all of it was good.
pub(super) struct ChainEntry<'a> {
    /// Key path of its table.
    pub(super) key: String,
    pub(super) name: Option<&'a str>,
    pub(super) limb: Option<Limb>,
    /// Settings of an arm, which is a chain too, if all of them were good.
    pub(super) arm: Option<ArmSettings>,
}

/// A chain with its joints.
pub(super) struct Limb {
    name: String,
    root_m: DVec3,
    root_rotation: DQuat,
    joints: Vec<Joint>,
    tendons: Option<TendonDrive>,
    foot: Option<Foot>,
}

impl Limb {
    pub(super) fn new(
        name: &str,
        root_m: DVec3,
        root_rotation: DQuat,
        joints: Vec<Joint>,
        tendons: Option<TendonDrive>,
    ) -> Limb {
        Limb { name: name.to_owned(), root_m, root_rotation, joints, tendons, foot: None }
    }

    /// True if no servo turns its joints.
    pub(super) fn is_on_paper(&self) -> bool {
        self.joints.iter().all(|joint| joint.servo.is_none())
    }

    pub(super) fn has_tendons(&self) -> bool {
        self.tendons.is_some()
    }

    pub(super) fn has_foot(&self) -> bool {
        self.foot.is_some()
    }

    pub(super) fn joints(&self) -> &[Joint] {
        &self.joints
    }
}

/// Reads all chains and then all arms, in file order.
pub(super) fn read<'a>(file: &Section<'a>, servos: &mut ServoPlaces<'_>) -> Vec<ChainEntry<'a>> {
    let mut names = Unique::default();
    let mut roots = Roots::default();
    let mut place = 0;
    let chains = file.list("chain", "the limbs", CHAINS_MAX, |section| {
        place += 1;
        Some(read_chain(section, place - 1, &mut names, &mut roots, servos))
    });
    let arms = arms::read(file, &mut names, &mut roots, servos);
    if chains.is_empty() && arms.is_empty() {
        file.fault("chain", "at least one limb, [[chain]], or arm, [[arm]]");
    }
    if chains.iter().any(Option::is_none) {
        // A list that is none at all: what refers to it cannot be judged.
        return vec![ChainEntry { key: "chain".to_owned(), name: None, limb: None, arm: None }];
    }
    chains.into_iter().flatten().chain(arms).collect()
}

/// The roots seen so far, with their lines.
#[derive(Default)]
pub(super) struct Roots {
    seen: Vec<(DVec3, usize)>,
}

impl Roots {
    /// Two limbs cannot both begin in one place: the second is a copy whose root was forgotten.
    pub(super) fn refuse_twin(&mut self, section: &Section<'_>, root_mm: DVec3) {
        if let Some((_, line)) = self.seen.iter().find(|(seen, _)| seen.distance(root_mm) < ROOTS_APART_MM) {
            section
                .fault("root_mm", format!("a place of its own: by line {line} another chain begins there"));
        }
        self.seen.push((root_mm, section.line("root_mm")));
    }
}

/// What a limb of either kind begins with: its name, and where and how it stands in the body, in mm and degrees.
pub(super) struct Root<'a> {
    pub(super) name: Option<&'a str>,
    pub(super) root: Option<DVec3>,
    pub(super) rpy: Option<DVec3>,
}

impl<'a> Root<'a> {
    pub(super) fn read(
        section: &Section<'a>,
        name_meaning: &str,
        rpy_meaning: &str,
        names: &mut Unique<'a>,
        roots: &mut Roots,
    ) -> Root<'a> {
        let name = names.name(section, name_meaning);
        let root = section.vector("root_mm", "the place of the first joint in the body, in mm");
        if let Some(root_mm) = root {
            roots.refuse_twin(section, root_mm);
        }
        let rpy = section.vector_or("root_rpy_deg", rpy_meaning, DVec3::ZERO);
        Root { name, root, rpy }
    }
}

fn read_chain<'a>(
    section: &Section<'a>,
    place: usize,
    names: &mut Unique<'a>,
    roots: &mut Roots,
    servos: &mut ServoPlaces<'_>,
) -> ChainEntry<'a> {
    let meaning = "roll, pitch and yaw of the chain in the body, in degrees";
    let Root { name, root, rpy } = Root::read(section, "the chain's name", meaning, names, roots);

    let mut joint_names = Unique::default();
    let mut end = None;
    let joints = section.list("joint", "the chain's joints", JOINTS_MAX, |joint| {
        let link = joint.vector("link_mm", "the way to the next joint, or to the tip, in mm");
        end = link;
        read_joint(joint, name, link, &mut joint_names, servos)
    });
    if joints.is_empty() {
        section.fault("joint", "at least one joint, [[chain.joint]]");
    }
    if end.is_some_and(|link| link.length() < LINK_SHORTEST_MM) {
        let last = joints.len() - 1;
        section.fault(
            &format!("joint[{last}].link_mm"),
            "a length above 0: the last link ends in the tip; only links before it may be zero",
        );
    }

    let joints: Option<Vec<Joint>> = joints.into_iter().collect();
    if let Some(joints) = &joints {
        refuse_balls_of_other_hinges(section, joints);
    }
    let foot = physics::read_foot(section);
    let limb = || {
        let limb = Limb::new(name?, meters(root?), rotation(rpy?), joints?, None);
        Some(Limb { foot: foot?, ..limb })
    };
    ChainEntry { key: format!("chain[{place}]"), name, limb: limb(), arm: None }
}

/// Roll about x, then pitch about y, then yaw about z, degrees, all axes fixed (REP-103).
pub(super) fn rotation(rpy_deg: DVec3) -> DQuat {
    let rpy_rad = rpy_deg.map(f64::to_radians);
    DQuat::from_rotation_z(rpy_rad.z) * DQuat::from_rotation_y(rpy_rad.y) * DQuat::from_rotation_x(rpy_rad.x)
}

fn read_joint<'a>(
    section: &Section<'a>,
    chain: Option<&str>,
    link: Option<DVec3>,
    names: &mut Unique<'a>,
    servos: &mut ServoPlaces<'_>,
) -> Option<Joint> {
    let name = names.name(section, "the joint's name");
    let axis = read_axis(section);
    let range_rad = read_range(section, "range_deg");
    let stiffness =
        section.number("stiffness", "the joint's share of each turn", Limits::AboveToMost(0.0, 1.0));
    let mass_kg = section.number("mass_kg", "the link's mass in kg", Limits::MASS_OR_NONE);
    let meaning = "the centre of the link's mass, from the joint, in mm";
    section.describe_default("center_mm", "", "the middle of the link");
    let center = section.vector_or("center_mm", meaning, link.unwrap_or_default() / 2.0);
    let servo = servos.read(section, range_rad);
    let ball = ball::read(section);
    Some(Joint {
        name: format!("{}.{}", chain?, name?),
        axis: axis?,
        link_m: meters(link?),
        range_rad: range_rad?,
        stiffness: stiffness?,
        mass_kg: mass_kg?,
        center_m: meters(center?),
        ball: ball?,
        servo: servo?,
    })
}

/// The range of a ball joint is that of hinges which make one.
fn refuse_balls_of_other_hinges(section: &Section<'_>, joints: &[Joint]) {
    for (place, _) in joints.iter().enumerate().filter(|(_, joint)| joint.ball.is_some()) {
        if !is_ball_joint(&joints[hinges_in_place(joints, place)]) {
            section.fault(
                &format!("joint[{place}].ball"),
                "no such key but on the last of two or three hinges in one place (link_mm = [0, 0, 0] of the others), of \
                 which the first turn about y and z, or z and y, and a third, if any, about x, the limb's own direction",
            );
        }
    }
}

fn read_axis(section: &Section<'_>) -> Option<DVec3> {
    let axis = section.vector("axis", "the turning axis in the parent link's frame")?;
    if (axis.length() - 1.0).abs() <= AXIS_TOLERANCE {
        return Some(axis.normalize());
    }
    let advice = match axis.try_normalize() {
        Some(unit) => {
            format!("this direction is [{:.6}, {:.6}, {:.6}]", unit.x, unit.y, unit.z)
        }
        None => "a hinge from side to side is [0, 1, 0]".to_owned(),
    };
    section.fault("axis", format!("a unit vector, length 1, not {:.4}; {advice}", axis.length()));
    None
}

/// A range of angles, rad, at a key in degrees.
pub(super) fn read_range(section: &Section<'_>, key: &'static str) -> Option<(f64, f64)> {
    let [low, high] =
        section.numbers::<2>(key, "the joint's lowest and highest angle in degrees", Limits::ANGLE)?;
    if low >= high {
        section.fault(key, "the lowest angle first, then a higher one, [min, max]");
        return None;
    }
    if high - low > 360.0 {
        section.fault(key, "at most a turn, 360 degrees, from end to end");
        return None;
    }
    Some((low.to_radians(), high.to_radians()))
}

/// Puts the limbs in the shape of the robot: chains, and one list of all joints.
pub(super) fn assemble(limbs: Vec<Limb>) -> (Vec<Chain>, Vec<Joint>) {
    let mut joints = Vec::new();
    let mut chains = Vec::new();
    for limb in limbs {
        let first = joints.len();
        joints.extend(limb.joints);
        let Limb { name, root_m, root_rotation, tendons, foot, .. } = limb;
        chains.push(Chain { name, root_m, root_rotation, joints: first..joints.len(), tendons, foot });
    }
    (chains, joints)
}
