//! One episode of a campaign: written to a folder if it has a finding, and replayed from there.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::{clear_bar, subject};
use crate::cli::run::fault_script;
use crate::cli::trial::TryArguments;
use crate::cli::{BadInput, COMPLETED, FAILED, say, write_whole};
use crate::model::{StopAction, TrippedServoPolicy};
use crate::output::{Outputs, WriteMode};
use crate::trial::campaign::{Campaign, Episode, Finding, Judged, Played, Violation, play};

/// An episode in the file beside its faults: the episode as drawn, and the changes made to it.
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
    /// Times of the remaining orders.
    orders_s: Vec<f64>,
}

/// Writes the smallest episode of a finding to a folder of its own, and prints how to replay it.
pub(super) fn write_finding(
    options: &TryArguments,
    campaign: &Campaign,
    judged: &Judged,
    (wrong, episode, played): (Violation, &Episode, &Played),
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
        trips_freeze: episode.tripped_servo == TrippedServoPolicy::Freeze,
        orders_s: episode.orders.iter().map(|ordered| ordered.at_s).collect(),
    };
    let (faults, file) = (folder.join("faults.toml"), folder.join("episode.toml"));
    let text = toml::to_string(&written).context("an episode could not be converted to TOML")?;
    let mut outputs = Outputs::of_reading(&options.robots);
    for (path, text) in [(&faults, &episode.script().to_toml()), (&file, &text)] {
        write_whole(&outputs.claim("--out", path, WriteMode::Whole)?, text)?;
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

fn said(finding: &Finding) -> String {
    format!("{} at {:.3} s: {}", finding.wrong.name(), finding.time_s, finding.what)
}

/// Replays the episode at `path`, with the faults at `faults`.
pub(super) fn again(options: &TryArguments, path: &Path, faults: &Path) -> Result<u8> {
    let [robot] = &options.robots[..] else {
        return Err(BadInput("--episode: expected one robot, the one of the episode".to_owned()).into());
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
    episode.tripped_servo =
        if written.trips_freeze { TrippedServoPolicy::Freeze } else { TrippedServoPolicy::Stop };
    let is_left = |at_s: f64| written.orders_s.iter().any(|left_s| (left_s - at_s).abs() < 1e-9);
    episode.orders.retain(|ordered| is_left(ordered.at_s));
    tell_of(&play(&subject, &episode)?, &episode)
}

pub(super) fn tell_of(played: &Played, episode: &Episode) -> Result<u8> {
    say::lines(&episode.script().to_toml());
    for ordered in &episode.orders {
        say!("# at {:.3} s: {:?}", ordered.at_s, ordered.order);
    }
    say!(
        "# ordered to stop at {:.3} s; physics {}, sits {}, {:?}, {:?}",
        episode.end_s,
        episode.has_physics,
        episode.sits,
        episode.stop_action,
        episode.tripped_servo
    );
    let outcome = played.outcome.map_or("not started", crate::telemetry::Outcome::name);
    say!("{outcome} after {:.2} s: {}", played.virtual_s, played.reason);
    played.findings.iter().for_each(|finding| say!("{}", said(finding)));
    if played.findings.is_empty() {
        say!("nothing found");
    }
    Ok(if played.findings.is_empty() { COMPLETED } else { FAILED })
}
