//! The options of `run`, and whether they can go together.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::ValueEnum;

use super::super::drivers::DriverArguments;
use super::super::mode::RunMode;
use super::super::ports::PortOption;
use super::super::{BadInput, UnitArguments, seed, unit};
use crate::config::UnitFile;
use crate::ik::Method;
use crate::model::Robot;
use crate::motion::tentacle::strokes::STROKES;
use crate::output::{Outputs, Place, WriteMode};
use crate::recording::RECORD_MAX;

/// Options of `run`.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct RunArguments {
    /// The robot file.
    pub(in crate::cli) robot: PathBuf,
    /// Gait: one of those that 'hippocamp check' lists [default: walk].
    #[arg(long, value_name = "NAME")]
    pub(in crate::cli) gait: Option<String>,
    /// Speed in m/s, negative to go backwards; limited to what legs and servos can do [default: nine tenths of the
    /// top speed].
    #[arg(long, value_name = "M_S", allow_negative_numbers = true)]
    pub(in crate::cli) speed: Option<f64>,
    #[arg(long, value_name = "NAME", conflicts_with_all = ["gait", "speed"], help = stroke_help())]
    pub(in crate::cli) stroke: Option<String>,
    /// For arms: the tempo, as a multiple of the robot file's.
    #[arg(long, value_name = "TIMES", requires = "stroke", allow_negative_numbers = true)]
    pub(in crate::cli) tempo: Option<f64>,
    /// For a figure: the pose to take, one of those that 'hippocamp check' lists [default: stand].
    #[arg(long, value_name = "NAME", conflicts_with_all = ["gait", "speed", "stroke"])]
    pub(in crate::cli) pose: Option<String>,
    /// How long to walk, or to perform a stroke, show or pose, in seconds, before slowing down.
    /// [default: 20; a show runs until you end it]
    #[arg(long = "for", value_name = "SECONDS", allow_negative_numbers = true)]
    pub(in crate::cli) walk_for_s: Option<f64>,
    /// Exit with code 6 where the run completed and its verdict is poor.
    #[arg(long)]
    pub(in crate::cli) strict: bool,
    #[command(flatten)]
    pub(in crate::cli) driver: DriverArguments,
    #[command(flatten)]
    pub(in crate::cli) unit: UnitArguments,
    /// Seed for the start angles of the simulated robot's limp joints, and everything else that is random.
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "ports",
          allow_negative_numbers = true, value_parser = seed)]
    pub(in crate::cli) seed: u64,
    /// Faults of the simulated buses, and their times (TOML; see docs/faults.md).
    #[arg(long, value_name = "FILE", conflicts_with = "ports")]
    pub(in crate::cli) faults: Option<PathBuf>,
    /// Write the report of the run to this file (JSON). A cycle counts as late when it begins more than a tenth of
    /// a period after its time; the robot then continues from where it is.
    #[arg(long, value_name = "FILE")]
    pub(in crate::cli) report: Option<PathBuf>,
    /// Record every cycle to this file (MCAP; opens in Foxglove and with 'hippocamp replay'). It is FILE.part until
    /// it is complete; a FILE.part that already exists is not overwritten.
    #[arg(long, value_name = "FILE")]
    pub(in crate::cli) record: Option<PathBuf>,
    /// Write a page that plays the run to this file; opens in any browser, without a network.
    #[arg(long, value_name = "FILE")]
    pub(in crate::cli) html: Option<PathBuf>,
    /// Inverse kinematics: the thesis' method alone, or with the least-squares finish.
    #[arg(long, value_enum, default_value_t = Ik::CcdFinish)]
    pub(in crate::cli) ik: Ik,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Ik {
    /// Cyclic coordinate descent alone, ten sweeps a cycle; leaves millimetres.
    #[value(name = "ccd")]
    Ccd,
    /// One sweep, then least squares.
    #[value(name = "ccd+finish")]
    CcdFinish,
}

impl From<Ik> for Method {
    fn from(ik: Ik) -> Method {
        match ik {
            Ik::Ccd => Method::Ccd { sweeps: 10 },
            Ik::CcdFinish => Method::CcdThenFinish,
        }
    }
}

/// Files that the run writes.
pub(super) struct Places {
    pub(super) page: Option<Place>,
    pub(super) record: Option<Place>,
    pub(super) report: Option<Place>,
}

/// The help of `--stroke`: every stroke of the table.
fn stroke_help() -> String {
    let names: Vec<_> = STROKES.iter().map(|kind| kind.name).collect();
    format!("For arms: one stroke ({}) instead of a show of all of them", names.join(", "))
}

/// Checks that `robot` can run at all, and for as long as `options` say.
pub(super) fn check(options: &RunArguments, mode: RunMode, robot: &Robot) -> Result<(), BadInput> {
    if robot.buses.is_empty() {
        let path = options.robot.display();
        return Err(BadInput(format!(
            "{path}: {} has no buses: it exists on paper only and cannot be run; try 'hippocamp check {path}'",
            robot.name
        )));
    }
    if mode == RunMode::Run && options.driver.script().is_some() && options.walk_for_s.is_some() {
        let said = "--for: cannot be used with --script, which sets its own end (end_s)";
        return Err(BadInput(said.to_owned()));
    }
    let for_s = mode.for_s(options);
    if !(for_s.is_finite() && for_s >= 0.0) {
        return Err(BadInput(format!("--for {for_s}: expected a time in seconds, 0 or more")));
    }
    Ok(())
}

/// Places of page, recording and report; none may be a file that the run reads.
pub(super) fn places(options: &RunArguments, unit: Option<&UnitFile>) -> Result<Places> {
    let unit_path = unit::path(&options.robot, options.unit.unit.as_deref());
    let files = [Some(&options.robot), unit_path.as_ref(), options.faults.as_ref()].into_iter().flatten();
    let files = files.map(PathBuf::as_path).chain(options.driver.script());
    let named = options.unit.ports.iter().map(PortOption::path);
    let noted = unit.iter().flat_map(|unit| unit.unit.devices()).map(Path::new);
    let mut outputs = Outputs::of_reading(files.chain(named).chain(noted));
    let mut claim = |option: &str, path: &Option<PathBuf>, writing| {
        path.as_deref().map(|path| outputs.claim(option, path, writing)).transpose()
    };
    let page = claim("--html", &options.html, WriteMode::Whole)?;
    let record = claim("--record", &options.record, WriteMode::Recording)?;
    let report = claim("--report", &options.report, WriteMode::Whole)?;
    if let (Some(_), Some(record)) = (&page, record.as_ref().filter(|record| record.is_stream())) {
        let path = record.path().display();
        return Err(BadInput(format!(
            "--record {path}: not a file, but the page of --html is made from the recording: name a file, or leave \
             out one of the two"
        ))
        .into());
    }
    let bytes = std::fs::metadata(&options.robot).map_or(0, |found| found.len());
    if (page.is_some() || record.is_some()) && bytes > RECORD_MAX {
        let path = options.robot.display();
        return Err(BadInput(format!(
            "{path}: {bytes} bytes; a recording contains the robot file, and one of more than {RECORD_MAX} bytes \
             cannot be read back: remove comments, or run without --record and --html"
        ))
        .into());
    }
    Ok(Places { page, record, report })
}
