//! What chains, arms and references to them have in common: a limb as far as it could be read.

use glam::{DQuat, DVec3};

use super::number::Limits;
use super::reader::Section;
use super::unique::Unique;
use crate::model::{ArmSettings, Chain, Foot, Joint, TendonDrive};

/// Roots closer together than this are in one place: two servos do not fit there.
const ROOTS_APART_MM: f64 = 1.0;

/// A chain as far as it could be read; `limb` is set only if all of it was good.
pub(super) struct ChainEntry<'a> {
    /// Key path of its table.
    pub(super) key: String,
    pub(super) name: Option<&'a str>,
    pub(super) limb: Option<Limb>,
    /// Settings of an arm (an arm is a chain too), if all of them were good.
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

    /// The same limb with this foot at its end.
    pub(super) fn with_foot(self, foot: Option<Foot>) -> Limb {
        Limb { foot, ..self }
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

/// The joints of an arm, and its tendons if it has them.
pub(super) type ArmJoints = (Vec<Joint>, Option<TendonDrive>);

/// The roots seen so far, with their lines.
#[derive(Default)]
pub(super) struct Roots {
    seen: Vec<(DVec3, usize)>,
}

impl Roots {
    /// Refuses two limbs with the same root: the second is usually a copy whose root was not changed.
    pub(super) fn refuse_twin(&mut self, section: &Section<'_>, root_mm: DVec3) {
        if let Some((_, line)) = self.seen.iter().find(|(seen, _)| seen.distance(root_mm) < ROOTS_APART_MM) {
            section
                .fault("root_mm", format!("a place of its own: by line {line} another chain begins there"));
        }
        self.seen.push((root_mm, section.line("root_mm")));
    }
}

/// The common start of every limb: its name, and its position and orientation in the body, in mm and degrees.
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

/// Roll about x, then pitch about y, then yaw about z, degrees, all axes fixed (REP-103).
pub(super) fn rotation(rpy_deg: DVec3) -> DQuat {
    let rpy_rad = rpy_deg.map(f64::to_radians);
    DQuat::from_rotation_z(rpy_rad.z) * DQuat::from_rotation_y(rpy_rad.y) * DQuat::from_rotation_x(rpy_rad.x)
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

/// Converts the limbs to the robot's form: chains, and one list of all joints.
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
