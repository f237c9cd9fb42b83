//! Motion scripts: at a time, a gait, a speed, a turn, a posture.
//!
//! | section | keys (those with a default in brackets) |
//! |---|---|
//! | top | (`end_s` 5 after the last entry) |
//! | `[[at]]` | `time_s`, (`gait`), (`speed_m_s`), (`yaw_deg_s`), (`height_mm`), (`pitch_deg`), (`roll_deg`), (`sway_mm`); what is left out stays as it was |

use std::path::Path;

use glam::DVec3;

use super::number::Limits;
use super::reader::Section;
use super::{ConfigError, parse_with, read_text};
use crate::model::{LEG_NAMES, Motion, Robot};
use crate::motion::{Command, GaitChoice};
use crate::operator::{Entry, Script};

/// A script that does not say when it ends does so this long after its last entry, s.
const LAST_ENTRY_S: f64 = 5.0;
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
/// Every fault of the text. Text that is no TOML is judged as TOML only.
pub fn parse_script(text: &str, file_name: &str, robot: &Robot) -> Result<Script, ConfigError> {
    parse_with(text, file_name, |file| read(file, robot)).map(|(script, _)| script)
}

fn read(file: &Section<'_>, robot: &Robot) -> Option<Script> {
    let mut last = Entry { time_s: f64::NEG_INFINITY, command: Command::default(), line: 0 };
    let entries = file.list("at", "the script's entries", |section| {
        let entry = read_entry(section, robot, last);
        if let Some(entry) = entry {
            last = entry;
        }
        entry
    });
    if entries.is_empty() {
        file.fault("at", "at least one entry, [[at]]");
        return None;
    }
    let end_s = file.number_or(
        "end_s",
        "when the robot stops, in s since it stood",
        Limits::NotNegative,
        last.time_s + LAST_ENTRY_S,
    );
    if end_s.is_some_and(|end_s| end_s <= last.time_s) {
        file.fault("end_s", format!("a time after the last entry's, {} s", last.time_s));
    }
    Some(Script { entries: entries.into_iter().collect::<Option<_>>()?, end_s: end_s? })
}

/// An entry, which leaves as it was in the `last` one what it does not name.
fn read_entry(section: &Section<'_>, robot: &Robot, last: Entry) -> Option<Entry> {
    let Motion::Horse(horse) = &robot.motion;
    let time_s = section.number("time_s", "a time in s since the robot stood", Limits::NotNegative);
    if time_s.is_some_and(|time_s| time_s <= last.time_s) {
        section.fault("time_s", format!("a time after the entry before, {} s", last.time_s));
    }
    let mut command = last.command;
    let has_gait = section.has("gait");
    if has_gait {
        let own =
            horse.gaits.iter().zip(0..).map(|(gait, index)| (gait.name.as_str(), GaitChoice::Gait(index)));
        let choices: Vec<_> =
            [("stand", GaitChoice::Stand), ("auto", GaitChoice::Auto)].into_iter().chain(own).collect();
        command.gait = section.choice("gait", "a gait", &choices)?;
    }
    if command.gait == GaitChoice::Stand {
        (command.speed_m_s, command.yaw_rate_rad_s) = (0.0, 0.0);
    }
    // A key that is not set changes nothing.
    let set = |key, meaning: &str, limits, to_si: f64, value: &mut f64| {
        if !section.has(key) {
            return Some(false);
        }
        *value = section.number(key, meaning, limits)? * to_si;
        Some(true)
    };
    let degree = 1_f64.to_radians();
    let yaw = Limits::FromTo(-YAW_MAX_DEG_S, YAW_MAX_DEG_S);
    let tilt = Limits::FromTo(-TILT_MAX_DEG, TILT_MAX_DEG);
    let posture = &mut command.posture;
    let stand_mm = horse.stand_height_m * 1000.0;
    let height = Limits::FromTo(HEIGHT_SHARES.0 * stand_mm, HEIGHT_SHARES.1 * stand_mm);
    let mut height_mm = stand_mm + posture.rise_m * 1000.0;
    let is_read = [
        set("speed_m_s", "a speed in m/s, backwards if negative", Limits::Any, 1.0, &mut command.speed_m_s),
        set(
            "yaw_deg_s",
            "a turn in degrees/s, to the left if positive",
            yaw,
            degree,
            &mut command.yaw_rate_rad_s,
        ),
        set("height_mm", "the trunk's height above the ground in mm", height, 1.0, &mut height_mm),
        set(
            "pitch_deg",
            "the trunk's pitch in degrees, nose down if positive",
            tilt,
            degree,
            &mut posture.pitch_rad,
        ),
        set(
            "roll_deg",
            "the trunk's roll in degrees, left side up if positive",
            tilt,
            degree,
            &mut posture.roll_rad,
        ),
        set(
            "sway_mm",
            "how far the trunk is to the left of its feet in mm",
            Limits::Any,
            1e-3,
            &mut posture.sway_m,
        ),
    ];
    posture.rise_m = (height_mm - stand_mm) / 1000.0;
    if command.gait == GaitChoice::Stand {
        for (key, value) in [("speed_m_s", command.speed_m_s), ("yaw_deg_s", command.yaw_rate_rad_s)] {
            if value.abs() > 0.0 {
                section
                    .fault(key, "a gait to go with it: the robot stands here; name one, or gait = \"auto\"");
            }
        }
    }
    if posture.sway_m.abs() > 0.0
        && let Some(leg) = leg_without_sideways_joint(robot, horse.legs)
    {
        section
            .fault("sway_mm", format!("0: the {leg} leg of this robot has no joint that moves it sideways"));
    }
    is_read.iter().all(Option::is_some).then_some(())?;
    Some(Entry { time_s: time_s?, command, line: section.line("time_s") })
}

/// The first leg all of whose joints turn about the body's y axis.
fn leg_without_sideways_joint(robot: &Robot, legs: [usize; 4]) -> Option<&'static str> {
    let is_planar = |leg: &usize| {
        let chain = &robot.chains[*leg];
        // Turned about y, an axis along y stays there: the angles of the joints do not matter.
        robot
            .joints_of(chain)
            .iter()
            .all(|joint| (chain.root_rotation * joint.axis).cross(DVec3::Y).length() <= PARALLEL)
    };
    legs.iter().position(is_planar).map(|place| LEG_NAMES[place])
}
