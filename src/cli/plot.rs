//! `hippocamp plot`: draws what a robot would do, without servos.

use std::fs;

use anyhow::Result;

use super::drivers::load_script;
use super::load::load;
use super::{BadInput, PlotArguments, write_whole};
use crate::kinds::Picture;
use crate::model::HorseMotion;
use crate::motion::Generator;
use crate::motion::horse::swing_of;
use crate::motion::horse::thesis_rule::{SteadyGait, ThesisRule};
use crate::operator::Script;
use crate::output::{Outputs, WriteMode};
use crate::plot::{self, Course, Subject};

/// Longest time that a picture can show, and longest that it shows well, s.
const LONGEST_S: f64 = 600.0;
const LONG_S: f64 = 40.0;

/// Draws what the robot would do under a script.
pub(super) fn plot(options: &PlotArguments) -> Result<()> {
    let loaded = load(&options.robot, None)?;
    let robot = &loaded.file.robot;
    let (kind, subject) = (&*loaded.kind, Subject::of(robot, &*loaded.kind));
    if options.thesis && robot.motion.horse().is_none() {
        return Err(
            BadInput(format!("--thesis: expected a horse; {} has no gaits to change", kind.name())).into()
        );
    }
    let script = load_script(&options.script, robot, kind)?;
    let course =
        follow(options, subject, Generator::new(robot, kind.plan_to_rest(robot), f64::MAX), &script)?;
    let mut pictures =
        kind.pictures().iter().map(|picture| drawn(*picture, &course)).collect::<Result<Vec<_>>>()?;
    if let Some(horse) = robot.motion.horse().filter(|_| options.thesis) {
        pictures.push(("thesis.svg", thesis(options, &course, horse)?));
    }
    print_summary(&course);
    let (from_s, to_s) = course.times_s();
    if to_s - from_s > LONG_S {
        say!(
            "  strides lie close together in pictures of such a long time: draw a part of it with --from and --to"
        );
    }
    fs::create_dir_all(&options.out)
        .map_err(|error| BadInput(format!("--out {}: {error}; expected a folder", options.out.display())))?;
    let mut outputs = Outputs::of_reading([&options.robot, &options.script]);
    let claim = |(name, svg)| {
        outputs.claim("--out", &options.out.join(name), WriteMode::Whole).map(|place| (place, svg))
    };
    let pictures = pictures.into_iter().map(claim).collect::<Result<Vec<_>, _>>()?;
    for (place, svg) in pictures {
        write_whole(&place, &svg)?;
        say!("picture written to {}", place.path().display());
    }
    Ok(())
}

/// The name of a picture's file, and the picture.
fn drawn(picture: Picture, course: &Course<'_>) -> Result<(&'static str, String)> {
    Ok(match picture {
        Picture::Feet => ("feet.svg", plot::feet(course)?),
        Picture::Footfalls => ("footfalls.svg", plot::footfalls(course)?),
        Picture::Joints => ("joints.svg", plot::joints(course)?),
        Picture::Poses => ("poses.svg", plot::poses(course)?),
        Picture::Front => ("front.svg", plot::front(course)?),
    })
}

/// The motion of the robot under `script` in the part to draw.
fn follow<'r>(
    options: &PlotArguments,
    subject: Subject<'r>,
    generator: Generator,
    script: &Script,
) -> Result<Course<'r>> {
    let span_s = span(options, script)?;
    let followed = Course::follow(subject, generator, span_s, |time_s| script.order_at(time_s));
    Ok(followed.map_err(|error| BadInput(format!("{}: {error}", options.script.display())))?)
}

/// The first change of gait, and beside it the same change by the rule of the thesis.
fn thesis(options: &PlotArguments, course: &Course<'_>, horse: &HorseMotion) -> Result<String> {
    let Some(change) = course.first_change() else {
        let path = options.script.display();
        return Err(BadInput(format!(
            "--thesis: expected a change from one gait to another in the part of {path} that is drawn"
        ))
        .into());
    };
    let steady = |side: usize| SteadyGait {
        gait: &horse.gaits[change.gaits[side]],
        speed_m_s: change.speeds_m_s[side],
    };
    let swing = swing_of(horse);
    // The thesis begins with the left hind's lift-off.
    let rule = ThesisRule::new(swing, steady(0), steady(1), 0.0);
    Ok(plot::comparison(course, &change, &rule, swing.time_s)?)
}

/// Start and end of the part to draw, s.
fn span(options: &PlotArguments, script: &Script) -> Result<(f64, f64), BadInput> {
    let (from_s, to_s) = (options.from_s.unwrap_or(0.0), options.to_s.unwrap_or(script.end_s));
    let end_s = to_s.min(script.end_s);
    if to_s.is_finite() && from_s >= 0.0 && from_s < end_s && end_s - from_s <= LONGEST_S {
        return Ok((from_s, end_s));
    }
    Err(BadInput(format!(
        "--from {from_s} --to {to_s}: expected a part of the script, which lasts {} s, of at most {LONGEST_S} s",
        script.end_s
    )))
}

fn print_summary(course: &Course<'_>) {
    let (from_s, to_s) = course.times_s();
    say!("{}: {from_s:.2} s to {to_s:.2} s after it stood", course.subject.robot.name);
    let held_back: u32 = course.frames.iter().map(|frame| frame.interventions).sum();
    let goals = course.frames.len() * course.subject.robot.joints.len();
    say!("  safety changed {held_back} of {goals} joint goals");
    if let Some(range) = course.subject.ranges.first() {
        let feet = course.frames.iter().flat_map(|frame| &frame.feet);
        let furthest_m = feet.map(|foot| foot.excursion_m.abs()).fold(0.0, f64::max);
        let reach_m = range.half_excursion_m;
        say!("  feet: {:.1} mm from neutral at most, of {:.1} mm", furthest_m * 1e3, reach_m * 1e3);
    }
}
