//! `[[motion.gait]]`, and the gaits a horse knows without it.

use super::number::Limits;
use super::reader::Section;
use super::unique::Unique;
use crate::model::Gait;

/// Name, duty factor, fore-hind lag, left-right lag. From Takizawa 2005, the table of 2.2 with the lags of
/// 3.3; `walk-steady` is ours: its longer stance keeps a robot inside the triangle of its standing feet.
const BUILT_IN: [(&str, f64, f64, f64); 5] = [
    ("walk", 0.70, 0.20, 0.50),
    ("walk-steady", 0.75, 0.25, 0.50),
    ("trot", 0.50, 0.50, 0.50),
    ("canter", 0.30, 0.20, 0.20),
    ("gallop", 0.25, 0.35, 0.20),
];

/// Reads the gaits of `[motion]`; the built-in table where there are none.
pub(super) fn read(motion: &Section<'_>) -> Option<Vec<Gait>> {
    let mut names = Unique::default();
    let gaits = motion.list("gait", "the gaits", |section| read_gait(section, &mut names));
    if gaits.is_empty() {
        return Some(built_in());
    }
    gaits.into_iter().collect()
}

fn read_gait<'a>(section: &Section<'a>, names: &mut Unique<'a>) -> Option<Gait> {
    let name = names.name(section, "the gait's name");
    let duty_factor =
        section.number("duty_factor", "the share of the period a foot stands", Limits::Between(0.0, 1.0));
    let lags = read_lags(section);
    Some(Gait { name: name?.to_owned(), duty_factor: duty_factor?, lags: lags? })
}

fn read_lags(section: &Section<'_>) -> Option<[f64; 4]> {
    let period = Limits::FromToBelow(0.0, 1.0);
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
    Some(lags(fore_hind?, left_right?))
}

/// Lift-off of each leg from the two lags (thesis 3.3), as shares of the period, in [0, 1).
fn lags(fore_hind: f64, left_right: f64) -> [f64; 4] {
    let both = (fore_hind + left_right) % 1.0;
    // Lags that add up to the period but for rounding mean its start.
    let both = if 1.0 - both < 1e-9 { 0.0 } else { both };
    [0.0, fore_hind, left_right, both]
}

fn built_in() -> Vec<Gait> {
    let gait = |(name, duty_factor, fore_hind, left_right): (&str, f64, f64, f64)| Gait {
        name: name.to_owned(),
        duty_factor,
        lags: lags(fore_hind, left_right),
    };
    BUILT_IN.into_iter().map(gait).collect()
}
