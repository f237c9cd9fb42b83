//! `hippocamp plot`: draws what a robot would do, without servos.

use std::fs;

use anyhow::Result;

use super::drivers::load_script;
use super::load::load;
use super::{BadInput, PlotArguments, strokes, write_whole};
use crate::capability::{Capability, HorseCapability};
use crate::config;
use crate::model::HorseMotion;
use crate::motion::curves::SwingCurve;
use crate::motion::horse::thesis_rule::{SteadyGait, ThesisRule};
use crate::motion::{Command, Generator, StrokeCommand};
use crate::operator::{Repertoire, Script};
use crate::output::{Outputs, Writing};
use crate::plot::{self, Course, Subject};

/// Longest time that a picture can show, and longest that it shows well, s.
const LONGEST_S: f64 = 600.0;
const LONG_S: f64 = 40.0;

/// Draws what the robot would do under a script.
pub(super) fn plot(options: &PlotArguments) -> Result<()> {
    let loaded = load(&options.robot, None)?;
    let robot = &loaded.file.robot;
    let (course, pictures) = match &loaded.capability {
        Capability::Horse(horse, capability) => {
            let plan = capability.plan(horse, Command::default());
            let script = load_script(&options.script, robot, &Repertoire::of(&plan))?;
            let swing = plan.swing();
            let subject = Subject::horse(robot, horse, capability);
            let course = follow(options, subject, Generator::new(robot, plan, f64::MAX), &script)?;
            let mut pictures = vec![
                ("feet.svg", plot::feet(&course)?),
                ("footfalls.svg", plot::footfalls(&course)?),
                ("joints.svg", plot::joints(&course)?),
                ("poses.svg", plot::poses(&course)?),
            ];
            if options.thesis {
                pictures.push(("thesis.svg", thesis(options, &course, horse, swing)?));
            }
            print_summary(&course);
            print_feet(&course, capability);
            (course, pictures)
        }
        Capability::Tentacle(tentacle, capability) => {
            if options.thesis {
                let said = "--thesis: expected a horse; arms have no gaits to change";
                return Err(BadInput(said.to_owned()).into());
            }
            let script = strokes::load_script(&options.script, robot, capability)?;
            let plan = capability.plan(robot, tentacle, StrokeCommand::default());
            let generator = Generator::new(robot, plan, f64::MAX);
            let course = follow(options, Subject::without_gaits(robot), generator, &script)?;
            let pictures = vec![("joints.svg", plot::joints(&course)?), ("poses.svg", plot::poses(&course)?)];
            print_summary(&course);
            (course, pictures)
        }
        Capability::Figure(_, capability) => {
            if options.thesis {
                let said = "--thesis: expected a horse; a figure has no gaits to change";
                return Err(BadInput(said.to_owned()).into());
            }
            let script = config::load_script(&options.script, robot)?;
            let generator = Generator::new(robot, capability.plan(0), f64::MAX);
            let course = follow(options, Subject::without_gaits(robot), generator, &script)?;
            let pictures = vec![
                ("joints.svg", plot::joints(&course)?),
                ("poses.svg", plot::poses(&course)?),
                ("front.svg", plot::front(&course)?),
            ];
            print_summary(&course);
            (course, pictures)
        }
    };
    let (from_s, to_s) = course.times_s();
    if to_s - from_s > LONG_S {
        say!("  strides lie close together in pictures of so long a time: --from and --to draw a part of it");
    }
    fs::create_dir_all(&options.out)
        .map_err(|error| BadInput(format!("--out {}: {error}; expected a folder", options.out.display())))?;
    let mut outputs = Outputs::of_reading([&options.robot, &options.script]);
    let claim = |(name, svg)| {
        outputs.claim("--out", &options.out.join(name), Writing::Whole).map(|place| (place, svg))
    };
    let pictures = pictures.into_iter().map(claim).collect::<Result<Vec<_>, _>>()?;
    for (place, svg) in pictures {
        write_whole(&place, &svg)?;
        say!("picture written to {}", place.path().display());
    }
    Ok(())
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
fn thesis(
    options: &PlotArguments,
    course: &Course<'_>,
    horse: &HorseMotion,
    swing: SwingCurve,
) -> Result<String> {
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
}

fn print_feet(course: &Course<'_>, capability: &HorseCapability) {
    let feet = course.frames.iter().flat_map(|frame| &frame.feet);
    let furthest_m = feet.map(|foot| foot.excursion_m.abs()).fold(0.0, f64::max);
    let reach_m = capability.half_excursion_m();
    say!("  feet: {:.1} mm from neutral at most, of {:.1} mm", furthest_m * 1e3, reach_m * 1e3);
}
