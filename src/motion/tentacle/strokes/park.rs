//! Parking: the arms go to the parked pose and stay there; safety may then restart servos.

use super::{Needs, StrokeKind};
use crate::motion::Stroke;
use crate::motion::tentacle::perform::Parked;

/// The stroke.
pub const KIND: StrokeKind = StrokeKind {
    name: Stroke::PARK.name,
    meaning: "stays still in the parked pose, where safety may restart servos that tripped on overload",
    key: None,
    needs: Needs::Nothing,
    is_rhythmic: false,
    shown: None,
    make: |_| Box::new(Parked),
};
