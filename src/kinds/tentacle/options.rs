//! The stroke that a user asked for.

use crate::config::did_you_mean;
use crate::kinds::{MotionOptions, Refusal};
use crate::model::TentacleMotion;
use crate::motion::StrokeCommand;
use crate::motion::tentacle::strokes::{self, Needs, STROKES};

/// The stroke that the user asked for, if any.
pub(super) fn command(
    tentacle: &TentacleMotion,
    asked: &MotionOptions<'_>,
) -> Result<Option<StrokeCommand>, Refusal> {
    if asked.gait.is_some() || asked.speed_m_s.is_some() {
        let said = "--gait, --speed: arms do not walk away; --stroke and --tempo say what they do";
        return Err(Refusal(said.to_owned()));
    }
    if asked.pose.is_some() {
        let said = "--pose: arms have strokes; --stroke names one, --script many with the places they go to";
        return Err(Refusal(said.to_owned()));
    }
    let Some(name) = asked.stroke else { return Ok(None) };
    let Some(stroke) = strokes::named(name, tentacle) else {
        let of = |needs: &[Needs]| {
            let kinds = STROKES.iter().filter(|kind| needs.contains(&kind.needs));
            kinds.map(|kind| kind.name).collect::<Vec<_>>().join(", ")
        };
        return Err(Refusal(format!(
            "--stroke {name}: expected one of {}; or, where the robot file names reach_mm, {}; a path, {}; a pole, {}{}",
            of(&[Needs::Nothing]),
            of(&[Needs::Point]),
            of(&[Needs::Path]),
            of(&[Needs::Pole]),
            did_you_mean(name, STROKES.iter().map(|kind| kind.name)),
        )));
    };
    let tempo = asked.tempo.unwrap_or(1.0);
    if !(tempo.is_finite() && tempo >= 0.0) {
        return Err(Refusal(format!("--tempo {tempo}: expected a number, 0 or more")));
    }
    Ok(Some(StrokeCommand { tempo, ..StrokeCommand::of(stroke) }))
}
