//! The service that is shipped, `contrib/hippocamp@.service`: what it says, what systemd thinks of it, and what becomes
//! of the servos of a controller that is killed under it.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may panic, and says why it is skipped")]

#[path = "service/machine.rs"]
mod machine;
mod rig;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hippocamp::config::{UnitBus, write_unit};
use machine::{Machine, thaw};
use rig::{Rig, calibrated, signal};

const UNIT: &str = "contrib/hippocamp@.service";
/// The most `systemd-analyze security` may find, tenths.
const EXPOSURE_MAX: &str = "29";

fn unit_text() -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(UNIT)).unwrap()
}

/// The last value of `key` in the unit file; empty where it has none.
fn value(key: &str) -> String {
    let text = unit_text();
    let mut values = text.lines().filter_map(|line| line.strip_prefix(key)?.strip_prefix('='));
    values.next_back().unwrap_or_default().to_owned()
}

#[test]
fn the_guard_outlives_its_controller_and_nothing_starts_by_itself() {
    for (key, expected) in [
        ("KillMode", "process"),
        ("Restart", "no"),
        ("OOMPolicy", "continue"),
        ("ManagedOOMPreference", "omit"),
        // What the loop and the guard ask for.
        ("LimitRTPRIO", "80"),
        ("LimitMEMLOCK", "infinity"),
        // Else no real-time priority is had, and no serial port is there.
        ("RestrictRealtime", ""),
        ("PrivateDevices", ""),
        // A process beside the controller that systemd ends by itself would be the guard.
        ("FinalKillSignal", ""),
        ("SendSIGHUP", ""),
        ("NoNewPrivileges", "yes"),
        ("CapabilityBoundingSet", ""),
        ("DevicePolicy", "closed"),
        ("ProtectSystem", "strict"),
        ("RestrictAddressFamilies", "none"),
    ] {
        assert_eq!(value(key), expected, "{key}");
    }
    assert!(value("OOMScoreAdjust").parse::<i32>().unwrap() < 0);
}

/// The folder with a unit file for `systemd-analyze`, whose program is there.
fn installed(folder: &Path) -> PathBuf {
    let path = folder.join("hippocamp@.service");
    let text =
        unit_text().replace("/usr/local/bin/hippocamp ", concat!(env!("CARGO_BIN_EXE_hippocamp"), " "));
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn systemd_finds_no_fault_with_it_and_little_that_it_exposes() {
    if Command::new("systemd-analyze").arg("--version").output().is_err() {
        eprintln!("skipped: there is no systemd-analyze here to read the unit file");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let unit = installed(folder.path());
    for arguments in
        [&["verify"][..], &["security", "--offline=true", "--no-pager", "--threshold", EXPOSURE_MAX]]
    {
        let output = Command::new("systemd-analyze").args(arguments).arg(&unit).output().unwrap();
        let said =
            format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "systemd-analyze {}: {said}", arguments[0]);
        // Lines it does not understand are only warned of.
        assert!(!said.contains("nknown") && !said.contains("ignoring"), "{said}");
    }
}

/// A horse behind pseudo-terminals that a service of this unit walks, in a machine of its own.
struct Served {
    // Ends first.
    machine: Machine,
    rig: Rig,
    _folder: tempfile::TempDir,
}

impl Served {
    fn start(edit: impl Fn(String) -> String) -> Served {
        let rig = Rig::new("horse.toml", "");
        let folder = tempfile::tempdir().unwrap();
        let robot = folder.path().join("robot");
        fs::create_dir(&robot).unwrap();
        fs::copy(&rig.robot_file, robot.join("horse.toml")).unwrap();
        // The links of the rig are in a folder the service does not see.
        let links = rig.server.as_ref().unwrap().paths();
        let devices: Vec<PathBuf> = links.iter().map(|link| link.canonicalize().unwrap()).collect();
        let bus = |(bus, path): (&hippocamp::model::Bus, &PathBuf)| UnitBus {
            name: bus.name.clone(),
            device: path.display().to_string(),
        };
        let buses = rig.robot.buses.iter().zip(&devices).map(bus).collect();
        write_unit(&robot.join("horse.unit.toml"), &calibrated(&rig.robot, "horse.toml", buses)).unwrap();
        let script = "end_s = 600\n[[at]]\ntime_s = 0\ngait = \"walk\"\nspeed_m_s = 0.05\n";
        fs::write(robot.join("horse.script.toml"), script).unwrap();
        let unit = folder.path().join("hippocamp@.service");
        fs::write(&unit, edit(unit_text())).unwrap();
        let machine = Machine::boot(folder.path(), &unit, &robot, &devices);
        let mut served = Served { machine, rig, _folder: folder };
        served.walk();
        served
    }

    /// Starts the service and waits until the robot has torque.
    fn walk(&mut self) {
        let output = self.machine.systemctl(&["start", SERVICE]).unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        self.rig.wait_for_torque(true);
    }

    /// The controller and its guard.
    fn processes(&self) -> (u32, u32) {
        let mut all = self.machine.processes("hippocamp", "horse");
        all.sort_unstable_by_key(|process| is_guard(*process));
        assert_eq!(all.len(), 2, "controller and guard");
        assert!(!is_guard(all[0]) && is_guard(all[1]));
        (all[0], all[1])
    }

    /// Waits until systemd takes the service for dead.
    fn wait_until_failed(&mut self) {
        self.machine.wait_for("failure", |machine| machine.property(SERVICE, "ActiveState") == "failed");
    }
}

const SERVICE: &str = "hippocamp@horse.service";

fn is_guard(process: u32) -> bool {
    let line = fs::read_to_string(format!("/proc/{process}/cmdline")).unwrap_or_default();
    line.split('\0').nth(1) == Some("guard")
}

#[test]
fn a_controller_killed_under_systemd_leaves_no_torque() {
    if let Some(obstacle) = Machine::obstacle() {
        eprintln!("skipped, no machine with systemd can be had: {obstacle}");
        return;
    }
    let mut served = Served::start(|unit| unit);
    // The guard has not even begun when systemd is done with the service.
    let (controller, guard) = served.processes();
    let freezer = served.machine.freeze("hippocamp", "horse", guard);
    signal(controller, "KILL");
    served.wait_until_failed();
    assert_eq!(served.rig.with_torque(), served.rig.robot.joints.len(), "the guard is frozen");
    assert!(is_guard(guard), "systemd killed the guard");
    thaw(&freezer);
    served.rig.wait_for_torque(false);
}
