//! `hippocamp try`: how a robot falls, over many pushes; and how it copes while everything goes wrong.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Serialize;

use super::campaign::{CampaignArguments, try_faults};
use super::load::load;
use super::readable::readable;
use super::{BadInput, COMPLETED, say, write_whole};
use crate::kinds::Falls;
use crate::model::ReflexMode;
use crate::output::{Outputs, Place, WriteMode};
use crate::plot::{self, FallRow};
use crate::trial::{FRICTION, IMPULSE_NS_KG, Scene, Summary, TrialError, Trials, Tried};

/// Columns of the progress bar.
pub(super) const BAR: u64 = 40;

/// Options of `try`.
#[derive(Debug, clap::Args)]
pub(super) struct TryArguments {
    /// The robot file; with --faults several are allowed.
    #[arg(required = true, value_name = "ROBOT")]
    pub(super) robots: Vec<PathBuf>,
    /// Try faults instead of falls: "random" draws new ones for each episode; a file of a folder of findings is
    /// played with --episode.
    #[arg(long, value_name = "random|FILE", conflicts_with_all = ["runs", "is_json", "is_markdown", "picture", "kept"])]
    pub(super) faults: Option<PathBuf>,
    #[command(flatten)]
    pub(super) campaign: CampaignArguments,
    /// How many trials.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    runs: u64,
    /// Seed of all trials: of their pushes, speeds and friction.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = super::seed)]
    pub(super) seed: u64,
    /// Print every trial and the figures as JSON.
    #[arg(long = "json")]
    is_json: bool,
    /// Print the tables as Markdown, for a page.
    #[arg(long = "markdown", conflicts_with = "is_json")]
    is_markdown: bool,
    /// Draw one fall, passive and with the reflex, to this file (SVG): under the hardest push that made it fall.
    #[arg(long, value_name = "FILE")]
    pub(super) picture: Option<PathBuf>,
    /// Draw how it kept its feet against the hardest push that did not make it fall, to this file (SVG).
    #[arg(long, value_name = "FILE")]
    pub(super) kept: Option<PathBuf>,
}

#[derive(Serialize)]
struct Json<'a> {
    robot: &'a str,
    seed: u64,
    summary: &'a Summary,
    trials: &'a [Tried],
}

/// Runs the trials that the options ask for.
pub(super) fn try_it(options: &TryArguments) -> Result<u8> {
    if options.faults.is_some() {
        return try_faults(options);
    }
    match &options.robots[..] {
        [robot] => try_falls(options, robot),
        _ => Err(BadInput("expected one robot; only --faults takes several".to_owned()).into()),
    }
}

/// Tries falls, and prints the results.
fn try_falls(options: &TryArguments, robot_file: &Path) -> Result<u8> {
    let mut outputs = Outputs::of_reading([robot_file]);
    let mut place = |option: &str, path: &Option<PathBuf>| {
        path.as_deref().map(|path| outputs.claim(option, path, WriteMode::Whole)).transpose()
    };
    let picture = place("--picture", &options.picture)?;
    let kept = place("--kept", &options.kept)?;
    let loaded = load(robot_file, None)?;
    let robot = &loaded.file.robot;
    let trials = Trials::new(robot).map_err(bad_input)?;
    let tried =
        trials.try_all(options.runs, options.seed, |done| show(done, options.runs)).map_err(bad_input)?;
    let summary = Summary::of(&tried);
    let tables = format!("{}\n\n{summary}", headline(options, robot_file, &trials));
    if options.is_json {
        let json = Json { robot: &robot.name, seed: options.seed, summary: &summary, trials: &tried };
        say::lines(
            &serde_json::to_string_pretty(&json).context("the trials could not be converted to JSON")?,
        );
    } else {
        say::lines(&if options.is_markdown { tables } else { readable(&tables) });
    }
    let ways = [("passive: limp", ReflexMode::Passive), ("reflex", ReflexMode::Reflex)];
    if let Some(place) = &picture {
        let falls = tried.iter().filter(|tried| tried.off.fallen_s.is_some() && tried.reflex.is_some());
        write_picture(place, &trials, hardest("--picture", "a fall", falls)?, &ways)?;
    }
    if let Some(place) = &kept {
        let kept = tried.iter().filter(|tried| tried.off.fallen_s.is_none());
        write_picture(
            place,
            &trials,
            hardest("--kept", "withstood", kept)?,
            &[("kept its feet", ReflexMode::Off)],
        )?;
    }
    Ok(COMPLETED)
}

pub(super) fn bad_input(error: TrialError) -> anyhow::Error {
    match error {
        TrialError::Unfit(what) => BadInput(what).into(),
        other => other.into(),
    }
}

fn headline(options: &TryArguments, robot_file: &Path, trials: &Trials) -> String {
    let newton_seconds = |share: f64| share * trials.mass_kg();
    if let Falls::AllRound(strengths) = trials.falls() {
        let strengths: Vec<String> = strengths.iter().map(|share| format!("{share}")).collect();
        return format!(
            "`hippocamp try {} --runs {} --seed {}`: standing on ground of friction {} to {}, pushed at the middle of its trunk for 0.1 s \
             to each of eight sides with {} N s for each of its {:.1} kg.",
            robot_file.display(),
            options.runs,
            options.seed,
            FRICTION.0,
            FRICTION.1,
            strengths.join(", "),
            trials.mass_kg(),
        );
    }
    format!(
        "`hippocamp try {} --runs {} --seed {}`: standing, walking and trotting on ground of friction {} to {}, pushed \
         for 0.1 s towards any side with {:.2} to {:.2} N s.",
        robot_file.display(),
        options.runs,
        options.seed,
        FRICTION.0,
        FRICTION.1,
        newton_seconds(IMPULSE_NS_KG.0),
        newton_seconds(IMPULSE_NS_KG.1),
    )
}

/// Draws a progress bar on a terminal; elsewhere prints only the end.
#[allow(clippy::disallowed_methods, reason = "draws over itself, and only its own words")]
fn show(done: u64, of: u64) {
    let mut err = std::io::stderr().lock();
    if !err.is_terminal() {
        return;
    }
    let filled = usize::try_from(BAR * done / of.max(1)).unwrap_or(0);
    let bar = "#".repeat(filled) + &".".repeat(usize::try_from(BAR).unwrap_or(0).saturating_sub(filled));
    let end = if done == of { "\n" } else { "" };
    let _ = write!(err, "\r[{bar}] {done} of {of}{end}");
    let _ = err.flush();
}

/// The trial with the hardest push among these.
fn hardest<'t>(option: &str, what: &str, trials: impl Iterator<Item = &'t Tried>) -> Result<&'t Scene> {
    let hardest = trials.max_by(|a, b| a.scene.impulse_ns.total_cmp(&b.scene.impulse_ns));
    let none = || BadInput(format!("{option}: none of these trials was {what}; more of them may have one"));
    Ok(&hardest.ok_or_else(none)?.scene)
}

/// Draws `scene`, once for each response to it, one below the other.
fn write_picture(
    place: &Place,
    trials: &Trials,
    scene: &Scene,
    ways: &[(&'static str, ReflexMode)],
) -> Result<()> {
    let rows = ways.iter().map(|&(name, mode)| -> Result<FallRow> {
        let observed = trials.observe(scene, mode, true)?;
        Ok(FallRow { name, impact_n: observed.impact_n, track: observed.track })
    });
    let rows: Vec<FallRow> = rows.collect::<Result<_>>()?;
    write_whole(place, &plot::fall(trials.robot(), scene, &rows)?)?;
    say!("picture written to {}", place.path().display());
    Ok(())
}
