//! `[physics]`, the body of a simulated robot and its ground; and the feet of chains.

use super::limb::ChainEntry;
use super::meters;
use super::number::Limits;
use super::reader::Section;
use crate::model::{Foot, Ground, Motion, Physics, Step};

/// Friction of rubber on a dry floor.
pub(super) const FRICTION: f64 = 0.8;
/// A stalled servo pushes a few degrees into such a stop: stiffness and damping, N m/rad and N m s/rad.
const STOP: (f64, f64) = (60.0, 0.3);
/// Radius of a servo's horn with its bracket.
const LINK_RADIUS_MM: f64 = 8.0;

/// Most blocks: more than a robot steps over in an hour.
const STEPS_MAX: usize = 1000;

/// Reads `[physics]`; `Some(None)` if the file has none.
pub(super) fn read(
    file: &Section<'_>,
    chains: &[ChainEntry<'_>],
    motion: Option<&Motion>,
) -> Option<Option<Physics>> {
    let meaning = "the body of the simulated robot and its ground";
    file.describe_default("physics", &format!("{meaning}, a table"), "none: simulated joints turn freely");
    if !file.has("physics") {
        return Some(None);
    }
    refuse_what_has_no_body(file, chains, motion);
    file.section("physics", meaning, |section| read_physics(section, motion)).map(Some)
}

/// Refuses rigs that the rigid body cannot model as their file describes them.
fn refuse_what_has_no_body(file: &Section<'_>, chains: &[ChainEntry<'_>], motion: Option<&Motion>) {
    let limbs = || chains.iter().filter_map(|chain| Some((chain, chain.limb.as_ref()?)));
    if limbs().any(|(_, limb)| limb.is_on_paper()) {
        file.fault("physics", "no such section on a robot without buses: nothing turns its joints");
    }
    for (chain, _) in limbs().filter(|(_, limb)| limb.has_tendons()) {
        let key = format!("{}.tendons", chain.key);
        file.fault(&key, "no tendons beside [physics]: its links are turned by hinges; take one of them out");
    }
    refuse_legs_without_feet(file, chains, motion, "in physics a leg stands on it");
}

/// Refuses a leg that should bear weight but has no foot; `why` gives the reason.
pub(super) fn refuse_legs_without_feet(
    file: &Section<'_>,
    chains: &[ChainEntry<'_>],
    motion: Option<&Motion>,
    why: &str,
) {
    let legs = motion.map_or(&[][..], Motion::legs);
    for chain in legs.iter().filter_map(|place| chains.get(*place)) {
        if chain.limb.as_ref().is_some_and(|limb| !limb.has_foot()) {
            let expected = format!(
                "a foot, as foot = {{ radius_mm = 10, width_mm = 30 }}, or a plate, as foot = {{ size_mm = [60, 40, 4] }}: {why}"
            );
            file.fault(&format!("{}.foot", chain.key), expected);
        }
    }
}

fn read_physics(section: &Section<'_>, motion: Option<&Motion>) -> Option<Physics> {
    let step_ms = section.integer_or("step_ms", "the time of a step of the body in ms", 1..=2, 1);
    section.describe_default(
        "rotor_inertia_kg_m2",
        "the inertia of a servo's rotor and gears at its shaft, in kg m^2, a number above 0 and at most 1",
        "the servo model's",
    );
    let rotor = match section.has("rotor_inertia_kg_m2") {
        true => {
            let meaning = "the inertia of a servo's rotor and gears at its shaft, in kg m^2";
            section.number("rotor_inertia_kg_m2", meaning, Limits::AboveToMost(0.0, 1.0)).map(Some)
        }
        false => Some(None),
    };
    let meaning = "the torque every joint loses for each rad/s, beside its servo's friction, in N m s/rad";
    let viscosity = section.number_or("viscosity_nm_s", meaning, Limits::FromTo(0.0, 1.0), 0.0);
    let meaning = "the stiffness of the stops behind the ranges of joints and ball joints in N m/rad";
    let stiffness = section.number_or("stop_stiffness_nm_rad", meaning, Limits::FromTo(0.0, 1000.0), STOP.0);
    let meaning = "the damping of those stops in N m s/rad";
    let damping = section.number_or("stop_damping_nm_s", meaning, Limits::FromTo(0.0, 10.0), STOP.1);
    // The base of a rig of arms is bolted down, and its arms have their own radius.
    let is_free = motion.is_none_or(Motion::is_on_legs);
    let trunk_box = match is_free {
        true => {
            let meaning = "the edges of the trunk's box, in mm along x, y, z; its middle is trunk.center_mm";
            section.numbers::<3>("trunk_box_mm", meaning, Limits::LENGTH).map(Some)
        }
        false => Some(None),
    };
    let link_radius = match is_free {
        true => {
            let meaning = "the radius of the links in mm";
            section.number_or("link_radius_mm", meaning, Limits::LENGTH, LINK_RADIUS_MM)
        }
        false => Some(LINK_RADIUS_MM),
    };
    let ground = match is_free {
        true => read_ground(section),
        false => Some(Ground { friction: FRICTION, slope_rad: 0.0, uphill_rad: 0.0, steps: Vec::new() }),
    };
    Some(Physics {
        step_ms: step_ms?,
        rotor_inertia_kg_m2: rotor?,
        trunk_box_m: trunk_box?.map(|edges| meters(edges.into())),
        link_radius_m: link_radius? / 1000.0,
        viscosity_nm_s: viscosity?,
        stop: (stiffness?, damping?),
        ground: ground?,
    })
}

fn read_ground(section: &Section<'_>) -> Option<Ground> {
    let meaning = "the friction between ground and robot";
    let friction = section.number_or("friction", meaning, Limits::FromTo(0.0, 5.0), FRICTION);
    let meaning = "how steep the ground is, in degrees";
    let slope = section.number_or("slope_deg", meaning, Limits::FromTo(-45.0, 45.0), 0.0);
    let meaning = "where uphill is, in degrees from ahead to the left";
    let uphill = section.number_or("uphill_deg", meaning, Limits::FromTo(-360.0, 360.0), 0.0);
    let steps = section.list("step", "blocks across the way", STEPS_MAX, |step| {
        let at = step.number("at_mm", "where it begins, in mm ahead of the start", Limits::PLACE);
        let length = step.number("length_mm", "how long it is, in mm along the way", Limits::LENGTH);
        let height = step.number("height_mm", "how high it is, in mm", Limits::LENGTH);
        Some(Step { at_m: at? / 1000.0, length_m: length? / 1000.0, height_m: height? / 1000.0 })
    });
    Some(Ground {
        friction: friction?,
        slope_rad: slope?.to_radians(),
        uphill_rad: uphill?.to_radians(),
        steps: steps.into_iter().collect::<Option<_>>()?,
    })
}

/// Reads the foot of a chain; `Some(None)` if it has none.
pub(super) fn read_foot(chain: &Section<'_>) -> Option<Option<Foot>> {
    let meaning = "the chain's foot: a round sole across it (radius_mm, width_mm) or a plate (size_mm)";
    chain.describe_default("foot", &format!("{meaning}, a table"), "none: it ends in a point");
    if !chain.has("foot") {
        return Some(None);
    }
    chain
        .section("foot", meaning, |foot| {
            let edges = "the edges of a plate in mm along x, y, z";
            foot.describe_default("size_mm", &format!("{edges}, a list of 3 numbers"), "a round sole");
            if foot.has("size_mm") {
                let size = foot.numbers::<3>("size_mm", edges, Limits::LENGTH);
                let meaning = "the middle of a plate, from the tip, in mm";
                let middle = foot.vector_or("middle_mm", meaning, glam::DVec3::ZERO);
                return Some(Foot::Plate { size_m: meters(size?.into()), middle_m: meters(middle?) });
            }
            let radius = foot.number("radius_mm", "the radius of a round sole in mm", Limits::LENGTH);
            let meaning = "the width of a round sole in mm, between the middles of its round ends";
            let width = foot.number("width_mm", meaning, Limits::LENGTH_OR_NONE);
            Some(Foot::Round { radius_m: radius? / 1000.0, width_m: width? / 1000.0 })
        })
        .map(Some)
}
