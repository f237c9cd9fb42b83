//! No text from outside controls the terminal.

use std::path::Path;

use crate::{FIGURE, HORSE, TENTACLE, hippocamp, shipped_with, text, texts, written};

/// Characters that control a terminal: an escape, a new line, the order of letters.
fn assert_harmless(said: &str, of: &str) {
    let steers = |c: char| {
        (c.is_control() && c != '\n')
            || matches!(c, '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
    };
    assert!(!said.contains(steers), "{of} lets through: {said:?}");
    assert!(!said.lines().any(|line| line.starts_with("forged")), "{of} lets a line be forged: {said}");
}

/// A file with a bad name in it, which key that is, and how it is shown.
struct Bad {
    file: &'static str,
    replaced: (&'static str, &'static str),
    key: &'static str,
    shown: &'static str,
}

const fn bad(
    file: &'static str,
    replaced: (&'static str, &'static str),
    key: &'static str,
    shown: &'static str,
) -> Bad {
    Bad { file, replaced, key, shown }
}

/// Written with TOML's escapes, or, where TOML lets them stand, as they are.
const NAMES: &[Bad] = &[
    bad(HORSE, ("name = \"horse\"", "name = \"ho\\u001b[2Jrse\""), "name", "\"ho\\u001b[2Jrse\""),
    bad(HORSE, ("name = \"horse\"", "name = \"ho\\u0000rse\""), "name", "\"ho\\u0000rse\""),
    bad(HORSE, ("name = \"horse\"", "name = \"horse\\nforged\""), "name", "\"horse\\nforged\""),
    bad(HORSE, ("name = \"horse\"", "name = \"\"\"horse\nforged\"\"\""), "name", "horse forged"),
    bad(HORSE, ("name = \"horse\"", "name = \"ho\\u007frse\""), "name", "\"ho\\u007frse\""),
    bad(HORSE, ("name = \"horse\"", "name = \"ho\u{9b}2Jrse\""), "name", "\"ho\\u009b2Jrse\""),
    bad(HORSE, ("name = \"horse\"", "name = \"\u{202e}esroh\""), "name", "\"\\u202eesroh\""),
    bad(HORSE, ("name = \"main\"", "name = \"ma\u{85}in\""), "bus[0].name", "\"ma\\u0085in\""),
    bad(
        HORSE,
        ("name = \"left_hind\"", "name = \"left\u{2066}hind\""),
        "chain[0].name",
        "\"left\\u2066hind\"",
    ),
    bad(HORSE, ("name = \"pelvis\"", "name = \"pel\\tvis\""), "chain[0].joint[0].name", "\"pel\\tvis\""),
    bad(
        HORSE,
        (
            "[motion]",
            "[[motion.gait]]\nname = \"am\u{200b}ble\"\nduty_factor = 0.6\nlags = [0, 0, 0, 0]\n[motion]",
        ),
        "motion.gait[0].name",
        "\"am\\u200bble\"",
    ),
    bad(FIGURE, ("name = \"stand\"", "name = \"st\u{feff}and\""), "motion.pose[0].name", "\"st\\ufeffand\""),
    bad(TENTACLE, ("name = \"arm\"", "name = \"a\u{1b}rm\""), "", ""),
];

#[test]
fn names_with_control_characters_are_refused_by_line_and_shown_as_codes() {
    let folder = tempfile::tempdir().unwrap();
    for (number, Bad { file, replaced, key, shown }) in NAMES.iter().enumerate() {
        let content = shipped_with(file, &[*replaced]);
        let path = written(folder.path(), &format!("{number}.toml"), &content);
        let (stdout, stderr, code) = texts(&hippocamp(&["check", text(&path)]).output().unwrap());
        assert_eq!((code, stdout.as_str()), (Some(2), ""), "{replaced:?}: {stderr}");
        assert_harmless(&stderr, replaced.1);
        // Of what TOML itself forbids only the line is known.
        let start = content.find(replaced.1).unwrap()
            + if key.contains("gait") { "[[motion.gait]]\n".len() } else { 0 };
        let line = 1 + content[..start].matches('\n').count();
        assert!(stderr.contains(&format!("{}:{line}:", path.display())), "no line {line}: {stderr}");
        if !key.is_empty() {
            assert!(
                stderr.contains(&format!("{key} = ")) && stderr.contains(shown),
                "{key}, {shown}: {stderr}"
            );
            assert!(stderr.contains("controls a terminal"), "{stderr}");
        }
    }
}

#[test]
fn control_characters_in_keys_values_and_file_names_are_shown_as_codes() {
    let folder = tempfile::tempdir().unwrap();
    let key = "\"\\u001b]0;owned\\u0007\\nforged\\u202e\" = 1\n";
    let robot = written(folder.path(), "robot.toml", format!("{key}{}", shipped_with(HORSE, &[])));
    let unit = written(
        folder.path(),
        "unit.toml",
        format!(
            "version = 1\nrobot_file = \"horse.toml\"\n{key}[[bus]]\nname = \"main\"\ndevice = \"/dev/\\u001b[2J\"\n"
        ),
    );
    let script =
        written(folder.path(), "script.toml", format!("{key}[[at]]\ntime_s = 0\ngait = \"\u{9b}31m\"\n"));
    let faults = written(
        folder.path(),
        "faults.toml",
        format!(
            "{key}[[fault]]\nkind = \"silent\"\nat_s = 1\nbus = \"\\u001bforged\u{202e}\"\n\"a\\nforged\" = 1\n"
        ),
    );
    let backup = written(folder.path(), "backup.toml", format!("{key}version = 1\n"));
    let no_recording = written(folder.path(), "a\u{1b}[2J\nforged\u{202e}.mcap", "no recording");
    let hostile_path = folder.path().join("x\u{1b}[31m\nforged\u{85}.toml");
    let (robot, unit, script, faults) = (text(&robot), text(&unit), text(&script), text(&faults));
    let hostile = text(&hostile_path);
    let cases: &[&[&str]] = &[
        &["check", robot],
        &["run", FIGURE, "--unit", unit],
        &["run", FIGURE, "--virtual", "--script", script],
        &["run", FIGURE, "--virtual", "--faults", faults],
        &["servo", "restore", "/dev/null", "1", text(&backup), "--yes"],
        &["replay", text(&no_recording)],
        &["check", hostile],
        &["run", FIGURE, "--virtual", "--faults", hostile],
        &["run", HORSE, "--virtual", "--gait", hostile],
        &["run", FIGURE, "--virtual", "--report", &format!("{hostile}/{hostile}")],
        &["run", FIGURE, "--port", &format!("{hostile}={hostile}")],
        &["jog", FIGURE, hostile, "3", "--virtual"],
        &["check", HORSE, "--nonsense", hostile],
        &["run", HORSE, "--seed", hostile],
        &[hostile],
    ];
    for arguments in cases {
        let (stdout, stderr, code) = texts(&hippocamp(arguments).output().unwrap());
        assert_eq!(code, Some(2), "{arguments:?}: {stderr}");
        assert!(stdout.is_empty() && !stderr.is_empty(), "{arguments:?}: {stdout}");
        assert_harmless(&stderr, &format!("{arguments:?}"));
    }
}

#[test]
fn control_characters_in_a_recording_are_shown_as_codes() {
    let folder = tempfile::tempdir().unwrap();
    // The recording names the script of the run.
    let script = written(
        folder.path(),
        "s\u{1b}[2J\nforged\u{202e}.toml",
        "end_s = 0.2\n[[at]]\ntime_s = 0\npose = \"stand\"\n",
    );
    let recording = folder.path().join("of.mcap");
    let run =
        ["run", FIGURE, "--virtual", "--no-physics", "--script", text(&script), "--record", text(&recording)];
    let (stdout, stderr, code) = texts(&hippocamp(&run).output().unwrap());
    assert_eq!(code, Some(0), "{stderr}");
    assert_harmless(&stdout, "run");
    let (stdout, stderr, code) = texts(&hippocamp(&["replay", text(&recording)]).output().unwrap());
    assert_eq!(code, Some(0), "{stderr}");
    assert_harmless(&stdout, "replay");
    assert!(stdout.contains("s\\u001b[2J\\nforged\\u202e.toml"), "{stdout}");
}

/// A command, and the file that its refusal must name.
type Refused<'a> = (Vec<&'a str>, &'a str);

#[test]
fn every_refusal_names_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let bad = written(folder.path(), "bad.toml", "no = TOML\n");
    let latin = written(folder.path(), "latin.toml", b"name = \"gr\xf6n\"\n");
    let other = written(
        folder.path(),
        "other.unit.toml",
        "version = 1\nrobot_file = \"horse.toml\"\n[[bus]]\nname = \"x\"\ndevice = \"/dev/x\"\n",
    );
    let late = written(folder.path(), "late.toml", "end_s = 1\n[[at]]\ntime_s = 3\ngait = \"walk\"\n");
    let pose = written(folder.path(), "pose.toml", "[[at]]\ntime_s = 0\npose = \"bow\"\n");
    let thunder = written(folder.path(), "thunder.toml", "[[fault]]\nkind = \"thunder\"\nat_s = 0\n");
    let push = written(folder.path(), "push.toml", "[[fault]]\nkind = \"push\"\nimpulse_n_s = 1\nat_s = 0\n");
    let absent = folder.path().join("absent.toml");
    let [bad, latin, other, late] = [&bad, &latin, &other, &late].map(|path| text(path));
    let [pose, thunder, push, absent] = [&pose, &thunder, &push, &absent].map(|path| text(path));
    let paper = "config/thoroughbred.toml";
    let mut cases: Vec<Refused<'_>> = vec![
        (vec!["run", HORSE, "--virtual", "--script", late], late),
        (vec!["run", FIGURE, "--virtual", "--script", late], late),
        (vec!["plot", HORSE, "--script", pose, "--out", "nowhere"], pose),
        (vec!["run", FIGURE, "--unit", other], other),
        (vec!["calibrate", HORSE, "--unit", bad], bad),
        (vec!["doctor", HORSE, "--unit", bad], bad),
        (vec!["monitor", HORSE, "--unit", bad], bad),
        (vec!["imu", "show", HORSE, "--unit", bad], bad),
        (vec!["servo", "restore", "/dev/null", "1", bad, "--yes"], bad),
        (vec!["servo", "restore", "/dev/null", "1", absent, "--yes"], absent),
        (vec!["monitor", FIGURE, "--virtual", "--faults", thunder], thunder),
        (vec!["sim", HORSE, "--faults", thunder], thunder),
        (vec!["run", FIGURE, "--virtual", "--no-physics", "--faults", push], push),
        (vec!["replay", HORSE], HORSE),
        (vec!["replay", absent], absent),
        // The fault concerns the whole robot, not a key of its file.
        (vec!["run", paper], paper),
        (vec!["monitor", paper], paper),
        (vec!["jog", paper, "left_hind.hip", "3"], paper),
        (vec!["doctor", paper], paper),
        (vec!["calibrate", paper], paper),
        (vec!["sim", paper], paper),
        (vec!["imu", "show", paper], paper),
        (vec!["try", TENTACLE], TENTACLE),
        (vec!["show", HORSE], HORSE),
        (vec!["run", HORSE, "--gait", "pace"], HORSE),
        (vec!["run", FIGURE, "--port", "tail=/dev/null"], FIGURE),
        (vec!["jog", HORSE, "nowhere", "3", "--virtual"], HORSE),
    ];
    for file in [bad, latin, absent] {
        let commands: [&[&str]; 8] = [
            &["check", file],
            &["run", file],
            &["monitor", file],
            &["try", file],
            &["imu", "show", file],
            &["run", FIGURE, "--virtual", "--script", file],
            &["run", FIGURE, "--virtual", "--faults", file],
            &["run", FIGURE, "--unit", file],
        ];
        cases.extend(commands.map(|arguments| (arguments.to_vec(), file)));
    }
    for (arguments, file) in cases {
        let (_, stderr, code) = texts(&hippocamp(&arguments).output().unwrap());
        assert_eq!(code, Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(file), "{arguments:?} does not name {file}: {stderr}");
    }
    assert!(!Path::new("nowhere").exists());
}
