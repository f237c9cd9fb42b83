//! Hostile files, names and numbers: all are refused quickly, and none controls the terminal.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod numbers;
mod output;
mod sizes;
mod terminal;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const HORSE: &str = "config/horse.toml";
const FIGURE: &str = "config/figure.toml";
const TENTACLE: &str = "config/tentacle.toml";

/// The program, in the folder of the sources, with nothing to read on standard input.
fn hippocamp(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
    command
}

/// The program with limits on processor time and memory that only an endless computation exceeds.
fn bounded(arguments: &[&str]) -> Command {
    let mut command = Command::new("sh");
    command
        .args(["-c", "ulimit -t 20; ulimit -v 2000000; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_hippocamp")])
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::null());
    command
}

/// Standard output, standard error and exit code; none where a signal ended it.
fn texts(output: &Output) -> (String, String, Option<i32>) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (text(&output.stdout), text(&output.stderr), output.status.code())
}

/// A file in a folder of this test alone.
fn written(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, content).unwrap();
    path
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A file that comes with the program, some of its text replaced.
fn shipped_with(name: &str, replacements: &[(&str, &str)]) -> String {
    let content = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    replacements.iter().fold(content, |content, (from, to)| {
        assert!(content.contains(from), "{name} has no '{from}'");
        content.replacen(from, to, 1)
    })
}
