//! Strokes at random, for campaigns.

use crate::kinds::TOO_MUCH;
use crate::model::TentacleMotion;
use crate::motion::tentacle::strokes::STROKES;
use crate::motion::{Stroke, StrokeCommand};
use crate::random::RandomStream;

/// Any stroke of these arms.
pub(super) fn command(chance: &mut RandomStream, tentacle: &TentacleMotion) -> StrokeCommand {
    let known: Vec<Stroke> = STROKES.iter().filter_map(|kind| kind.in_file(tentacle)).collect();
    let stroke = chance.one_of(&known).copied().unwrap_or(Stroke::REST);
    StrokeCommand {
        tempo: chance.between(0.2, TOO_MUCH),
        turn_rad: if chance.is(0.3) { chance.between(-1.5, 1.5) } else { 0.0 },
        ..StrokeCommand::of(stroke)
    }
}
