//! `[[chain]]` and `[[chain.joint]]`: the limbs; and the limbs that [`super::arms`] reads.

use glam::DVec3;

use super::limb::{ChainEntry, Limb, Root, Roots, read_range, rotation};
use super::number::Limits;
use super::reader::Section;
use super::servos::ServoPlaces;
use super::unique::Unique;
use super::{arms, ball, meters, physics};
use crate::model::{Joint, hinges_in_place, is_ball_joint};

/// Largest accepted difference of an axis's length from 1; the length is then made exactly 1.
const AXIS_TOLERANCE: f64 = 1e-3;

/// A shorter last link has no reliable direction.
const LINK_SHORTEST_MM: f64 = 1e-6;

/// Most chains, and most joints of one: the work at loading grows with the square of the number of joints.
const CHAINS_MAX: usize = 32;
const JOINTS_MAX: usize = 32;

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
        // The value is not a list: references to its entries cannot be checked.
        return vec![ChainEntry { key: "chain".to_owned(), name: None, limb: None, arm: None }];
    }
    chains.into_iter().flatten().chain(arms).collect()
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
        let link = joint.vector("link_mm", "the vector to the next joint, or to the tip, in mm");
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
        Some(limb.with_foot(foot?))
    };
    ChainEntry { key: format!("chain[{place}]"), name, limb: limb(), arm: None }
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

/// Refuses a ball joint's range on hinges that do not form a ball joint.
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
