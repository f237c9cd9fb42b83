//! The pose of a figure in a run, and its driver.

use anyhow::Result;

use super::drivers::Driver;
use super::kind::Kind;
use super::{BadInput, RunArguments};
use crate::config;
use crate::model::{FigureMotion, FigurePose, Robot};

/// The pose asked for, or the stand if none is: index into the figure's poses.
///
/// # Errors
/// Bad input: options of other robots, an unknown pose.
pub(super) fn pose(
    options: &RunArguments,
    kind: Kind,
    robot: &Robot,
    figure: &FigureMotion,
) -> Result<usize> {
    if kind == Kind::Show {
        return Err(
            BadInput(format!("show: expected arms; {} is a figure: use run --script", robot.name)).into()
        );
    }
    if options.gait.is_some() || options.speed.is_some() || options.stroke.is_some() {
        let said = "--gait, --speed, --stroke: a figure takes poses, one of them by --pose, many by --script";
        return Err(BadInput(said.to_owned()).into());
    }
    let wanted = options.pose.as_deref().unwrap_or(FigurePose::STAND);
    figure.poses.iter().position(|pose| pose.name == wanted).ok_or_else(|| {
        let known: Vec<&str> = figure.poses.iter().map(|pose| pose.name.as_str()).collect();
        BadInput(format!("--pose {wanted}: expected one of {}", known.join(", "))).into()
    })
}

/// The figure's driver: the one that `options` name, else its plan.
///
/// # Errors
/// Bad input: a bad script, no terminal, a gamepad.
pub(super) fn driver(options: &RunArguments, robot: &Robot, figure: &FigureMotion) -> Result<Driver> {
    match options.driver.is_some() {
        true => Driver::of_figure(&options.driver, figure, |path| Ok(config::load_script(path, robot)?)),
        false => Ok(Driver::Plan),
    }
}
