//! The strokes of arms in a run, and their driver.

use std::path::Path;

use anyhow::Result;

use super::drivers::Driver;
use super::kind::Kind;
use super::{BadInput, RunArguments};
use crate::capability::TentacleCapability;
use crate::config;
use crate::model::{Robot, TentacleMotion};
use crate::motion::tentacle::KEYED;
use crate::motion::{Order, Stroke, StrokeCommand};
use crate::operator::{Script, Show};

/// The stroke that the user asked for, if any.
///
/// # Errors
/// Bad input: an unknown stroke, an invalid tempo.
pub(super) fn command(options: &RunArguments, tentacle: &TentacleMotion) -> Result<Option<StrokeCommand>> {
    if options.gait.is_some() || options.speed.is_some() {
        let said = "--gait, --speed: arms do not walk away; --stroke and --tempo say what they do";
        return Err(BadInput(said.to_owned()).into());
    }
    if options.pose.is_some() {
        let said = "--pose: arms have strokes; --stroke names one, --script many with the places they go to";
        return Err(BadInput(said.to_owned()).into());
    }
    let Some(name) = &options.stroke else { return Ok(None) };
    let Some(stroke) = Stroke::named(name, tentacle) else {
        let known: Vec<&str> = Stroke::PLACELESS.iter().map(|(name, _)| *name).collect();
        return Err(BadInput(format!(
            "--stroke {name}: expected one of {}; and reach, path or wind where the robot file names reach_mm, a path or a pole",
            known.join(", ")
        ))
        .into());
    };
    let tempo = options.tempo.unwrap_or(1.0);
    if !(tempo.is_finite() && tempo >= 0.0) {
        return Err(BadInput(format!("--tempo {tempo}: expected a number, 0 or more")).into());
    }
    Ok(Some(StrokeCommand { tempo, ..StrokeCommand::of(stroke) }))
}

/// Loads a script for arms with this `capability`.
pub(super) fn load_script(path: &Path, robot: &Robot, capability: &TentacleCapability) -> Result<Script> {
    let script = config::load_script(path, robot)?;
    for entry in &script.entries {
        let Order::Perform(command) = entry.order else { continue };
        let tempos = KEYED.iter().zip(capability.tempo_max);
        for (stroke, most) in tempos.filter(|(stroke, _)| **stroke == command.stroke) {
            if command.tempo > most {
                let place = format!("{}:{}", path.display(), entry.line);
                say!("{place}: tempo {} is too fast for {}: held at {most:.2}", command.tempo, stroke.name());
            }
        }
    }
    Ok(script)
}

/// The driver of the arms: the one that `options` name, else a show of all strokes.
pub(super) fn driver(
    options: &RunArguments,
    (kind, for_s): (Kind, f64),
    robot: &Robot,
    tentacle: &TentacleMotion,
    capability: &TentacleCapability,
) -> Result<Driver> {
    let load = |path: &Path| load_script(path, robot, capability);
    let show = |script: Script, name: String| Driver::show(Show::new(robot, script), name);
    match (command(options, tentacle)?, kind) {
        (Some(_), Kind::Run) => Ok(Driver::Plan),
        (Some(_), Kind::Show) => {
            Err(BadInput("--stroke: a show has many; --script says which".to_owned()).into())
        }
        (None, Kind::Run) if options.driver.is_some() => Driver::of_arms(&options.driver, tentacle, load),
        (None, Kind::Show) if options.driver.is_by_hand() => {
            Err(BadInput("show: plays a script; run --keys drives by hand".to_owned()).into())
        }
        (None, _) => match options.driver.script() {
            None => show(Show::of_all_strokes(tentacle, for_s), "a show of all strokes".to_owned()),
            Some(path) => {
                let script = load(path)?;
                let repeats_after_s = Some(script.end_s);
                let name = format!("the show {}", path.display());
                show(Script { end_s: for_s, repeats_after_s, ..script }, name)
            }
        },
    }
}
