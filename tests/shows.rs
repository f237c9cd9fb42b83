//! The rigs of arms that come with the program, as a person runs them: `check`, `run` and `show` on simulated buses.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Output of `hippocamp`, and its exit code.
fn said(arguments: &[&str]) -> (String, Option<i32>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
    let output = command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout) + &text(&output.stderr), output.status.code())
}

/// Output of a completed run, and its report: no goal register outside its joint's range or above its rate.
fn completed(name: &str, arguments: &[&str]) -> (String, Value) {
    let file = scratch(&format!("{name}.json"));
    let report = ["--virtual", "--report", file.to_str().unwrap()];
    let (words, code) = said(&[arguments, &report].concat());
    assert_eq!(code, Some(0), "{arguments:?}: {words}");
    let report: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    assert_eq!(report["outcome"], "completed", "{arguments:?}: {words}");
    for count in ["range_violations", "rate_violations"] {
        assert_eq!(report["joints"][count], 0, "{arguments:?}: {words}");
    }
    // Arms keep 5 mm from each other and the base unless the file says otherwise.
    let arms = &report["arms"];
    assert!(arms["clearance_min_m"].as_f64().unwrap() >= 0.005, "{arguments:?}: {words}");
    assert!(arms["tip_residual_max_m"].as_f64().unwrap() < 0.05, "{arguments:?}: {words}");
    (words, report)
}

/// Two servos that trip while the arms are under way, lost and damaged replies, and a loop that is late.
fn faults(name: &str, bus: &str) -> String {
    let file = scratch(name);
    let overload = |at_s: f64, id: u8| {
        format!("[[fault]]\nkind = 'overload'\nat_s = {at_s}\nfor_s = 60\nbus = '{bus}'\nid = {id}\n")
    };
    let passing = "[[fault]]\nkind = 'silent'\nat_s = 22\nfor_s = 0.05\n\
                   [[fault]]\nkind = 'bit-flip'\nat_s = 25\nfor_s = 0.06\n\
                   [[fault]]\nkind = 'late-host'\nat_s = 27\ndelay_ms = 80\n";
    std::fs::write(&file, overload(20.0, 3) + &overload(24.0, 6) + passing).unwrap();
    file.to_str().unwrap().to_owned()
}

#[test]
fn every_stroke_of_both_rigs_runs_and_keeps_its_joints_limits() {
    for (rig, strokes) in [
        ("tentacle", &["rest", "sway", "walk", "swim", "reach", "wind"][..]),
        ("octopus", &["rest", "sway", "walk", "swim", "reach"]),
    ] {
        for stroke in strokes {
            let file = format!("config/{rig}.toml");
            completed(&format!("{rig}-{stroke}"), &["run", &file, "--stroke", stroke, "--for", "8"]);
        }
    }
}

#[test]
fn check_describes_both_rigs() {
    let (words, code) = said(&["check", "config/octopus.toml"]);
    assert_eq!(code, Some(0), "{words}");
    for part in ["8 chains, 48 joints", "STS3215-12V id 6 on bus right_4", "Weight carried by water, 90 %"] {
        assert!(words.contains(part), "no '{part}' in {words}");
    }
    assert!(!words.contains("WARNING"), "{words}");
    let (words, code) = said(&["check", "config/tentacle.toml"]);
    assert_eq!(code, Some(0), "{words}");
    assert!(words.contains("1 chains, 24 joints") && !words.contains("WARNING"), "{words}");
}

/// A winch is not a hinge.
#[test]
fn an_arm_on_cords_has_no_urdf_and_one_on_hinges_has() {
    let file = scratch("arms.urdf");
    let _ = std::fs::remove_file(&file);
    let (words, code) = said(&["check", "config/octopus.toml", "--urdf", file.to_str().unwrap()]);
    assert_eq!(code, Some(2), "{words}");
    assert!(words.contains("--urdf: left_1 is bent by cords") && !file.exists(), "{words}");
    let (words, code) = said(&["check", "config/tentacle.toml", "--urdf", file.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{words}");
    let text = std::fs::read_to_string(&file).unwrap();
    assert_eq!(text.matches("type=\"revolute\"").count(), 24);
}

#[test]
fn a_show_performs_all_strokes_and_continues_without_tripped_servos() {
    for (rig, bus, told) in [
        ("tentacle", "root", ["arm.lift_2", "arm.sweep_3"]),
        ("octopus", "left_1", ["left_1.lift_2", "left_1.sweep_3"]),
    ] {
        let (file, faults) = (format!("config/{rig}.toml"), faults(&format!("{rig}-faults.toml"), bus));
        let (words, report) =
            completed(&format!("{rig}-show"), &["show", &file, "--for", "75", "--faults", &faults]);
        let outages = report["outages"].as_array().unwrap();
        let joints: Vec<&Value> = outages.iter().map(|outage| &outage["joint"]).collect();
        assert_eq!(joints[..2], told, "{words}");
        for joint in told {
            assert!(words.contains(&format!("joint {joint} (servo")), "{words}");
        }
        assert!(words.contains("overload; it is restarted when the arms are parked"), "{words}");
        assert!(report["servo_restarts"].as_u64().unwrap() >= 2, "{words}");
        assert!(report["duration_s"].as_f64().unwrap() > 75.0);
    }
}
