//! `hippocamp replay`: prints what a recording holds, checks that it is consistent, and writes a page that plays
//! it.

use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result};

use super::{BadInput, COMPLETED, FAILED, NOT_ALL_JUDGED, write_whole};
use crate::bus::ServoGoal;
use crate::html::Page;
use crate::model::Robot;
use crate::observe::BusFacts;
use crate::output::{Outputs, Place, WriteMode, named_part};
use crate::recording::{self, Ending, RecordedRun, Sample};
use crate::replay::{Judge, Replay};

/// Judges the recording at `path`; returns the exit code.
pub(super) fn replay(path: &Path, page: Option<&Path>) -> Result<u8> {
    let part = named_part(path);
    if !path.exists() && part.exists() {
        let part = part.display();
        return Err(BadInput(format!(
            "{} does not exist, but {part} does: a recording that was cut short. Try 'hippocamp replay {part}'",
            path.display()
        ))
        .into());
    }
    let place =
        page.map(|page| Outputs::of_reading([path]).claim("--html", page, WriteMode::Whole)).transpose()?;
    let (run, mut cycles) = recording::open(path)?;
    let judge = Judge::new(&run.robot, &run.header);
    let mut judge = judge.with_context(|| path.display().to_string())?;
    let mut page = place.map(|place| (place, Page::new(&run.robot)));
    let mut summary = Summary::default();
    while let Some(sample) = cycles.next(&run.robot)? {
        judge.look(&sample);
        summary.look(&run.robot, &sample);
        if let Some((_, page)) = &mut page {
            page.look(&sample);
        }
    }
    let ending = cycles.ending();
    let replay = judge.end(&ending);
    summary.print(&run, path, &ending, &replay);
    print_replay(&run.robot, &replay);
    if let Some((place, page)) = page {
        write_whole(&place, &page.end(&run.header, &ending))?;
        say!("page written to {}", place.path().display());
    }
    Ok(match (replay.agrees(), replay.is_complete()) {
        (false, _) => FAILED,
        (true, false) => NOT_ALL_JUDGED,
        (true, true) => COMPLETED,
    })
}

/// Writes the page of the recording called `name`, read from `from`.
pub(super) fn write_page(from: impl Read, name: &str, place: &Place) -> Result<()> {
    let (run, mut cycles) = recording::read(from, name)?;
    let mut page = Page::new(&run.robot);
    while let Some(sample) = cycles.next(&run.robot)? {
        page.look(&sample);
    }
    write_whole(place, &page.end(&run.header, &cycles.ending()))
}

/// Figures of a recording that its judge does not provide.
#[derive(Default)]
struct Summary {
    cycles: u64,
    end_s: f64,
    buses: Vec<BusFacts>,
    /// Largest error between a joint's angle and its goal, rad; the joint, and when, s.
    worst: Option<(f64, usize, f64)>,
}

impl Summary {
    fn look(&mut self, robot: &Robot, sample: &Sample) {
        self.cycles += 1;
        self.end_s = sample.facts.times.began.as_secs_f64();
        self.buses.clone_from(&sample.buses);
        for (index, joint) in robot.joints.iter().enumerate() {
            let (ServoGoal::Move { position, .. }, Some(servo)) = (sample.goals[index], &joint.servo) else {
                continue;
            };
            let goal_rad = servo.angle_of(f64::from(position));
            let error_rad = (goal_rad - sample.state.joints[index].position_rad).abs();
            if self.worst.is_none_or(|(worst_rad, ..)| error_rad >= worst_rad) {
                self.worst = Some((error_rad, index, self.end_s));
            }
        }
    }

    fn print(&self, run: &RecordedRun, path: &Path, ending: &Ending, replay: &Replay) {
        let (robot, header) = (&run.robot, &run.header);
        match &header.driver {
            Some(_) => say!("{}: {}", robot.name, header.words()),
            None => say!("{}: {} for {} s", robot.name, header.words(), header.walk_for_s),
        }
        match ending {
            Ending::Outcome(outcome) => {
                let entry = |key: &str| outcome.get(key).map_or("?", String::as_str);
                say!("{}: {}", entry("outcome"), entry("reason"));
                say!(
                    "  {} cycles in {} s, {} late",
                    entry("cycles"),
                    entry("duration_s"),
                    entry("late_cycles")
                );
            }
            Ending::CutShort { reason } => {
                say!(
                    "CUT SHORT: {} can be read only in part: {reason}. The program that recorded it was ended, or the file \
                     was damaged since: if there is a better copy, replay that",
                    path.display()
                );
            }
        }
        say!("  {} cycles recorded in {:.1} s, {} dropped", self.cycles, self.end_s, replay.dropped);
        if let Some((error_rad, joint, time_s)) = self.worst {
            say!(
                "  farthest off its goal: {} by {:.2} degrees at {time_s:.2} s",
                robot.joints[joint].name,
                error_rad.to_degrees()
            );
        }
        for (bus, sample) in robot.buses.iter().zip(&self.buses) {
            say!("  bus {}: {} replies missing, {} damaged", bus.name, sample.missing, sample.corrupt);
        }
    }
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

/// Number of gaps listed one by one; beyond that only the count is printed.
const GAPS_NAMED: usize = 5;

fn print_not_judged(replay: &Replay) {
    if let Some(first) = replay.gaps.first() {
        let named = |gap: &std::ops::RangeInclusive<u64>| match gap.end() - gap.start() {
            0 => gap.start().to_string(),
            _ => format!("{} to {}", gap.start(), gap.end()),
        };
        let mut names: Vec<String> = replay.gaps.iter().take(GAPS_NAMED).map(named).collect();
        let left = replay.gap_count - u64::try_from(names.len()).unwrap_or(replay.gap_count);
        if left > 0 {
            names.push(format!("{left} more gaps"));
        }
        let cycles = replay.dropped;
        say!("NOT JUDGED: {cycles} cycles that were dropped from the recording: {}", names.join(", "));
        let behind = replay.cycles - replay.cycles_run_again;
        if behind > 0 {
            say!(
                "NOT RUN AGAIN: {behind} cycles after cycle {}: the controller would not know what was dropped",
                first.start()
            );
        }
    }
    if replay.is_cut_short {
        say!("NOT JUDGED: the rest of the run, since the recording was cut short");
    }
}
