//! Swimming: all arms alike, upright (Ishizuka 2008, 3.3.2).

use std::f64::consts::{FRAC_PI_2, PI};

use super::{Needs, Shown, StrokeKind};
use crate::motion::tentacle::key_angles::{KeyAngles, KeyInterpolation};
use crate::motion::tentacle::key_stroke::{KEY_NUMBERS, KeyStroke};
use crate::motion::tentacle::rhythm::Rhythm;
use crate::motion::tentacle::variation::Variation;

/// The stroke.
pub const KIND: StrokeKind = StrokeKind {
    name: "swim",
    meaning: "raise and spread, swing down, streamline (3.3.2), all arms alike",
    key: Some('3'),
    needs: Needs::Nothing,
    is_rhythmic: true,
    shown: Some(Shown { strokes: 3.0, hold_s: 0.0 }),
    make: |rig| Box::new(Rhythm::new("swim", rig, |arm, between| of_arm(between, arm.variation.clone()))),
};

/// Swimming (3.15 to 3.17): raise and spread, swing down, streamline, raise from the root. The third piece of
/// (3.15) and the fourth of (3.17) are misprinted: they do not meet their neighbours. These keys do.
pub const SWIM: KeyAngles = KeyAngles([
    [0.0, PI / 18.0, -4.0 / 9.0 * PI, -PI / 36.0],
    [0.0, PI / 12.0, -PI / 36.0, -PI / 4.0],
    [0.0, PI / 12.0, 0.0, -PI / 3.0],
]);

/// The swimming of an arm, its key angles varied.
pub fn of_arm(between: KeyInterpolation, variation: Variation) -> KeyStroke {
    // The first numbers are those of the walk.
    let keys = variation.after(KEY_NUMBERS).varied(SWIM);
    KeyStroke { keys, between, plane_rad: FRAC_PI_2, lag: 0.0 }
}
