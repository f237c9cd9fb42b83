//! `[[motion.gait]]`: gaits beside those built in for a horse.

use super::number::Limits;
use super::reader::Section;
use super::unique::Unique;
use crate::model::{Bob, Gait};

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
    let lags = read_lags(section);
    let bob = read_bob(section);
    let meaning = "the Froude number above which gait auto takes the next faster gait";
    section.describe_default("auto_froude_max", meaning, "none: taken by its name only");
    let is_auto = section.has("auto_froude_max");
    let auto_froude_max =
        is_auto.then(|| section.number("auto_froude_max", meaning, Limits::AboveToMost(0.0, 1000.0)));
    Some(Gait {
        name: name?.to_owned(),
        duty_factor: duty_factor?,
        lags: lags?,
        bob: bob?,
        auto_froude_max: match auto_froude_max {
            Some(number) => Some(number?),
            None => None,
        },
    })
}

fn read_bob(section: &Section<'_>) -> Option<Bob> {
    let rise = section.number_or(
        "bob_mm",
        "how far the trunk rises and falls, from lowest to highest, in mm",
        Limits::LENGTH_OR_NONE,
        0.0,
    );
    let per_stride = section.integer_or("bobs_per_stride", "how often in a stride", 1..=4, 2);
    let meaning = "when the trunk is highest, in strides since the left hind's lift-off";
    let highest_at = section.number_or("bob_highest_at", meaning, Limits::FromToBelow(0.0, 1.0), 0.0);
    Some(Bob { rise_m: rise? / 1000.0, per_stride: per_stride?, highest_at: highest_at? })
}

fn read_lags(section: &Section<'_>) -> Option<[f64; 4]> {
    let period = Limits::FromToBelow(0.0, 1.0);
    section.describe_default("lags", "", "the two keys below");
    section.describe_default("fore_hind_lag", "", "lags, above");
    section.describe_default("left_right_lag", "", "lags, above");
    let has_pair = section.has("fore_hind_lag") | section.has("left_right_lag");
    if section.has("lags") {
        if has_pair {
            section.fault("lags", "either lags, or fore_hind_lag and left_right_lag, not both");
        }
        let meaning = "the lift-offs of left hind, left fore, right hind, right fore as shares of the period";
        return section.numbers("lags", meaning, period);
    }
    let meaning = "the fore foot's lift-off after the hind foot's as a share of the period";
    let fore_hind = section.number("fore_hind_lag", meaning, period);
    let meaning = "the right foot's lift-off after the left foot's as a share of the period";
    let left_right = section.number("left_right_lag", meaning, period);
    Some(Gait::lags_of_thesis(fore_hind?, left_right?))
}
