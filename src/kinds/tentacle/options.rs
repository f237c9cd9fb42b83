//! The stroke that a user asked for.

use crate::kinds::{MotionOptions, Refusal};
use crate::model::TentacleMotion;
use crate::motion::{Stroke, StrokeCommand};

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
    let Some(stroke) = Stroke::named(name, tentacle) else {
        let known: Vec<&str> = Stroke::PLACELESS.iter().map(|(name, _)| *name).collect();
        return Err(Refusal(format!(
            "--stroke {name}: expected one of {}; and reach, path or wind where the robot file names reach_mm, a path or a pole",
            known.join(", ")
        )));
    };
    let tempo = asked.tempo.unwrap_or(1.0);
    if !(tempo.is_finite() && tempo >= 0.0) {
        return Err(Refusal(format!("--tempo {tempo}: expected a number, 0 or more")));
    }
    Ok(Some(StrokeCommand { tempo, ..StrokeCommand::of(stroke) }))
}
