//! Commands destroy no file that is needed: which outputs they refuse before doing anything, and which files they
//! replace.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs::{self, File, Permissions};
use std::io::Write;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// A run that takes no time.
const RUN: [&str; 6] = ["run", "robot.txt", "--virtual", "--no-physics", "--for", "0"];

/// A folder of one test with all that a command can read. No name ends in .toml, which has a rule of its own.
struct Folder(TempDir);

impl Folder {
    fn new() -> Folder {
        let folder = tempfile::tempdir().unwrap();
        let copy = |from: &str, to: &str| fs::copy(from, folder.path().join(to)).unwrap();
        copy("config/horse.toml", "robot.txt");
        copy("config/scripts/round.toml", "script.txt");
        copy("config/faults/nudges.toml", "faults.txt");
        let unit = "version = 1\nrobot_file = \"robot.txt\"\n";
        fs::write(folder.path().join("unit.txt"), unit).unwrap();
        Folder(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    fn text(&self, name: &str) -> String {
        String::from_utf8_lossy(&fs::read(self.path(name)).unwrap()).into_owned()
    }

    /// Every name in it, and the content.
    fn all(&self) -> Vec<(String, Vec<u8>)> {
        let entries = fs::read_dir(self.0.path()).unwrap().map(|entry| entry.unwrap());
        let mut all: Vec<_> = entries
            .map(|entry| {
                let target =
                    fs::read_link(entry.path()).map(|target| target.display().to_string().into_bytes());
                let name = entry.file_name().into_string().unwrap();
                (name, target.or_else(|_| fs::read(entry.path())).unwrap_or_default())
            })
            .collect();
        all.sort();
        all
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
        command.args(arguments).current_dir(self.0.path()).output().unwrap()
    }

    /// Asserts that the command refuses its input and changes no file; returns its message.
    fn assert_refused(&self, arguments: &[&str]) -> String {
        let before = self.all();
        let done = self.run(arguments);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(self.all() == before, "{arguments:?} changed a file: {said}");
        said
    }

    /// Asserts that the command succeeds.
    fn assert_done(&self, arguments: &[&str]) -> Output {
        let done = self.run(arguments);
        assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
        done
    }

    fn record(&self, name: &str) {
        self.assert_done(&[&RUN[..], &["--record", name]].concat());
    }
}

#[test]
fn no_command_overwrites_its_own_input() {
    let folder = Folder::new();
    folder.record("k.mcap");
    let run = |more: &[&'static str]| [&RUN[..], more].concat();
    let driven = ["--script", "script.txt", "--faults", "faults.txt", "--unit", "unit.txt"];
    // The command before the name of its output, and its inputs.
    let mut table: Vec<(Vec<&str>, Vec<&str>)> = vec![
        (vec!["check", "robot.txt", "--urdf"], vec!["robot.txt"]),
        (vec!["replay", "k.mcap", "--html"], vec!["k.mcap"]),
        (vec!["try", "robot.txt", "--runs", "1", "--picture"], vec!["robot.txt"]),
        (vec!["try", "robot.txt", "--runs", "1", "--kept"], vec!["robot.txt"]),
        (vec!["calibrate", "robot.txt", "--yes", "--port", "main=/dev/null", "--unit"], vec!["robot.txt"]),
        (vec!["setup", "robot.txt", "--yes", "--port", "main=/dev/null", "--unit"], vec!["robot.txt"]),
        (vec!["imu", "setup", "robot.txt", "--port", "imu=/dev/null", "--unit"], vec!["robot.txt"]),
    ];
    for option in ["--report", "--record", "--html"] {
        let mut command = run(&["--faults", "faults.txt", "--unit", "unit.txt", option]);
        table.push((command.clone(), vec!["robot.txt", "unit.txt", "faults.txt"]));
        command = ["run", "robot.txt", "--virtual", "--no-physics"].into_iter().chain(driven).collect();
        command.push(option);
        table.push((command, vec!["script.txt"]));
    }
    // Another name of the same file is no other file.
    for input in ["robot.txt", "unit.txt", "faults.txt", "script.txt", "k.mcap"] {
        symlink(input, folder.path(&format!("link to {input}"))).unwrap();
        fs::hard_link(folder.path(input), folder.path(&format!("second {input}"))).unwrap();
    }
    for (command, inputs) in table {
        for input in inputs {
            let output = format!("second {input}");
            let said = folder.assert_refused(&[&command[..], &[&output]].concat());
            assert!(said.contains(&output), "{command:?} {output}: {said}");
        }
    }
    let absolute = folder.path("k.mcap");
    for output in ["k.mcap", "./k.mcap", "link to k.mcap", absolute.to_str().unwrap()] {
        let said = folder.assert_refused(&["replay", "k.mcap", "--html", output]);
        assert!(said.contains(output) && said.contains("this command reads that file"), "{output}: {said}");
    }
}

#[test]
fn pictures_overwrite_no_script_and_a_backup_overwrites_no_file() {
    let folder = Folder::new();
    fs::create_dir(folder.path("out")).unwrap();
    fs::hard_link(folder.path("script.txt"), folder.path("out/footfalls.svg")).unwrap();
    let before = folder.text("script.txt");
    let said = folder.assert_refused(&["plot", "robot.txt", "--script", "script.txt", "--out", "out"]);
    assert!(said.contains("footfalls.svg"), "{said}");
    let pictures: Vec<_> = fs::read_dir(folder.path("out")).unwrap().collect();
    assert_eq!((pictures.len(), folder.text("script.txt")), (1, before));
    // Known before the servo is asked.
    folder.write("kept.toml", "mine");
    let said = folder.assert_refused(&["servo", "backup", "/dev/null", "1", "kept.toml"]);
    assert!(said.contains("kept.toml") && said.contains("another name"), "{said}");
}

#[test]
fn two_outputs_to_one_file_are_refused_whatever_their_names() {
    let folder = Folder::new();
    folder.write("old", "old");
    symlink("old", folder.path("link")).unwrap();
    for (options, words) in [
        (["--html", "new", "--report", "./new"], "file of its own"),
        (["--record", "old", "--report", "link"], "file of its own"),
        (["--record", "new", "--html", "new.part"], "file of its own"),
        (["--html", "new.part", "--record", "new"], "file of its own"),
        (["--record", "link", "--report", "old.part"], "file of its own"),
        (["--record", "/dev/null", "--html", "new"], "not a file"),
    ] {
        let said = folder.assert_refused(&[&RUN[..], &options].concat());
        assert!(said.contains(words), "{options:?}: {said}");
    }
}

#[test]
fn a_page_destroys_no_file_with_a_similar_name() {
    let folder = Folder::new();
    for name in ["walk.html.mcap", "walk.html.mcap.part", "walk.html.part"] {
        folder.write(name, "mine");
    }
    folder.assert_done(&[&RUN[..], &["--html", "walk.html"]].concat());
    for name in ["walk.html.mcap", "walk.html.mcap.part", "walk.html.part"] {
        assert_eq!(folder.text(name), "mine", "{name}");
    }
    assert!(folder.text("walk.html").contains("</html>"));
    let left = folder.all().into_iter().map(|(name, _)| name).filter(|name| name.starts_with('.'));
    assert_eq!(left.collect::<Vec<_>>(), Vec::<String>::new());
}

#[test]
fn a_partial_recording_of_an_earlier_run_is_not_overwritten() {
    let folder = Folder::new();
    folder.write("walk.mcap", "earlier");
    folder.write("walk.mcap.part", "half");
    let said = folder.assert_refused(&[&RUN[..], &["--record", "walk.mcap"]].concat());
    for words in ["--record walk.mcap", "walk.mcap.part exists", "hippocamp replay", "delete it"] {
        assert!(said.contains(words), "no '{words}' in {said}");
    }
    fs::remove_file(folder.path("walk.mcap.part")).unwrap();
    folder.record("walk.mcap");
    assert!(!folder.path("walk.mcap.part").exists());
    folder.assert_done(&["replay", "walk.mcap"]);
}

#[test]
fn a_symbolic_link_in_place_of_a_part_file_is_not_followed() {
    let folder = Folder::new();
    folder.write("victim", "mine");
    for name in ["report.part", "page.part", "page.mcap", "page.mcap.part", "walk.mcap.part"] {
        symlink("victim", folder.path(name)).unwrap();
    }
    symlink("nowhere", folder.path("dangling")).unwrap();
    folder.assert_refused(&[&RUN[..], &["--record", "walk.mcap"]].concat());
    folder.assert_refused(&[&RUN[..], &["--report", "dangling"]].concat());
    folder.assert_done(&[&RUN[..], &["--report", "report", "--html", "page"]].concat());
    assert_eq!(folder.text("victim"), "mine");
    assert!(!folder.path("nowhere").exists());
    for name in ["report.part", "page.part", "page.mcap", "page.mcap.part"] {
        assert!(folder.path(name).is_symlink(), "{name}");
    }
    for name in ["report", "page"] {
        assert!(fs::symlink_metadata(folder.path(name)).unwrap().is_file(), "{name}");
    }
}

#[test]
fn an_output_that_is_no_input_is_replaced_with_its_rights_and_a_link_to_it_stays_one() {
    let folder = Folder::new();
    fs::create_dir(folder.path("elsewhere")).unwrap();
    let outputs =
        [("--report", "report", 0o600), ("--html", "page", 0o640), ("--record", "walk.mcap", 0o604)];
    let options: Vec<&str> = outputs.iter().flat_map(|(option, name, _)| [*option, *name]).collect();
    for is_linked in [false, true] {
        for (_, name, mode) in outputs {
            let _ = fs::remove_file(folder.path(name));
            let real = if is_linked { format!("elsewhere/{name}") } else { name.to_owned() };
            folder.write(&real, "old");
            fs::set_permissions(folder.path(&real), Permissions::from_mode(mode)).unwrap();
            if is_linked {
                symlink(&real, folder.path(name)).unwrap();
            }
        }
        folder.assert_done(&[&RUN[..], &options].concat());
        for (_, name, mode) in outputs {
            assert_eq!(folder.path(name).is_symlink(), is_linked, "{name}");
            let written = fs::metadata(folder.path(name)).unwrap();
            assert!(written.len() > 100, "{name}");
            assert_eq!(written.mode() & 0o777, mode, "{name}, linked: {is_linked}");
        }
    }
    assert_eq!(fs::read_dir(folder.path("elsewhere")).unwrap().count(), 3, "and nothing beside them");
}

#[test]
fn a_new_file_has_the_rights_that_the_mask_leaves() {
    let folder = Folder::new();
    let plain = File::create(folder.path("plain")).unwrap().metadata().unwrap().mode();
    folder.assert_done(
        &[&RUN[..], &["--report", "report", "--html", "page", "--record", "walk.mcap"]].concat(),
    );
    folder.assert_done(&["check", "robot.txt", "--urdf", "urdf"]);
    for name in ["report", "page", "walk.mcap", "urdf"] {
        assert_eq!(fs::metadata(folder.path(name)).unwrap().mode(), plain, "{name}");
    }
}

/// A report to standard output, which goes to a file: that file holds the whole output, and the report.
#[test]
fn standard_output_is_written_to_and_not_replaced() {
    let folder = Folder::new();
    let out = File::options().create_new(true).append(true).open(folder.path("out")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
    command.args(RUN).args(["--report", "/dev/stdout", "--html", "/dev/null"]).current_dir(folder.0.path());
    assert!(command.stdout(out).status().unwrap().success());
    let said = folder.text("out");
    for words in ["horse: walk at", "\"robot\": \"horse\"", "0 replies missing"] {
        assert!(said.contains(words), "no '{words}' in {said}");
    }
}

#[test]
fn impossible_output_paths_are_refused() {
    let folder = Folder::new();
    fs::create_dir(folder.path("folder")).unwrap();
    folder.write("other.toml", "of another robot");
    symlink("other.toml", folder.path("other")).unwrap();
    let places = ["folder", "nowhere/file", "..", "other.toml", "other", "robot.txt/file"];
    for option in ["--report", "--record", "--html"] {
        for place in places {
            let said = folder.assert_refused(&[&RUN[..], &[option, place]].concat());
            assert!(said.contains(&format!("{option} {place}: ")), "{said}");
        }
    }
    for place in places {
        folder.assert_refused(&["check", "robot.txt", "--urdf", place]);
        folder.assert_refused(&["try", "robot.txt", "--runs", "1", "--picture", place]);
    }
    folder.write("file", "mine");
    folder.assert_refused(&["plot", "robot.txt", "--script", "script.txt", "--out", "file"]);
}

#[test]
fn links_to_simulated_buses_replace_no_file() {
    for name in ["main", "main.new", "imu.new"] {
        let folder = Folder::new();
        folder.write(name, "mine");
        let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
        command.args(["sim", "robot.txt", "--link", "."]).current_dir(folder.0.path());
        // If it starts in spite of this, this ends it.
        let mut child = command.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let _ = child.stdin.take().unwrap().write_all(b"quit\n");
        let done = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!((done.status.code(), folder.text(name).as_str()), (Some(2), "mine"), "{said}");
        assert!(said.contains(name), "{said}");
    }
}

#[test]
fn a_recording_whose_start_fails_leaves_nothing() {
    let folder = Folder::new();
    folder.write("walk.mcap", "earlier");
    // No servo answers.
    let faults = "[[fault]]\nkind = \"silent\"\nat_s = 0\nbus = \"main\"\n";
    folder.write("faults.txt", faults);
    let before = folder.all();
    let done = folder.run(&[&RUN[..], &["--faults", "faults.txt", "--record", "walk.mcap"]].concat());
    assert_eq!(done.status.code(), Some(1));
    assert!(folder.all() == before);
}

#[test]
fn a_recording_that_could_not_be_read_back_is_not_begun() {
    let folder = Folder::new();
    let text = folder.text("robot.txt");
    folder.write("robot.txt", &(text + &"# a long remark\n".repeat(1 << 16)));
    for option in ["--record", "--html"] {
        let said = folder.assert_refused(&[&RUN[..], &[option, "new"]].concat());
        assert!(said.contains("robot.txt: ") && said.contains("read back"), "{said}");
    }
}

#[test]
fn the_page_of_a_run_equals_the_page_of_its_recording() {
    let folder = Folder::new();
    folder.assert_done(&[&RUN[..], &["--html", "alone.html"]].concat());
    folder.assert_done(&[&RUN[..], &["--html", "beside.html", "--record", "walk.mcap"]].concat());
    folder.assert_done(&["replay", "walk.mcap", "--html", "after.html"]);
    assert!(is_same(&folder.path("alone.html"), &folder.path("beside.html")));
    assert!(is_same(&folder.path("alone.html"), &folder.path("after.html")));
}

fn is_same(a: &Path, b: &Path) -> bool {
    fs::read(a).unwrap() == fs::read(b).unwrap()
}
