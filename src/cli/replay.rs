//! `hippocamp replay`: what a recording holds, whether it holds together, and a page that plays it.

use std::path::Path;

use anyhow::Result;

use super::{BadInput, COMPLETED, FAILED, NOT_ALL_JUDGED, part_of, write_whole};
use crate::bus::ServoGoal;
use crate::html;
use crate::model::Robot;
use crate::recording::{Ending, Recording, Sample};
use crate::replay::{Replay, replay as run_again};

/// Judges the recording at `path`; returns the exit code.
pub(super) fn replay(path: &Path, page: Option<&Path>) -> Result<u8> {
    let part = part_of(path).filter(|part| !path.exists() && part.exists());
    if let Some(part) = part.as_deref().map(Path::display) {
        return Err(BadInput(format!(
            "{} is not there, but {part} is: a recording that was cut short. Try 'hippocamp replay {part}'",
            path.display()
        ))
        .into());
    }
    let recording = Recording::read(path)?;
    print_run(&recording);
    let replay = run_again(&recording)?;
    print_replay(&recording.robot, &replay);
    if let Some(page) = page {
        write_whole(page, &html::page(&recording))?;
        say!("page written to {}", page.display());
    }
    Ok(match (replay.agrees(), replay.is_complete()) {
        (false, _) => FAILED,
        (true, false) => NOT_ALL_JUDGED,
        (true, true) => COMPLETED,
    })
}

/// Writes the page of the recording at `path`.
pub(super) fn write_page(path: &Path, page: &Path) -> Result<()> {
    write_whole(page, &html::page(&Recording::read(path)?))
}

fn print_run(recording: &Recording) {
    let (robot, header, samples) = (&recording.robot, &recording.header, &recording.samples);
    match &header.driver {
        Some(_) => say!("{}: {}", robot.name, header.words()),
        None => say!("{}: {} for {} s", robot.name, header.words(), header.walk_for_s),
    }
    match &recording.ending {
        Ending::Outcome(outcome) => {
            let entry = |key: &str| outcome.get(key).map_or("?", String::as_str);
            say!("{}: {}", entry("outcome"), entry("reason"));
            say!("  {} cycles in {} s, {} late", entry("cycles"), entry("duration_s"), entry("late_cycles"));
        }
        Ending::CutShort { reason } => {
            say!("CUT SHORT: the recording ends before the run, or the program did ({reason})");
        }
    }
    let end = samples.last().map_or(0.0, |sample| sample.times.began.as_secs_f64());
    let recorded = u64::try_from(samples.len()).unwrap_or(u64::MAX);
    let dropped = recording.cycles_of_run().saturating_sub(recorded);
    say!("  {recorded} cycles recorded in {end:.1} s, {dropped} dropped");
    if let Some((error_rad, joint, time_s)) = worst_tracking(robot, samples) {
        say!(
            "  off its goal most: {} by {:.2} degrees at {time_s:.2} s",
            robot.joints[joint].name,
            error_rad.to_degrees()
        );
    }
    if let Some(last) = samples.last() {
        for (bus, sample) in robot.buses.iter().zip(&last.buses) {
            say!("  bus {}: {} replies missing, {} damaged", bus.name, sample.missing, sample.corrupt);
        }
    }
}

/// Largest distance of a joint from its goal, rad; the joint, and when, s.
fn worst_tracking(robot: &Robot, samples: &[Sample]) -> Option<(f64, usize, f64)> {
    let errors = samples.iter().flat_map(|sample| {
        robot.joints.iter().enumerate().filter_map(move |(index, joint)| {
            let ServoGoal::Move { position, .. } = sample.goals[index] else { return None };
            let goal_rad = joint.servo.as_ref()?.angle_of(f64::from(position));
            let error_rad = (goal_rad - sample.state.joints[index].position_rad).abs();
            Some((error_rad, index, sample.times.began.as_secs_f64()))
        })
    });
    errors.max_by(|a, b| a.0.total_cmp(&b.0))
}

fn print_replay(robot: &Robot, replay: &Replay) {
    if let Some(feet) = &replay.feet {
        say!("  {feet}");
    }
    if let Some(body) = &replay.body {
        say!("  {body}");
    }
    for violation in &replay.violations {
        say!("VIOLATED: {violation}");
    }
    match &replay.difference {
        None => say!("replay: {} cycles run again, all goals the same", replay.cycles_run_again),
        Some(found) => {
            let joint = found.joint.map_or("the robot", |joint| &robot.joints[joint].name);
            say!("DIFFERS first in cycle {} ({:.3} s), {joint}: {}", found.cycle, found.time_s, found.what);
        }
    }
    print_not_judged(replay);
}

/// Gaps named one by one; of more only the number is told.
const GAPS_NAMED: usize = 5;

fn print_not_judged(replay: &Replay) {
    if let Some(first) = replay.gaps.first() {
        let cycles: u64 = replay.gaps.iter().map(|gap| gap.end() - gap.start() + 1).sum();
        let named = |gap: &std::ops::RangeInclusive<u64>| match gap.end() - gap.start() {
            0 => gap.start().to_string(),
            _ => format!("{} to {}", gap.start(), gap.end()),
        };
        let mut names: Vec<String> = replay.gaps.iter().take(GAPS_NAMED).map(named).collect();
        if replay.gaps.len() > GAPS_NAMED {
            names.push(format!("{} more gaps", replay.gaps.len() - GAPS_NAMED));
        }
        say!("NOT JUDGED: {cycles} cycles that were dropped from the recording: {}", names.join(", "));
        let behind = replay.cycles - replay.cycles_run_again;
        if behind > 0 {
            say!(
                "NOT RUN AGAIN: {behind} cycles behind cycle {}: the controller would not know what was dropped",
                first.start()
            );
        }
    }
    if replay.is_cut_short {
        say!("NOT JUDGED: how the run went on, as the recording was cut short");
    }
}
