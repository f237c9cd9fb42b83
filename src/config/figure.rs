//! `[motion]` of a figure, and `[[motion.pose]]`.

use super::legs::read_legs;
use super::limb::ChainEntry;
use super::number::Limits;
use super::reader::Section;
use super::unique::Unique;
use crate::model::{FigureMotion, FigurePose, Joint};

/// Keys of `motion.legs`.
const LEG_KEYS: [&str; 2] = ["left", "right"];

/// A few degrees, as soft as tissue: human joints resist over about this angle before they stop.
const SOFT_STOP_DEG: f64 = 5.0;
/// Long enough for a person's hands, s.
const SET_DOWN_S: f64 = 5.0;
/// Most poses, and most turns of joints in one: more poses than people name, and more joints than a robot has.
const POSES_MAX: usize = 200;
const TURNS_MAX: usize = 1000;
/// Steepest trunk either way, degrees.
const TILT_MAX_DEG: f64 = 60.0;
/// Longest motion to a pose, s.
const LONGEST_S: f64 = 60.0;

/// A joint that poses may name.
struct PosableJoint<'a> {
    joint: &'a Joint,
    is_leg: bool,
}

pub(super) fn read_figure(section: &Section<'_>, chains: &[ChainEntry<'_>]) -> Option<FigureMotion> {
    for chain in chains.iter().filter(|chain| chain.key.starts_with("arm")) {
        section.fault(
            "kind",
            format!("a kind that has arms as [[arm]]; a figure's are chains: {} is none", chain.key),
        );
    }
    let meaning = "the chain of each leg";
    let legs = section.section("legs", meaning, |legs| read_legs(legs, chains, LEG_KEYS));
    section.describe_default(
        "head",
        "the name of the chain that is its head, which a fall should spare",
        "none",
    );
    let head = match section.has("head") {
        true => {
            let names: Vec<_> = chains.iter().map(|chain| chain.name).collect();
            section.reference("head", "the name of the chain that is its head", &names).map(Some)
        }
        false => Some(None),
    };
    let stand = section.number("stand_height_mm", "the body's standing height in mm", Limits::LENGTH);
    let sit = section.number("sit_height_mm", "the body's sitting height in mm", Limits::LENGTH);
    if let (Some(stand), Some(sit)) = (stand, sit)
        && sit > stand
    {
        section.fault("sit_height_mm", format!("at most the standing height, {stand}"));
    }
    let meaning = "how far before the end of its range a joint begins to slow down, in degrees";
    let soft_stop = section.number_or("soft_stop_deg", meaning, Limits::FromTo(0.0, 30.0), SOFT_STOP_DEG);
    let meaning = "how long it stands still after it has risen, to be set down, in s";
    let set_down = section.number_or("set_down_s", meaning, Limits::FromTo(0.0, LONGEST_S), SET_DOWN_S);
    let joints = named_joints(chains, legs);
    let mut names = Unique::default();
    let mut stand_pose: Option<FigurePose> = None;
    let poses =
        section.list("pose", "the poses it knows by name, the first of them \"stand\"", POSES_MAX, |pose| {
            let pose = read_pose(pose, stand? / 1000.0, joints.as_deref()?, stand_pose.as_ref(), &mut names)?;
            stand_pose.get_or_insert_with(|| pose.clone());
            Some(pose)
        });
    let is_first_stand =
        poses.first().is_some_and(|first| first.as_ref().is_none_or(|first| first.name == FigurePose::STAND));
    if !is_first_stand {
        section.fault("pose", "the pose it stands in as the first: [[motion.pose]] with name = \"stand\"");
    }
    Some(FigureMotion {
        legs: legs?,
        head: head?,
        stand_height_m: stand? / 1000.0,
        sit_height_m: sit? / 1000.0,
        soft_stop_rad: soft_stop?.to_radians(),
        set_down_s: set_down?,
        poses: poses.into_iter().collect::<Option<_>>()?,
    })
}

/// All joints in the robot's order, if all chains could be read.
fn named_joints<'c>(chains: &'c [ChainEntry<'_>], legs: Option<[usize; 2]>) -> Option<Vec<PosableJoint<'c>>> {
    let legs = legs?;
    let mut named = Vec::new();
    for (place, chain) in chains.iter().enumerate() {
        let is_leg = legs.contains(&place);
        named.extend(chain.limb.as_ref()?.joints().iter().map(|joint| PosableJoint { joint, is_leg }));
    }
    Some(named)
}

fn read_pose<'a>(
    section: &Section<'a>,
    stand_height_m: f64,
    joints: &[PosableJoint<'_>],
    stand: Option<&FigurePose>,
    names: &mut Unique<'a>,
) -> Option<FigurePose> {
    let name = names.name(section, "the pose's name");
    let time_s = section.number("time_s", "the time to get there in s", Limits::AboveToMost(0.0, LONGEST_S));
    let stand_mm = stand_height_m * 1000.0;
    section.describe_default("height_mm", "the body's height above the ground in mm", "standing");
    let height = section.number_or(
        "height_mm",
        "the body's height above the ground in mm",
        Limits::AboveToMost(0.0, 1.5 * stand_mm),
        stand_mm,
    );
    let tilt = Limits::FromTo(-TILT_MAX_DEG, TILT_MAX_DEG);
    let pitch =
        section.number_or("pitch_deg", "the trunk's pitch in degrees, nose down if positive", tilt, 0.0);
    let roll =
        section.number_or("roll_deg", "the trunk's roll in degrees, left side up if positive", tilt, 0.0);
    let meaning = "how far the trunk is to the left of the middle between its feet in mm";
    let sway = section.number_or("sway_mm", meaning, Limits::PLACE, 0.0);
    let resting = |joint: &PosableJoint<'_>| 0.0_f64.clamp(joint.joint.range_rad.0, joint.joint.range_rad.1);
    let mut angles_rad = match stand {
        Some(stand) => stand.angles_rad.clone(),
        None => joints.iter().map(resting).collect(),
    };
    let turns = section.list("turn", "angles of joints that are not the legs'", TURNS_MAX, |turn| {
        let (joint, angle_rad) = read_turn(turn, joints)?;
        *angles_rad.get_mut(joint)? = angle_rad;
        Some(())
    });
    turns.into_iter().collect::<Option<Vec<()>>>()?;
    Some(FigurePose {
        name: name?.to_owned(),
        time_s: time_s?,
        height_m: height? / 1000.0,
        pitch_rad: pitch?.to_radians(),
        roll_rad: roll?.to_radians(),
        sway_m: sway? / 1000.0,
        angles_rad,
    })
}

/// A joint and its angle, rad.
fn read_turn(section: &Section<'_>, joints: &[PosableJoint<'_>]) -> Option<(usize, f64)> {
    let names: Vec<Option<&str>> = joints.iter().map(|named| Some(named.joint.name.as_str())).collect();
    let joint = section.reference("joint", "the name of a joint, after that of its chain", &names);
    let angle = section.number("angle_deg", "its angle in degrees", Limits::ANGLE);
    let (joint, angle) = (joint?, angle?);
    let PosableJoint { joint: turned, is_leg } = joints.get(joint)?;
    if *is_leg {
        let expected = "a joint that is not a leg's: feet stay on the ground, and legs follow height_mm, pitch_deg, \
                        roll_deg and sway_mm";
        section.fault("joint", expected);
        return None;
    }
    let (low, high) = turned.range_rad;
    if !(low..=high).contains(&angle.to_radians()) {
        let (low, high) = (low.to_degrees(), high.to_degrees());
        section.fault("angle_deg", format!("an angle in the joint's range, {low:.1} to {high:.1} degrees"));
        return None;
    }
    Some((joint, angle.to_radians()))
}
