//! The modules of `src` form layers: none uses one above it in the list of ARCHITECTURE.md.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The modules from ground to roof, as the page lists them: in backticks, below its heading "Layers".
fn layers() -> Vec<String> {
    let page = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let section = page.split("\n## ").find(|section| section.starts_with("Layers\n")).unwrap();
    let listed = section.lines().filter(|line| line.starts_with("| "));
    listed.flat_map(|line| line.split('`').skip(1).step_by(2).map(str::to_owned)).collect()
}

/// Every source file below `folder`, but for those of tests.
fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_test = path.file_stem().is_some_and(|stem| stem == "tests" || stem == "testing");
        if path.is_dir() && !is_test {
            sources(&path, into);
        } else if path.extension().is_some_and(|extension| extension == "rs") && !is_test {
            into.push(path);
        }
    }
}

/// The code of a file, without comments and tests.
fn code_of(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// The top-level modules that `code` names by a path from the crate's root.
fn named(code: &str) -> BTreeSet<String> {
    let first = |path: &str| -> String {
        path.trim_start().chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect()
    };
    let mut found = BTreeSet::new();
    for rest in code.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            // The names of a group, at its first level.
            Some(group) => {
                let mut depth = 0;
                let mut name = String::new();
                for letter in group.chars() {
                    match letter {
                        '}' if depth == 0 => break,
                        '{' => depth += 1,
                        '}' => depth -= 1,
                        ',' if depth == 0 => {
                            found.insert(first(&name));
                            name.clear();
                        }
                        _ if depth == 0 => name.push(letter),
                        _ => {}
                    }
                }
                found.insert(first(&name));
            }
            None => {
                found.insert(first(rest));
            }
        }
    }
    found
}

/// The top-level module a file belongs to; none for the crate's root and its main function.
fn module_of(path: &Path) -> Option<String> {
    let inside = path.strip_prefix(root().join("src")).unwrap();
    let first = Path::new(inside.components().next().unwrap().as_os_str());
    let name = first.file_stem().unwrap().to_str().unwrap().to_owned();
    (name != "lib" && name != "main").then_some(name)
}

#[test]
fn no_module_uses_one_above_it() {
    let layers = layers();
    let height = |module: &str| layers.iter().position(|layer| layer == module);
    let mut files = Vec::new();
    sources(&root().join("src"), &mut files);
    let mut used = BTreeSet::new();
    let mut wrong = Vec::new();
    for path in &files {
        let Some(module) = module_of(path) else { continue };
        let own = height(&module).unwrap_or_else(|| panic!("{module} is not in the list of ARCHITECTURE.md"));
        used.insert(module.clone());
        for other in named(&code_of(&fs::read_to_string(path).unwrap())) {
            if height(&other).is_some_and(|other| other > own) {
                wrong.push(format!("{}: {module} uses {other}, which stands above it", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let unknown: Vec<_> = layers.iter().filter(|layer| !used.contains(*layer)).collect();
    assert!(unknown.is_empty(), "ARCHITECTURE.md lists modules that do not exist: {unknown:?}");
}

/// Observers are attached to the loop, which knows none of them: another one changes nothing here.
#[test]
fn the_loop_names_no_observer() {
    for file in ["src/cycle.rs", "src/run/mod.rs", "src/run/cycle.rs", "src/run/end.rs"] {
        let used = named(&code_of(&fs::read_to_string(root().join(file)).unwrap()));
        let known: Vec<_> =
            used.iter().filter(|module| ["telemetry", "recording"].contains(&module.as_str())).collect();
        assert!(known.is_empty(), "{file} names {known:?}");
        assert!(used.contains("observe"), "{file}: its paths were not found");
    }
}

#[test]
fn module_paths_are_found_in_code_but_not_in_comments_or_tests() {
    let text = "use crate::b::{X, y::Z};\n/// [`crate::c`]\nuse crate::{d, e::{F, G}, h};\nlet i = crate::j::k();\n\
                #[cfg(test)]\nmod tests {\n use crate::l;\n}";
    let found: Vec<_> = named(&code_of(text)).into_iter().collect();
    assert_eq!(found, ["b", "d", "e", "h", "j"]);
}

/// The one file of each crate that names all protocols; their folders stand beside it.
const LISTS: [&str; 2] = ["src/bus/protocols.rs", "hw-sim/src/protocols.rs"];

/// True if this code names a protocol of the lists: `Protocol::Some`, or `some::` for its folder.
fn names_a_protocol(code: &str, folders: &[String]) -> bool {
    let begins = |rest: &str, is: fn(&char) -> bool| rest.chars().next().is_some_and(|letter| is(&letter));
    let is_variant =
        |rest: &str| begins(rest, char::is_ascii_uppercase) && begins(&rest[1..], char::is_ascii_lowercase);
    let is_path = |before: &str| !before.ends_with(|letter: char| letter.is_alphanumeric() || letter == '_');
    code.split("Protocol::").skip(1).any(is_variant)
        || folders
            .iter()
            .any(|folder| code.match_indices(&format!("{folder}::")).any(|(at, _)| is_path(&code[..at])))
}

/// So a further protocol is a folder and a few lines, and the simulated servo and its protocols form no loop.
#[test]
fn only_the_lists_and_a_protocols_own_folder_name_a_protocol() {
    let lists = LISTS.map(|list| fs::read_to_string(root().join(list)).unwrap());
    let lines = lists.iter().flat_map(|list| list.lines());
    let entries = lines.filter_map(|line| line.trim().strip_prefix('&'));
    let folders: Vec<String> =
        entries.filter_map(|entry| Some(entry.split("::").nth(1)?.to_owned())).collect();
    assert!(folders.iter().any(|folder| folder == "feetech"), "{folders:?}");
    let mut files = Vec::new();
    ["src", "hw-sim/src"].iter().for_each(|crate_of| sources(&root().join(crate_of), &mut files));
    let mut wrong = Vec::new();
    for path in &files {
        let place = path.strip_prefix(root()).unwrap();
        let is_own = place.iter().any(|part| folders.iter().any(|folder| part == folder.as_str()));
        if !is_own && !LISTS.iter().any(|list| place == Path::new(list)) {
            let code = code_of(&fs::read_to_string(path).unwrap());
            let lines = code.lines().filter(|line| names_a_protocol(line, &folders));
            wrong.extend(lines.map(|line| format!("{}: {}", place.display(), line.trim())));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn protocols_are_found_by_variant_and_by_folder() {
    let folders = ["dynamixel".to_owned()];
    for code in ["of == Protocol::Feetech", "use super::dynamixel::X;", "dynamixel::ping()"] {
        assert!(names_a_protocol(code, &folders), "{code}");
    }
    for code in ["id <= Protocol::ID_MAX", "Protocol::all()", "no_dynamixel::ping()", "mod dynamixel;"] {
        assert!(!names_a_protocol(code, &folders), "{code}");
    }
}
