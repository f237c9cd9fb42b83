//! Letting go: an arm that is wound round a pole unwinds ([`super::wind`]), and the arms rest.

use super::{Needs, StrokeKind};
use crate::motion::Stroke;
use crate::motion::tentacle::perform::Parked;

/// The stroke.
pub const KIND: StrokeKind = StrokeKind {
    name: Stroke::LET_GO.name,
    meaning: "unwinds, back to rest",
    key: Some('6'),
    needs: Needs::Nothing,
    is_rhythmic: false,
    shown: None,
    make: |_| Box::new(Parked),
};
