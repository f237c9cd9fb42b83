//! `hippocamp run`: stands up, walks, stops, and prints a summary.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use super::drivers::{Driver, load_script};
use super::guard::Guard;
use super::kind::Kind;
use super::load::{Loaded, load};
use super::operator::{OnHardware, Signals, Terminal};
use super::panics::said_afterwards;
use super::ports::{self, Choice, PortOption};
#[cfg(debug_assertions)]
use super::provoke;
use super::record::RecordingFile;
use super::replay::write_page;
use super::status::StatusLine;
use super::unit;
use super::{
    BadInput, COMPLETED, FAILED, FALLEN, POOR, RunArguments, STOPPED_BY_SAFETY, Several, write_whole,
};
use crate::bus::{SerialPorts, SimPorts};
use crate::config::{RobotFile, UnitFile};
use crate::input::read_text;
use crate::kinds::Asked;
use crate::model::Robot;
use crate::motion::Plan;
use crate::operator::Script;
use crate::output::{Outputs, Place, Writing};
use crate::plan::RunPlan;
use crate::recording::{RECORD_MAX, Recorder, RunHeader, Task};
use crate::run::{LATE_SHARE, run_recorded};
use crate::simulation;
use crate::telemetry::{INCOMPLETE, Outcome, Report, Verdict};
use anyhow::{Context, Result};

/// Runs the robot as `options` say; returns the exit code.
pub(super) fn run(options: &RunArguments, kind: Kind) -> Result<u8> {
    let unit = unit::find(&options.robot, options.unit.unit.as_deref())?;
    let [page, record, report_place] = places(options, unit.as_ref())?;
    let mut loaded = load(&options.robot, unit.as_ref())?;
    options.unit.take_physics_off(&mut loaded.file.robot, unit.as_ref());
    let robot = &loaded.file.robot;
    if robot.buses.is_empty() {
        let path = options.robot.display();
        return Err(BadInput(format!(
            "{path}: {} has no buses: it exists on paper only and cannot be run; try 'hippocamp check {path}'",
            robot.name
        ))
        .into());
    }
    if kind == Kind::Run && options.driver.script().is_some() && options.walk_for_s.is_some() {
        let said = "--for: cannot be used with --script, which says itself when it ends (end_s)";
        return Err(BadInput(said.to_owned()).into());
    }
    let for_s = kind.for_s(options);
    if !(for_s.is_finite() && for_s >= 0.0) {
        return Err(BadInput(format!("--for {for_s}: expected a time in seconds, 0 or more")).into());
    }
    let choice = ports::choose(&options.unit, robot, &options.robot, unit.as_ref())?;
    // Before a driver sets the terminal to keys: an uncaught signal would leave it so.
    let signals = Signals::catch()?;
    let (motion, move_for_s, driver) = plan(options, kind, &loaded)?;
    let ports = match &choice {
        Choice::Simulated { is_virtual } => AnyPorts::Simulated(SimPorts::of(
            simulated_world(robot, options.faults.as_deref(), options.seed)?,
            *is_virtual,
        )),
        Choice::Devices(_) if options.faults.is_some() => {
            let said = "--faults: only simulated buses have them; add --simulate, or leave it out";
            return Err(BadInput(said.to_owned()).into());
        }
        Choice::Devices(ports) => {
            let guard = Guard::start(&options.robot, ports)?;
            AnyPorts::Serial(ports::open(robot, ports)?, guard)
        }
    };
    // A page is made from a recording; one that the user did not ask for is deleted afterwards.
    let is_passing = record.is_none();
    let recording = match (record, &page) {
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
        say!("  --virtual: time flies, a minute in less than a second; leave it out to drive by hand");
    }
    let status_line = StatusLine::start(robot, &*loaded.kind);
    let driver_name = (!matches!(driver, Driver::Plan)).then(|| driver.to_string());
    let terminal = |hardware| {
        let terminal = Terminal::new(signals, driver, Some(status_line), hardware);
        #[cfg(debug_assertions)]
        let terminal = provoke::Loop::new(terminal);
        terminal
    };
    let plan = RunPlan { motion, method: options.ik.into(), move_for_s, driver: driver_name };
    #[cfg(debug_assertions)]
    let file = file.map(provoke::Sink::new);
    let recorder = recording.as_ref().zip(file);
    let recorder = recorder
        .map(|(of, file)| recorder_into(file, of.name(), &loaded.file, &plan, options))
        .transpose()?;
    let ended = said_afterwards(|| match ports {
        AnyPorts::Simulated(ports) => Ok(run_recorded(robot, plan, ports, recorder, terminal(None))?),
        AnyPorts::Serial(ports, guard) => {
            let hardware = OnHardware { processor: options.unit.processor, heart: guard.heart()? };
            let terminal = terminal(Some(hardware));
            guard.over(
                || Ok(run_recorded(robot, plan, ports, recorder, terminal)?),
                |report| report.is_end_heard,
            )
        }
    });
    let (mut report, mut recording) = match ended {
        Ok(report) => (report, recording),
        Err(error) => {
            recording.into_iter().for_each(RecordingFile::discard);
            return Err(error);
        }
    };
    if let Some(recording) = &mut recording {
        keep(recording, &mut report);
    }
    if is_passing {
        // A recording made only for a page does not belong in the report, unless it is incomplete.
        report.recording =
            report.recording.filter(|recording| recording.error.is_some() || recording.dropped > 0);
    }
    let written = report_place.map_or(Ok(()), |place| write_report(&place, &report));
    print_summary(robot, &report);
    written?;
    if let (Some(page), Some(recording)) = (page, recording) {
        write_page(recording.read_back(), recording.name(), &page)?;
    }
    Ok(match (report.outcome, report.verdict) {
        (Outcome::Completed, Verdict::Poor) if options.strict => POOR,
        // It fell on the way, and got up.
        (Outcome::Completed, Verdict::Failed) if options.strict => FALLEN,
        (outcome, _) => exit_code(outcome),
    })
}

/// Ports of either kind. The compiler makes a loop for each, so that the choice costs nothing at run time.
enum AnyPorts {
    Simulated(SimPorts),
    /// With the guard that takes the torque off if this process dies.
    Serial(SerialPorts, Guard),
}

/// The servos of `robot` in a simulated world, with the faults that the user asked for.
pub(super) fn simulated_world(robot: &Robot, faults: Option<&Path>, seed: u64) -> Result<hw_sim::World> {
    let faults = match faults {
        Some(path) => fault_script(robot, path)?,
        None => hw_sim::FaultScript::default(),
    };
    Ok(simulation::world(robot, seed, &faults)?)
}

/// Exit code of a run with this outcome.
pub(super) fn exit_code(outcome: Outcome) -> u8 {
    match outcome {
        Outcome::Completed => COMPLETED,
        Outcome::StoppedBySafety => STOPPED_BY_SAFETY,
        Outcome::Fallen => FALLEN,
        Outcome::Failed => FAILED,
    }
}

/// An outcome as it is printed.
pub(super) fn outcome_words(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Completed => "completed",
        Outcome::StoppedBySafety => "STOPPED BY SAFETY",
        Outcome::Fallen => "FALLEN",
        Outcome::Failed => "FAILED",
    }
}

/// The plan, its length, and the driver: drivers other than the plan start from a stand, for as long as they like.
fn plan(options: &RunArguments, command: Kind, loaded: &Loaded) -> Result<(Plan, f64, Driver)> {
    let (robot, kind) = (&loaded.file.robot, &*loaded.kind);
    let asked = Asked {
        gait: options.gait.as_deref(),
        speed_m_s: options.speed,
        stroke: options.stroke.as_deref(),
        tempo: options.tempo,
        pose: options.pose.as_deref(),
    };
    let for_s = command.for_s(options);
    let is_alone = !options.driver.is_some() && !asked.is_some();
    if command == Kind::Show || (is_alone && kind.shows_by_itself()) {
        return Ok((kind.plan_to_rest(robot), for_s, show(options, for_s, &asked, loaded)?));
    }
    let driver = match asked.is_some() && kind.shows_by_itself() {
        true => Driver::Plan,
        false => Driver::start(&options.driver, robot, kind)?,
    };
    if !matches!(driver, Driver::Plan) && !asked.is_some() {
        return Ok((kind.plan_to_rest(robot), 0.0, driver));
    }
    let (plan, remark) = kind.plan(robot, &asked).map_err(BadInput::from)?;
    remark.iter().for_each(|remark| say!("{remark}"));
    Ok((plan, for_s, driver))
}

/// A show: of the script that the user names, over and over, or of everything the robot can show.
fn show(options: &RunArguments, for_s: f64, asked: &Asked<'_>, loaded: &Loaded) -> Result<Driver> {
    let (robot, kind) = (&loaded.file.robot, &*loaded.kind);
    let all = kind.show(robot, for_s).map_err(BadInput::from)?;
    if asked.is_some() {
        return Err(BadInput("--stroke: a show has many; --script says which".to_owned()).into());
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

pub(super) fn fault_script(robot: &Robot, path: &Path) -> Result<hw_sim::FaultScript> {
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

/// Places of page, recording and report; none may be a file that the run reads.
fn places(options: &RunArguments, unit: Option<&UnitFile>) -> Result<[Option<Place>; 3]> {
    let unit_path = unit::path(&options.robot, options.unit.unit.as_deref());
    let files = [Some(&options.robot), unit_path.as_ref(), options.faults.as_ref()].into_iter().flatten();
    let files = files.map(PathBuf::as_path).chain(options.driver.script());
    let named = options.unit.ports.iter().map(PortOption::path);
    let noted = unit.iter().flat_map(|unit| unit.unit.devices()).map(Path::new);
    let mut outputs = Outputs::of_reading(files.chain(named).chain(noted));
    let mut claim = |option: &str, path: &Option<PathBuf>, writing| {
        path.as_deref().map(|path| outputs.claim(option, path, writing)).transpose()
    };
    let page = claim("--html", &options.html, Writing::Whole)?;
    let record = claim("--record", &options.record, Writing::Recording)?;
    let report = claim("--report", &options.report, Writing::Whole)?;
    if let (Some(_), Some(record)) = (&page, record.as_ref().filter(|record| record.is_stream())) {
        let path = record.path().display();
        return Err(BadInput(format!(
            "--record {path}: no file, and the page of --html is made from the recording: name a file, or leave one out"
        ))
        .into());
    }
    let bytes = std::fs::metadata(&options.robot).map_or(0, |found| found.len());
    if (page.is_some() || record.is_some()) && bytes > RECORD_MAX {
        let path = options.robot.display();
        return Err(BadInput(format!(
            "{path}: {bytes} bytes; a recording has the robot file inside, and none of more than {RECORD_MAX} is read back: \
             take out comments, or run without --record and --html"
        ))
        .into());
    }
    Ok([page, record, report])
}

/// Moves a complete recording to its final place, and notes the place in the report.
fn keep(recording: &mut RecordingFile, report: &mut Report) {
    if let Some(of) = &mut report.recording
        && of.error.is_none()
    {
        match recording.keep() {
            Ok(()) => recording.name().clone_into(&mut of.file),
            Err(error) => of.error = Some(format!("it could not be put in its place: {error}")),
        }
    }
}

/// Records into `sink`, which is the file called `name`.
fn recorder_into(
    sink: impl Write + Send + 'static,
    name: &str,
    file: &RobotFile,
    plan: &RunPlan,
    options: &RunArguments,
) -> Result<Recorder> {
    // A recording that outgrows a limit of the system breaks off; it must not kill the controller.
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())
        .context("signals could not be caught")?;
    // A virtual run is the same at any time of day, and so is its recording.
    let started = if options.unit.is_virtual { UNIX_EPOCH } else { SystemTime::now() };
    let started_ns = started.duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    let header = RunHeader::new(
        &file.robot,
        plan,
        &options.robot.display().to_string(),
        u64::try_from(started_ns).unwrap_or_default(),
    );
    Recorder::start(
        &file.robot,
        header,
        file.text().to_owned(),
        name.to_owned(),
        sink,
        options.unit.is_virtual,
    )
    .context("the recording could not be started")
}

fn write_report(place: &Place, report: &Report) -> Result<()> {
    let text = serde_json::to_string_pretty(report).context("the report could not be put into JSON")?;
    write_whole(place, &(text + "\n"))
}

fn print_summary(robot: &Robot, report: &Report) {
    say!("{}: {}: {}", report.verdict.name(), outcome_words(report.outcome), report.reason);
    if let (Some(asked), Some(reached)) = (report.asked, report.reached) {
        say!(
            "  asked for {:.3} m/s, {:.2} m and {:.0} degrees of turn; reached {:.3} m/s, {:.2} m and {:.0} degrees",
            asked.speed_m_s,
            asked.distance_m,
            asked.turn_deg,
            reached.speed_m_s,
            reached.distance_m,
            reached.turn_deg
        );
    }
    // The first line says why a run did not complete.
    for finding in report.findings.iter().filter(|finding| finding.what != INCOMPLETE) {
        let place = if finding.place.is_empty() { String::new() } else { format!(" ({})", finding.place) };
        say!(
            "  {}: {}{place}: {}; likely cause: {}; cure: {}",
            finding.verdict.name(),
            finding.what,
            finding.how_much,
            finding.likely_cause,
            finding.cure
        );
    }
    let computing = report.loop_times.work_us.map_or_else(String::new, |work_us| {
        format!("; computing a cycle {} us at most, {} us half of the time", work_us.max, work_us.p50)
    });
    say!(
        "  {:.1} s, {} cycles, {} late by more than {} ms{computing}",
        report.duration_s,
        report.cycles,
        report.late_cycles,
        LATE_SHARE * robot.period_s() * 1e3
    );
    if let Some(slowest) = &report.loop_times.slowest {
        say!("  {slowest}");
    }
    say!(
        "  joints: {} goals outside their range, {} too fast, {} changed by safety, held for {} cycles; off their goal by {:.1} degrees at most",
        report.joints.range_violations,
        report.joints.rate_violations,
        report.safety_interventions,
        report.held_cycles,
        report.joints.tracking_error_max_deg
    );
    if let Some(feet) = &report.feet {
        say!("  {feet}");
    }
    if let Some(body) = &report.body {
        say!("  {body}");
    }
    if let Some(arms) = &report.arms {
        say!("  {arms}");
    }
    if let Some(imu) = &report.imu {
        say!("  {imu}");
    }
    if let Some(falls) = report.falls.filter(|falls| falls.falls > 0) {
        say!("  {falls}");
    }
    if let Some(times) = report.arm_yields.filter(|times| *times > 0) {
        say!("  arms gave way to a load {times} times");
    }
    for outage in &report.outages {
        say!("  at {:.1} s {}", outage.time_s, outage.reason);
    }
    if report.servo_restarts > 0 {
        say!("  servos that tripped: {} restarts", report.servo_restarts);
    }
    for (bus, described) in report.buses.iter().zip(&robot.buses) {
        say!(
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
    if let Some(recording) = &report.recording {
        let error =
            recording.error.as_ref().map_or_else(String::new, |error| format!(", then ended: {error}"));
        say!(
            "  recording {}: {} cycles, {} dropped{error}",
            recording.file,
            recording.records,
            recording.dropped
        );
    }
}
