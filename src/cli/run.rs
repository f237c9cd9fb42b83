//! `hippocamp run`: stand up, walk, stop, and say how it was.
#![allow(clippy::print_stdout, reason = "the command's output")]

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, bounded};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use super::load::{Loaded, load};
use super::ports::{self, Choice};
use super::status::StatusLine;
use super::unit;
use super::{BadInput, COMPLETED, FAILED, RunArguments, STOPPED_BY_SAFETY};
use crate::bus::{Ports, SimPorts};
use crate::capability::top_speed;
use crate::model::{Gait, HorseMotion, Robot};
use crate::motion::Order;
use crate::motion::horse::HorsePlan;
use crate::run::{RunPlan, run as run_robot};
use crate::simulation;
use crate::telemetry::{Outcome, Report};

/// Share of the top speed a robot walks at when no speed is asked for.
const DEFAULT_SPEED_SHARE: f64 = 0.9;

/// Runs the robot as `options` say; returns the exit code.
pub(super) fn run(options: &RunArguments) -> Result<u8> {
    let unit = unit::find(&options.robot, options.unit.unit.as_deref())?;
    let loaded = load(&options.robot, unit.as_ref())?;
    let robot = &loaded.file.robot;
    if robot.buses.is_empty() {
        let path = options.robot.display();
        return Err(BadInput(format!(
            "{path}: {} has no buses: it exists on paper only and cannot be run; try 'hippocamp check {path}'",
            robot.name
        ))
        .into());
    }
    if !(options.walk_for_s.is_finite() && options.walk_for_s >= 0.0) {
        return Err(
            BadInput(format!("--for {}: expected a time in seconds, 0 or more", options.walk_for_s)).into()
        );
    }
    let choice = ports::choose(&options.unit, robot, &options.robot, unit.as_ref())?;
    let horse = plan(options, &loaded)?;
    let report_file = options.report.as_deref().map(check_writable).transpose()?;
    let line = format!(
        "{}: {} at {:.3} m/s for {} s on {choice}",
        robot.name, horse.gait.name, horse.speed_m_s, options.walk_for_s
    );
    let plan = RunPlan { horse, method: options.ik.into(), walk_for_s: options.walk_for_s };
    let report = match choice {
        Choice::Simulated { is_virtual } => {
            let world = simulated_world(options, robot)?;
            println!("{line}");
            drive(robot, plan, SimPorts::of(world, is_virtual))?
        }
        Choice::Devices(devices) => {
            if options.faults.is_some() {
                let said = "--faults: only simulated buses have them; add --simulate, or leave it out";
                return Err(BadInput(said.to_owned()).into());
            }
            let ports = ports::open(&devices)?;
            println!("{line}");
            drive(robot, plan, ports)?
        }
    };
    print_summary(robot, &report);
    if let Some(path) = report_file {
        write_report(path, &report)?;
    }
    Ok(exit_code(report.outcome))
}

/// Runs the robot until it is done, or the operator or safety stops it, and shows its status.
fn drive(robot: &Robot, plan: RunPlan, ports: impl Ports) -> Result<Report> {
    let orders = orders_from_signals()?;
    let mut status_line = StatusLine::start();
    let mut order = Order::Go;
    let report = run_robot(robot, plan, ports, |status| {
        status_line.show(status);
        order = orders.try_recv().unwrap_or(order);
        order
    });
    drop(status_line);
    Ok(report?)
}

/// The servos of `robot` in a world of their own, with the faults that were asked for.
fn simulated_world(options: &RunArguments, robot: &Robot) -> Result<hw_sim::World> {
    let faults = fault_script(options.faults.as_deref())?;
    simulation::world(robot, options.seed, &faults).map_err(|error| {
        let said = match &options.faults {
            Some(path) => format!("{}: {error}", path.display()),
            None => error.to_string(),
        };
        BadInput(said).into()
    })
}

/// Exit code of a run that ended so.
pub(super) fn exit_code(outcome: Outcome) -> u8 {
    match outcome {
        Outcome::Completed => COMPLETED,
        Outcome::StoppedBySafety => STOPPED_BY_SAFETY,
        Outcome::Failed => FAILED,
    }
}

/// An outcome as it is printed.
pub(super) fn outcome_words(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Completed => "completed",
        Outcome::StoppedBySafety => "STOPPED BY SAFETY",
        Outcome::Failed => "FAILED",
    }
}

/// The gait asked for, at the speed asked for, held to what the robot can do.
fn plan(options: &RunArguments, loaded: &Loaded) -> Result<HorsePlan> {
    let gait = gait(options.gait.as_deref(), &loaded.horse)?;
    let mut plan = loaded.capability.plan(&loaded.horse, gait);
    let top = top_speed::of_gait(&loaded.file.robot, &plan);
    plan.speed_m_s = match options.speed {
        None => DEFAULT_SPEED_SHARE * top.m_s(),
        Some(speed) if !speed.is_finite() || speed < 0.0 => {
            return Err(BadInput(format!("--speed {speed}: expected a speed in m/s, 0 or more")).into());
        }
        Some(speed) if speed > top.m_s() => {
            let limit = top.joint.map_or("the legs reach no further".to_owned(), |joint| {
                format!("{} can turn no faster", loaded.file.robot.joints[joint].name)
            });
            println!("{speed} m/s is too fast for {}: held at {:.3} m/s ({limit})", gait.name, top.m_s());
            top.m_s()
        }
        Some(speed) => speed,
    };
    Ok(plan)
}

fn gait<'h>(wanted: Option<&str>, horse: &'h HorseMotion) -> Result<&'h Gait> {
    let names = || horse.gaits.iter().map(|gait| gait.name.as_str()).collect::<Vec<_>>().join(", ");
    let found = match wanted {
        None => horse.gaits.first(),
        Some(name) => horse.gaits.iter().find(|gait| gait.name == name),
    };
    found.ok_or_else(|| {
        BadInput(format!("--gait {}: expected one of {}", wanted.unwrap_or("(none)"), names())).into()
    })
}

fn fault_script(path: Option<&Path>) -> Result<hw_sim::FaultScript> {
    let Some(path) = path else { return Ok(hw_sim::FaultScript::default()) };
    let text = fs::read_to_string(path).map_err(|error| BadInput(format!("{}: {error}", path.display())))?;
    hw_sim::FaultScript::from_toml(&text)
        .map_err(|error| BadInput(format!("{}: {error}", path.display())).into())
}

/// A report that could not be written is better known before the robot has walked.
fn check_writable(path: &Path) -> Result<&Path> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.file_name().is_none() || path.is_dir() || !folder.is_dir() {
        return Err(BadInput(format!(
            "--report {}: expected a file in a folder that exists",
            path.display()
        ))
        .into());
    }
    Ok(path)
}

/// Writes beside the file first, so that it is never half a report.
fn write_report(path: &Path, report: &Report) -> Result<()> {
    let text = serde_json::to_string_pretty(report).context("the report could not be put into JSON")?;
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    fs::write(&beside, text + "\n")
        .and_then(|()| fs::rename(&beside, path))
        .with_context(|| format!("the report could not be written to {}", path.display()))
}

/// The first SIGINT or SIGTERM orders a stop, the second one at once.
pub(super) fn orders_from_signals() -> Result<Receiver<Order>> {
    let (sender, receiver) = bounded(8);
    let mut signals = Signals::new([SIGINT, SIGTERM]).context("signals could not be caught")?;
    std::thread::spawn(move || {
        let orders = std::iter::once(Order::Stop).chain(std::iter::repeat(Order::StopAtOnce));
        for (_, order) in signals.forever().zip(orders) {
            let _ = sender.try_send(order);
        }
    });
    Ok(receiver)
}

fn print_summary(robot: &Robot, report: &Report) {
    println!("{}: {}", outcome_words(report.outcome), report.reason);
    println!(
        "  {:.1} s, {} cycles, {} late; computing a cycle {} us at most, {} us half of the time",
        report.duration_s,
        report.cycles,
        report.late_cycles,
        report.loop_times.work_us.max,
        report.loop_times.work_us.p50
    );
    println!(
        "  joints: {} goals outside their range, {} too fast, {} changed by safety; off their goal by {:.1} degrees at most",
        report.joints.range_violations,
        report.joints.rate_violations,
        report.safety_interventions,
        report.joints.tracking_error_max_deg
    );
    println!(
        "  feet: {:.1} mm from neutral at most; slip {:.4} mm planned, {:.1} mm measured; IK left {:.4} mm at most",
        report.feet.excursion_max_m * 1e3,
        report.feet.stance_slip_planned_max_m * 1e3,
        report.feet.stance_slip_measured_max_m * 1e3,
        report.feet.ik_residual_max_m * 1e3
    );
    for (bus, described) in report.buses.iter().zip(&robot.buses) {
        println!(
            "  bus {} ({}, {} baud): {} exchanges of {} us, wire busy {:.0} %, {} replies missing, {} damaged",
            bus.name,
            described.protocol.name(),
            described.baud,
            bus.exchanges,
            bus.exchange_us.p50,
            bus.wire_share * 100.0,
            bus.missing,
            bus.corrupt
        );
    }
}
