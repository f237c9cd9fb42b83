//! `[[arm]]`: a chain of equal joints of two or three hinges each, so that the file need not list every hinge.
//!
//! The arm `NAME` has the joints `NAME.lift_1`, `NAME.sweep_1`, (`NAME.twist_1`,) `NAME.lift_2` and so on from root to
//! tip, and their servos have ids in that order.

use glam::DVec3;

use super::limb::{ArmJoints, ChainEntry, Limb, Root, Roots, read_range, rotation};
use super::number::Limits;
use super::reader::Section;
use super::servos::{ServoPlaces, ServoRow};
use super::unique::Unique;
use super::{meters, tendons};
use crate::model::{ArmSettings, GROUPS, Joint, SharedRange, link_length};

/// Most joints of an arm: more than any bus of ids carries.
const JOINTS_MAX: u32 = 60;
/// Most arms: two octopuses.
const ARMS_MAX: usize = 16;
/// Each link is shorter than the one before by this share of the first: w_i = w_0 (1 - 0.01 i) (3.1).
const TAPER: f64 = 0.01;
/// With a taper of this or more, links would have no length.
const TAPER_MAX: f64 = 1.0 / JOINTS_MAX as f64;
/// Share that each joint takes of the turns CCD finds, if the file does not set it (3.7).
const STIFFNESS: f64 = 0.5;

/// Names of the hinges of a joint, and their axes.
const HINGES: [(&str, DVec3); 3] = [("lift", DVec3::NEG_Y), ("sweep", DVec3::Z), ("twist", DVec3::X)];

/// Reads all arms, in file order.
pub(super) fn read<'a>(
    file: &Section<'a>,
    names: &mut Unique<'a>,
    roots: &mut Roots,
    servos: &mut ServoPlaces<'_>,
) -> Vec<ChainEntry<'a>> {
    let mut place = 0;
    let arms = file.list("arm", "the arms", ARMS_MAX, |section| {
        place += 1;
        Some(read_arm(section, place - 1, names, roots, servos))
    });
    let faulty = || ChainEntry { key: "arm".to_owned(), name: None, limb: None, arm: None };
    arms.into_iter().map(|arm| arm.unwrap_or_else(faulty)).collect()
}

fn read_arm<'a>(
    section: &Section<'a>,
    place: usize,
    names: &mut Unique<'a>,
    roots: &mut Roots,
    servos: &mut ServoPlaces<'_>,
) -> ChainEntry<'a> {
    let meaning = "roll, pitch and yaw of the arm in the body, in degrees: at 0 it points forward";
    let Root { name, root, rpy } = Root::read(section, "the arm's name", meaning, names, roots);
    let joints = read_joints(section);
    let link = section.number("link_mm", "the length of the first link in mm", Limits::LENGTH);
    let meaning = "how much shorter each link is than the one before, as a share of the first";
    let taper = section.number_or("taper", meaning, Limits::FromToBelow(0.0, TAPER_MAX), TAPER);
    let mass_kg =
        section.number("mass_kg", "the mass of each joint with its link in kg", Limits::MASS_OR_NONE);
    let links_m = || {
        let (link_mm, taper) = (link?, taper?);
        Some((0..joints?).map(|joint| link_length(2.0 * link_mm, taper, joint) / 1000.0).collect::<Vec<_>>())
    };
    section.describe_default(
        "tendons",
        "the cords that bend the arm's three sections, a table",
        "none: a servo turns each hinge",
    );
    let (hinges, bent) = match section.has("tendons") {
        true => (Some(2), tendons::read(section, name, links_m().as_deref(), mass_kg, servos)),
        false => {
            let hinges =
                section.integer_or("hinges", "hinges per joint: lift, sweep and perhaps twist", 2..=3, 2);
            let hinges = hinges.map(|hinges| if hinges == 3 { 3 } else { 2 });
            (hinges, read_hinges(section, name, hinges, links_m().as_deref(), mass_kg, servos))
        }
    };
    let settings = read_settings(section, hinges);
    if let (Some(arm), Some((joints, tendons))) = (&settings, &bent) {
        refuse_bad_parking(section, arm, joints, tendons.is_some());
    }
    let limb = || {
        let (joints, tendons) = bent?;
        Some(Limb::new(name?, meters(root?), rotation(rpy?), joints, tendons))
    };
    ChainEntry { key: format!("arm[{place}]"), name, limb: limb(), arm: settings }
}

/// The hinges of an arm in which every joint has servos of its own.
fn read_hinges(
    section: &Section<'_>,
    name: Option<&str>,
    hinges: Option<usize>,
    links_m: Option<&[f64]>,
    mass_kg: Option<f64>,
    servos: &mut ServoPlaces<'_>,
) -> Option<ArmJoints> {
    let bend_range = read_range(section, "range_deg");
    let twist_range = match (hinges, section.has("twist_range_deg")) {
        (Some(3), _) => read_range(section, "twist_range_deg"),
        (_, false) => Some((0.0, 0.0)),
        (_, true) => {
            section.fault("twist_range_deg", "no such key without hinges = 3: two hinges do not twist");
            None
        }
    };
    let meaning = "each joint's share of each turn";
    let stiffness = section.number_or("stiffness", meaning, Limits::AboveToMost(0.0, 1.0), STIFFNESS);
    let ball = super::ball::read(section);
    let joints = links_m.map(<[f64]>::len);
    let rows: Vec<ServoRow> = servos.read_rows(section, joints, hinges, bend_range)?;
    let (name, hinges, stiffness, mass_kg) = (name?, hinges?, stiffness?, mass_kg?);
    let ball = ball?;
    let ranges = [bend_range?, bend_range?, twist_range?];
    let mut servos = rows.iter().flat_map(|row| (0..row.count).map(move |place| (row, place)));
    let mut all = Vec::new();
    for (joint, link_m) in links_m?.iter().enumerate() {
        for (hinge, (kind, axis)) in HINGES.iter().take(hinges).enumerate() {
            // The link follows the last hinge of the joint; the other hinges are in the same place.
            let is_last = hinge + 1 == hinges;
            let link_m = if is_last { DVec3::X * *link_m } else { DVec3::ZERO };
            all.push(Joint {
                name: format!("{name}.{kind}_{}", joint + 1),
                axis: *axis,
                link_m,
                range_rad: ranges[hinge],
                stiffness,
                mass_kg: if is_last { mass_kg } else { 0.0 },
                center_m: link_m / 2.0,
                ball: ball.clone().filter(|_| is_last),
                servo: servos.next().map(|(row, place)| row.servo(place, ranges[hinge])),
            });
        }
    }
    Some((all, None))
}

/// Refuses an arm whose parked pose lies outside its joints' ranges.
fn refuse_bad_parking(section: &Section<'_>, arm: &ArmSettings, joints: &[Joint], is_on_tendons: bool) {
    let park_deg = arm.park_lift_rad.to_degrees();
    if is_on_tendons {
        if arm.park_lift_rad.abs() > 0.0 {
            section
                .fault("park_lift_deg", "no such key beside tendons: an arm on tendons is parked straight");
        }
        return;
    }
    let mut pose = [0.0; 3];
    pose[0] = arm.park_lift_rad;
    // All joints are alike.
    let hinges = &joints[..arm.hinges.min(joints.len()).min(pose.len())];
    let is_in_range = |joint: &Joint, angle: f64| (joint.range_rad.0..=joint.range_rad.1).contains(&angle);
    if let Some(joint) = hinges.iter().zip(pose).find(|(joint, angle)| !is_in_range(joint, *angle)) {
        let (low, high) = joint.0.range_rad;
        let expected = format!(
            "a pose in the joints' ranges: {} would be parked at {:.0} degrees, outside [{:.0}, {:.0}]",
            joint.0.name,
            joint.1.to_degrees(),
            low.to_degrees(),
            high.to_degrees()
        );
        return section.fault("park_lift_deg", expected);
    }
    let shared = hinges.last().and_then(|joint| joint.ball.clone());
    let shared = shared.map(|ball| SharedRange::new(hinges, ball));
    if shared.is_some_and(|shared| !shared.holds(&pose[..hinges.len()])) {
        let expected =
            format!("a pose in the region of arm.ball, which {park_deg:.0} degrees of lift is not");
        section.fault("park_lift_deg", expected);
    }
}

/// Number of joints: a multiple of three.
fn read_joints(section: &Section<'_>) -> Option<usize> {
    let meaning = "how many joints, a multiple of 3";
    let joints = section.integer("joints", meaning, 3..=JOINTS_MAX)?;
    let joints = usize::try_from(joints).ok()?;
    if joints.is_multiple_of(GROUPS) {
        return Some(joints);
    }
    section.fault("joints", format!("{meaning}: an arm bends in three groups of as many joints each"));
    None
}

/// The arm's settings apart from its joints; its chain is not known yet.
fn read_settings(section: &Section<'_>, hinges: Option<usize>) -> Option<ArmSettings> {
    let meaning = "the arm's place on its side of an octopus, from the front";
    let role = section.integer_or("role", meaning, 1..=4, 1).and_then(|role| u8::try_from(role).ok());
    let meaning = "the turn of the plane of walking strokes in degrees, 0 left-right, 90 up-down";
    let plane = section.number_or("stroke_plane_deg", meaning, Limits::FromTo(-180.0, 180.0), 0.0);
    let radius = section.number("radius_mm", "the arm's radius with its skin in mm", Limits::LENGTH);
    let meaning = "the lift of every joint where the arm is parked, in degrees";
    let park = section.number_or("park_lift_deg", meaning, Limits::FromTo(-90.0, 90.0), 0.0);
    Some(ArmSettings {
        chain: 0,
        hinges: hinges?,
        role: role?,
        stroke_plane_rad: plane?.to_radians(),
        radius_m: radius? / 1000.0,
        park_lift_rad: park?.to_radians(),
    })
}
