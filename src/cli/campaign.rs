//! `hippocamp try --faults`: robots run over and over while everything goes wrong.

use std::fs::{self, File, OpenOptions};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::interrupt;
use super::load::load;
use super::run::fault_script;
use super::trial::{BAR, TryArguments, bad_input};
use super::{BadInput, COMPLETED, FAILED, say, write_whole};
use crate::model::{OnTrip, StopAction};
use crate::output::{Outputs, Writing};
use crate::platform::process_time;
use crate::trial::campaign::{Campaign, Episode, Judged, Played, Subject, Tally, Wrong, play};

/// Where a campaign keeps what is done, in its folder.
const KEPT: &str = "episodes.jsonl";

/// An episode as it is written beside its faults: one that was drawn, and what of it was changed.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    robot: String,
    seed: u64,
    number: u64,
    found: Vec<String>,
    end_s: f64,
    physics: bool,
    sits: bool,
    stops_holding: bool,
    trips_freeze: bool,
    /// Times of the orders that are left.
    orders_s: Vec<f64>,
}

/// Tries robots while everything goes wrong, or plays one episode again.
pub(super) fn try_faults(options: &TryArguments) -> Result<u8> {
    let faults = options.faults.as_deref().unwrap_or(Path::new("random"));
    if let Some(path) = &options.campaign.episode {
        return again(options, path, faults);
    }
    if faults != Path::new("random") {
        let said = "--faults FILE: expected --episode FILE beside it, of the same folder; or --faults random";
        return Err(BadInput(said.to_owned()).into());
    }
    let subjects = options.robots.iter().map(|path| subject(path)).collect::<Result<Vec<_>>>()?;
    if let Some(number) = options.campaign.only {
        let [subject] = &subjects[..] else {
            return Err(BadInput("--only: expected one robot, whose episode it is".to_owned()).into());
        };
        let episode = Episode::draw(subject, options.seed, number);
        return tell_of(&play(subject, &episode)?, &episode);
    }
    campaign(options, Campaign::new(subjects, options.seed))
}

fn subject(path: &Path) -> Result<Subject> {
    let loaded = load(path, None)?;
    Subject::new(loaded.file.robot, loaded.capability).map_err(bad_input)
}

fn campaign(options: &TryArguments, campaign: Campaign) -> Result<u8> {
    let (folder, most_s) = (&options.campaign.out, 3600.0 * options.campaign.hours);
    fs::create_dir_all(folder).with_context(|| format!("{} could not be made", folder.display()))?;
    let kept = folder.join(KEPT);
    let mut tally = Tally::default();
    match fs::read_to_string(&kept) {
        Ok(text) if options.campaign.resume => tally.take_up(&text),
        Ok(_) => {
            let said = format!(
                "{} is there already: go on with --resume, or name another folder with --out",
                kept.display()
            );
            return Err(BadInput(said).into());
        }
        Err(_) => {}
    }
    let mut log = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&kept)
        .with_context(|| format!("{} could not be opened", kept.display()))?;
    let is_to_stop = interrupt::catch()?;
    let begun = process_time();
    let before_s = tally.virtual_s;
    let (done, done_s) = (tally.done.clone(), tally.virtual_s);
    let mut failed = None;
    campaign
        .run(
            most_s,
            &done,
            done_s,
            || is_to_stop.load(Ordering::Relaxed),
            |judged| {
                let kept = keep(options, &campaign, &mut tally, &mut log, &judged);
                failed = failed.take().or(kept.err());
                show(tally.virtual_s, most_s, tally.wrong_episodes);
            },
        )
        .map_err(bad_input)?;
    failed.map_or(Ok(()), Err)?;
    say::lines(&tally.to_string());
    for (index, subject) in campaign.subjects().iter().enumerate() {
        let hours = tally.robots_s.get(&index).copied().unwrap_or_default() / 3600.0;
        say!("  {}: {hours:.2} virtual hours", subject.robot().name);
    }
    let core_s = process_time().saturating_sub(begun).as_secs_f64();
    say!("an hour of one core gives {:.0} virtual hours", (tally.virtual_s - before_s) / core_s.max(1e-3));
    if is_to_stop.load(Ordering::Relaxed) {
        say!("broken off; go on with --resume");
    }
    Ok(if tally.wrong_episodes == 0 { COMPLETED } else { FAILED })
}

/// Counts an episode, and writes it down.
fn keep(
    options: &TryArguments,
    campaign: &Campaign,
    tally: &mut Tally,
    log: &mut File,
    judged: &Judged,
) -> Result<()> {
    let line = tally.count(judged);
    writeln!(log, "{line}").context("what is done could not be written down")?;
    for (wrong, episode, played) in &judged.smallest {
        write_finding(options, campaign, judged, (*wrong, episode, played))?;
    }
    if let (Some(first), true) = (judged.played.findings.first(), judged.smallest.is_empty()) {
        let robot = options.robots[judged.subject].display();
        clear_bar();
        say!("{robot}, episode {}: {}: {}", judged.number, first.wrong.name(), first.what);
    }
    Ok(())
}

/// Writes the smallest episode of a finding to a folder of its own, and says how to play it again.
fn write_finding(
    options: &TryArguments,
    campaign: &Campaign,
    judged: &Judged,
    (wrong, episode, played): (Wrong, &Episode, &Played),
) -> Result<()> {
    let path = &options.robots[judged.subject];
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let folder = options.campaign.out.join(format!("{}-{stem}-{}", wrong.name(), judged.number));
    fs::create_dir_all(&folder).with_context(|| format!("{} could not be made", folder.display()))?;
    let written = Written {
        robot: path.display().to_string(),
        seed: options.seed,
        number: judged.number,
        found: played.findings.iter().map(said).collect(),
        end_s: episode.end_s,
        physics: episode.has_physics,
        sits: episode.sits,
        stops_holding: episode.stop_action == StopAction::Hold,
        trips_freeze: episode.on_trip == OnTrip::Freeze,
        orders_s: episode.orders.iter().map(|ordered| ordered.at_s).collect(),
    };
    let (faults, file) = (folder.join("faults.toml"), folder.join("episode.toml"));
    let text = toml::to_string(&written).context("an episode could not be put into TOML")?;
    let mut outputs = Outputs::of_reading(&options.robots);
    for (path, text) in [(&faults, &episode.script().to_toml()), (&file, &text)] {
        write_whole(&outputs.claim("--out", path, Writing::Whole)?, text)?;
    }
    clear_bar();
    let robot = campaign.subjects()[judged.subject].robot();
    say!("{}, episode {}: {}", robot.name, judged.number, wrong.name());
    played.findings.iter().for_each(|finding| say!("  {}", said(finding)));
    say!(
        "  again: hippocamp try {} --faults {} --episode {}",
        path.display(),
        faults.display(),
        file.display()
    );
    Ok(())
}

fn said(finding: &crate::trial::campaign::Finding) -> String {
    format!("{} at {:.3} s: {}", finding.wrong.name(), finding.time_s, finding.what)
}

/// Plays the episode at `path` again, with the faults at `faults`.
fn again(options: &TryArguments, path: &Path, faults: &Path) -> Result<u8> {
    let [robot] = &options.robots[..] else {
        return Err(BadInput("--episode: expected one robot, whose episode it is".to_owned()).into());
    };
    let subject = subject(robot)?;
    let text = fs::read_to_string(path).map_err(|error| BadInput(format!("{}: {error}", path.display())))?;
    let written: Written =
        toml::from_str(&text).map_err(|error| BadInput(format!("{}: {error}", path.display())))?;
    let mut episode = Episode::draw(&subject, written.seed, written.number);
    if faults != Path::new("random") {
        episode.faults = fault_script(subject.robot(), faults)?.faults;
    }
    episode.end_s = written.end_s;
    episode.has_physics = written.physics && subject.robot().physics.is_some();
    episode.sits = written.sits;
    episode.stop_action = if written.stops_holding { StopAction::Hold } else { StopAction::SitThenLimp };
    episode.on_trip = if written.trips_freeze { OnTrip::Freeze } else { OnTrip::Stop };
    let is_left = |at_s: f64| written.orders_s.iter().any(|left_s| (left_s - at_s).abs() < 1e-9);
    episode.orders.retain(|ordered| is_left(ordered.at_s));
    tell_of(&play(&subject, &episode)?, &episode)
}

fn tell_of(played: &Played, episode: &Episode) -> Result<u8> {
    say::lines(&episode.script().to_toml());
    for ordered in &episode.orders {
        say!("# at {:.3} s: {:?}", ordered.at_s, ordered.order);
    }
    say!(
        "# told to stop at {:.3} s; physics {}, sits {}, {:?}, {:?}",
        episode.end_s,
        episode.has_physics,
        episode.sits,
        episode.stop_action,
        episode.on_trip
    );
    let outcome = played.outcome.map_or("not started", crate::telemetry::Outcome::name);
    say!("{outcome} after {:.2} s: {}", played.virtual_s, played.reason);
    played.findings.iter().for_each(|finding| say!("{}", said(finding)));
    if played.findings.is_empty() {
        say!("nothing found");
    }
    Ok(if played.findings.is_empty() { COMPLETED } else { FAILED })
}

/// A bar on a terminal; elsewhere nothing.
#[allow(clippy::disallowed_methods, reason = "draws over itself, and only its own words")]
fn show(done_s: f64, of_s: f64, wrong: u64) {
    let mut err = std::io::stderr().lock();
    if !err.is_terminal() {
        return;
    }
    let share = (done_s / of_s.max(1e-9)).clamp(0.0, 1.0);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "0 to a few columns"
    )]
    let filled = (share * BAR as f64) as usize;
    let bar = "#".repeat(filled) + &".".repeat(usize::try_from(BAR).unwrap_or(0).saturating_sub(filled));
    let end = if done_s >= of_s { "\n" } else { "" };
    let (done, of) = (done_s / 3600.0, of_s / 3600.0);
    let _ = write!(err, "\r[{bar}] {done:.2} of {of:.1} hours, {wrong} findings{end}");
    let _ = err.flush();
}

/// Makes room for a line where the bar is.
#[allow(clippy::disallowed_methods, reason = "draws over itself, and only its own words")]
fn clear_bar() {
    let mut err = std::io::stderr().lock();
    if err.is_terminal() {
        let _ = write!(err, "\r{:80}\r", "");
    }
}

/// Options of a campaign, beside those of all trials.
#[derive(Debug, clap::Args)]
pub(super) struct CampaignArguments {
    /// How long, in virtual hours, all robots together.
    #[arg(long, value_name = "H", default_value_t = 1.0, requires = "faults", value_parser = hours)]
    pub(super) hours: f64,
    /// Where findings and what is done are kept; made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "campaign-findings", requires = "faults")]
    pub(super) out: PathBuf,
    /// Go on with what is kept there, of the same robots in the same order and the same seed.
    #[arg(long, requires = "faults")]
    pub(super) resume: bool,
    /// Play only the episode with this number, and say all of it.
    #[arg(long, value_name = "N", requires = "faults")]
    pub(super) only: Option<u64>,
    /// Play the episode of this file, of a folder of findings; its faults are those of --faults FILE.
    #[arg(long, value_name = "FILE", requires = "faults")]
    pub(super) episode: Option<PathBuf>,
}

fn hours(text: &str) -> Result<f64, String> {
    let hours = text.parse().ok().filter(|hours: &f64| hours.is_finite() && (0.0..=1e6).contains(hours));
    hours.ok_or_else(|| "expected hours, 0 to 1000000".to_owned())
}
