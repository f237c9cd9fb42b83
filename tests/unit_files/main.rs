//! Unit files: the effect of a good one on its robot, the messages for bad ones, and how they are written.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod bad;
mod robot;
mod writing;

use hippocamp::config::{self, Unit, UnitFile, UnitJoint};
use hippocamp::model::{Joint, Robot};
use std::path::Path;
use toml::value::Date;

/// A good file for `config/horse-dynamixel.toml`, not calibrated: made to be spoiled.
const GOOD: &str = include_str!("good.unit.toml");

fn robot() -> Robot {
    config::parse(include_str!("../../config/horse-dynamixel.toml"), "horse-dynamixel.toml").unwrap().robot
}

const ROBOT_FILE: &str = "config/horse-dynamixel.toml";

fn parsed(text: &str) -> UnitFile {
    config::parse_unit(text, "good.unit.toml").unwrap_or_else(|error| panic!("{error}"))
}

const DAY: Date = Date { year: 2026, month: 3, day: 9 };

/// A whole calibration of `robot`, each zero count a little off the one of the robot file.
fn calibrated(robot: &Robot) -> Unit {
    let entry = |(index, joint): (u8, &Joint)| UnitJoint {
        name: joint.name.clone(),
        zero_count: joint.servo.unwrap().zero_count + f64::from(index) - 7.25,
        reversed: None,
        direction_checked: true,
        firmware: Some("46".parse().unwrap()),
    };
    let mut unit = parsed(GOOD).unit;
    unit.joints = (0u8..).zip(&robot.joints).map(entry).collect();
    unit.seal(robot, DAY);
    unit
}

/// The text the unit is written as.
fn text_of(unit: &Unit, test: &str) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("a.unit.toml");
    config::write_unit(&path, unit).unwrap();
    std::fs::read_to_string(path).unwrap()
}
