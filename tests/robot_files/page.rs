//! The page of robot-file keys matches the reader.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use hippocamp::config::{Key, robot_file_keys};
use hippocamp::motion::tentacle::strokes::STROKES;

use crate::GOOD;

const BEGIN: &str =
    "<!-- From here on made from the reader: HIPPOCAMP_WRITE_DOCS=1 cargo test --test robot_files page -->\n";

/// The texts that have every key between them: the good file, what comes with the program, and a horse on a flat foot
/// before a step.
fn samples() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
    // The unit file of somebody who tries things out is none.
    files.retain(|path| !path.to_string_lossy().contains(".unit."));
    files.sort();
    let texts = files.iter().map(|path| fs::read_to_string(path).unwrap());
    let horse = include_str!("../../config/horse.toml");
    let round = "foot = { radius_mm = 10, width_mm = 30 }";
    let flat = horse.replacen(round, "foot = { size_mm = [60, 40, 5] }", 1);
    let step = "\n[[physics.step]]\nat_mm = 500\nlength_mm = 200\nheight_mm = 5\n";
    std::iter::once(GOOD.to_owned()).chain(texts).chain([flat + step]).collect()
}

/// A section as it is headed in a file, and a key of it. What is inside braces stays with its key.
fn place(path: &str, kind: &str) -> (String, String) {
    let (section, key) = match path.rsplit_once('.') {
        None => (String::new(), path),
        Some((section, key)) => (section.to_owned(), key),
    };
    let bare = section.replace("[]", "");
    let heading = match section.as_str() {
        "" => "Top of the file".to_owned(),
        list if list.ends_with("[]") => format!("`[[{bare}]]`"),
        _ => format!("`[{bare}]`"),
    };
    let is_of_motion = bare == "motion" || bare.starts_with("motion.");
    (if is_of_motion { format!("{heading} of a {kind}") } else { heading }, key.to_owned())
}

/// The kind of motion of a robot file.
fn kind(text: &str) -> String {
    let table: toml::Table = text.parse().unwrap();
    table["motion"]["kind"].as_str().unwrap().to_owned()
}

fn table() -> String {
    let mut sections: Vec<(String, Vec<(String, Key)>)> = Vec::new();
    for text in samples() {
        let kind = kind(&text);
        for key in robot_file_keys(&text).unwrap_or_else(|error| panic!("{error}")) {
            let (heading, name) = place(&key.path, &kind);
            let at = sections.iter().position(|(known, _)| *known == heading).unwrap_or_else(|| {
                sections.push((heading, Vec::new()));
                sections.len() - 1
            });
            let keys = &mut sections[at].1;
            if !keys.iter().any(|(known, _)| *known == name) {
                keys.push((name, key));
            }
        }
    }
    let mut page = String::new();
    for (heading, keys) in sections {
        writeln!(page, "\n## {heading}\n\n| key | meaning | default |\n|---|---|---|").unwrap();
        for (name, key) in keys {
            let default = key.default.unwrap_or_else(|| "required".to_owned());
            let expected = key.expected.replace('|', "\\|").replace("[[", "`[[").replace("]]", "]]`");
            writeln!(page, "| `{name}` | {expected} | {default} |").unwrap();
        }
    }
    page
}

#[test]
fn the_page_of_keys_matches_the_reader() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/robot-file.md");
    let page = fs::read_to_string(&path).unwrap();
    let (head, tables) = page.split_once(BEGIN).expect("the page says where its tables begin");
    let made = table();
    if std::env::var_os("HIPPOCAMP_WRITE_DOCS").is_some() {
        fs::write(&path, format!("{head}{BEGIN}{made}")).unwrap();
        return;
    }
    assert!(
        tables == made,
        "docs/robot-file.md is not what the reader asks for: HIPPOCAMP_WRITE_DOCS=1 cargo test --test robot_files page"
    );
}

/// The line of `docs/tentacle.md` below which the table of strokes stands.
const STROKES_BEGIN: &str = "<!-- The strokes, made from their table: HIPPOCAMP_WRITE_DOCS=1 cargo test --test robot_files page -->\n";

#[test]
fn the_page_of_arms_has_every_stroke_of_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tentacle.md");
    let page = fs::read_to_string(&path).unwrap();
    let (head, rest) = page.split_once(STROKES_BEGIN).expect("the page says where its strokes begin");
    let (_, tail) = rest.split_once("\n\nEach stroke").expect("the page goes on below its strokes");
    let mut made = "\n| stroke | key | motion |\n|---|---|---|".to_owned();
    for kind in STROKES {
        let key = kind.key.map_or_else(String::new, |key| format!("`{key}`"));
        write!(made, "\n| `{}` | {key} | {} |", kind.name, kind.meaning).unwrap();
    }
    let made = format!("{head}{STROKES_BEGIN}{made}\n\nEach stroke{tail}");
    if std::env::var_os("HIPPOCAMP_WRITE_DOCS").is_some() {
        fs::write(&path, made).unwrap();
        return;
    }
    assert!(
        page == made,
        "docs/tentacle.md has other strokes: HIPPOCAMP_WRITE_DOCS=1 cargo test --test robot_files page"
    );
}
