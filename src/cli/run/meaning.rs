//! What was asked means: the plan of the run, its driver, and the world of simulated servos.

use std::path::Path;

use anyhow::Result;

use super::super::drivers::Driver;
use super::super::kind::Kind;
use super::super::load::Loaded;
use super::super::{BadInput, Several, poses, strokes};
use super::RunArguments;
use crate::capability::{Capability, HorseCapability};
use crate::input::read_text;
use crate::model::Robot;
use crate::motion::horse::HorsePlan;
use crate::motion::{Command, GaitChoice, Plan};
use crate::operator::Repertoire;
use crate::simulation;

/// Share of the top speed at which a robot walks if the user names no speed.
const DEFAULT_SPEED_SHARE: f64 = 0.9;

/// The plan, its length, and the driver: drivers other than the plan start from a stand, for as long as they like.
pub(super) fn plan(options: &RunArguments, kind: Kind, loaded: &Loaded) -> Result<(Plan, f64, Driver)> {
    let robot = &loaded.file.robot;
    let for_s = kind.for_s(options);
    match &loaded.capability {
        Capability::Horse(..) if kind == Kind::Show => {
            Err(BadInput(format!("show: expected arms; {} is a horse: use run --script", robot.name)).into())
        }
        Capability::Horse(horse, capability) => {
            let standing = capability.plan(horse, Command::default());
            let driver = Driver::start(&options.driver, robot, Repertoire::of(&standing))?;
            match driver {
                Driver::Plan => {
                    let plan = walking(options, robot, capability, standing)?;
                    Ok((plan.into(), for_s, driver))
                }
                _ => Ok((standing.into(), 0.0, driver)),
            }
        }
        Capability::Tentacle(tentacle, capability) => {
            let driver = strokes::driver(options, (kind, for_s), robot, tentacle, capability)?;
            let command = strokes::command(options, tentacle)?;
            let plan = capability.plan(robot, tentacle, command.unwrap_or_default());
            Ok((plan.into(), for_s, driver))
        }
        Capability::Figure(figure, capability) => {
            let pose = poses::pose(options, kind, robot, figure)?;
            let driver = poses::driver(options, robot, figure)?;
            Ok((capability.plan(pose).into(), for_s, driver))
        }
    }
}

/// A plan for the gait and speed asked for, limited to what the robot can do.
fn walking(
    options: &RunArguments,
    robot: &Robot,
    capability: &HorseCapability,
    plan: HorsePlan,
) -> Result<HorsePlan> {
    if options.stroke.is_some() || options.pose.is_some() {
        let said = "--stroke, --pose: those are for arms and figures; a horse goes by --gait and --speed";
        return Err(BadInput(said.to_owned()).into());
    }
    let choice = gait(options.gait.as_deref(), &plan)?;
    let plan = plan.at_share(choice, DEFAULT_SPEED_SHARE);
    let top_m_s = plan.top_speed_m_s(choice);
    let joint = match choice {
        GaitChoice::Gait(gait) => capability.top_speeds[gait].joint,
        GaitChoice::Stand | GaitChoice::Auto => None,
    };
    let joint = joint.map(|joint| robot.joints[joint].name.as_str());
    let name = plan.gait_name(choice);
    if top_m_s <= 0.0 && choice != GaitChoice::Stand {
        return Err(BadInput(format!(
            "{} cannot {name}: even on the spot {} would pass its speed or acceleration limit; a longer \
             swing_time_s or a lower swing_lift_mm asks less of it",
            robot.name,
            joint.unwrap_or("a joint")
        ))
        .into());
    }
    let speed_m_s = match options.speed {
        None => plan.command.speed_m_s,
        Some(speed) if !speed.is_finite() => {
            let said = format!("--speed {speed}: expected a speed in m/s, negative to go backwards");
            return Err(BadInput(said).into());
        }
        Some(speed) if choice != GaitChoice::Stand => {
            let pace = plan.pace(choice);
            let held = speed.clamp(-pace.backward_m_s, pace.forward_m_s);
            if (held - speed).abs() > 0.0 {
                let limit = joint.map_or("the legs reach no further".to_owned(), |joint| {
                    format!("{joint} can turn no faster")
                });
                say!("{speed} m/s is too fast for {name}: held at {held:.3} m/s ({limit})");
            }
            held
        }
        Some(speed) => speed,
    };
    let command = Command { speed_m_s, ..plan.command };
    Ok(HorsePlan { command, ..plan })
}

fn gait(wanted: Option<&str>, plan: &HorsePlan) -> Result<GaitChoice> {
    let names = || plan.settings.gaits.iter().map(|gait| gait.name.as_str()).collect::<Vec<_>>().join(", ");
    let Some(wanted) = wanted else { return Ok(GaitChoice::Gait(0)) };
    plan.gait_choice(wanted).ok_or_else(|| {
        BadInput(format!("--gait {wanted}: expected auto, stand, or one of {}", names())).into()
    })
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
