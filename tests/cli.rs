//! The command as a person or a script uses it: exit codes, messages, report file, signals.

mod common;

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use common::config_file;
use serde_json::Value;

const HORSE: &str = "config/horse.toml";

fn hippocamp(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

fn output(arguments: &[&str]) -> Output {
    hippocamp(arguments).output().unwrap_or_else(|error| panic!("{error}"))
}

/// Standard output, standard error and exit code.
fn texts(output: &Output) -> (String, String, Option<i32>) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr), output.status.code())
}

/// A path for a file of one test.
fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap_or_else(|| panic!("{}", path.display()))
}

/// Writes a file for one test.
fn written(name: &str, content: &str) -> PathBuf {
    let path = scratch(name);
    fs::write(&path, content).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    path
}

/// horse.toml with some of its text replaced.
fn horse_with(name: &str, replacements: &[(&str, &str)]) -> PathBuf {
    let mut content = fs::read_to_string(config_file("horse.toml")).unwrap_or_else(|error| panic!("{error}"));
    for (from, to) in replacements {
        assert!(content.contains(from), "horse.toml has no '{from}'");
        content = content.replace(from, to);
    }
    written(name, &content)
}

/// The line of horse.toml that begins with `start`, from 1.
fn line_of(start: &str) -> usize {
    let content = fs::read_to_string(config_file("horse.toml")).unwrap_or_else(|error| panic!("{error}"));
    1 + content.lines().position(|line| line.starts_with(start)).unwrap_or_else(|| panic!("no line {start}"))
}

#[test]
fn bad_input_is_refused_with_a_message_before_anything_moves() {
    let bad_kind = written("bad-kind.toml", "\n[[fault]]\nkind = \"thunder\"\nat_s = 1\n");
    let bad_bus = written("bad-bus.toml", "[[fault]]\nkind = \"silent\"\nat_s = 1\nbus = \"rear\"\n");
    let bad_id = written("bad-id.toml", "[[fault]]\nkind = \"silent\"\nat_s = 1\nbus = \"main\"\nid = 99\n");
    let no_toml = written("no-toml.toml", "[[fault]\n");
    let misspelt = horse_with("misspelt.toml", &[("stiffness = 0.6", "stifness = 0.6")]);
    let (bad_kind, bad_bus, bad_id) = (text(&bad_kind), text(&bad_bus), text(&bad_id));
    let (no_toml, misspelt) = (text(&no_toml), text(&misspelt));
    let run = |rest: &[&'static str]| [&["run", HORSE, "--virtual"], rest].concat();
    let with_faults = |file| vec!["run", HORSE, "--virtual", "--faults", file];
    let cases: Vec<(Vec<&str>, Vec<&str>)> = vec![
        (vec!["check", "nowhere.toml"], vec!["nowhere.toml", "expected a robot file", "No such file"]),
        (vec!["run", "nowhere.toml"], vec!["nowhere.toml", "expected a robot file"]),
        (vec!["run", misspelt], vec![misspelt, "stifness", "stiffness", "nothing was started"]),
        (vec!["check", misspelt], vec![misspelt, "stifness", "stiffness"]),
        (
            run(&["--gait", "pace"]),
            vec!["--gait pace", "walk, walk-steady, trot, canter, canter-left, gallop"],
        ),
        (run(&["--pose", "squat"]), vec!["--pose", "figures", "--gait"]),
        (run(&["--stroke", "swim"]), vec!["--stroke", "arms", "--gait"]),
        (vec!["run", "config/tentacle.toml", "--pose", "bow"], vec!["--pose", "--stroke"]),
        (run(&["--seed", "-1"]), vec!["'-1'", "--seed", "a whole number, 0 or more"]),
        (run(&["--seed", "0.5"]), vec!["'0.5'", "--seed", "a whole number, 0 or more"]),
        (run(&["--speed", "NaN"]), vec!["--speed NaN", "a speed in m/s"]),
        (run(&["--speed", "inf"]), vec!["--speed inf", "a speed in m/s"]),
        (run(&["--speed", "fast"]), vec!["--speed", "fast"]),
        (run(&["--for", "-1"]), vec!["--for -1", "seconds, 0 or more"]),
        (run(&["--for", "NaN"]), vec!["--for NaN", "seconds"]),
        (run(&["--keys", "--for", "3"]), vec!["--keys", "--for"]),
        (run(&["--gamepad"]), vec!["--gamepad", "--virtual"]),
        (
            vec!["run", HORSE, "--gamepad=nowhere", "--gamepad-silence", "0.5"],
            vec!["--gamepad=nowhere", "No such file", "gamepad"],
        ),
        (
            vec!["run", HORSE, "--gamepad=nowhere", "--gamepad-silence", "0"],
            vec!["--gamepad-silence 0", "0.1 or more"],
        ),
        (run(&["--faults", "nowhere.toml"]), vec!["nowhere.toml", "No such file"]),
        (
            with_faults(bad_kind),
            vec![bad_kind, ":3: fault[0].kind = \"thunder\"", "\"silent\", \"slow\"", "nothing was started"],
        ),
        (with_faults(bad_bus), vec![bad_bus, ":4: fault[0].bus = \"rear\"", "\"main\""]),
        (with_faults(bad_id), vec![bad_id, ":5: fault[0].id = 99", "16 on \"main\""]),
        (with_faults(no_toml), vec![no_toml, ":1: expected TOML"]),
        (run(&["--report", "nowhere/report.json"]), vec!["--report nowhere/report.json", "folder"]),
        (run(&["--report", "config"]), vec!["--report config", "folder"]),
        (vec!["run", "config/thoroughbred.toml"], vec!["thoroughbred", "no buses", "hippocamp check"]),
        (run(&["--sped", "1"]), vec!["--sped", "--speed"]),
        (vec!["trot", HORSE], vec!["trot", "--help"]),
        (vec![], vec!["run", "check"]),
    ];
    for (arguments, says) in cases {
        let (stdout, stderr, code) = texts(&output(&arguments));
        assert_eq!(code, Some(2), "{arguments:?}: {stderr}");
        for word in says {
            assert!(stderr.contains(word), "{arguments:?} does not say '{word}': {stderr}");
        }
        assert!(!stdout.contains("simulated buses"), "{arguments:?} began: {stdout}");
        assert!(!stderr.contains(" s limp"), "{arguments:?} began: {stderr}");
    }
}

#[test]
fn all_impossible_requests_are_refused_at_once() {
    let path = horse_with(
        "impossible.toml",
        &[("stand_height_mm = 190", "stand_height_mm = 600"), ("loop_rate_hz = 100", "loop_rate_hz = 400")],
    );
    for command in ["check", "run"] {
        let (_, stderr, code) = texts(&output(&[command, text(&path)]));
        assert_eq!(code, Some(2), "{stderr}");
        let rate = format!("{}:{}: loop_rate_hz = 400", path.display(), line_of("loop_rate_hz"));
        let height =
            format!("{}:{}: motion.stand_height_mm = 600", path.display(), line_of("stand_height_mm"));
        for words in
            [rate.as_str(), "at most 200 Hz", "bus main", "5.00 ms", height.as_str(), "leg", "2 faults"]
        {
            assert!(stderr.contains(words), "no '{words}' in {stderr}");
        }
    }
    let path = horse_with("cannot-sit.toml", &[("sit_height_mm = 170", "sit_height_mm = 20")]);
    let (_, stderr, code) = texts(&output(&["check", text(&path)]));
    assert_eq!(code, Some(2), "{stderr}");
    let sit = format!("{}:{}: motion.sit_height_mm = 20", path.display(), line_of("sit_height_mm"));
    assert!(stderr.contains(&sit), "{stderr}");
}

#[test]
fn check_lists_the_capability_of_the_robot() {
    let (stdout, stderr, code) = texts(&output(&["check", HORSE]));
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    let line = |start: &str| {
        let found = stdout.lines().find(|line| line.starts_with(start));
        found
            .unwrap_or_else(|| panic!("no line '{start}' in {stdout}"))
            .split_whitespace()
            .collect::<Vec<_>>()
    };
    let number = |text: &str| text.parse::<f64>().unwrap_or_else(|error| panic!("{text}: {error}"));
    // Joints: range, rate (0.7 of 45 rpm), servo.
    let hip = line("right_hind.hip");
    assert_eq!(
        hip[1..],
        ["-100.0", "..", "-70.0", "189", "STS3215-12V", "id", "10", "on", "bus", "main,", "reversed"]
    );
    // Legs: both sides alike, and the shorter excursion counts for all.
    let e_mm = |leg: &str| line(leg)[2].to_owned();
    let [hind, fore] = [e_mm("left hind"), e_mm("left fore")];
    assert_eq!([e_mm("right hind"), e_mm("right fore")], [hind.clone(), fore.clone()]);
    assert_eq!(number(&e_mm("all legs")).to_string(), number(&hind).min(number(&fore)).to_string());
    assert!(number(&hind) > 20.0 && number(&fore) > 20.0, "{hind} {fore}");
    assert!(line("left hind").ends_with(&["up", "-190.0"]), "{stdout}");
    // Gaits: no gait is faster by servos than by reach; the table names the limit.
    for gait in [
        "walk ",
        "walk-steady",
        "trot",
        "canter ",
        "canter-left",
        "gallop ",
        "gallop-left",
        "rotary-gallop ",
        "rotary-gallop-left",
    ] {
        let words = line(gait);
        let (by_reach, by_servos) = (number(words[1]), number(words[2]));
        assert!(by_servos > 0.0 && by_servos <= by_reach, "{words:?}");
        let by = words[3..].join(" ");
        let by = by.split(';').next().unwrap();
        if by_servos < by_reach {
            let joint =
                by.strip_prefix("the speed or acceleration of ").unwrap_or_else(|| panic!("{words:?}"));
            assert_eq!(line(joint)[0], joint);
        } else {
            assert!(by.contains("reach"), "{words:?}");
        }
    }
    // Bus: (8+16*3) + (8+16*3) + (8+16*2) + (8+16) bytes out, 16*14 in, 10 us each; adapter 1 ms.
    assert_eq!(line("main"), ["main", "5.000", "4.000", "1.000", "200"]);

    let (stdout, _, code) = texts(&output(&["check", "config/thoroughbred.toml"]));
    assert_eq!(code, Some(0));
    assert!(stdout.contains("No buses"), "{stdout}");
}

#[test]
fn check_names_the_gaits_of_the_robot_file() {
    let own = |name: &str| {
        format!("\n[[motion.gait]]\nname = \"{name}\"\nduty_factor = 0.6\nlags = [0, 0.25, 0.5, 0.75]\n")
    };
    let last_line = "slide on their feet in a turn\n";
    let path =
        horse_with("own-gaits.toml", &[(last_line, &format!("{last_line}{}{}", own("trot"), own("amble")))]);
    let (stdout, stderr, code) = texts(&output(&["check", text(&path)]));
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    assert!(stdout.lines().any(|line| line.starts_with("rotary-gallop-left ")), "{stdout}");
    assert_eq!(stdout.lines().filter(|line| line.starts_with("trot ")).count(), 1, "{stdout}");
    let says = "from the robot file: trot (in the place of the built-in one), amble";
    assert!(stdout.lines().any(|line| line == says), "{stdout}");
}

/// Keys the report of a run has at least.
const REPORT_KEYS: [&str; 31] = [
    "/robot",
    "/gait",
    "/speed_m_s",
    "/duration_s",
    "/cycles",
    "/late_cycles",
    "/outcome",
    "/reason",
    "/safety_interventions",
    "/loop/late_us/p50",
    "/loop/late_us/p99",
    "/loop/late_us/p999",
    "/loop/late_us/max",
    "/joints/range_violations",
    "/joints/range_overshoot_max_deg",
    "/joints/rate_violations",
    "/joints/tracking_error_max_deg",
    "/feet/excursion_max_m",
    "/feet/stance_slip_planned_max_m",
    "/feet/stance_slip_measured_max_m",
    "/feet/swing_velocity_jump_max_m_s",
    "/feet/ik_residual_max_m",
    "/buses/0/name",
    "/buses/0/exchanges",
    "/buses/0/bytes_out",
    "/buses/0/bytes_in",
    "/buses/0/missing",
    "/buses/0/corrupt",
    "/buses/0/wire_share",
    "/buses/0/exchange_us/p50",
    "/buses/0/exchange_us/max",
];

fn report(path: &Path) -> Value {
    let content = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let report: Value = serde_json::from_str(&content).unwrap_or_else(|error| panic!("{error}: {content}"));
    for key in REPORT_KEYS {
        assert!(report.pointer(key).is_some_and(|value| !value.is_null()), "no {key} in {content}");
    }
    report
}

fn at<'v>(report: &'v Value, key: &str) -> &'v Value {
    report.pointer(key).unwrap_or_else(|| panic!("no {key}"))
}

#[test]
fn a_run_completes_and_reports() {
    let path = scratch("trot.json");
    let arguments =
        ["run", HORSE, "--gait", "trot", "--speed", "0.05", "--for", "6", "--virtual", "--report"];
    let (stdout, stderr, code) = texts(&output(&[&arguments[..], &[text(&path)]].concat()));
    assert_eq!(code, Some(0), "{stderr}");
    for words in ["trot at 0.050 m/s for 6 s", "completed: walked for the time asked", "bus main", "0 late"] {
        assert!(stdout.contains(words), "no '{words}' in {stdout}");
    }
    assert!(stderr.contains("limp") && stderr.contains("walking 0.0"), "{stderr}");
    // On a virtual clock no cycle is late and computing takes no time: the report leaves out what was not measured.
    assert!(!stdout.contains("computing") && stdout.contains("0 late by more than 1 ms"), "{stdout}");
    let report = report(&path);
    assert_eq!(at(&report, "/robot"), "horse");
    assert_eq!(at(&report, "/gait"), "trot");
    assert_eq!(at(&report, "/speed_m_s"), 0.05);
    assert_eq!(at(&report, "/outcome"), "completed");
    for key in ["/loop/work_us", "/loop/stages_us", "/loop/slowest", "/loop/first"] {
        assert!(at(&report, key).is_null(), "{key}: {report}");
    }
    assert!(!stdout.contains("slowest"), "{stdout}");
    assert!(at(&report, "/duration_s").as_f64().is_some_and(|s| s > 3.0));
    assert!(!scratch("trot.json.part").exists(), "a half report was left behind");
}

#[test]
fn speed_beyond_the_limit_is_limited_and_reported() {
    let path = scratch("fast.json");
    let (stdout, _, code) = texts(&output(&[
        "run",
        HORSE,
        "--speed",
        "9",
        "--for",
        "1",
        "--virtual",
        "--no-physics",
        "--report",
        text(&path),
    ]));
    assert_eq!(code, Some(0), "{stdout}");
    assert!(stdout.contains("9 m/s is too fast for walk: held at 0.0"), "{stdout}");
    assert!(stdout.contains("_fore.carpus can turn no faster"), "{stdout}");
    let report = report(&path);
    assert!(at(&report, "/speed_m_s").as_f64().is_some_and(|speed| speed < 0.1), "{report}");
    let backwards = output(&[
        "run",
        HORSE,
        "--speed",
        "-9",
        "--for",
        "1",
        "--virtual",
        "--no-physics",
        "--report",
        text(&path),
    ]);
    assert!(texts(&backwards).0.contains("-9 m/s is too fast"), "{backwards:?}");
    let report = self::report(&path);
    assert!(at(&report, "/speed_m_s").as_f64().is_some_and(|speed| -0.1 < speed && speed < 0.0), "{report}");
    assert_eq!(at(&report, "/joints/rate_violations"), 0);
    assert_eq!(at(&report, "/safety_interventions"), 0);
}

#[test]
fn thesis_inverse_kinematics_alone_walks_less_precisely() {
    let path = scratch("ccd.json");
    let (_, stderr, code) =
        texts(&output(&["run", HORSE, "--ik", "ccd", "--for", "2", "--virtual", "--report", text(&path)]));
    assert_eq!(code, Some(0), "{stderr}");
    let report = report(&path);
    assert!(at(&report, "/feet/ik_residual_max_m").as_f64().is_some_and(|m| m > 1e-4), "{report}");
    assert_eq!(at(&report, "/joints/range_violations"), 0);
    assert_eq!(at(&report, "/joints/rate_violations"), 0);
}

#[test]
fn the_shipped_fault_scripts_do_what_they_say() {
    let cases = [
        ("bad-morning", 0, "completed"),
        ("unplugged-servo", 3, "was not heard"),
        ("loose-plug", 0, "completed"),
        ("noisy-line", 0, "completed"),
        ("late-loop", 3, "the loop stood still for 3.0"),
        ("jammed-joint", 3, "servo 8 on bus main (joint left_fore.carpus) does not turn"),
        ("low-battery", 3, "sees 8.5 V"),
        ("hot-servo", 3, "servo 4 on bus main (joint left_hind.hock) is at 75 C"),
        ("reset-servo", 0, "completed"),
        ("brown-out", 3, "bus main: none of its servos answers"),
        ("twin-ids", 3, "servo 3 on bus main (joint left_hind.stifle) was not heard"),
        ("overload", 3, "servo 4 on bus main (joint left_hind.hock) raises alarm bits 0x20 (overload)"),
        ("bad-replies", 0, "completed"),
        ("nudges", 0, "did not fall"),
    ];
    let mut scripts: Vec<String> = fs::read_dir(config_file("faults"))
        .unwrap_or_else(|error| panic!("{error}"))
        .filter_map(|entry| Some(entry.ok()?.path().file_stem()?.to_str()?.to_owned()))
        .collect();
    scripts.sort();
    let mut tested = cases.map(|(script, ..)| script);
    tested.sort_unstable();
    assert_eq!(scripts, tested, "every script is tried here");
    for (script, expected, says) in cases {
        let (file, path) = (format!("config/faults/{script}.toml"), scratch(&format!("{script}.json")));
        let mut arguments = vec!["run", HORSE, "--virtual", "--faults", &file, "--report", text(&path)];
        // Faults of the buses act the same on joints that turn freely.
        let is_of_body = script == "nudges";
        arguments.extend(if is_of_body { &["--gait", "walk-steady"][..] } else { &["--no-physics"] });
        let (stdout, stderr, code) = texts(&output(&arguments));
        assert_eq!(code, Some(expected), "{script}: {stdout}{stderr}");
        assert!(stdout.contains(says), "{script}: no '{says}' in {stdout}");
        assert_eq!(stdout.contains("STOPPED BY SAFETY"), expected == 3, "{script}: {stdout}");
        let report = report(&path);
        assert_eq!(at(&report, "/outcome"), if expected == 3 { "stopped-by-safety" } else { "completed" });
        assert!(at(&report, "/reason").as_str().is_some_and(|reason| expected == 0 || reason.contains(says)));
    }
    let (_, stderr, code) =
        texts(&output(&["run", HORSE, "--virtual", "--no-physics", "--faults", "config/faults/nudges.toml"]));
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("nudges.toml:4: fault[0].kind") && stderr.contains("[physics]"), "{stderr}");
}

/// A servo missing at the start is a different failure from one lost during the run.
#[test]
fn a_servo_missing_at_the_start_ends_with_1_and_a_message() {
    let faults = written("missing.toml", "[[fault]]\nkind = \"silent\"\nat_s = 0\nbus = \"main\"\nid = 12\n");
    let (stdout, stderr, code) = texts(&output(&["run", HORSE, "--virtual", "--faults", text(&faults)]));
    assert_eq!(code, Some(1), "{stdout}{stderr}");
    for words in ["servo 12", "right_hind.hock", "bus main", "check its power and cable"] {
        assert!(stderr.contains(words), "no '{words}' in {stderr}");
    }
}

#[test]
fn help_explains_and_gives_an_example() {
    for (arguments, words) in [
        (vec!["--help"], vec!["Example", "Exit codes: 0 completed, 2 bad input", "check", "run"]),
        (vec!["check", "--help"], vec!["Example: hippocamp check config/horse.toml", "half-excursion"]),
        (
            vec!["run", "--help"],
            vec![
                "Example",
                "--gait",
                "--speed",
                "--for",
                "--script",
                "--keys",
                "--gamepad",
                "--virtual",
                "--seed",
                "--faults",
                "--report",
                "--ik",
                "Ctrl-C",
            ],
        ),
    ] {
        let (stdout, stderr, code) = texts(&output(&arguments));
        assert_eq!((code, stderr.as_str()), (Some(0), ""), "{arguments:?}");
        for word in words {
            assert!(stdout.contains(word), "{arguments:?} does not say '{word}': {stdout}");
        }
    }
}

/// A run on the real clock that gets `signal` once its status shows `when`: returns its output and its report.
#[cfg(unix)]
fn run_and_signal(signal: &str, when: &str, times: usize) -> (String, Value) {
    let path = scratch(&format!("{signal}-{when}.json"));
    let mut child = hippocamp(&["run", HORSE, "--for", "600", "--report", text(&path)])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{error}"));
    let stderr = child.stderr.take().unwrap_or_else(|| panic!("no stderr"));
    let mut lines = BufReader::new(stderr).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains(when)), "no status line said {when}");
    for _ in 0..times {
        let sent = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()), "{signal} could not be sent");
    }
    for _ in lines {}
    let mut stdout = String::new();
    child.stdout.take().map(|mut out| out.read_to_string(&mut stdout));
    let status = child.wait().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(status.code(), Some(0), "{signal} at {when}: {stdout}");
    (stdout, report(&path))
}

#[cfg(unix)]
#[test]
fn a_signal_to_a_limp_robot_ends_the_run() {
    let (stdout, report) = run_and_signal("INT", "limp", 1);
    assert!(stdout.contains("completed: stopped by the operator"), "{stdout}");
    assert_eq!(at(&report, "/outcome"), "completed");
    assert_eq!(at(&report, "/reason"), "stopped by the operator");
}

#[cfg(unix)]
#[test]
fn a_signal_to_a_moving_robot_makes_it_sit_down() {
    let (stdout, report) = run_and_signal("TERM", "rising", 1);
    assert!(stdout.contains("completed: stopped by the operator"), "{stdout}");
    assert_eq!(at(&report, "/reason"), "stopped by the operator");
    // The status line comes 5 s into the run; sitting down takes time after that.
    assert!(at(&report, "/duration_s").as_f64().is_some_and(|s| s > 5.0), "{report}");
    assert_eq!(at(&report, "/joints/range_violations"), 0);
    assert_eq!(at(&report, "/joints/rate_violations"), 0);
}

#[test]
fn a_report_to_a_device_or_a_link_goes_through_it() {
    let folder = tempfile::tempdir().unwrap();
    let (target, link) = (folder.path().join("target.json"), folder.path().join("link.json"));
    std::fs::write(&target, "old").unwrap();
    std::os::unix::fs::symlink(&target, &link).unwrap();
    let program = env!("CARGO_BIN_EXE_hippocamp");
    let report = link.to_str().unwrap();
    let arguments = ["run", "config/horse.toml", "--virtual", "--for", "0", "--report", report];
    let output = std::process::Command::new(program).args(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink(), "the link is still one");
    assert!(std::fs::read_to_string(&target).unwrap().starts_with('{'), "and the report is behind it");
}

#[test]
fn no_output_takes_the_place_of_a_robot_file_or_of_another_output() {
    let folder = tempfile::tempdir().unwrap();
    let robot = folder.path().join("mine.toml");
    std::fs::copy("config/horse.toml", &robot).unwrap();
    let (before, mine) = (std::fs::read(&robot).unwrap(), robot.to_str().unwrap());
    let twice = folder.path().join("x");
    let twice = twice.to_str().unwrap();
    for arguments in [
        vec!["run", mine, "--virtual", "--for", "0", "--report", mine],
        vec!["run", mine, "--virtual", "--for", "0", "--record", mine],
        vec!["run", mine, "--virtual", "--for", "0", "--html", mine],
        vec!["run", mine, "--virtual", "--for", "0", "--html", twice, "--report", twice],
        vec!["check", mine, "--urdf", mine],
    ] {
        let output =
            std::process::Command::new(env!("CARGO_BIN_EXE_hippocamp")).args(&arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert_eq!(std::fs::read(&robot).unwrap(), before, "{arguments:?}");
    }
}

/// Every gait is run on the simulated body, and those that leave the ground are not promised.
#[test]
fn check_prints_the_speeds_that_physics_reaches() {
    let (stdout, stderr, code) = texts(&output(&["check", "tests/robots/eight-joint-dog.toml", "--physics"]));
    assert_eq!(code, Some(0), "{stderr}");
    let (formulas, measured) = stdout.split_once("On the simulated body").unwrap();
    let row = |table: &str, gait: &str| -> Vec<String> {
        let line = table.lines().find(|line| line.split_whitespace().next() == Some(gait));
        line.unwrap().split_whitespace().map(str::to_owned).collect()
    };
    for gait in ["walk", "walk-steady", "trot"] {
        let row: Vec<f64> = row(measured, gait)[1..3].iter().map(|word| word.parse().unwrap()).collect();
        assert!((0.7..1.1).contains(&(row[1] / row[0])), "{gait}: {row:?}");
    }
    for gait in ["canter", "gallop"] {
        assert!(row(formulas, gait).join(" ").contains("leaves the ground"), "{gait}");
        assert_eq!(row(measured, gait)[4], "poor:", "{gait}");
    }
}

#[test]
fn a_gait_or_tempo_that_is_more_than_the_robot_can_do_is_remarked_on() {
    let arguments = ["run", HORSE, "--gait", "canter", "--for", "0", "--virtual"];
    let (stdout, stderr, _) = texts(&output(&arguments));
    let said = stdout + &stderr;
    assert!(said.contains("canter leaves the ground for 30 % of each stride"), "{said}");
    let arguments =
        ["run", "config/tentacle.toml", "--stroke", "walk", "--tempo", "9", "--for", "0", "--virtual"];
    let (stdout, stderr, _) = texts(&output(&arguments));
    let said = stdout + &stderr;
    assert!(said.contains("tempo 9 is too fast for walk: held at"), "{said}");
}
