//! Numbers far from those of any robot: each key has limits, and within them every result stays bounded.

use std::collections::BTreeSet;
use std::path::Path;

use hippocamp::config;
use hippocamp::kinds;
use toml::{Table, Value};

use crate::{HORSE, TENTACLE, bounded, shipped_with, text, texts, written};

const ROBOTS: [&str; 6] = [
    "config/figure.toml",
    "config/horse-dynamixel.toml",
    "config/horse.toml",
    "config/octopus.toml",
    "config/tentacle.toml",
    "config/thoroughbred.toml",
];
/// No key of any robot takes these.
const NEVER: [f64; 6] = [1e9, -1e9, 1e308, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
/// Some keys take these.
const TINY: [f64; 3] = [0.0, 1e-9, -1e-9];

/// A step on the way to a value.
#[derive(Debug, Clone)]
enum Step {
    Key(String),
    Place(usize),
}

/// Ways to all numbers of a file, one for each key of the schema: the last of those in lists of tables, where a later
/// check could not be hidden by an earlier one.
fn numbers(table: &Table) -> Vec<Vec<Step>> {
    fn walk(value: &Value, way: &[Step], found: &mut Vec<Vec<Step>>) {
        let on = |step| [way, &[step]].concat();
        match value {
            Value::Integer(_) | Value::Float(_) => found.push(way.to_vec()),
            Value::Table(table) => {
                table.iter().for_each(|(key, value)| walk(value, &on(Step::Key(key.clone())), found));
            }
            Value::Array(items) => {
                items.iter().enumerate().for_each(|(place, item)| walk(item, &on(Step::Place(place)), found));
            }
            _ => {}
        }
    }
    let mut found = Vec::new();
    walk(&Value::Table(table.clone()), &[], &mut found);
    // Each place in a list of numbers is a key of its own; places in a list of tables are not.
    let key = |way: &[Step]| -> String {
        let steps = way.iter().enumerate();
        steps
            .map(|(index, step)| match step {
                Step::Key(key) => format!(".{key}"),
                Step::Place(_) if index + 1 < way.len() => "[]".to_owned(),
                Step::Place(place) => format!("[{place}]"),
            })
            .collect()
    };
    let mut seen = BTreeSet::new();
    found.into_iter().rev().filter(|way| seen.insert(key(way))).collect()
}

fn with(table: &Table, way: &[Step], number: f64) -> String {
    let mut table = Value::Table(table.clone());
    let mut place = &mut table;
    for step in way {
        place = match step {
            Step::Key(key) => &mut place[key.as_str()],
            Step::Place(index) => &mut place[*index],
        };
    }
    *place = Value::Float(number);
    toml::to_string(&table).unwrap()
}

/// As a fault names it: `chain[0].joint[1].link_mm`; of a list of numbers, with or without its place.
fn path(way: &[Step]) -> String {
    way.iter().fold(String::new(), |path, step| match step {
        Step::Key(key) if path.is_empty() => key.clone(),
        Step::Key(key) => format!("{path}.{key}"),
        Step::Place(place) => format!("{path}[{place}]"),
    })
}

#[test]
fn no_key_accepts_a_number_impossible_for_a_robot() {
    for name in ROBOTS {
        let table: Table = shipped_with(name, &[]).parse().unwrap();
        let ways = numbers(&table);
        assert!(ways.len() >= 25, "{name} has {} numbers", ways.len());
        for way in &ways {
            for number in NEVER {
                let Err(error) = config::parse(&with(&table, way, number), name) else {
                    panic!("{name}: {} takes {number}", path(way));
                };
                // TOML does not take 1e9 as a whole number.
                let key = path(way);
                let is_named =
                    |fault: &config::Fault| key.starts_with(&fault.key) || fault.key.starts_with(&key);
                assert!(error.faults.iter().any(is_named), "{name}: {key} = {number} is not named: {error}");
            }
        }
    }
}

/// Computing the capability of a horse takes half a second: with `HIPPOCAMP_FULL` all robots are computed.
#[test]
fn tiny_numbers_are_refused_or_computed_without_a_panic() {
    let is_full = std::env::var_os("HIPPOCAMP_FULL").is_some();
    for name in ROBOTS {
        let is_quick = name.contains("figure") || name.contains("tentacle");
        let table: Table = shipped_with(name, &[]).parse().unwrap();
        for way in numbers(&table) {
            for number in TINY {
                if let Ok(file) = config::parse(&with(&table, &way, number), name)
                    && (is_full || is_quick)
                {
                    // Any result will do, as long as the computation ends.
                    let _ = kinds::of(&file.robot);
                }
            }
        }
    }
}

#[test]
fn the_slowest_possible_motions_take_no_more_steps_than_others() {
    let folder = tempfile::tempdir().unwrap();
    let check = |name: &str, content: String| {
        let path = written(folder.path(), name, content);
        let (_, stderr, code) = texts(&bounded(&["check", text(&path)]).output().unwrap());
        (stderr, code)
    };
    let gait = "[[motion.gait]]\nname = \"crawl\"\nduty_factor = 0.95\nlags = [0, 0.25, 0.5, 0.75]\n";
    let horse = shipped_with(HORSE, &[("swing_time_s = 0.45", "swing_time_s = 10")]);
    // The motion is slow, and its capability is computed.
    assert_eq!(check("slow-horse.toml", format!("{horse}\n{gait}")), (String::new(), Some(0)));
    let arm = shipped_with(TENTACLE, &[("stroke_time_s = 4.0", "stroke_time_s = 100")]);
    assert_eq!(check("slow-arm.toml", arm), (String::new(), Some(0)));
    for (name, from, to, key) in [
        ("horse", "swing_time_s = 0.45", "swing_time_s = 1e9", "motion.swing_time_s = 1e9"),
        ("tentacle", "stroke_time_s = 4.0", "stroke_time_s = 1e9", "motion.stroke_time_s = 1e9"),
    ] {
        let content = shipped_with(&format!("config/{name}.toml"), &[(from, to)]);
        let (stderr, code) = check(&format!("{name}.toml"), content);
        assert_eq!(code, Some(2), "{name}");
        assert!(stderr.contains(key) && stderr.contains("at most 10"), "{stderr}");
    }
}

#[test]
fn arms_that_overlap_when_parked_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, says) in [
        ("radius_mm = 15", "radius_mm = 1000", "arm[0].radius_mm = 1000"),
        ("clearance_mm = 8", "clearance_mm = 1000", "than motion.clearance_mm allows"),
        ("base_radius_mm = 60", "base_radius_mm = 1000", "nearer to the base"),
    ] {
        let path = written(folder.path(), "octopus.toml", shipped_with("config/octopus.toml", &[(from, to)]));
        let (_, stderr, code) = texts(&bounded(&["check", text(&path)]).output().unwrap());
        assert_eq!(code, Some(2), "{to}: {stderr}");
        assert!(stderr.contains(says) && stderr.contains("mm less, or roots further apart"), "{stderr}");
    }
    // They are apart when parked, and in each other's way in every stroke.
    let crowded = shipped_with("config/octopus.toml", &[("clearance_mm = 8", "clearance_mm = 100")]);
    let path = written(folder.path(), "crowded.toml", crowded);
    let (_, stderr, code) = texts(&bounded(&["check", text(&path)]).output().unwrap());
    assert_eq!((stderr.as_str(), code), ("", Some(0)));
    assert!(config::load(Path::new("config/octopus.toml")).is_ok());
}

#[test]
fn a_push_that_throws_the_robot_far_ends_its_run_and_not_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let script = "[[fault]]\nkind = \"push\"\nat_s = 1\nfor_s = 100\nforce_n = 1e4\n[ground]\nfriction = 0\n";
    let path = written(folder.path(), "thrown.toml", script);
    let arguments = ["run", HORSE, "--virtual", "--for", "0", "--faults", text(&path)];
    let (stdout, stderr, code) = texts(&bounded(&arguments).output().unwrap());
    assert_eq!(code, Some(1), "{stderr}");
    assert!(
        stdout.contains("the simulated body is unstable") && !stderr.contains("panicked"),
        "{stdout}{stderr}"
    );
}
