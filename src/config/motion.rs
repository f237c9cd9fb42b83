//! `[motion]`: how the robot moves. One function for each kind of rig.

use super::figure::read_figure;
use super::gaits;
use super::legs::read_legs;
use super::limb::ChainEntry;
use super::meters;
use super::number::Limits;
use super::reader::Section;
use super::strokes::{read_path, read_pole};
use crate::model::{
    ArmSettings, Bending, HorseMotion, KeyInterpolation, Motion, TentacleMotion, WeightSupport,
};

/// The kinds of motion a file may name.
#[derive(Clone)]
enum Kind {
    Horse,
    Tentacle,
    Figure,
}

const KINDS: [(&str, Kind); 3] =
    [("horse", Kind::Horse), ("tentacle", Kind::Tentacle), ("figure", Kind::Figure)];

/// Fastest turn if the file sets none: legs without a sideways joint slide on their feet in a turn.
const YAW_RATE_MAX_DEG_S: f64 = 20.0;

/// Slowest swing, and slowest stroke of arms, s: slower than anyone would watch; the capability check steps through
/// both cycle by cycle.
const SWING_MAX_S: f64 = 10.0;
const STROKE_MAX_S: f64 = 100.0;
/// A hundred times the acceleration of free fall.
const ACCELERATION_MAX_M_S2: f64 = 1000.0;

/// Keys of `motion.legs`, in the order of [`crate::model::LEG_NAMES`].
const LEG_KEYS: [&str; 4] = ["left_hind", "left_fore", "right_hind", "right_fore"];

/// Reads `[motion]`.
pub(super) fn read(file: &Section<'_>, chains: &[ChainEntry<'_>]) -> Option<Motion> {
    file.section("motion", "what the robot does", |section| {
        match section.choice("kind", "a kind of motion", &KINDS) {
            Some(Kind::Horse) => read_horse(file, section, chains).map(Motion::Horse),
            Some(Kind::Tentacle) => read_tentacle(file, section, chains).map(Motion::Tentacle),
            Some(Kind::Figure) => read_figure(section, chains).map(Motion::Figure),
            None => {
                section.allow_unknown_keys();
                None
            }
        }
    })
}

fn read_horse(file: &Section<'_>, section: &Section<'_>, chains: &[ChainEntry<'_>]) -> Option<HorseMotion> {
    let legs = section
        .section("legs", "the chain of each leg", |legs| read_legs(legs, chains, LEG_KEYS))
        .inspect(|legs| refuse_idle_chains(file, chains, legs));

    let stand = section.number("stand_height_mm", "the body's standing height in mm", Limits::LENGTH);
    let sit = section.number("sit_height_mm", "the body's sitting height in mm", Limits::LENGTH);
    if let (Some(stand), Some(sit)) = (stand, sit)
        && sit > stand
    {
        section.fault("sit_height_mm", format!("at most the standing height, {stand}"));
    }
    let swing_time_s = section.number(
        "swing_time_s",
        "a foot's time in the air in s",
        Limits::AboveToMost(0.0, SWING_MAX_S),
    );
    let lift = section.number("swing_lift_mm", "a foot's height in mid-swing in mm", Limits::LENGTH);
    let swing_ramp_share = section.number(
        "swing_ramp_share",
        "the share of the swing in which the foot gains, and again loses, its speed",
        Limits::Between(0.0, 0.5),
    );
    let acceleration_m_s2 = section.number(
        "acceleration_max_m_s2",
        "the trunk's largest acceleration in m/s^2",
        Limits::AboveToMost(0.0, ACCELERATION_MAX_M_S2),
    );
    let yaw_rate = section.number_or(
        "yaw_rate_max_deg_s",
        "the fastest turn of the trunk in degrees/s",
        Limits::AboveToMost(0.0, 360.0),
        YAW_RATE_MAX_DEG_S,
    );
    let gaits = gaits::read(section);
    Some(HorseMotion {
        legs: legs?,
        stand_height_m: stand? / 1000.0,
        sit_height_m: sit? / 1000.0,
        swing_time_s: swing_time_s?,
        swing_lift_m: lift? / 1000.0,
        swing_ramp_share: swing_ramp_share?,
        acceleration_m_s2: acceleration_m_s2?,
        yaw_rate_max_rad_s: yaw_rate?.to_radians(),
        gaits: gaits?,
    })
}

/// Refuses chains of a horse that are not legs: they would never get a goal.
fn refuse_idle_chains(file: &Section<'_>, chains: &[ChainEntry<'_>], legs: &[usize; 4]) {
    for place in (0..chains.len()).filter(|place| !legs.contains(place)) {
        file.fault(
            &format!("{}.name", chains[place].key),
            "a chain that motion.legs names: a horse moves its four legs and no other chain",
        );
    }
}

/// Distance that arms keep from each other and the base if the file does not set it, mm.
const CLEARANCE_MM: f64 = 5.0;
/// How hard arms hold a pole if the file does not set it.
const GRIP_SHARE: f64 = 0.15;

const CARRIERS: [(&str, WeightSupport); 3] = [
    ("servos", WeightSupport::Servos),
    ("water", WeightSupport::Water),
    ("counterweight", WeightSupport::Counterweight),
];
const BETWEEN: [(&str, KeyInterpolation); 2] =
    [("linear", KeyInterpolation::Linear), ("smooth", KeyInterpolation::Smooth)];
const BENDINGS: [(&str, Bending); 2] = [("ccd", Bending::Ccd), ("smooth", Bending::Smooth)];

/// Optional keys of a tentacle's motion: each with its meaning and its default.
const OPTIONAL: [(&str, &str, &str); 6] = [
    (
        "reach_mm",
        "the point that a tip reaches for, in the body, in mm along x, y, z, a list of 3 numbers",
        "nowhere",
    ),
    (
        "base_radius_mm",
        "the radius in mm of the base, a ball round the trunk's centre, that arms keep clear of, a number above 0",
        "no base",
    ),
    (
        "key_angles",
        "how strokes go from one key angle to the next: one of \"linear\", \"smooth\"",
        "\"smooth\"",
    ),
    ("bending", "how an arm bends to reach the ends of its groups: one of \"ccd\", \"smooth\"", "\"smooth\""),
    ("pole", "the pole to wind round, a table", "no pole"),
    ("path", "the path of a tip, a table", "no path"),
];

fn read_tentacle(
    file: &Section<'_>,
    section: &Section<'_>,
    chains: &[ChainEntry<'_>],
) -> Option<TentacleMotion> {
    for chain in chains.iter().filter(|chain| chain.key.starts_with("chain")) {
        let expected = "no such limb: a tentacle moves arms, written as [[arm]], and no other chain";
        file.fault(&chain.key, expected);
    }
    let carrier = section.choice("carried_by", "what carries the arms' weight", &CARRIERS);
    let meaning = "the share of the arms' weight that it carries";
    let carried_share = match carrier {
        Some(WeightSupport::Servos) if !section.has("carried_share") => Some(0.0),
        Some(WeightSupport::Servos) => {
            section.fault("carried_share", "no such key where servos carry all of the weight");
            None
        }
        _ => section.number("carried_share", meaning, Limits::FromTo(0.0, 1.0)),
    };
    let stroke_time_s = section.number(
        "stroke_time_s",
        "the time of one stroke in s",
        Limits::AboveToMost(0.0, STROKE_MAX_S),
    );
    // Optional keys are described here, since each is read only if it is set.
    for (key, meaning, default) in OPTIONAL {
        section.describe_default(key, meaning, default);
    }
    let between = match section.has("key_angles") {
        true => section.choice("key_angles", "how strokes go from one key angle to the next", &BETWEEN),
        false => Some(KeyInterpolation::Smooth),
    };
    let bending = match section.has("bending") {
        true => section.choice("bending", "how an arm bends to reach the ends of its groups", &BENDINGS),
        false => Some(Bending::Smooth),
    };
    let meaning = "the largest random change of each key angle, in degrees";
    let variation = section.number_or("variation_deg", meaning, Limits::FromTo(0.0, 30.0), 0.0);
    let seed = section.integer_or("variation_seed", "the seed of the variation", 0..=u32::MAX, 1);
    let reach = match section.has("reach_mm") {
        true => section.vector("reach_mm", "the point that a tip reaches for, in the body, in mm").map(Some),
        false => Some(None),
    };
    let base = match section.has("base_radius_mm") {
        true => {
            let meaning =
                "the radius in mm of the base, a ball round the trunk's centre, that arms keep clear of";
            section.number("base_radius_mm", meaning, Limits::LENGTH).map(Some)
        }
        false => Some(None),
    };
    let meaning = "the distance arms keep from each other and from the base, skin to skin, in mm";
    let clearance_mm = section.number_or("clearance_mm", meaning, Limits::LENGTH_OR_NONE, CLEARANCE_MM);
    let meaning = "the mean load of the outer joints on a pole they hold, as a share of stall torque";
    let grip = section.number_or("grip_share", meaning, Limits::AboveToMost(0.0, 0.5), GRIP_SHARE);
    let pole = match section.has("pole") {
        true => section.section("pole", "the pole to wind round", read_pole).map(Some),
        false => Some(None),
    };
    let path = match section.has("path") {
        true => section.section("path", "the path of a tip", read_path).map(Some),
        false => Some(None),
    };
    let arm =
        |(place, entry): (usize, &ChainEntry<'_>)| Some(ArmSettings { chain: place, ..entry.arm.clone()? });
    Some(TentacleMotion {
        arms: chains.iter().enumerate().map(arm).collect::<Option<_>>()?,
        carrier: carrier?,
        carried_share: carried_share?,
        stroke_time_s: stroke_time_s?,
        between: between?,
        bending: bending?,
        variation_rad: variation?.to_radians(),
        seed: u64::from(seed?),
        reach_in_body: reach?.map(meters),
        base_radius_m: base?.map(|radius_mm| radius_mm / 1000.0),
        clearance_m: clearance_mm? / 1000.0,
        grip_share: grip?,
        pole: pole?,
        path: path?.map(Box::new),
    })
}
