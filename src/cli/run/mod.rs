//! `hippocamp run`: stands up, walks, stops, and prints a summary.

mod options;
mod outcome;
mod resolve;

use anyhow::Result;

use super::drivers::Driver;
use super::guard::Guard;
use super::load::load;
use super::mode::RunMode;
use super::operator::{OnHardware, Signals, Terminal};
use super::panics::said_afterwards;
use super::ports::{self, Choice};
#[cfg(debug_assertions)]
use super::provoke;
use super::record::{RecordingFile, recorder_into};
use super::replay::write_page;
use super::status::StatusLine;
use super::{BadInput, unit};
use crate::bus::{SerialPorts, SimPorts};
use crate::kinds;
use crate::model::Robot;
use crate::observe::Observer;
use crate::plan::RunPlan;
use crate::recording::{Recorder, Task};
use crate::run::run_observed;
use crate::telemetry::Report;
pub(super) use options::RunArguments;
pub(super) use outcome::{exit_code, outcome_words};
pub(super) use resolve::{fault_script, simulated_world};

/// Runs the robot as `options` say; returns the exit code.
pub(super) fn run(options: &RunArguments, mode: RunMode) -> Result<u8> {
    let unit = unit::find(&options.robot, options.unit.unit.as_deref())?;
    let places = options::places(options, unit.as_ref())?;
    let mut loaded = load(&options.robot, unit.as_ref())?;
    options.unit.take_physics_off(&mut loaded.file.robot, unit.as_ref());
    let robot = &loaded.file.robot;
    options::check(options, mode, robot)?;
    let choice = ports::choose(&options.unit, robot, &options.robot, unit.as_ref())?;
    // Before a driver sets the terminal to keys: an uncaught signal would leave it so.
    let signals = Signals::catch()?;
    let (motion, move_for_s, driver) = resolve::plan(options, mode, &loaded)?;
    let ports = open(options, robot, &choice)?;
    // A page is made from a recording; one that the user did not ask for is deleted afterwards.
    let is_passing = places.record.is_none();
    let recording = match (places.record, &places.page) {
        (Some(place), _) => Some(RecordingFile::begin(place)?),
        (None, Some(page)) => Some(RecordingFile::for_page(page)?),
        (None, None) => None,
    };
    let (recording, file) = recording.unzip();

    match &driver {
        Driver::Plan => {
            say!("{}: {} for {move_for_s} s on {choice}", robot.name, Task::of(&motion));
        }
        driver => say!("{}: driven by {driver}, on {choice}", robot.name),
    }
    driver.help().iter().for_each(|line| say!("  {line}"));
    if options.unit.is_virtual && matches!(driver, Driver::Keys(..) | Driver::Gamepad(..)) {
        say!("  --virtual: a minute passes in less than a second; leave it out to drive by hand");
    }
    let driver_name = (!matches!(driver, Driver::Plan)).then(|| driver.to_string());
    let plan = RunPlan { motion, method: options.ik.into(), move_for_s, driver: driver_name };
    #[cfg(debug_assertions)]
    let file = file.map(provoke::Sink::new);
    let recorder = recording.as_ref().zip(file);
    let recorder = recorder
        .map(|(of, file)| recorder_into(file, of.name(), &loaded.file, &plan, options))
        .transpose()?;
    let ended =
        said_afterwards(|| drive(options, (robot, &*loaded.kind), &plan, ports, recorder, (signals, driver)));
    let (mut report, mut recording) = match ended {
        Ok(report) => (report, recording),
        Err(error) => {
            recording.into_iter().for_each(RecordingFile::discard);
            return Err(error);
        }
    };

    if let Some(recording) = &mut recording {
        outcome::keep(recording, &mut report);
    }
    if is_passing {
        // A recording made only for a page does not belong in the report, unless it is incomplete.
        report.recording =
            report.recording.filter(|recording| recording.error.is_some() || recording.dropped > 0);
    }
    let written = places.report.map_or(Ok(()), |place| outcome::write_report(&place, &report));
    outcome::print_summary(robot, &report);
    written?;
    if let (Some(page), Some(recording)) = (places.page, recording) {
        write_page(recording.read_back(), recording.name(), &page)?;
    }
    Ok(outcome::exit_code_of(&report, options.strict))
}

/// Ports of either kind. The compiler makes a loop for each, so that the choice costs nothing at run time.
enum AnyPorts {
    Simulated(SimPorts),
    /// With the guard that takes the torque off if this process dies.
    Serial(SerialPorts, Guard),
}

/// Opens the ports of `robot` that were chosen.
fn open(options: &RunArguments, robot: &Robot, choice: &Choice) -> Result<AnyPorts> {
    match choice {
        Choice::Simulated { is_virtual } => {
            let world = simulated_world(robot, options.faults.as_deref(), options.seed)?;
            Ok(AnyPorts::Simulated(SimPorts::of(world, *is_virtual)))
        }
        Choice::Devices(_) if options.faults.is_some() => {
            let said = "--faults: only simulated buses have them; add --simulate, or leave it out";
            Err(BadInput(said.to_owned()).into())
        }
        Choice::Devices(ports) => {
            let guard = Guard::start(&options.robot, ports)?;
            Ok(AnyPorts::Serial(ports::open(robot, ports)?, guard))
        }
    }
}

/// Runs the robot with everything that looks on.
fn drive(
    options: &RunArguments,
    (robot, kind): (&Robot, &dyn kinds::Kind),
    plan: &RunPlan,
    ports: AnyPorts,
    mut recorder: Option<Recorder>,
    (signals, driver): (Signals, Driver),
) -> Result<Report> {
    let mut status_line = StatusLine::start(robot, kind);
    let notes = status_line.notes();
    let mut observers: Vec<&mut dyn Observer> = Vec::new();
    observers.extend(recorder.as_mut().map(|recorder| recorder as &mut dyn Observer));
    observers.push(&mut status_line);
    let terminal = |hardware| {
        let terminal = Terminal::new(signals, driver, Some(notes), hardware);
        #[cfg(debug_assertions)]
        let terminal = provoke::Loop::new(terminal);
        terminal
    };
    match ports {
        AnyPorts::Simulated(ports) => Ok(run_observed(robot, plan, ports, &mut observers, terminal(None))?),
        AnyPorts::Serial(ports, guard) => {
            let hardware = OnHardware { processor: options.unit.processor, heart: guard.heart()? };
            let terminal = terminal(Some(hardware));
            guard.over(
                || Ok(run_observed(robot, plan, ports, &mut observers, terminal)?),
                |report| report.is_end_heard,
            )
        }
    }
}
