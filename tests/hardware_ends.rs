//! Every way out of a run on serial lines: the real program is killed or stopped, panics, or loses its port or its
//! disk; what its servos do then. In real time, over pseudo-terminals.
//!
//! Times are on the simulated servos' clock: from the cause until the last byte of the request in question has
//! crossed the wire.
//! - Torque off: every servo was ordered to take its torque off.
//! - The stop action has begun: the goals of its first cycle. The recording shows which cycle that is; without a
//!   recording it is the first cycle whose goals differ from those of an undisturbed walk.
//!
//! With `HIPPOCAMP_FULL` set, every robot is tested at every moment, and with every signal; otherwise the robot with
//! one bus as its torque rises and as it walks, and the one with four buses as it walks.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic; figures are for people")]

mod common;

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Condvar, Mutex, OnceLock, PoisonError};

use hippocamp::bus::ServoGoal;
use hippocamp::model::Robot;
use hippocamp::motion::Activity;
use hippocamp::platform::monotonic;
use hippocamp::recording::{Ending, Recording, Sample};
use hippocamp::signals::Permission;
use hw_sim::World;

use common::built::Built;
use common::frames::{all_let_go_ns, frames};
use common::reference::Reference;
use common::{ROBOTS, is_full, servo};

/// Robots of one bus that run side by side: six keep two processors busy for a third of the time. The other robot takes the place
/// of two.
const PLACES: usize = 6;

static FREE: Mutex<usize> = Mutex::new(PLACES);
static FREED: Condvar = Condvar::new();

/// The places that a robot takes while it runs: real time is for a few robots at once.
struct Place(usize);

impl Place {
    /// Waits until there is a place for the robot `file`. Shared results are computed before the first run, so that
    /// they take no processor from running robots.
    fn take(file: &str) -> Place {
        ROBOTS.iter().for_each(|file| {
            reference(file);
        });
        walk_recording();
        let count = if file == "horse.toml" { 1 } else { 2 };
        let free = FREE.lock().unwrap_or_else(PoisonError::into_inner);
        let mut free = FREED.wait_while(free, |free| *free < count).unwrap_or_else(PoisonError::into_inner);
        *free -= count;
        Place(count)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        *FREE.lock().unwrap_or_else(PoisonError::into_inner) += self.0;
        FREED.notify_all();
    }
}

/// Runs all of these, as many side by side as there are places.
fn try_all<T: Send>(cases: impl IntoIterator<Item = T>, test: impl Fn(T) + Sync) {
    std::thread::scope(|scope| {
        for case in cases {
            let test = &test;
            scope.spawn(move || test(case));
        }
    });
}

/// How long the servos may wait for torque off or the beginning of the stop action.
const GATE_NS: u64 = 200_000_000;

/// A moment in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Moment {
    /// The torque is rising.
    TorqueUp,
    /// The feet lift the trunk.
    Rise,
    Walk,
}

const MOMENTS: [Moment; 3] = [Moment::TorqueUp, Moment::Rise, Moment::Walk];

impl Moment {
    /// The cycle of this moment.
    fn cycle(self, robot: &Robot, reference: &Reference) -> usize {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few seconds")]
        let cycles = |s: f64| (s * robot.rate_hz) as usize;
        match self {
            Moment::TorqueUp => reference.first(Activity::Rising) + cycles(0.3),
            Moment::Rise => reference.first(Activity::Standing) - cycles(0.7),
            Moment::Walk => reference.first(Activity::Walking) + cycles(1.0),
        }
    }
}

/// The robots and moments at which each end is tried.
fn robots_and_moments() -> impl Iterator<Item = (&'static str, Moment)> {
    let all = ROBOTS.into_iter().flat_map(|file| MOMENTS.map(|moment| (file, moment)));
    all.filter(|(file, moment)| {
        is_full() || *moment == Moment::Walk || *file == "horse.toml" && *moment == Moment::TorqueUp
    })
}

/// The undisturbed walk of the robot `file`, made once.
fn reference(file: &str) -> &'static Reference {
    static REFERENCES: [OnceLock<Reference>; ROBOTS.len()] = [const { OnceLock::new() }; ROBOTS.len()];
    let index = ROBOTS.iter().position(|of| *of == file).unwrap();
    REFERENCES[index].get_or_init(|| Reference::of(&Built::new(file).robot))
}

/// The recording of the undisturbed walk of the horse, made once.
fn walk_recording() -> &'static mcap::Summary {
    static RECORDED: OnceLock<mcap::Summary> = OnceLock::new();
    RECORDED.get_or_init(|| {
        let built = Built::new("horse.toml");
        let file = built.folder.path().join("reference.mcap");
        let mut command = built.run();
        assert!(command.args(["--virtual", "--for", "5", "--record"]).arg(&file).status().unwrap().success());
        mcap::Summary::read(&fs::read(&file).unwrap()).unwrap().unwrap()
    })
}

/// Waits until a run has reached this moment.
fn wait_for(moment: Moment, built: &Built, reference: &Reference) {
    let moving = reference.first(Activity::Rising);
    let cycles = moment.cycle(&built.robot, reference) - moving;
    let mut looked_ns = 0;
    let mut is_there = |world: &mut World| {
        // The whole output is read each time; this is rare, so that no servo waits for it.
        if world.now_ns() < looked_ns + 10_000_000 {
            return false;
        }
        looked_ns = world.now_ns();
        let frames = frames(&built.robot, world, 0);
        frames.iter().filter(|frame| !frame.goals.is_empty()).count() >= cycles
    };
    built.wait_for("such moment", || built.with_world(&mut is_there));
}

/// The present on the servos' clock, ns.
fn now_ns(built: &Built) -> u64 {
    built.with_world(|world| world.now_ns())
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

#[allow(clippy::cast_precision_loss, reason = "milliseconds for people")]
fn assert_in_time(what: &str, from_ns: u64, until_ns: u64) {
    assert!(until_ns >= from_ns, "{what}: {} ns before its cause", from_ns - until_ns);
    println!("{what} after {:.1} ms", (until_ns - from_ns) as f64 / 1e6);
    assert!(until_ns - from_ns <= GATE_NS, "{what} after {} ns", until_ns - from_ns);
}

/// Waits until every servo was ordered to take its torque off, and asserts that it was soon enough.
fn assert_lets_go(what: &str, built: &Built, from_ns: u64) {
    let let_go = || built.with_world(|world| all_let_go_ns(&built.robot, world, from_ns));
    built.wait_for("torque off", || let_go().is_some());
    assert_in_time(what, from_ns, let_go().unwrap());
    assert_eq!(built.with_torque(), 0, "{what}");
}

/// When the goals of the first cycle of which `is` holds, or of a later one if they were lost, had crossed the line of
/// `bus` after `from_ns`, ns.
fn first_cycle_ns(
    built: &Built,
    recording: &Recording,
    bus: usize,
    from_ns: u64,
    is: impl Fn(&Sample) -> bool,
) -> u64 {
    let goals = |sample: &Sample| -> Vec<(u8, u64)> {
        let all = built.robot.joints.iter().map(servo).zip(&sample.goals);
        let of_bus = all.filter(|(servo, _)| servo.bus == bus);
        of_bus
            .filter_map(|(servo, goal)| match goal {
                ServoGoal::Move { position, .. } => Some((servo.id.0, u64::try_from(*position).unwrap())),
                ServoGoal::Limp | ServoGoal::Keep => None,
            })
            .collect()
    };
    let frames = built.with_world(|world| frames(&built.robot, world, bus));
    // Offset between the clocks of the run and of the servos: a late exchange is further off, and no exchange is
    // nearer.
    let moving = recording.samples.iter().filter(|sample| !goals(sample).is_empty());
    let heard = frames.iter().filter(|frame| !frame.goals.is_empty());
    let between = moving
        .zip(heard)
        .take(50)
        .map(|(sample, frame)| frame.at_ns.saturating_sub(sample.facts.times.began.0));
    let between_ns = between.min().unwrap() - u64::try_from(built.period().as_nanos()).unwrap() / 10;
    let crossed_ns = recording
        .samples
        .iter()
        .skip_while(|sample| sample.facts.times.began.0 + between_ns < from_ns)
        .skip_while(|sample| !is(sample))
        .find_map(|sample| {
            let frame = frames.iter().find(|frame| frame.at_ns >= sample.facts.times.began.0 + between_ns)?;
            (!frame.goals.is_empty() && frame.goals == goals(sample)).then_some(frame.at_ns)
        });
    crossed_ns.unwrap()
}

#[test]
fn a_killed_controller_leaves_no_torque() {
    try_all(robots_and_moments(), |(file, moment)| {
        let _place = Place::take(file);
        let built = Built::new(file);
        let reference = reference(file);
        let (place, part) = recording_of(&built);
        fs::write(&place, "an earlier one").unwrap();
        let mut child = built.run().arg("--record").arg(&place).spawn().unwrap();
        wait_for(moment, &built, reference);
        let cause_ns = now_ns(&built);
        signal(&child, "KILL");
        assert!(!child.wait().unwrap().success());
        assert_lets_go(&format!("{file}, {moment:?}, SIGKILL: torque off"), &built, cause_ns);
        assert_eq!(fs::read(&place).unwrap(), b"an earlier one");
        // A second may not have been written yet.
        if moment == Moment::Walk {
            assert!(matches!(Recording::read(&part).unwrap().ending, Ending::CutShort { .. }));
        }
    });
}

/// The moment does not depend on the signal: by default each signal is tested at one moment.
#[test]
fn a_controller_takes_its_stop_action_on_every_stop_signal() {
    let signals = ["TERM", "INT", "HUP"];
    let of_horse = MOMENTS.into_iter().enumerate().flat_map(|(number, moment)| {
        let wanted = move |(of, _): &(usize, &str)| is_full() || *of == number;
        let chosen = signals.into_iter().enumerate().filter(wanted);
        chosen.map(move |(_, name)| ("horse.toml", moment, name))
    });
    let of_others = robots_and_moments().filter(|(file, _)| *file != "horse.toml");
    let all = of_horse.chain(of_others.map(|(file, moment)| (file, moment, "TERM")));
    try_all(all, |(file, moment, name)| told_to_stop(file, moment, name));
}

fn told_to_stop(file: &str, moment: Moment, name: &str) {
    let _place = Place::take(file);
    let built = Built::new(file);
    let reference = reference(file);
    let (place, part) = recording_of(&built);
    let mut child = built.run().arg("--record").arg(&place).spawn().unwrap();
    wait_for(moment, &built, reference);
    let cause_ns = now_ns(&built);
    signal(&child, name);
    let code = child.wait().unwrap().code();
    assert_eq!((code, built.with_torque()), (Some(0), 0), "{file}, SIG{name}");
    let recording = Recording::read(&place).unwrap();
    assert!(matches!(recording.ending, Ending::Outcome(_)) && !part.exists());
    let began_ns =
        first_cycle_ns(&built, &recording, 0, cause_ns, |sample| sample.facts.activity == Activity::Stopping);
    assert_in_time(&format!("{file}, {moment:?}, SIG{name}: stop action"), cause_ns, began_ns);
    let before = recording.samples.iter().rev().find(|sample| {
        sample.facts.activity != Activity::Stopping && sample.facts.activity != Activity::Done
    });
    let expected = if moment == Moment::Walk { Activity::Walking } else { Activity::Rising };
    assert_eq!(before.unwrap().facts.activity, expected);
}

/// The path of this run's recording, and the path that it has until it is complete.
fn recording_of(built: &Built) -> (PathBuf, PathBuf) {
    (built.folder.path().join("run.mcap"), built.folder.path().join("run.mcap.part"))
}

/// The moment of a provoked panic by its own message, on the servos' clock, ns; and the whole output.
fn panicked_ns(built: &Built, said: &str) -> u64 {
    let (_, rest) = said.split_once("a panic that a test wants, at ").unwrap_or_else(|| panic!("{said}"));
    let at_ns: u64 = rest.split_once(" ns").unwrap().0.parse().unwrap();
    let before = u64::try_from(monotonic().as_nanos()).unwrap();
    at_ns - (before - now_ns(built))
}

#[test]
#[cfg(debug_assertions)]
fn a_controller_that_panics_takes_torque_off_before_it_prints() {
    try_all(robots_and_moments(), |(file, moment)| {
        let _place = Place::take(file);
        let built = Built::new(file);
        let cycle = moment.cycle(&built.robot, reference(file));
        let mut command = built.run();
        command.env("HIPPOCAMP_PANIC", format!("loop:{cycle}")).env("RUST_BACKTRACE", "1");
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let mut said = String::new();
        for line in BufReader::new(child.stderr.take().unwrap()).lines() {
            let line = line.unwrap();
            if line.contains("panicked") {
                assert_eq!(built.with_torque(), 0, "{file}, {moment:?}: first the robot, then the word");
            }
            said += &(line + "\n");
        }
        assert_eq!(child.wait().unwrap().code(), Some(1));
        assert_lets_go(&format!("{file}, {moment:?}, panic: torque off"), &built, panicked_ns(&built, &said));
        assert!(said.contains("hippocamp::run::perform"), "no backtrace: {said}");
    });
}

/// The size a recording of this robot has in the middle of the second that is being written at `moment`.
fn bytes_at(moment: Moment, built: &Built, reference: &Reference) -> u64 {
    /// A rise takes 1.5 s.
    const BEFORE_STANDING_S: f64 = 1.25;
    // Each second is written at its end. This takes one that ends in the middle of the rise: from a standing robot
    // the first count of the stop action takes as long as from any rest.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few seconds")]
    let cycle = match moment {
        Moment::Rise => {
            reference.first(Activity::Standing) - (BEFORE_STANDING_S * built.robot.rate_hz) as usize
        }
        _ => moment.cycle(&built.robot, reference),
    };
    let cycle = u64::try_from(cycle).unwrap();
    let number = |time_ns: u64| time_ns / u64::try_from(built.period().as_nanos()).unwrap();
    let chunks = walk_recording().chunk_indexes.iter();
    let chunk = chunks
        .filter(|chunk| number(chunk.message_end_time) >= cycle)
        .min_by_key(|chunk| chunk.message_end_time);
    let chunk = chunk.unwrap();
    chunk.chunk_start_offset + chunk.chunk_length / 2
}

/// Asserts that the robot began its stop action in time after `cause_ns`, ended by itself, and gave the reason.
fn assert_stops_without_its_recording(
    what: &str,
    built: &Built,
    reference: &Reference,
    child: &mut Child,
    cause_ns: impl FnOnce() -> u64,
    why: &str,
) {
    assert_eq!((child.wait().unwrap().code(), built.with_torque()), (Some(1), 0), "{what}");
    let frames = built.with_world(|world| frames(&built.robot, world, 0));
    let cause_ns = cause_ns();
    let began_ns = reference.left_at_ns(&frames, cause_ns).unwrap();
    assert_in_time(&format!("{what}: stop action"), cause_ns, began_ns);
    let report = fs::read_to_string(built.folder.path().join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let reason = report["reason"].as_str().unwrap();
    assert!(
        reason.starts_with("stopped because the recording broke off") && reason.contains(why),
        "{reason}"
    );
    let (place, part) = recording_of(built);
    assert!(!place.exists());
    let recording = Recording::read(&part).unwrap();
    assert!(matches!(recording.ending, Ending::CutShort { .. }) && recording.samples.len() > 50);
}

/// `command` with its recording and its report.
fn with_files<'c>(command: &'c mut Command, built: &Built) -> &'c mut Command {
    let report = built.folder.path().join("report.json");
    command.arg("--record").arg(recording_of(built).0).arg("--report").arg(report)
}

#[test]
fn a_controller_whose_disk_is_full_takes_its_stop_action() {
    try_all([Moment::Rise, Moment::Walk], |moment| {
        let _place = Place::take("horse.toml");
        let built = Built::new("horse.toml");
        let reference = reference("horse.toml");
        // A limit on the file size acts as a full disk: in blocks of 512 bytes.
        let blocks = bytes_at(moment, &built, reference) / 512;
        let mut run = built.run();
        let run = with_files(&mut run, &built);
        let mut limited = Command::new("sh");
        limited.args(["-c", &format!("ulimit -f {blocks} && exec \"$@\""), "sh"]);
        limited.arg(run.get_program()).args(run.get_args()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = limited.spawn().unwrap();
        let part = recording_of(&built).1;
        let mut cause_ns = 0;
        built.wait_for("full disk", || {
            cause_ns = now_ns(&built);
            part.metadata().is_ok_and(|file| file.len() == blocks * 512)
        });
        let what = format!("{moment:?}, full disk");
        assert_stops_without_its_recording(
            &what,
            &built,
            reference,
            &mut child,
            || cause_ns,
            "File too large",
        );
    });
}

#[test]
#[cfg(debug_assertions)]
fn a_controller_whose_recording_thread_is_gone_takes_its_stop_action() {
    try_all([Moment::Rise, Moment::Walk], |moment| {
        let _place = Place::take("horse.toml");
        let built = Built::new("horse.toml");
        let reference = reference("horse.toml");
        let bytes = bytes_at(moment, &built, reference);
        let said_file = built.folder.path().join("said");
        let mut run = built.run();
        let run = with_files(&mut run, &built).env("HIPPOCAMP_PANIC", format!("recording:{bytes}"));
        let mut child = run.stderr(fs::File::create(&said_file).unwrap()).spawn().unwrap();
        let cause_ns = || panicked_ns(&built, &fs::read_to_string(&said_file).unwrap());
        let what = format!("{moment:?}, recording thread gone");
        assert_stops_without_its_recording(&what, &built, reference, &mut child, cause_ns, "panicked");
    });
}

#[test]
fn a_controller_without_one_of_its_ports_holds_the_robot_and_takes_its_stop_action() {
    let file = "horse-dynamixel.toml";
    let moments = robots_and_moments().filter(|(of, _)| *of == file);
    try_all(moments, |(_, moment)| {
        let _place = Place::take(file);
        let built = Built::new(file);
        let reference = reference(file);
        let place = recording_of(&built).0;
        let mut child = built.run().arg("--record").arg(&place).spawn().unwrap();
        wait_for(moment, &built, reference);
        let cause_ns = now_ns(&built);
        built.with_world(|world| world.unplug(3, u64::MAX));
        assert_eq!(child.wait().unwrap().code(), Some(3), "stopped by safety");
        let recording = Recording::read(&place).unwrap();
        for bus in 0..3 {
            let held_ns = first_cycle_ns(&built, &recording, bus, cause_ns, |sample| sample.facts.is_held);
            assert_in_time(
                &format!("{moment:?}, port of another bus gone: hold on bus {bus}"),
                cause_ns,
                held_ns,
            );
        }
        // The hold lasts for hold_s; then the stop action begins, and ends.
        let permitted = |wanted| move |sample: &Sample| sample.state.permission == wanted;
        let held_until_ns = first_cycle_ns(&built, &recording, 0, cause_ns, permitted(Permission::Stop));
        let stopping_ns = first_cycle_ns(&built, &recording, 0, cause_ns, |sample| {
            sample.facts.activity == Activity::Stopping
        });
        assert_in_time(&format!("{moment:?}, port gone for hold_s: stop action"), held_until_ns, stopping_ns);
        assert_eq!(built.with_torque(), 4, "those behind the port");
        // Their own watchdog has stopped them (ROBOTIS e-manual, X-series: Bus Watchdog, 98, reads -1).
        let tripped = |world: &mut World| {
            built
                .robot
                .joints
                .iter()
                .map(servo)
                .filter(|servo| servo.bus == 3)
                .all(|servo| world.register(3, servo.id.0, 98) == Some(0xFF))
        };
        assert!(built.with_world(tripped));
        built.with_world(|world| world.plug_in(3));
        built.wait_for("guard that lets go", || built.with_torque() == 0);
    });
}

#[test]
fn a_controller_without_its_only_port_ends_by_itself() {
    let _place = Place::take("horse.toml");
    let mut built = Built::new("horse.toml");
    let reference = reference("horse.toml");
    let mut child = built.run().spawn().unwrap();
    wait_for(Moment::Walk, &built, reference);
    built.server = None;
    assert_eq!(child.wait().unwrap().code(), Some(3), "stopped by safety");
}

#[test]
fn servos_that_missed_the_end_go_limp_when_their_adapter_is_back() {
    let _place = Place::take("horse.toml");
    let built = Built::new("horse.toml");
    let mut child = built.run().spawn().unwrap();
    built.wait_for("torque", || built.with_torque() == built.robot.joints.len());
    built.with_world(|world| world.unplug(0, u64::MAX));
    assert_eq!(child.wait().unwrap().code(), Some(3), "stopped by safety");
    assert_eq!(built.with_torque(), built.robot.joints.len(), "nobody can reach them");
    let cause_ns = now_ns(&built);
    built.with_world(|world| world.plug_in(0));
    assert_lets_go("adapter back: torque off", &built, cause_ns);
}

#[test]
fn a_start_that_fails_leaves_an_earlier_recording_alone() {
    let _place = Place::take("horse.toml");
    let built = Built::new("horse.toml");
    built.with_world(|world| world.unplug(0, u64::MAX));
    let (place, part) = recording_of(&built);
    fs::write(&place, "an earlier one").unwrap();
    assert!(!built.run().arg("--record").arg(&place).status().unwrap().success());
    assert_eq!((fs::read(&place).unwrap(), part.exists()), (b"an earlier one".to_vec(), false));
}

#[test]
fn without_a_calibration_nothing_is_opened_and_nothing_moves() {
    let _place = Place::take("horse.toml");
    let built = Built::new("horse.toml");
    let text = fs::read_to_string(&built.unit_file).unwrap();
    let text = text.replacen("direction_checked = true", "direction_checked = false", 1);
    fs::write(&built.unit_file, text).unwrap();
    assert_eq!(built.run().status().unwrap().code(), Some(2));
    assert_eq!(built.with_torque(), 0);
}
