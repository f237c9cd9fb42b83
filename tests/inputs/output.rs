//! Output that cannot be printed is a failure, and a reader that closes the pipe is not.

use std::fs::File;
use std::process::Stdio;

use crate::{FIGURE, TENTACLE, hippocamp, text, texts};

/// Commands that say something and succeed.
fn commands(recording: &str, pictures: &str) -> Vec<Vec<String>> {
    let commands: [&[&str]; 9] = [
        &["check", FIGURE],
        &["--help"],
        &["run", FIGURE, "--virtual", "--no-physics", "--for", "0.1"],
        &["jog", FIGURE, "head.nod", "3", "--virtual", "--no-physics"],
        &["show", TENTACLE, "--virtual", "--no-physics", "--for", "0.1"],
        &["monitor", FIGURE, "--virtual", "--no-physics", "--for", "0.3"],
        &["monitor", FIGURE, "--virtual", "--no-physics", "--for", "0.3", "--json"],
        &["plot", FIGURE, "--script", "config/scripts/poses.toml", "--to", "0.5", "--out", pictures],
        &["replay", recording],
    ];
    commands.iter().map(|words| words.iter().map(|word| (*word).to_owned()).collect()).collect()
}

#[test]
fn a_full_standard_output_is_a_failure_and_a_closed_one_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("of.mcap");
    let record = ["run", FIGURE, "--virtual", "--no-physics", "--for", "0.1", "--record", text(&recording)];
    assert_eq!(texts(&hippocamp(&record).output().unwrap()).2, Some(0));
    for arguments in commands(text(&recording), text(&folder.path().join("pictures"))) {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let full = File::options().write(true).open("/dev/full").unwrap();
        let mut command = hippocamp(&arguments);
        let output = command.stdout(full).stderr(Stdio::piped()).spawn().unwrap().wait_with_output();
        let (_, stderr, code) = texts(&output.unwrap());
        assert_eq!(code, Some(1), "{arguments:?}: {stderr}");
        assert!(
            stderr.contains("standard output") && stderr.contains("No space left"),
            "{arguments:?}: {stderr}"
        );

        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = hippocamp(&arguments);
        let output = command.stdout(writer).stderr(Stdio::piped()).spawn().unwrap().wait_with_output();
        let (_, stderr, code) = texts(&output.unwrap());
        assert_eq!(code, Some(0), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("standard output"), "{arguments:?}: {stderr}");
    }
}

#[test]
fn a_refusal_keeps_its_exit_code_if_nothing_can_be_printed() {
    let full = || File::options().write(true).open("/dev/full").unwrap();
    let status = hippocamp(&["check", "nowhere.toml"]).stdout(full()).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(2));
}
