//! Tools by others on the program's output: the Python mcap reader, five readers of URDF, Chromium.
//!
//! Each test runs where its tool is named by an environment variable, and says so where it is not:
//! `HIPPOCAMP_PYTHON`, a Python with the packages of `.ci/python-setup`; `HIPPOCAMP_CHROMIUM`, a Chromium.

#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(
    clippy::explicit_write,
    reason = "macros would be captured, and a test that is left out should say so"
)]

mod urdf;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use hippocamp::recording::Recording;

/// The tool named by the environment variable `name`.
fn tool(name: &str) -> Option<String> {
    let tool = std::env::var(name).ok().filter(|tool| !tool.is_empty());
    if tool.is_none() {
        // Not captured, so that it is read whether the tests pass or not.
        #[allow(clippy::disallowed_methods, reason = "not captured")]
        writeln!(std::io::stderr(), "left out: {name} is not set").unwrap();
    }
    tool
}

/// Runs a program that must succeed; what it printed.
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{command:?}\n{text}\n{}", String::from_utf8_lossy(&output.stderr));
    text
}

fn hippocamp() -> Command {
    Command::new(env!("CARGO_BIN_EXE_hippocamp"))
}

/// An empty folder of its own for the test called `name`.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A recording of a few seconds of walking.
fn record(robot: &str, folder: &Path) -> PathBuf {
    let file = folder.join("run.mcap");
    run(hippocamp().args(["run", robot, "--virtual", "--for", "3", "--record"]).arg(&file));
    file
}

#[test]
fn the_python_mcap_reader_opens_a_recording() {
    let Some(python) = tool("HIPPOCAMP_PYTHON") else { return };
    let recording = record("config/horse.toml", &folder("python_mcap"));
    let cycles = Recording::read(&recording).unwrap().samples.len();
    let script = Command::new(python)
        .arg("tests/python/check_recording.py")
        .arg(recording)
        .arg(cycles.to_string())
        .output()
        .unwrap();
    assert!(script.status.success(), "{}", String::from_utf8_lossy(&script.stderr));
}

#[test]
fn pinocchio_puts_the_feet_of_the_urdf_where_the_recording_says_they_were() {
    let Some(python) = tool("HIPPOCAMP_PYTHON") else { return };
    for robot in ["horse", "horse-dynamixel"] {
        let folder = folder(&format!("pinocchio_{robot}"));
        let (file, urdf) = (format!("config/{robot}.toml"), folder.join("robot.urdf"));
        let recording = record(&file, &folder);
        run(hippocamp().args(["check", &file, "--urdf"]).arg(&urdf));
        let said =
            run(Command::new(&python).arg("tests/python/check_kinematics.py").arg(recording).arg(urdf));
        println!("{robot}: {said}");
    }
}

/// The attribute `name` of the page's body.
fn attribute<'p>(page: &'p str, name: &str) -> Option<&'p str> {
    let body = &page[page.find("<body")?..];
    let body = &body[..body.find('>')?];
    let value = body.split_once(&format!("{name}=\""))?.1;
    value.split_once('"').map(|(value, _)| value)
}

/// Opens `address` in Chromium for some seconds of its virtual time; the page as it is then.
fn open(chromium: &str, folder: &Path, address: &str) -> String {
    open_in(chromium, folder, address, "1200,800")
}

/// The same in a window of this size. One browser at a time: several together starve each other of frames.
fn open_in(chromium: &str, folder: &Path, address: &str, size: &str) -> String {
    static BROWSER: Mutex<()> = Mutex::new(());
    let _only = BROWSER.lock().unwrap_or_else(PoisonError::into_inner);
    run(Command::new(chromium)
        .arg(format!("--window-size={size}"))
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"])
        .args(["--no-first-run", "--disable-sync", "--virtual-time-budget=10000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(address))
}

#[test]
fn the_page_plays_in_chromium_without_an_error() {
    let Some(chromium) = tool("HIPPOCAMP_CHROMIUM") else { return };
    let folder = folder("chromium_plays");
    let page = folder.join("run.html");
    run(hippocamp().args(["run", "config/horse.toml", "--virtual", "--for", "3", "--html"]).arg(&page));
    let left = std::fs::read_dir(&folder).unwrap().count();
    assert_eq!(left, 1, "the recording the page was made from is gone");
    // How far it gets depends on the machine: one that is busy may draw no second frame in the browser's virtual
    // time. A page that hangs does so every time.
    let played = (0..5)
        .map(|_| open(&chromium, &folder, &format!("file://{}", page.display())))
        .find(|played| {
            assert_eq!(attribute(played, "data-error"), None);
            attribute(played, "data-frame").expect("a frame was drawn").parse::<u32>().unwrap() > 0
        })
        .expect("goes on from the first frame");
    assert!(played.contains("<h1 id=\"title\">horse: walk at"), "the title is filled in");
}

#[test]
fn the_page_draws_the_feet_where_the_robot_has_them() {
    let Some(chromium) = tool("HIPPOCAMP_CHROMIUM") else { return };
    let folder = folder("chromium_draws");
    let (file, page) = (record("config/horse.toml", &folder), folder.join("run.html"));
    run(hippocamp().arg("replay").arg(&file).arg("--html").arg(&page));
    // At 100 cycles a second the page has every other.
    let recording = Recording::read(&file).unwrap();
    let sample =
        recording.samples.iter().step_by(2).find(|sample| sample.facts.times.began.as_secs_f64() >= 8.0);
    let sample = sample.unwrap();
    // The page rounds times to a millisecond and shows the first frame from the one asked for.
    let time_s = sample.facts.times.began.as_secs_f64() - 5e-3;
    let shown = open(&chromium, &folder, &format!("file://{}#t={time_s}", page.display()));
    assert_eq!(attribute(&shown, "data-error"), None);
    let tips: Vec<[f64; 3]> = serde_json::from_str(attribute(&shown, "data-tips").unwrap()).unwrap();
    let (trunk, turn) = sample.trunk_in_world(&recording.robot);
    for (limb, tip) in sample.limbs_in_body(&recording.robot).iter().zip(tips) {
        let drawn_m = glam::DVec3::from_array(tip) * 1e-3;
        // Angles are rounded to a hundredth of a degree in the page: a tenth of a millimetre on this robot.
        assert!(drawn_m.distance(turn * *limb.last().unwrap() + trunk) < 2e-4, "{drawn_m}");
    }
}

#[test]
fn the_page_fits_windows_of_every_width() {
    let Some(chromium) = tool("HIPPOCAMP_CHROMIUM") else { return };
    let folder = folder("chromium_fits");
    let (page, measured) = (folder.join("run.html"), folder.join("measured.html"));
    run(hippocamp().args(["run", "config/horse.toml", "--virtual", "--for", "3", "--html"]).arg(&page));
    // A frame of the width wanted round the page: the browser's own window may have a least width.
    let text = std::fs::read_to_string(&page).unwrap();
    for width in [320, 400, 700, 1200] {
        let frame = format!(
            "<body><iframe width={width} height=800 style='border:0' id=page></iframe>\n\
             <script>\nconst page = document.getElementById('page');\n\
             page.onload = () => setTimeout(() => {{\n\
             const inside = page.contentDocument;\n\
             document.body.setAttribute('data-error', inside.body.dataset.error || 'none');\n\
             document.body.setAttribute('data-frame', inside.body.dataset.frame);\n\
             document.body.setAttribute('data-wide', inside.documentElement.scrollWidth);\n\
             }}, 500);\npage.srcdoc = {};</script>",
            serde_json::to_string(&text).unwrap().replace('<', "\\u003c")
        );
        std::fs::write(&measured, frame).unwrap();
        let shown = open_in(&chromium, &folder, &format!("file://{}", measured.display()), "1300,900");
        assert_eq!(attribute(&shown, "data-error"), Some("none"), "{width}");
        assert!(attribute(&shown, "data-frame").is_some_and(|frame| frame != "undefined"), "{width}");
        let wide: u32 = attribute(&shown, "data-wide").expect("it was measured").parse().unwrap();
        assert!(wide <= width, "{wide} pixels of page in a window of {width}");
    }
}

#[test]
fn the_pictures_of_plot_open_in_chromium() {
    let Some(chromium) = tool("HIPPOCAMP_CHROMIUM") else { return };
    let folder = folder("chromium_pictures");
    let out = folder.join("pictures");
    run(hippocamp()
        .args(["plot", "config/thoroughbred.toml", "--script", "docs/walk-to-trot.toml", "--thesis"])
        .arg("--out")
        .arg(&out));
    for name in ["feet", "footfalls", "joints", "poses", "thesis"] {
        let picture = open(&chromium, &folder, &format!("file://{}/{name}.svg", out.display()));
        assert!(!picture.contains("parsererror"), "{name}: {picture}");
        assert!(picture.contains("</text>"), "{name} has words");
    }
}
