//! Motion scripts: their meaning, refusals, and a run.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;

use std::fs;
use std::process::Command;

use common::{ROBOTS, config_file, shipped};
use hippocamp::config::{self, ConfigError};
use hippocamp::model::Robot;
use hippocamp::motion::{Command as MotionOptions, GaitChoice, Order, Posture};
use hippocamp::operator::Script;
use hippocamp::recording::Recording;
use hippocamp::replay::replay;

fn parse(text: &str, robot: &Robot) -> Result<Script, ConfigError> {
    config::parse_script(text, "test.toml", robot)
}

fn gait(robot: &Robot, name: &str) -> GaitChoice {
    let horse = robot.motion.horse().unwrap();
    GaitChoice::Gait(horse.gaits.iter().position(|gait| gait.name == name).unwrap())
}

/// horse.toml with shoulder and hip girdles that swing sideways, on these legs.
fn horse_with_sideways_joints(legs: &[&str]) -> Robot {
    let mut text = fs::read_to_string(config_file("horse.toml")).unwrap();
    for leg in legs {
        let start = text.find(&format!("name = \"{leg}\"")).unwrap();
        let axis = start + text[start..].find("axis = [0, 1, 0]").unwrap();
        text.replace_range(axis..axis + "axis = [0, 1, 0]".len(), "axis = [1, 0, 0]");
    }
    config::parse(&text, "horse.toml").unwrap_or_else(|error| panic!("{error}")).robot.without_body()
}

const LEGS: [&str; 4] = ["left_hind", "left_fore", "right_hind", "right_fore"];

#[test]
fn each_entry_changes_what_it_names_and_keeps_the_rest() {
    let robot = shipped("horse.toml");
    let text = "
        end_s = 12
        [[at]]
        time_s = 1
        height_mm = 185
        roll_deg = -3
        [[at]]
        time_s = 2.5
        gait = 'trot'
        speed_m_s = 0.1
        yaw_deg_s = 9
        pitch_deg = 6
        [[at]]
        time_s = 4
        gait = 'auto'
        [[at]]
        time_s = 5
        gait = 'stand'
        [[at]]
        time_s = 6
        gait = 'walk'
    ";
    let script = parse(text, &robot).unwrap_or_else(|error| panic!("{error}"));
    let degree = std::f64::consts::PI / 180.0;
    let bent = Posture { rise_m: -0.005, roll_rad: -3.0 * degree, ..Posture::default() };
    let bowed = Posture { pitch_rad: 6.0 * degree, ..bent };
    let (speed_m_s, yaw_rate_rad_s) = (0.1, 9.0 * degree);
    let standing = MotionOptions { posture: bent, ..MotionOptions::default() };
    let trotting = MotionOptions { gait: gait(&robot, "trot"), speed_m_s, yaw_rate_rad_s, posture: bowed };
    let expected = [
        (0.0, MotionOptions::default()),
        (1.0, standing),
        (2.5, trotting),
        (4.9, MotionOptions { gait: GaitChoice::Auto, ..trotting }),
        (5.0, MotionOptions { posture: bowed, ..MotionOptions::default() }),
        // A stand resets speed and turn: they have to be named again.
        (11.9, MotionOptions { gait: gait(&robot, "walk"), posture: bowed, ..MotionOptions::default() }),
    ];
    for (time_s, wanted) in expected {
        let Order::Drive(asked) = script.order_at(time_s) else { panic!("ends before {time_s} s") };
        assert_eq!(asked.gait, wanted.gait, "at {time_s} s");
        let numbers = |asked: MotionOptions| {
            let Posture { rise_m, pitch_rad, roll_rad, sway_m } = asked.posture;
            [asked.speed_m_s, asked.yaw_rate_rad_s, rise_m, pitch_rad, roll_rad, sway_m]
        };
        for (asked, wanted) in numbers(asked).into_iter().zip(numbers(wanted)) {
            assert!((asked - wanted).abs() < 1e-12, "{asked} instead of {wanted} at {time_s} s");
        }
    }
    assert_eq!(script.order_at(12.0), Order::Stop);
}

#[test]
fn a_script_without_an_end_ends_five_seconds_after_its_last_entry() {
    let script = parse("[[at]]\ntime_s = 2\ngait = 'walk'", &shipped("horse.toml")).unwrap();
    assert!(matches!(script.order_at(6.99), Order::Drive(_)));
    assert_eq!(script.order_at(7.01), Order::Stop);
}

#[test]
fn mistakes_are_reported_by_line_and_key() {
    let robot = shipped("horse.toml");
    let cases: &[(&str, usize, &str, &[&str])] = &[
        ("", 1, "at", &["at least one entry"]),
        ("at = 3", 1, "at", &["write [[at]]"]),
        ("[[at]]\ngait = 'walk'", 1, "at[0].time_s", &["is not set", "a time in s"]),
        ("[[at]]\ntime_s = -1", 2, "at[0].time_s", &["from 0 to"]),
        ("[[at]]\ntime_s = nan", 2, "at[0].time_s", &["from 0 to"]),
        ("[[at]]\ntime_s = 2\n[[at]]\ntime_s = 2", 4, "at[1].time_s", &["after the entry before, 2 s"]),
        ("[[at]]\ntime_s = 2\n[[at]]\ntime_s = 1", 4, "at[1].time_s", &["after the entry before"]),
        ("end_s = 2\n[[at]]\ntime_s = 2", 1, "end_s", &["after the last entry's, 2 s"]),
        (
            "[[at]]\ntime_s = 0\ngait = 'trott'",
            3,
            "at[0].gait",
            &["\"stand\", \"auto\", \"walk\"", "mean \"trot\""],
        ),
        ("[[at]]\ntime_s = 0\nspeed = 1", 3, "at[0].speed", &["known are time_s, gait, speed_m_s"]),
        ("[[at]]\ntime_s = 0\ngait = 'walk'\nspeed_m_s = 'fast'", 4, "at[0].speed_m_s", &["a speed in m/s"]),
        ("[[at]]\ntime_s = 0\nspeed_m_s = 0.1", 3, "at[0].speed_m_s", &["a gait to go with it"]),
        ("[[at]]\ntime_s = 0\nyaw_deg_s = 5", 3, "at[0].yaw_deg_s", &["a gait to go with it"]),
        (
            "[[at]]\ntime_s = 0\ngait = 'stand'\nyaw_deg_s = 5",
            4,
            "at[0].yaw_deg_s",
            &["the robot stands here"],
        ),
        ("[[at]]\ntime_s = 0\nyaw_deg_s = 400", 3, "at[0].yaw_deg_s", &["from -360 to 360"]),
        ("[[at]]\ntime_s = 0\nheight_mm = 0.19", 3, "at[0].height_mm", &["from 95 to 285"]),
        ("[[at]]\ntime_s = 0\npitch_deg = -31", 3, "at[0].pitch_deg", &["from -30 to 30"]),
        ("[[at]]\ntime_s = 0\nroll_deg = inf", 3, "at[0].roll_deg", &["from -30 to 30"]),
        (
            "[[at]]\ntime_s = 0\nsway_mm = 5",
            3,
            "at[0].sway_mm",
            &["left hind leg", "no joint that moves it sideways"],
        ),
        ("[[at]\ntime_s = 0", 1, "", &["TOML"]),
    ];
    for (text, line, key, said) in cases {
        let error = parse(text, &robot).err().unwrap_or_else(|| panic!("taken: {text}"));
        let found = error.faults.iter().find(|fault| (fault.line, fault.key.as_str()) == (*line, *key));
        let fault = found.unwrap_or_else(|| panic!("no fault at {key} on line {line}: {error}")).to_string();
        for words in *said {
            assert!(fault.contains(words), "no '{words}' in {fault}");
        }
    }
}

#[test]
fn all_faults_are_reported_at_once() {
    let text = "end = 3\n[[at]]\ntime_s = -1\n[[at]]\ntime_s = 0\ngait = 'pace'\npitch_deg = 90\n\
                [[at]]\ntime_s = 1\nspeed_m_s = 0.1";
    let error = parse(text, &shipped("horse.toml")).unwrap_err();
    let lines: Vec<usize> = error.faults.iter().map(|fault| fault.line).collect();
    // The unknown gait of the last entry is not a fault of its own.
    assert_eq!(lines, [1, 3, 6, 7], "{error}");
    assert!(error.to_string().contains("known are at, end_s\n"), "each key once: {error}");
}

#[test]
fn a_trunk_sways_only_over_legs_that_all_move_sideways() {
    let sway = "[[at]]\ntime_s = 0\nsway_mm = 5";
    let script = parse(sway, &horse_with_sideways_joints(&LEGS)).unwrap_or_else(|error| panic!("{error}"));
    let Order::Drive(command) = script.entries[0].order else { panic!("{script:?}") };
    assert!((command.posture.sway_m - 0.005).abs() < 1e-12);
    let error = parse(sway, &horse_with_sideways_joints(&LEGS[..3])).unwrap_err().to_string();
    assert!(error.contains("the right fore leg"), "{error}");
    // No sway is no fault on any robot.
    assert!(parse("[[at]]\ntime_s = 0\nsway_mm = 0", &shipped("horse.toml")).is_ok());
}

/// Runs `hippocamp run` by a script on a virtual clock; its output and exit code.
fn run(robot: &str, script: &str, rest: &[&str]) -> (String, Option<i32>) {
    let output = Command::new(env!("CARGO_BIN_EXE_hippocamp"))
        .args(["run", robot, "--script", script, "--virtual"])
        .args(rest)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout) + &text(&output.stderr), output.status.code())
}

#[test]
fn the_shipped_script_runs_to_its_end_and_replays() {
    let script = config_file("scripts/round.toml");
    std::thread::scope(|scope| {
        ROBOTS.map(|robot| drop(scope.spawn(|| runs_to_its_end_and_replays(robot, &script))))
    });
}

fn runs_to_its_end_and_replays(robot: &str, script: &std::path::Path) {
    let end_s = config::load_script(script, &shipped(robot)).unwrap_or_else(|error| panic!("{error}")).end_s;
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{robot}.mcap"));
    let recorded = ["--record", path.to_str().unwrap()];
    // In physics feedback asks for more than servos have at times, and safety holds it to that; nothing else is held.
    let limits = "0 goals outside their range, 0 too fast";
    let free = format!("{limits}, 0 changed by safety");
    for (rest, words) in
        [(&["--no-physics"][..], [free.as_str(), ""]), (&recorded, [limits, "body: did not fall"])]
    {
        let (said, code) = run(&format!("config/{robot}"), script.to_str().unwrap(), rest);
        assert_eq!(code, Some(0), "{robot}: {said}");
        assert!(said.contains("completed: the script is over"), "{robot}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{robot}: {said}");
        assert!(!said.contains("held at"), "{robot}: {said}");
    }
    let recording = Recording::read(&path).unwrap_or_else(|error| panic!("{error}"));
    let driven =
        recording.samples.iter().filter(|sample| matches!(sample.facts.order, Order::Drive(_))).count();
    let stood = recording
        .samples
        .iter()
        .position(|sample| sample.facts.activity == hippocamp::motion::Activity::Standing);
    let cycle_s = shipped(robot).period_s();
    #[allow(clippy::cast_precision_loss, reason = "thousands")]
    let driven_s = (driven - stood.unwrap()) as f64 * cycle_s;
    assert!((driven_s - end_s).abs() < 3.0 * cycle_s, "{robot}: driven for {driven_s} s of {end_s}");
    let replayed = replay(&recording).unwrap_or_else(|error| panic!("{error}"));
    assert!(replayed.agrees(), "{robot}: {replayed:?}");
}

#[test]
fn a_script_faster_than_the_robot_is_limited_and_reported() {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("fast-script.toml");
    fs::write(&path, "end_s = 1\n[[at]]\ntime_s = 0\ngait = 'walk'\nspeed_m_s = 3\nyaw_deg_s = -300\n")
        .unwrap();
    let (said, code) = run("config/horse.toml", path.to_str().unwrap(), &[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("fast-script.toml:3: 3 m/s is too fast for walk: held at 0.0"), "{said}");
    assert!(said.contains("fast-script.toml:3: -300.0 degrees/s is too fast a turn: held at 20.0"), "{said}");
}

#[test]
fn a_bad_script_starts_nothing() {
    let (said, code) = run("config/horse.toml", "config/horse.toml", &[]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("config/horse.toml:") && said.contains("nothing was started"), "{said}");
    let (said, code) = run("config/horse.toml", "nowhere.toml", &[]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("nowhere.toml") && said.contains("a motion script"), "{said}");
}
