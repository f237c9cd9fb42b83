//! The shipped service, `contrib/hippocamp@.service`: its settings, systemd's checks of it, and the servos of a
//! controller that is killed under it.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may panic, and says why it is skipped")]

mod common;
#[path = "service/machine.rs"]
mod machine;
mod rig;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hippocamp::config::{UnitBus, write_unit};
use hippocamp::cycle::Controller;
use hippocamp::ik::Method;
use hippocamp::kinds::figure::FigureCapability;
use hippocamp::model::Robot;
use hippocamp::motion::tentacle::strokes;
use hippocamp::motion::{Activity, Order, Plan, StrokeCommand};
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
        // The limits that the loop and the guard need.
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

/// How long a robot that has moved by `plan` for a while takes to stop, s. Servos are always at their goals.
fn stop_s(robot: &Robot, plan: impl Into<Plan>) -> f64 {
    let mut controller = Controller::new(robot, plan, Method::CcdThenFinish, f64::MAX);
    let (mut moved_s, mut stopped_s) = (0.0, 0.0);
    loop {
        let order = if moved_s < MOVES_S { Order::Go } else { Order::Stop };
        controller.decide(robot.period_s(), order);
        controller.learn_from_goals();
        match controller.record(&[]).facts.activity {
            Activity::Done => return stopped_s,
            _ if order == Order::Stop => stopped_s += robot.period_s(),
            Activity::Limp | Activity::Rising => {}
            _ => moved_s += robot.period_s(),
        }
        assert!(stopped_s < 600.0, "it does not stop");
    }
}

/// How long a robot moves before it is stopped: an arm is wound then, s.
const MOVES_S: f64 = 15.0;

#[test]
fn systemd_waits_longer_than_any_shipped_robot_takes_to_stop() {
    let patience_s: f64 = value("TimeoutStopSec").parse().unwrap();
    let [horse, arms, figure] = ["horse.toml", "tentacle.toml", "figure.toml"].map(common::shipped);
    // The gait, stroke or pose that took longest.
    let tentacle = arms.motion.tentacle().unwrap();
    let wind = StrokeCommand::of(strokes::named("wind", tentacle).unwrap());
    let poses = FigureCapability::of(&figure, figure.motion.figure().unwrap()).unwrap();
    for (robot, plan) in [
        (&horse, Plan::from(common::plan(&horse, "gallop-left", 1.0))),
        (&arms, common::arm::plan(&arms, wind).into()),
        (&figure, poses.plan(0).into()),
    ] {
        let stop_s = stop_s(robot, plan) + robot.safety.hold_s;
        println!("{}: {stop_s:.1} s, a hold before it included", robot.name);
        // Half is for servos that lag, for a fall to get up from, and for a recording to be finished.
        assert!(stop_s < 0.5 * patience_s, "{}: {stop_s} s", robot.name);
    }
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
fn systemd_accepts_the_service_and_rates_its_exposure_low() {
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
        // There is no journal in the machine.
        let words = format!("[Service]\nStandardOutput=append:{SAID}\nStandardError=append:{SAID}");
        fs::write(&unit, edit(unit_text().replace("[Service]", &words))).unwrap();
        let machine = Machine::boot(folder.path(), &unit, &robot, &devices);
        let mut served = Served { machine, rig, _folder: folder };
        served.walk();
        served
    }

    /// Starts the service and waits until the robot has torque.
    fn walk(&mut self) {
        // Five starts in ten seconds are what systemd takes for a service that only fails, unless it is told otherwise.
        let _ = self.machine.systemctl(&["reset-failed", SERVICE]);
        let output = self.machine.systemctl(&["start", SERVICE]).unwrap();
        assert!(
            output.status.success(),
            "{} {}",
            String::from_utf8_lossy(&output.stderr),
            said(&self.machine)
        );
        let rig = &self.rig;
        self.machine.wait_for("torque", |machine| {
            assert_eq!(machine.property(SERVICE, "ActiveState"), "active", "{}", said(machine));
            rig.with_torque() == rig.robot.joints.len()
        });
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
/// The output file of the service.
const SAID: &str = "/run/said";

/// The last of it.
fn said(machine: &Machine) -> String {
    String::from_utf8_lossy(&machine.run(&["tail", SAID]).unwrap().stdout).into_owned()
}

fn is_guard(process: u32) -> bool {
    let line = fs::read_to_string(format!("/proc/{process}/cmdline")).unwrap_or_default();
    line.split('\0').nth(1) == Some("guard")
}

/// A machine with the shipped service; none, and the reason said, where none can be had.
fn served() -> Option<Served> {
    if let Some(obstacle) = Machine::obstacle() {
        eprintln!("skipped, no machine with systemd can be had here: {obstacle}");
        return None;
    }
    Some(Served::start(|unit| unit))
}

#[test]
fn a_controller_killed_under_systemd_leaves_no_torque() {
    let Some(mut served) = served() else { return };
    // The guard has not even begun when systemd is done with the service.
    let (controller, guard) = served.processes();
    let freezer = served.machine.freeze("hippocamp", "horse", guard);
    signal(controller, "KILL");
    served.wait_until_failed();
    assert_eq!(served.rig.with_torque(), served.rig.robot.joints.len(), "the guard is frozen");
    assert!(is_guard(guard), "systemd killed the guard");
    thaw(&freezer);
    served.rig.wait_for_torque(false);
    // One that hangs is killed by its guard, which the service permits.
    served.walk();
    signal(served.processes().0, "STOP");
    served.wait_until_failed();
    served.rig.wait_for_torque(false);
}

#[test]
fn a_service_that_is_stopped_sits_the_robot_down_and_leaves_its_report() {
    let Some(served) = served() else { return };
    let output = served.machine.systemctl(&["stop", SERVICE]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(served.rig.with_torque(), 0);
    assert_eq!(served.machine.property(SERVICE, "Result"), "success");
    assert_eq!(served.machine.processes("hippocamp", "horse"), [0_u32; 0], "the guard has gone");
    let report = served.machine.run(&["cat", "/var/lib/hippocamp/horse.report.json"]).unwrap().stdout;
    let report = String::from_utf8(report).unwrap();
    assert!(report.contains(r#""outcome": "completed""#), "{report}");
}

/// Kills controllers of `served` in mid-walk; how many of `count` kills left torque on.
fn kills_with_torque(served: &mut Served, count: u32) -> u32 {
    let mut left = 0;
    for kill in 0..count {
        if kill > 0 {
            served.walk();
        }
        let (controller, _) = served.processes();
        signal(controller, "KILL");
        served.wait_until_failed();
        let gone = |machine: &mut Machine| machine.processes("hippocamp", "horse").is_empty();
        served.machine.wait_for("end of the guard", gone);
        left += u32::from(served.rig.with_torque() > 0);
        // Servos that still have torque would count as walking in the next round: their power is cut.
        served.rig.server.as_ref().unwrap().with_world(|world| {
            for place in 0..served.rig.robot.joints.len() {
                world.pull_servo_out(0, place);
                world.plug_servo_in(0, place);
            }
        });
        assert_eq!(served.rig.with_torque(), 0);
    }
    left
}

/// With `HIPPOCAMP_FULL` set; one kill by chance would show nothing.
#[test]
fn no_kill_under_systemd_leaves_torque() {
    if !common::is_full() {
        eprintln!("skipped: it takes a minute and has HIPPOCAMP_FULL set");
        return;
    }
    const KILLS: u32 = 24;
    let Some(mut served) = served() else { return };
    let left = kills_with_torque(&mut served, KILLS);
    drop(served);
    let mixed = |unit: String| unit.replace("KillMode=process", "KillMode=mixed");
    let left_by_mixed = kills_with_torque(&mut Served::start(mixed), KILLS);
    println!("torque left on by {left} of {KILLS} kills, with KillMode=mixed by {left_by_mixed}");
    assert_eq!(left, 0);
    assert!(left_by_mixed > 0, "this test cannot tell the two");
}
