//! `hippocamp try --faults`: runs robots over and over while everything goes wrong.

mod episode;

use std::fs::{self, File, OpenOptions};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context, Result};
use serde::Serialize;

use super::interrupt;
use super::load::load;
use super::trial::{BAR, TryArguments, bad_input};
use super::{BadInput, COMPLETED, FAILED, say};
use crate::platform::process_time;
use crate::trial::campaign::{Campaign, Episode, Judged, Subject, Tally, play};
use episode::{again, tell_of, write_finding};

/// File in the campaign's folder that lists the finished episodes.
const KEPT: &str = "episodes.jsonl";

/// The first line of that file: the campaign that the numbers below belong to.
#[derive(Debug, Serialize)]
struct LogHeader<'a> {
    seed: u64,
    robots: Vec<std::borrow::Cow<'a, str>>,
}

impl<'a> LogHeader<'a> {
    fn of(options: &'a TryArguments) -> LogHeader<'a> {
        LogHeader {
            seed: options.seed,
            robots: options.robots.iter().map(|path| path.to_string_lossy()).collect(),
        }
    }
}

/// Tries robots while everything goes wrong, or replays one episode.
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
            return Err(BadInput("--only: expected one robot, the one of the episode".to_owned()).into());
        };
        let episode = Episode::draw(subject, options.seed, number);
        return tell_of(&play(subject, &episode)?, &episode);
    }
    campaign(options, Campaign::new(subjects, options.seed))
}

fn subject(path: &Path) -> Result<Subject> {
    let loaded = load(path, None)?;
    Subject::new(loaded.file.robot, loaded.kind).map_err(bad_input)
}

fn campaign(options: &TryArguments, campaign: Campaign) -> Result<u8> {
    let (folder, most_s) = (&options.campaign.out, 3600.0 * options.campaign.hours);
    fs::create_dir_all(folder).with_context(|| format!("{} could not be made", folder.display()))?;
    let kept = folder.join(KEPT);
    let mut tally = Tally::default();
    let head = serde_json::to_string(&LogHeader::of(options))
        .context("the campaign could not be converted to JSON")?;
    let is_new = match fs::read_to_string(&kept) {
        Ok(text) if options.campaign.resume => {
            let first = text.lines().next().unwrap_or_default();
            if first != head {
                let said = format!(
                    "{}: expected {head} in its first line, the same robots in the same order and the same seed; it has \
                     {first}",
                    kept.display()
                );
                return Err(BadInput(said).into());
            }
            tally.take_up(&text);
            false
        }
        Ok(_) => {
            let said = format!(
                "{} exists already: continue with --resume, or name another folder with --out",
                kept.display()
            );
            return Err(BadInput(said).into());
        }
        Err(_) => true,
    };
    let mut log = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&kept)
        .with_context(|| format!("{} could not be opened", kept.display()))?;
    if is_new {
        writeln!(log, "{head}").with_context(|| format!("{} could not be written", kept.display()))?;
    }
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
        say!("interrupted; continue with --resume");
    }
    Ok(if tally.wrong_episodes == 0 { COMPLETED } else { FAILED })
}

/// Counts an episode, and appends it to the file.
fn keep(
    options: &TryArguments,
    campaign: &Campaign,
    tally: &mut Tally,
    log: &mut File,
    judged: &Judged,
) -> Result<()> {
    let line = tally.count(judged);
    writeln!(log, "{line}").context("the finished episodes could not be written")?;
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

/// Draws the progress bar on a terminal; elsewhere does nothing.
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

/// Clears the bar to make room for a line.
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
    /// Folder for findings and finished episodes; made if it does not exist.
    #[arg(long, value_name = "DIR", default_value = "campaign-findings", requires = "faults")]
    pub(super) out: PathBuf,
    /// Continue the campaign in that folder, with the same robots in the same order and the same seed.
    #[arg(long, requires = "faults")]
    pub(super) resume: bool,
    /// Play only the episode with this number, and print all of it.
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
