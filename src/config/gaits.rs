//! `[[motion.gait]]`: gaits beside those built in for a horse.

use super::number::Limits;
use super::reader::Section;
use super::unique::Unique;
use crate::model::{Gait, VerticalOscillation};

/// Most gaits of a file: loading computes the top speed of each.
const GAITS_MAX: usize = 32;

/// The built-in gaits and those of `[motion]`: one with a built-in gait's name replaces that.
pub(super) fn read(motion: &Section<'_>) -> Option<Vec<Gait>> {
    let mut names = Unique::default();
    let own = motion.list("gait", "the gaits", GAITS_MAX, |section| read_gait(section, &mut names));
    let mut gaits = Gait::built_in();
    for own in own.into_iter().collect::<Option<Vec<_>>>()? {
        match gaits.iter_mut().find(|gait| gait.name == own.name) {
            Some(built_in) => *built_in = own,
            None => gaits.push(own),
        }
    }
    Some(gaits)
}

fn read_gait<'a>(section: &Section<'a>, names: &mut Unique<'a>) -> Option<Gait> {
    let name = names.name(section, "the gait's name");
    if let Some(taken) = name.filter(|name| ["stand", "auto"].contains(name)) {
        section.fault("name", format!("another name: \"{taken}\" is a choice of gait already"));
    }
    let duty_factor =
        section.number("duty_factor", "the share of the period a foot stands", Limits::FromTo(0.05, 0.95));
    let phase_offsets = read_phase_offsets(section);
    let vertical_oscillation = read_vertical_oscillation(section);
    let meaning = "the Froude number above which gait auto takes the next faster gait";
    section.describe_default("auto_froude_max", meaning, "none: taken by its name only");
    let is_auto = section.has("auto_froude_max");
    let auto_froude_max =
        is_auto.then(|| section.number("auto_froude_max", meaning, Limits::AboveToMost(0.0, 1000.0)));
    Some(Gait {
        name: name?.to_owned(),
        duty_factor: duty_factor?,
        phase_offsets: phase_offsets?,
        vertical_oscillation: vertical_oscillation?,
        auto_froude_max: match auto_froude_max {
            Some(number) => Some(number?),
            None => None,
        },
    })
}

fn read_vertical_oscillation(section: &Section<'_>) -> Option<VerticalOscillation> {
    let rise = section.number_or(
        "vertical_oscillation_mm",
        "how far the trunk rises and falls, from lowest to highest, in mm",
        Limits::LENGTH_OR_NONE,
        0.0,
    );
    let per_stride =
        section.integer_or("vertical_oscillations_per_stride", "how often in a stride", 1..=4, 2);
    let meaning = "when the trunk is highest, in strides since the left hind's lift-off";
    let highest_at =
        section.number_or("vertical_oscillation_highest_at", meaning, Limits::FromToBelow(0.0, 1.0), 0.0);
    Some(VerticalOscillation { rise_m: rise? / 1000.0, per_stride: per_stride?, highest_at: highest_at? })
}

fn read_phase_offsets(section: &Section<'_>) -> Option<[f64; 4]> {
    let period = Limits::FromToBelow(0.0, 1.0);
    section.describe_default("phase_offsets", "", "the two keys below");
    section.describe_default("fore_hind_phase_offset", "", "phase_offsets, above");
    section.describe_default("left_right_phase_offset", "", "phase_offsets, above");
    let has_pair = section.has("fore_hind_phase_offset") | section.has("left_right_phase_offset");
    if section.has("phase_offsets") {
        if has_pair {
            section.fault(
                "phase_offsets",
                "either phase_offsets, or fore_hind_phase_offset and left_right_phase_offset, not both",
            );
        }
        let meaning = "the lift-offs of left hind, left fore, right hind, right fore as shares of the period";
        return section.numbers("phase_offsets", meaning, period);
    }
    let meaning = "the fore foot's lift-off after the hind foot's as a share of the period";
    let fore_hind = section.number("fore_hind_phase_offset", meaning, period);
    let meaning = "the right foot's lift-off after the left foot's as a share of the period";
    let left_right = section.number("left_right_phase_offset", meaning, period);
    Some(Gait::phase_offsets_of_thesis(fore_hind?, left_right?))
}
