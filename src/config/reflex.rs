//! `[reflex]` and `[yield]`: how a robot reacts to a fall, and an arm to a load beyond its limit.

use super::limb::ChainEntry;
use super::number::Limits;
use super::reader::Section;
use crate::model::{
    Detector, FallDirection, GetUp, Joint, KeyPose, Lying, Motion, ReflexMode, ReflexSettings, YieldSettings,
};

const MODES: [(&str, ReflexMode); 3] =
    [("reflex", ReflexMode::Reflex), ("passive", ReflexMode::Passive), ("off", ReflexMode::Off)];

#[derive(Clone, Copy)]
enum Rule {
    Lean,
    Rate,
}

const RULES: [(&str, Rule); 2] = [("lean", Rule::Lean), ("rate", Rule::Rate)];

/// Longest motion by key poses, s.
const LONGEST_S: f64 = 60.0;

/// Most poses, and most key poses of a motion.
const POSES_MAX: usize = 200;
const KEYS_MAX: usize = 100;

/// A named pose, if it could be read.
type NamedPose<'a> = (Option<&'a str>, Option<Vec<f64>>);

/// Reads `[reflex]` of a robot with `joints` (`None` if they could not be read); `Some(None)` if it is not set.
pub(super) fn read(
    file: &Section<'_>,
    joints: Option<&[Joint]>,
    motion: Option<&Motion>,
) -> Option<Option<ReflexSettings>> {
    file.describe_default(
        "reflex",
        "what the robot does when it falls, a table",
        "the robot does not notice falls",
    );
    if !file.has("reflex") {
        return Some(None);
    }
    if motion.is_some_and(|motion| !motion.is_on_legs()) {
        file.fault("reflex", "no such section: arms on a base do not fall; [yield] is for their loads");
        return None;
    }
    file.section("reflex", "what the robot does when it falls", |section| read_reflex(section, joints))
        .map(Some)
}

fn read_reflex(section: &Section<'_>, joints: Option<&[Joint]>) -> Option<ReflexSettings> {
    section.describe_default(
        "mode",
        "how the robot meets a fall: one of \"reflex\", \"passive\" (limp at once, for comparison), \"off\"",
        "\"reflex\"",
    );
    let mode = match section.has("mode") {
        true => section.choice("mode", "how the robot meets a fall", &MODES),
        false => Some(ReflexMode::Reflex),
    };
    let detector = read_detector(section);
    let poses = section.list("pose", "named poses", POSES_MAX, |pose| {
        Some((pose.name("name", "the pose's name"), read_angles(pose, joints)))
    });
    let poses: Vec<NamedPose<'_>> = poses.into_iter().map(Option::unwrap_or_default).collect();

    let mut falls: [Vec<KeyPose>; 5] = Default::default();
    let mut known = [false; 5];
    let read = section.list(
        "fall",
        "what the robot does in a fall, by direction",
        FallDirection::ALL.len(),
        |fall| {
            let directions = FallDirection::ALL.map(|direction| (direction.name(), direction));
            let direction = fall.choice("direction", "which way it falls", &directions);
            let keys = read_keys(fall, &poses);
            if keys.as_ref().is_some_and(Vec::is_empty) {
                fall.fault("key", "at least one key pose, [[reflex.fall.key]]");
            }
            let (place, keys) = (direction? as usize, keys?);
            if std::mem::replace(known.get_mut(place)?, true) {
                fall.fault("direction", "a direction of its own: there is one with it before");
            }
            *falls.get_mut(place)? = keys;
            Some(())
        },
    );
    let all_falls = read.iter().all(Option::is_some);
    let meaning = "the torque with which joints give way, a share of what is permitted";
    let passive = section.number_or("passive_torque_share", meaning, Limits::AboveToMost(0.0, 1.0), 0.2);
    let meaning = "the robot rests while its trunk turns slower than this, in degrees/s";
    let rest_rate = section.number_or("rest_rate_deg_s", meaning, Limits::FromTo(1.0, 90.0), 20.0);
    let meaning = "how long the trunk must turn so slowly, in s";
    let rest_s = section.number_or("rest_s", meaning, Limits::FromTo(0.1, 10.0), 0.5);
    let get_ups =
        section.list("get_up", "how the robot gets up, by the side it lies on", Lying::ALL.len(), |way| {
            let lying = Lying::ALL.map(|lying| (lying.name(), lying));
            let lying =
                way.choice("lying", "the side that the robot lies on: upright is the underside", &lying);
            let keys = read_keys(way, &poses);
            Some(GetUp { lying: lying?, keys: keys? })
        });
    let get_ups_max =
        section.integer_or("get_ups_max", "how often it gets up by itself in one run", 0..=1000, 3);
    Some(ReflexSettings {
        mode: mode?,
        detector: detector?,
        falls: all_falls.then_some(falls)?,
        passive_torque_share: passive?,
        rest_rate_rad_s: rest_rate?.to_radians(),
        rest_s: rest_s?,
        get_ups: get_ups.into_iter().collect::<Option<_>>()?,
        get_ups_max: get_ups_max?,
    })
}

fn read_detector(section: &Section<'_>) -> Option<Detector> {
    let words = "the rule by which a fall is certain: one of \"lean\" (where the trunk will be), \"rate\" (how fast it turns)";
    section.describe_default("detector", words, "\"lean\"");
    let rule = match section.has("detector") {
        true => section.choice("detector", "the rule by which a fall is certain", &RULES),
        false => Some(Rule::Lean),
    };
    let only_of = |keys: &[&'static str], rule: &str| {
        for key in keys.iter().filter(|key| section.has(key)) {
            section.fault(key, format!("no such key: it belongs to detector = \"{rule}\""));
        }
    };
    let roll = "the roll in degrees, at its rate ahead_s from now, from which a fall is certain";
    let pitch = "the pitch in degrees, at its rate ahead_s from now, from which a fall is certain";
    let ahead = "how far ahead the lean is predicted, in s";
    let rate = "the size of roll and pitch rate together, in degrees/s, from which a fall is certain";
    match rule? {
        Rule::Lean => {
            only_of(&["rate_max_deg_s"], "rate");
            let degrees = Limits::FromTo(5.0, 89.0);
            let roll = section.number_or("roll_max_deg", roll, degrees, 34.0);
            let pitch = section.number_or("pitch_max_deg", pitch, degrees, 29.0);
            let ahead_s = section.number_or("ahead_s", ahead, Limits::FromTo(0.0, 1.0), 0.14);
            section.describe_default("rate_max_deg_s", &format!("{rate} (detector = \"rate\")"), "172");
            Some(Detector::Lean {
                roll_rad: roll?.to_radians(),
                pitch_rad: pitch?.to_radians(),
                ahead_s: ahead_s?,
            })
        }
        Rule::Rate => {
            only_of(&["roll_max_deg", "pitch_max_deg", "ahead_s"], "lean");
            let rate = section.number_or("rate_max_deg_s", rate, Limits::FromTo(10.0, 1000.0), 172.0);
            Some(Detector::Rate(rate?.to_radians()))
        }
    }
}

/// Angles of all joints of a pose, rad, each within its joint's range.
fn read_angles(pose: &Section<'_>, joints: Option<&[Joint]>) -> Option<Vec<f64>> {
    let meaning = "the angles of all joints in degrees, chain by chain as in the file";
    let angles = pose.number_list("angles_deg", meaning, joints.map(<[Joint]>::len))?;
    let joints = joints?;
    let mut is_good = true;
    for (place, (angle, joint)) in angles.iter().zip(joints).enumerate() {
        let (low, high) = joint.range_rad;
        let (low, high) = (low.to_degrees(), high.to_degrees());
        if !(low - 1e-9..=high + 1e-9).contains(angle) {
            pose.fault(
                &format!("angles_deg[{place}]"),
                format!("an angle of {}, in its range of {low:.1} to {high:.1}", joint.name),
            );
            is_good = false;
        }
    }
    is_good.then(|| angles.into_iter().map(f64::to_radians).collect())
}

/// Key poses in the order of their times.
fn read_keys(motion: &Section<'_>, poses: &[NamedPose<'_>]) -> Option<Vec<KeyPose>> {
    let names: Vec<Option<&str>> = poses.iter().map(|(name, _)| *name).collect();
    let mut before_s = 0.0;
    let keys = motion.list("key", "its key poses", KEYS_MAX, |key| {
        let pose = key.reference("pose", "the name of a pose", &names);
        let at_s = key.number(
            "at_s",
            "when the robot should reach the pose, in s since the motion began",
            Limits::AboveToMost(0.0, LONGEST_S),
        );
        if let Some(at_s) = at_s {
            if at_s <= before_s {
                key.fault("at_s", format!("a time after that of the key before it, {before_s}"));
            }
            before_s = at_s;
        }
        let torque_share = key.number_or(
            "torque_share",
            "the torque on the way there, a share of what is permitted; with 0 it is limp meanwhile",
            Limits::FromTo(0.0, 1.0),
            1.0,
        );
        let angles_rad = poses.get(pose?).and_then(|(_, angles)| angles.clone());
        Some(KeyPose { at_s: at_s?, angles_rad: angles_rad?, torque_share: torque_share? })
    });
    keys.into_iter().collect()
}

/// Reads `[yield]`; `Some(None)` if it is not set.
pub(super) fn read_yield(
    file: &Section<'_>,
    chains: &[ChainEntry<'_>],
    motion: Option<&Motion>,
) -> Option<Option<YieldSettings>> {
    let meaning = "what an overloaded arm does, a table";
    file.describe_default("yield", meaning, "arms do not give way");
    if !file.has("yield") {
        return Some(None);
    }
    if motion.is_some_and(|motion| motion.horse().is_some()) {
        file.fault("yield", "no such section: arms may give way, a horse stands on its legs");
        return None;
    }
    if chains.iter().all(|chain| !chain.key.starts_with("arm")) {
        file.fault("yield", "no such section where there is no [[arm]]");
        return None;
    }
    file.section("yield", "what an overloaded arm does", |section| {
        let meaning = "the joint load above which an arm gives way, a share of stall torque";
        let load_share = section.number("load_share", meaning, Limits::Between(0.0, 1.0));
        let meaning = "how long an arm bears such a load, in s";
        let after_s = section.number_or("after_s", meaning, Limits::FromTo(0.0, 5.0), 0.2);
        let meaning = "the torque with which it gives way, a share of what is permitted";
        let torque_share = section.number_or("torque_share", meaning, Limits::AboveToMost(0.0, 0.5), 0.1);
        let meaning = "how long an arm gives way at least, in s";
        let for_s = section.number_or("for_s", meaning, Limits::FromTo(0.1, 60.0), 1.0);
        let meaning = "how long it takes to return, in s";
        let return_s = section.number_or("return_s", meaning, Limits::FromTo(0.5, 60.0), 2.0);
        Some(YieldSettings {
            load_share: load_share?,
            after_s: after_s?,
            torque_share: torque_share?,
            for_s: for_s?,
            return_s: return_s?,
        })
    })
    .map(Some)
}
