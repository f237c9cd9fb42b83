//! From a box of new servos to a walking robot, with the program's own commands alone, in real time: `sim`, and
//! `setup`, `calibrate`, `doctor` and `run` on its devices; each interrupted in the middle and run again.
//!
//! By default a dog of eight servos. With `HIPPOCAMP_FULL` set the horse, which is interrupted more often, and a figure.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use hippocamp::config::{self, load_unit};
use hippocamp::model::Robot;
use tempfile::TempDir;

/// Mounted the other way round than the robot files say.
const REVERSED_OF_DOG: [&str; 2] = ["left_hind.knee", "right_fore.hip"];
const REVERSED_OF_HORSE: [&str; 3] = ["left_hind.stifle", "left_fore.carpus", "right_fore.scapula"];
const REVERSED_OF_FIGURE: [&str; 2] = ["left_leg.knee", "right_arm.shoulder_yaw"];

/// Where a command is interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Break {
    /// Nowhere.
    Never,
    /// It is killed at the line that has these words.
    Kill(&'static str),
    /// The plug of this joint's servo is pulled at the line that has these words.
    Pull(&'static str, &'static str),
}

/// A box of servos, and a person with hands.
struct Workshop {
    folder: TempDir,
    robot: Robot,
    robot_file: PathBuf,
    sim: Child,
    hands: ChildStdin,
    seen: BufReader<ChildStdout>,
}

impl Workshop {
    /// With the robot file `text`.
    fn new(text: &str, reversed: &[&str], horns: &[&str]) -> Workshop {
        let folder = tempfile::tempdir().unwrap();
        let robot_file = folder.path().join("robot.toml");
        // As fast as the file permits: the test waits for all of it.
        let text = text
            .replace("slow_rate_deg_s = 30 ", "slow_rate_deg_s = 90 ")
            .replace("torque_ramp_s = 1.0 ", "torque_ramp_s = 0.2 ")
            .replace("[safety]\n\n", "[safety]\nslow_rate_deg_s = 90\ntorque_ramp_s = 0.2\n\n");
        fs::write(&robot_file, text).unwrap();
        let robot = config::load(&robot_file).unwrap().robot;
        let mut sim = Command::new(env!("CARGO_BIN_EXE_hippocamp"))
            .arg("sim")
            .arg(&robot_file)
            .arg("--factory-new")
            .args(horns)
            .args(["--seed", "3", "--reversed", &reversed.join(",")])
            .arg("--link")
            .arg(folder.path().join("ports"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (hands, seen) = (sim.stdin.take().unwrap(), BufReader::new(sim.stdout.take().unwrap()));
        let mut shop = Workshop { folder, robot, robot_file, sim, hands, seen };
        // The devices are there once it answers.
        let last = format!("{}: ", shop.robot.joints.last().unwrap().name);
        shop.handle("list", &last);
        shop
    }

    /// Performs an action by hand, and waits for the line that begins so.
    fn handle(&mut self, what: &str, done: &str) {
        writeln!(self.hands, "{what}").unwrap();
        let mut line = String::new();
        while !line.starts_with(done) {
            line.clear();
            assert!(self.seen.read_line(&mut line).unwrap() > 0, "'sim' ended before {done:?}");
        }
    }

    fn turn(&mut self, joint: &str, angle_rad: f64) {
        self.handle(&format!("turn {joint} {:.3}", angle_rad.to_degrees()), &format!("{joint}: at "));
    }

    fn range_rad(&self, joint: &str) -> (f64, f64) {
        self.robot.joints.iter().find(|of| of.name == joint).unwrap().range_rad
    }

    fn unit_file(&self) -> PathBuf {
        self.robot_file.with_extension("unit.toml")
    }

    /// Follows the instruction in a line of a command's output.
    fn obey(&mut self, line: &str) {
        if line.starts_with("Measured as soon as") {
            let joints: Vec<(String, f64)> =
                self.robot.joints.iter().map(|joint| (joint.name.clone(), joint.middle_rad())).collect();
            let pairs: Vec<String> =
                joints.iter().map(|(name, rad)| format!("{name} {:.3}", rad.to_degrees())).collect();
            let last = format!("{}: at ", joints.last().unwrap().0);
            return self.handle(&format!("turn {}", pairs.join(" ")), &last);
        }
        let Some((joint, rest)) = line.split_once(": ") else { return };
        if rest.starts_with("plug in its new ") {
            self.handle(&format!("plug {joint}"), &format!("{joint}: plugged in"));
        } else if rest.starts_with("turn it ") {
            self.turn(joint, self.range_rad(joint).1);
        } else if rest.starts_with("now ") {
            self.turn(joint, self.range_rad(joint).0);
        } else if rest.starts_with("bring it ") {
            let (low, high) = self.range_rad(joint);
            self.turn(joint, 0.5 * (low + high));
        }
    }

    /// Runs a command on the robot, follows it, and interrupts it; its exit code, `None` if it was killed, and its
    /// output. Begins again while the guard of one that was killed still has the device.
    fn run(&mut self, command: &str, arguments: &[&str], broken: Break) -> (Option<i32>, String) {
        loop {
            let (code, words) = self.run_once(command, arguments, broken);
            if !words.contains("is in use by another program") {
                return (code, words);
            }
        }
    }

    fn run_once(&mut self, command: &str, arguments: &[&str], mut broken: Break) -> (Option<i32>, String) {
        let mut child = Command::new(env!("CARGO_BIN_EXE_hippocamp"))
            .arg(command)
            .arg(&self.robot_file)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut words = String::new();
        let mut pulled = None;
        for line in BufReader::new(child.stdout.take().unwrap()).lines() {
            let line = line.unwrap();
            words.push_str(&line);
            words.push('\n');
            match broken {
                Break::Kill(at) if line.contains(at) => {
                    child.kill().unwrap();
                    broken = Break::Never;
                }
                Break::Pull(joint, at) if line.contains(at) => {
                    self.handle(&format!("unplug {joint}"), &format!("{joint}: unplugged"));
                    (broken, pulled) = (Break::Never, Some(joint));
                }
                _ => self.obey(&line),
            }
        }
        child.stderr.take().unwrap().read_to_string(&mut words).unwrap();
        let code = child.wait().unwrap().code();
        let is_busy = words.contains("is in use by another program");
        assert!(
            is_busy || broken == Break::Never,
            "{command} was not where it was to be broken off:\n{words}"
        );
        if let Some(joint) = pulled {
            self.handle(&format!("plug {joint}"), &format!("{joint}: plugged in"));
        }
        (code, words)
    }

    /// No file is half written: every file can be read.
    fn assert_files_whole(&self) {
        if self.unit_file().exists() {
            load_unit(&self.unit_file()).unwrap_or_else(|error| panic!("{error}"));
        }
        let leftovers: Vec<_> = fs::read_dir(self.folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.ends_with(".part"))
            .collect();
        assert!(leftovers.is_empty(), "{leftovers:?}");
    }
}

fn is_full() -> bool {
    std::env::var_os("HIPPOCAMP_FULL").is_some()
}

/// The doctor's faults that do not depend on the machine's speed.
fn faults(words: &str) -> Vec<&str> {
    let is_of_the_machine = |line: &&str| line.contains("replies lost") || line.contains("an exchange takes");
    words.lines().filter(|line| line.starts_with("FAULT") && !is_of_the_machine(line)).collect()
}

impl Drop for Workshop {
    fn drop(&mut self) {
        let _ = self.sim.kill();
        let _ = self.sim.wait();
    }
}

/// The small dog without its sideways joints and its IMU, on Feetech servos, which are set up sooner: two servos a leg.
fn eight_servo_dog() -> String {
    let text = include_str!("../robots/small-dog.toml").replace("[imu]\nrpy_deg = [0, 0, 0]\n", "");
    let text = text
        .replace("protocol = \"dynamixel\"", "protocol = \"feetech\"")
        .replace("XL330-M288", "STS3215-12V");
    let parts = text.split("[[chain.joint]]").filter(|part| !part.contains("name = \"abduction\""));
    parts.collect::<Vec<_>>().join("[[chain.joint]]") + "\n[safety]\n\n"
}

#[test]
fn new_servos_become_a_walking_robot_despite_interruptions() {
    if is_full() {
        let breaks = [
            Break::Kill("Measured as soon as"),
            Break::Pull("right_hind.hip", "left_fore.scapula: turn it"),
            Break::Kill("left_fore.carpus: now "),
            Break::Kill("left_hind.stifle: turns "),
            Break::Pull("right_fore.elbow", "right_hind.hip: turns "),
        ];
        let horse = include_str!("../../config/horse.toml");
        become_a_walking_robot(horse, &REVERSED_OF_HORSE, "left_fore.shoulder", &breaks);
    } else {
        let breaks = [
            Break::Kill("Measured as soon as"),
            Break::Pull("right_hind.hip", "left_fore.hip: turn it"),
            Break::Kill("left_fore.knee: turns "),
        ];
        become_a_walking_robot(&eight_servo_dog(), &REVERSED_OF_DOG, "right_hind.hip", &breaks);
    }
}

/// The robot of this file, whose setup is killed at the `killed` joint, and whose calibration is interrupted by each of
/// `breaks`.
fn become_a_walking_robot(file: &str, reversed: &[&str], killed: &'static str, breaks: &[Break]) {
    let mut shop = Workshop::new(file, reversed, &["--horns-within-deg", "8"]);
    let port = format!("main={}", shop.folder.path().join("ports/main").display());
    let port = ["--yes", "--port", &port];

    // Killed while it waits for a servo; run again, it continues after the one before it.
    let place = shop.robot.joints.iter().position(|joint| joint.name == killed).unwrap();
    let before = shop.robot.joints[place - 1].name.clone();
    let (code, words) = shop.run("setup", &port, Break::Kill(killed));
    assert_eq!(code, None, "{words}");
    shop.assert_files_whole();
    let (code, words) = shop.run("setup", &["--yes"], Break::Never);
    assert_eq!(code, Some(0), "{words}");
    assert!(words.contains(&format!("{before}: servo")) && words.contains("is set up"), "{words}");
    assert!(!words.contains(&format!("{before}: plug in")), "{words}");

    // Killed in the marked pose, in a sweep and while a joint turns by itself; a plug pulled in a sweep.
    for broken in breaks.iter().copied() {
        let (code, words) = shop.run("calibrate", &["--yes"], broken);
        assert_ne!(code, Some(0), "{broken:?}: {words}");
        shop.assert_files_whole();
    }
    let (code, words) = shop.run("calibrate", &["--yes"], Break::Never);
    assert_eq!(code, Some(0), "{words}");
    let unit = load_unit(&shop.unit_file()).unwrap().unit;
    for entry in &unit.joints {
        let of_file = entry.name.starts_with("right");
        let is_other = reversed.contains(&entry.name.as_str());
        assert_eq!(entry.reversed, Some(of_file != is_other), "{}", entry.name);
    }

    // It writes nothing, so it has nothing to resume. The number of lost replies depends on the machine.
    let (code, words) = shop.run("doctor", &[], Break::Kill("servo 3 of joint"));
    assert_eq!(code, None, "{words}");
    let (_, words) = shop.run("doctor", &[], Break::Never);
    assert!(faults(&words).is_empty(), "{words}");

    // Killed while the torque rises: its guard takes it off. Then it stands up, walks and sits down.
    let (code, words) = shop.run("run", &["--for", "1"], Break::Kill("real-time priority"));
    assert_eq!(code, None, "{words}");
    let report = shop.folder.path().join("report.json");
    let arguments = ["--for", "2", "--report", report.to_str().unwrap()];
    let (code, words) = shop.run("run", &arguments, Break::Never);
    assert_eq!(code, Some(0), "{words}");
    let report: serde_json::Value = serde_json::from_str(&fs::read_to_string(report).unwrap()).unwrap();
    assert_eq!(report["outcome"], "completed", "{report:#}");
    assert_eq!(report["reason"], "walked for the time asked", "{report:#}");
}

/// For the person who builds the robot, a ball joint is three ordinary servos. With `HIPPOCAMP_FULL` set: it takes
/// one and a half minutes.
#[test]
fn new_servos_become_a_figure_that_takes_a_pose() {
    if !is_full() {
        eprintln!("skipped: it takes one and a half minutes and has HIPPOCAMP_FULL set");
        return;
    }
    let mut shop = Workshop::new(
        include_str!("../../config/figure.toml"),
        &REVERSED_OF_FIGURE,
        &["--horns-within-deg", "8"],
    );
    let port = |bus: &str| format!("{bus}={}", shop.folder.path().join("ports").join(bus).display());
    let ports: Vec<String> = shop.robot.buses.iter().map(|bus| port(&bus.name)).collect();
    let (code, words) = shop.run("setup", &["--yes", "--port", &ports[0], "--port", &ports[1]], Break::Never);
    assert_eq!(code, Some(0), "{words}");
    let (code, words) = shop.run("calibrate", &["--yes"], Break::Never);
    assert_eq!(code, Some(0), "{words}");
    let unit = load_unit(&shop.unit_file()).unwrap().unit;
    for (entry, joint) in unit.joints.iter().zip(&shop.robot.joints) {
        let of_file = joint.servo.as_ref().unwrap().reversed;
        let is_other = REVERSED_OF_FIGURE.contains(&entry.name.as_str());
        assert_eq!(entry.reversed, Some(of_file != is_other), "{}", entry.name);
    }
    let (_, words) = shop.run("doctor", &[], Break::Never);
    assert!(faults(&words).is_empty(), "{words}");
    let report = shop.folder.path().join("report.json");
    let arguments = ["--pose", "squat", "--for", "2", "--report", report.to_str().unwrap()];
    let (code, words) = shop.run("run", &arguments, Break::Never);
    assert_eq!(code, Some(0), "{words}");
    let report: serde_json::Value = serde_json::from_str(&fs::read_to_string(report).unwrap()).unwrap();
    assert_eq!(report["outcome"], "completed", "{report:#}");
}
