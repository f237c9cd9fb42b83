//! Motion scripts: timed orders. For a horse a gait, a speed, a turn, a posture; for arms a stroke; for a figure a
//! pose.
//!
//! | section | keys (those with a default in brackets) |
//! |---|---|
//! | top | (`end_s` 5 after the last entry) |
//! | `[[at]]` of a horse | `time_s`, (`gait`), (`speed_m_s`), (`yaw_deg_s`), (`height_mm`), (`pitch_deg`), (`roll_deg`), (`sway_mm`); what is left out stays as it was |
//! | `[[at]]` of arms | `time_s`, (`stroke`), (`tempo`), (`turn_deg` or `goal_mm`), of `reach` (`point_mm`), (`direction`), of `path` (`points_mm`, `speed_mm_s`), of `wind` (`point_mm`, `axis`, `radius_mm`); what is left out stays as it was, places are those of the robot file |
//! | `[[at]]` of a figure | `time_s`, `pose` |

use std::path::Path;

use glam::DVec3;

use super::number::Limits;
use super::reader::Section;
use super::{ConfigError, parse_with, read_text, strokes};
use crate::model::{Gait, HorseMotion, LEG_NAMES, Motion, Robot};
use crate::motion::{Command, GaitChoice, Order, Posture, StrokeCommand};
use crate::operator::{Entry, Script};

/// Time from the last entry to the end of a script that does not set its end, s.
const LAST_ENTRY_S: f64 = 5.0;
/// Highest speed either way, more than any robot reaches, m/s.
const SPEED_MAX_M_S: f64 = 1000.0;
/// Most entries: one a second for nearly three hours.
const ENTRIES_MAX: usize = 10_000;
/// Lowest and highest trunk, shares of its standing height.
const HEIGHT_SHARES: (f64, f64) = (0.5, 1.5);
/// Steepest trunk either way, degrees.
const TILT_MAX_DEG: f64 = 30.0;
/// Fastest turn either way, degrees/s.
const YAW_MAX_DEG_S: f64 = 360.0;
/// An axis this close to the body's y axis is one from side to side.
const PARALLEL: f64 = 1e-6;

/// Loads a motion script for `robot`; its name in faults is the path as given.
///
/// # Errors
/// Every fault of the file, or one that says why it cannot be read.
pub fn load_script(path: &Path, robot: &Robot) -> Result<Script, ConfigError> {
    let text = read_text(path, "a motion script that can be read, such as config/scripts/round.toml")?;
    parse_script(&text, &path.display().to_string(), robot)
}

/// Checks the text of a motion script for `robot`; `file_name` is its name in faults.
///
/// # Errors
/// Every fault of the text. If the text is not TOML, only that fault.
pub fn parse_script(text: &str, file_name: &str, robot: &Robot) -> Result<Script, ConfigError> {
    parse_with(text, file_name, |file| read(file, robot)).map(|(script, _)| script)
}

fn read(file: &Section<'_>, robot: &Robot) -> Option<Script> {
    let (before, entries) = match &robot.motion {
        Motion::Horse(horse) => {
            let mut last = PreviousValues { gait: Some(GaitChoice::Stand), command: Command::default() };
            (
                Order::Drive(Command::default()),
                read_entries(file, |at| read_entry(at, robot, horse, &mut last))?,
            )
        }
        Motion::Tentacle(tentacle) => {
            let mut last = StrokeCommand::default();
            let entries =
                read_entries(file, |at| strokes::read(at, (robot, tentacle), &mut last).map(Order::Perform))?;
            (Order::Perform(StrokeCommand::default()), entries)
        }
        Motion::Figure(figure) => {
            let poses: Vec<(&str, usize)> =
                figure.poses.iter().enumerate().map(|(place, pose)| (pose.name.as_str(), place)).collect();
            let read = |at: &Section<'_>| at.choice("pose", "a pose", &poses).map(Order::Take);
            (Order::Take(0), read_entries(file, read)?)
        }
    };
    let last_s = entries.iter().flatten().last().map_or(0.0, |entry| entry.time_s);
    let meaning = "when the robot stops, in s since it stood";
    let end_s = file.number_or("end_s", meaning, Limits::MOMENT, last_s + LAST_ENTRY_S);
    if file.has("end_s") && end_s.is_some_and(|end_s| end_s <= last_s) {
        file.fault("end_s", format!("a time after the last entry's, {last_s} s"));
    }
    Some(Script {
        before,
        entries: entries.into_iter().collect::<Option<_>>()?,
        end_s: end_s?,
        repeats_after_s: None,
    })
}

/// All entries, each order read by `read`; `None` if there are none.
fn read_entries<'a>(
    file: &Section<'a>,
    mut read: impl FnMut(&Section<'a>) -> Option<Order>,
) -> Option<Vec<Option<Entry>>> {
    let mut last_s = f64::NEG_INFINITY;
    let entries = file.list("at", "the script's entries", ENTRIES_MAX, |section| {
        let time_s = section.number("time_s", "a time in s since the robot stood", Limits::MOMENT);
        if time_s.is_some_and(|time_s| time_s <= last_s) {
            section.fault("time_s", format!("a time after the entry before, {last_s} s"));
        }
        last_s = time_s.unwrap_or(last_s);
        let order = read(section);
        Some(Entry { time_s: time_s?, order: order?, line: section.line("time_s") })
    });
    if entries.is_empty() {
        file.fault("at", "at least one entry, [[at]]");
        return None;
    }
    Some(entries)
}

/// The values in force where an entry begins.
struct PreviousValues {
    /// `None` after an entry whose gait could not be read.
    gait: Option<GaitChoice>,
    /// As far as it could be read.
    command: Command,
}

/// An entry; values that it does not name stay as in `last`.
fn read_entry(
    section: &Section<'_>,
    robot: &Robot,
    horse: &HorseMotion,
    last: &mut PreviousValues,
) -> Option<Order> {
    let gait = if section.has("gait") { read_gait(section, &horse.gaits) } else { last.gait };
    let before = match gait {
        Some(GaitChoice::Stand) => Command { posture: last.command.posture, ..Command::default() },
        _ => last.command,
    };
    let value = |key, meaning: &str, limits, unit: f64, before: f64| match section.has(key) {
        true => section.number(key, meaning, limits).map(|number| number * unit),
        false => Some(before),
    };
    let degrees = |key, meaning: &str, most: f64, before_rad: f64| {
        value(key, meaning, Limits::FromTo(-most, most), 1_f64.to_radians(), before_rad)
    };
    let meaning = "a speed in m/s, backwards if negative";
    let speed_m_s =
        value("speed_m_s", meaning, Limits::FromTo(-SPEED_MAX_M_S, SPEED_MAX_M_S), 1.0, before.speed_m_s);
    let meaning = "a turn in degrees/s, to the left if positive";
    let yaw_rate_rad_s = degrees("yaw_deg_s", meaning, YAW_MAX_DEG_S, before.yaw_rate_rad_s);
    if gait == Some(GaitChoice::Stand) {
        for (key, asked) in [("speed_m_s", speed_m_s), ("yaw_deg_s", yaw_rate_rad_s)] {
            if asked.is_some_and(|asked| asked.abs() > 0.0) {
                let expected = "a gait to go with it, such as gait = \"auto\": the robot stands here";
                section.fault(key, expected);
            }
        }
    }

    let Posture { rise_m, pitch_rad, roll_rad, sway_m } = before.posture;
    let stand_mm = horse.stand_height_m * 1000.0;
    let limits = Limits::FromTo(HEIGHT_SHARES.0 * stand_mm, HEIGHT_SHARES.1 * stand_mm);
    let meaning = "the trunk's height above the ground in mm";
    let height_m = value("height_mm", meaning, limits, 1e-3, horse.stand_height_m + rise_m);
    let meaning = "the trunk's pitch in degrees, nose down if positive";
    let pitch_rad = degrees("pitch_deg", meaning, TILT_MAX_DEG, pitch_rad);
    let meaning = "the trunk's roll in degrees, left side up if positive";
    let roll_rad = degrees("roll_deg", meaning, TILT_MAX_DEG, roll_rad);
    let meaning = "how far the trunk is to the left of its feet in mm";
    let sway_m = value("sway_mm", meaning, Limits::PLACE, 1e-3, sway_m);
    if section.has("sway_mm")
        && sway_m.is_some_and(|sway_m| sway_m.abs() > 0.0)
        && let Some(leg) = leg_without_sideways_joint(robot, horse.legs)
    {
        section
            .fault("sway_mm", format!("0: the {leg} leg of this robot has no joint that moves it sideways"));
    }

    last.gait = gait;
    last.command = Command {
        gait: gait?,
        speed_m_s: speed_m_s?,
        yaw_rate_rad_s: yaw_rate_rad_s?,
        posture: Posture {
            rise_m: height_m? - horse.stand_height_m,
            pitch_rad: pitch_rad?,
            roll_rad: roll_rad?,
            sway_m: sway_m?,
        },
    };
    Some(Order::Drive(last.command))
}

fn read_gait(section: &Section<'_>, gaits: &[Gait]) -> Option<GaitChoice> {
    let own = gaits.iter().enumerate().map(|(index, gait)| (gait.name.as_str(), GaitChoice::Gait(index)));
    let fixed = [("stand", GaitChoice::Stand), ("auto", GaitChoice::Auto)];
    section.choice("gait", "a gait", &fixed.into_iter().chain(own).collect::<Vec<_>>())
}

/// The first leg all of whose joints turn about the body's y axis.
fn leg_without_sideways_joint(robot: &Robot, legs: [usize; 4]) -> Option<&'static str> {
    let is_planar = |leg: &usize| {
        let chain = &robot.chains[*leg];
        // A turn about y leaves an axis along y unchanged: so the joint angles do not matter.
        robot
            .joints_of(chain)
            .iter()
            .all(|joint| (chain.root_rotation * joint.axis).cross(DVec3::Y).length() <= PARALLEL)
    };
    legs.iter().position(is_planar).map(|place| LEG_NAMES[place])
}
