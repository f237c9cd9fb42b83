//! From the options to the plan of the run, its driver, and the world of simulated servos.

use std::path::Path;

use anyhow::Result;

use super::super::drivers::{Driver, load_script};
use super::super::load::Loaded;
use super::super::mode::RunMode;
use super::super::{BadInput, Several};
use super::RunArguments;
use crate::input::read_text;
use crate::kinds::MotionOptions;
use crate::model::Robot;
use crate::motion::Plan;
use crate::operator::Script;
use crate::simulation;

/// The plan, its length, and the driver: drivers other than the plan start from a stand, for as long as they like.
pub(super) fn plan(options: &RunArguments, mode: RunMode, loaded: &Loaded) -> Result<(Plan, f64, Driver)> {
    let (robot, kind) = (&loaded.file.robot, &*loaded.kind);
    let asked = MotionOptions {
        gait: options.gait.as_deref(),
        speed_m_s: options.speed,
        stroke: options.stroke.as_deref(),
        tempo: options.tempo,
        pose: options.pose.as_deref(),
    };
    let for_s = mode.for_s(options);
    let is_alone = !options.driver.is_some() && !asked.is_some();
    if mode == RunMode::Show || (is_alone && kind.shows_by_itself()) {
        return Ok((kind.plan_to_rest(robot), for_s, show(options, for_s, &asked, loaded)?));
    }
    // Refuse a wish that the robot cannot carry out before a driver takes the terminal.
    let planned = match !options.driver.is_some() || asked.is_some() {
        true => Some(kind.plan(robot, &asked).map_err(BadInput::from)?),
        false => None,
    };
    let driver = match asked.is_some() && kind.shows_by_itself() {
        true => Driver::Plan,
        false => Driver::start(&options.driver, robot, kind)?,
    };
    let Some((plan, remark)) = planned else {
        return Ok((kind.plan_to_rest(robot), 0.0, driver));
    };
    remark.iter().for_each(|remark| say!("{remark}"));
    Ok((plan, for_s, driver))
}

/// A show: of the script that the user names, over and over, or of everything the robot can show.
fn show(options: &RunArguments, for_s: f64, asked: &MotionOptions<'_>, loaded: &Loaded) -> Result<Driver> {
    let (robot, kind) = (&loaded.file.robot, &*loaded.kind);
    let all = kind.show(robot, for_s).map_err(BadInput::from)?;
    kind.plan(robot, asked).map_err(BadInput::from)?;
    if asked.is_some() {
        return Err(
            BadInput("--stroke: a show has many strokes; choose them with --script".to_owned()).into()
        );
    }
    if options.driver.is_by_hand() {
        return Err(BadInput("show: plays a script; run --keys drives by hand".to_owned()).into());
    }
    match options.driver.script() {
        None => Driver::show(robot, all, "a show of all strokes".to_owned()),
        Some(path) => {
            let script = load_script(path, robot, kind)?;
            let repeats_after_s = Some(script.end_s);
            let script = Script { end_s: for_s, repeats_after_s, ..script };
            Driver::show(robot, script, format!("the show {}", path.display()))
        }
    }
}

/// The servos of `robot` in a simulated world, with the faults that the user asked for.
pub(in crate::cli) fn simulated_world(
    robot: &Robot,
    faults: Option<&Path>,
    seed: u64,
) -> Result<hw_sim::World> {
    let faults = match faults {
        Some(path) => fault_script(robot, path)?,
        None => hw_sim::FaultScript::default(),
    };
    Ok(simulation::world(robot, seed, &faults)?)
}

/// The faults of the script at `path`.
pub(in crate::cli) fn fault_script(robot: &Robot, path: &Path) -> Result<hw_sim::FaultScript> {
    let file_name = path.display().to_string();
    let text = read_text(path).map_err(|error| {
        BadInput(format!("{file_name}: expected a fault script that can be read; this one cannot: {error}"))
    })?;
    simulation::fault_script(robot, &text, &file_name).map_err(|error| {
        let count = error.count();
        let counted = if count == 1 { "1 mistake".to_owned() } else { format!("{count} mistakes") };
        let mut lines = error.lines();
        lines.push(format!("{counted}; nothing was started"));
        Several { lines, is_input: true }.into()
    })
}
