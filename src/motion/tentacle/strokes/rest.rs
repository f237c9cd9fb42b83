//! Resting in the parked pose: the stroke of arms that have no other order.

use super::{Needs, StrokeKind};
use crate::motion::Stroke;
use crate::motion::tentacle::perform::Parked;

/// The stroke.
pub const KIND: StrokeKind = StrokeKind {
    name: Stroke::REST.name,
    meaning: "stays still in the parked pose",
    key: None,
    needs: Needs::Nothing,
    is_rhythmic: false,
    shown: None,
    make: |_| Box::new(Parked),
};
