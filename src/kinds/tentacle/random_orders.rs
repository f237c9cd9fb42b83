//! Strokes at random, for campaigns.

use crate::kinds::TOO_MUCH;
use crate::model::TentacleMotion;
use crate::motion::{Stroke, StrokeCommand};
use crate::random::RandomStream;

/// Any stroke of these arms.
pub(super) fn command(chance: &mut RandomStream, tentacle: &TentacleMotion) -> StrokeCommand {
    let names = ["park", "rest", "sway", "walk", "swim", "let-go", "reach", "path", "wind"];
    let known: Vec<Stroke> = names.iter().filter_map(|name| Stroke::named(name, tentacle)).collect();
    let stroke = chance.one_of(&known).copied().unwrap_or_default();
    StrokeCommand {
        tempo: chance.between(0.2, TOO_MUCH),
        turn_rad: if chance.is(0.3) { chance.between(-1.5, 1.5) } else { 0.0 },
        ..StrokeCommand::of(stroke)
    }
}
