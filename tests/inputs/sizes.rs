//! Refusing a file takes little time and memory, whatever its size and kind.

use std::fs::File;
use std::path::Path;

use rustix::fs::{CWD, Mode, mkfifoat};

use crate::{FIGURE, HORSE, bounded, shipped_with, text, texts, written};

/// Lines of the faults, the line that counts them, and the two lines after a fault of the whole file.
const LINES_MAX: usize = 52;
/// Largest answer, bytes.
const BYTES_MAX: usize = 40_000;

/// Asserts a refusal with exit code 2 in little time, memory and text; returns the text.
fn refused(arguments: &[&str], file: &Path) -> String {
    let (_, stderr, code) = texts(&bounded(arguments).output().unwrap());
    assert_eq!(code, Some(2), "{}: {stderr:.1000}", file.display());
    assert!(stderr.contains(text(file)), "it is not named: {stderr:.1000}");
    assert!(stderr.lines().count() <= LINES_MAX && stderr.len() <= BYTES_MAX, "{stderr:.2000}");
    stderr
}

fn chain(name: &str, joints: usize) -> String {
    let joint = |number| {
        format!(
            "[[chain.joint]]\nname = \"j{number}\"\naxis = [0, 1, 0]\nlink_mm = [10, 0, 0]\nrange_deg = [-90, 90]\n\
             stiffness = 0.5\nmass_kg = 0.01\n"
        )
    };
    let joints: String = (0..joints).map(joint).collect();
    format!("[[chain]]\nname = \"{name}\"\nroot_mm = [0, 0, 0]\n{joints}")
}

#[test]
fn large_files_are_refused_soon_with_their_first_fifty_faults() {
    let folder = tempfile::tempdir().unwrap();
    let horse = shipped_with(HORSE, &[]);
    let numbered = |count: u32, line: fn(u32) -> String| (0..count).map(line).collect::<String>();
    let cases: [(&str, String, &[&str]); 10] = [
        (
            "unknown keys",
            numbered(200_000, |number| format!("k{number}=1\n")) + &horse,
            &[":1: k0 = 1:", ":50: k49 = 1:", "and 199950 more: 200000 faults"],
        ),
        (
            "a long key",
            "a".repeat(4_000_000) + "=1\n" + &horse,
            &[":1: aaaaaaaa", "a... = 1: expected a known key"],
        ),
        ("a key of 10 MB", "a".repeat(10_000_000) + "=1\n" + &horse, &["larger than 4 MiB"]),
        (
            "a long name",
            horse.replacen("\"horse\"", &format!("\"{}\"", "a".repeat(3_000_000)), 1),
            &["name = \"aaaaaaa", "at most 4096 characters"],
        ),
        ("many joints", chain("leg", 10_000), &["chain[0].joint = ", "at most 32 tables; there are 10000"]),
        ("many chains", "[[chain]]\n".repeat(100_000), &["at most 32 tables; there are 100000"]),
        ("deep lists", format!("{horse}\nx = {}", "[".repeat(1_000_000)), &["expected TOML"]),
        ("deep tables", "a.".repeat(1_000_000) + "b = 1\n", &["expected TOML"]),
        // Each of these keys has a path of 140 letters.
        (
            "long paths",
            format!("[{}b]\n{}", "a.".repeat(70), numbered(200_000, |number| format!("k{number}=1\n"))),
            &[":1: a = a: expected a known key"],
        ),
        ("no TOML", "a\n".repeat(1_000_000), &[":1:2: expected TOML", "and 999950 more: 1000000 faults"]),
    ];
    for (name, content, says) in cases {
        let path = written(folder.path(), &format!("{name}.toml"), content);
        let said = refused(&["check", text(&path)], &path);
        for words in says {
            assert!(said.contains(words), "{name} does not say '{words}': {said}");
        }
    }
}

#[test]
fn large_scripts_and_fault_scripts_are_refused_soon() {
    let folder = tempfile::tempdir().unwrap();
    let bad_fault = "[[fault]]\nkind = \"thunder\"\nat_s = 1\n";
    for (option, name, content, says) in [
        ("--faults", "many.toml", bad_fault.repeat(100_000), "at most 10000 faults; these are 100000"),
        ("--faults", "bad.toml", bad_fault.repeat(10_000), "and 9950 more\n10000 mistakes"),
        ("--faults", "keys.toml", (0..200_000).map(|n| format!("k{n}=1\n")).collect(), "and 199950 more"),
        ("--faults", "long.toml", "a".repeat(4_000_000) + "=1\n", "a... = 1: expected a known key"),
        ("--script", "entries.toml", "[[at]]\n".repeat(100_000), "at most 10000 tables; there are 100000"),
        ("--unit", "joints.toml", "[[joint]]\n".repeat(100_000), "at most 2000 tables; there are 100000"),
    ] {
        let path = written(folder.path(), name, content);
        let said = refused(&["run", FIGURE, "--virtual", option, text(&path)], &path);
        assert!(said.contains(says), "{name} does not say '{says}': {said}");
    }
}

#[test]
fn anything_but_a_plain_file_of_sane_size_is_refused_everywhere() {
    let folder = tempfile::tempdir().unwrap();
    let huge = folder.path().join("huge.toml");
    // A hole, which takes no room.
    File::create(&huge).unwrap().set_len(1 << 30).unwrap();
    let pipe = folder.path().join("pipe.toml");
    mkfifoat(CWD, &pipe, Mode::RUSR | Mode::WUSR).unwrap();
    for file in [huge.as_path(), &pipe, folder.path(), Path::new("/dev/zero"), Path::new("/dev/tty")] {
        let name = text(file);
        let commands: [&[&str]; 8] = [
            &["check", name],
            &["run", name],
            &["sim", name],
            &["run", FIGURE, "--unit", name],
            &["run", FIGURE, "--virtual", "--script", name],
            &["run", FIGURE, "--virtual", "--faults", name],
            &["monitor", FIGURE, "--virtual", "--faults", name],
            &["servo", "restore", "/dev/null", "1", name, "--yes"],
        ];
        for arguments in commands {
            let said = refused(arguments, file);
            let why = if file == huge { "larger than 4 MiB" } else { "not a plain file" };
            assert!(said.contains(why), "{arguments:?}: {said}");
        }
    }
}
