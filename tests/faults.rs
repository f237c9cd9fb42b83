//! Faults of the simulated buses while the robot walks: in a short loss the robot coasts, in a long one it holds
//! and then takes the stop action, with a message that a person can act on; and no goal ever leaves its limits.
//!
//! With `HIPPOCAMP_FULL` set, at more times and in more joints.

mod common;

use std::ops::RangeInclusive;

use common::{Scenario, Truth, Watched, is_full, servo, shipped};
use hippocamp::model::{Robot, StopAction};
use hippocamp::motion::Activity;
use hippocamp::signals::Permission;
use hippocamp::telemetry::Outcome;

/// When the faults below begin, s since power-up: in mid-walk (asserted).
const FAULT_S: f64 = 6.0;
/// How long a robot walks, s: after a passing fault, and during one that takes long to find.
const SHORT_WALK_S: f64 = 4.0;
const LONG_WALK_S: f64 = 10.0;
/// Allowance for the cycles between a cause and its effect, s.
const SLACK_S: f64 = 0.05;
/// How far a servo at rest may be off its goal, counts: its dead band and friction.
const AT_REST_COUNTS: f64 = 30.0;
/// Servos that no fault cuts off.
#[allow(clippy::reversed_empty_ranges, reason = "meant to be empty")]
const NONE: RangeInclusive<u8> = 1..=0;

/// A fault that passes: the robot still walks for the ordered time.
struct Passing {
    faults: &'static str,
    holds: bool,
    /// Lost replies.
    missing: RangeInclusive<u64>,
    /// Damaged replies.
    corrupt: RangeInclusive<u64>,
    late_cycles: RangeInclusive<u64>,
}

/// Nothing to see.
const UNSEEN: Passing =
    Passing { faults: "", holds: false, missing: 0..=0, corrupt: 0..=0, late_cycles: 0..=0 };

fn passing_faults() -> Vec<Passing> {
    vec![
        Passing {
            faults: "[[fault]]\nkind = 'silent'\nat_s = 6.0\nfor_s = 0.03\nbus = 'main'\nid = 3",
            missing: 3..=3,
            ..UNSEEN
        },
        Passing {
            faults: "[[fault]]\nkind = 'silent'\nat_s = 6.0\nfor_s = 1.0\nbus = 'main'\nid = 3",
            holds: true,
            missing: 100..=100,
            ..UNSEEN
        },
        Passing {
            faults: "[[fault]]\nkind = 'bit-flip'\nat_s = 6.0\nfor_s = 0.01\nbus = 'main'\nid = 5",
            corrupt: 0..=1,
            missing: 0..=1,
            ..UNSEEN
        },
        Passing {
            faults: "[[fault]]\nkind = 'bit-flip'\nat_s = 6.0\nfor_s = 0.05",
            corrupt: 40..=80,
            missing: 0..=40,
            ..UNSEEN
        },
        // Bytes before a reply may, rarely, look like its beginning, and then the reply is lost.
        Passing {
            faults: "[[fault]]\nkind = 'noise'\nat_s = 6.0\nfor_s = 0.05",
            corrupt: 0..=8,
            missing: 0..=8,
            ..UNSEEN
        },
        // It restarts: away for 1.8 s, and then without torque until the next cycle.
        Passing {
            faults: "[[fault]]\nkind = 'reset'\nat_s = 6.0\nbus = 'main'\nid = 3",
            holds: true,
            missing: 180..=182,
            ..UNSEEN
        },
        Passing {
            faults: "[[fault]]\nkind = 'slow'\nat_s = 6.0\nfor_s = 1.0\nbus = 'main'\nid = 3\ndelay_ms = 0.5",
            ..UNSEEN
        },
        Passing { faults: "[[fault]]\nkind = 'echo'\nat_s = 0.0", ..UNSEEN },
        Passing {
            faults: "[[fault]]\nkind = 'unplugged'\nat_s = 6.0\nfor_s = 0.03",
            missing: 3 * 16..=4 * 16,
            ..UNSEEN
        },
        Passing {
            faults: "[[fault]]\nkind = 'late-host'\nat_s = 6.0\ndelay_ms = 30",
            late_cycles: 1..=2,
            ..UNSEEN
        },
        Passing {
            faults: "[[fault]]\nkind = 'late-host'\nat_s = 6.0\ndelay_ms = 300",
            late_cycles: 1..=2,
            ..UNSEEN
        },
        Passing { faults: "[[fault]]\nkind = 'low-voltage'\nat_s = 6.0\nfor_s = 0.3\nvolts = 7.5", ..UNSEEN },
        Passing {
            faults: "[[fault]]\nkind = 'low-voltage'\nat_s = 6.0\nfor_s = 1.0\nvolts = 7.5",
            holds: true,
            ..UNSEEN
        },
    ]
}

/// A fault that ends the run.
struct Lasting {
    robot: &'static str,
    faults: &'static str,
    /// From the fault to the hold, s.
    holds_after_s: RangeInclusive<f64>,
    /// The expected message.
    says: &'static [&'static str],
    /// Servos that receive nothing any more.
    cut_off: RangeInclusive<u8>,
    /// The joint that does not arrive in the sitting pose.
    jammed: Option<u8>,
}

fn lasting_faults() -> Vec<Lasting> {
    let coast_s = 0.1..=0.1 + SLACK_S;
    let fault_delay_s = 0.5..=0.5 + SLACK_S;
    vec![
        Lasting {
            robot: "horse.toml",
            faults: "[[fault]]\nkind = 'silent'\nat_s = 6.0\nbus = 'main'\nid = 7",
            holds_after_s: coast_s.clone(),
            says: &[
                "servo 7",
                "bus main",
                "left_fore.elbow",
                "not heard",
                "check its plug",
                "cut their power",
            ],
            cut_off: 7..=7,
            jammed: None,
        },
        Lasting {
            robot: "horse.toml",
            faults: "[[fault]]\nkind = 'unplugged'\nat_s = 6.0",
            holds_after_s: coast_s.clone(),
            says: &["bus main", "not heard", "its adapter"],
            cut_off: 1..=16,
            jammed: None,
        },
        Lasting {
            robot: "horse-dynamixel.toml",
            faults: "[[fault]]\nkind = 'unplugged'\nat_s = 6.0\nbus = 'left_fore'",
            holds_after_s: coast_s.clone(),
            says: &["servo 5", "bus left_fore", "left_fore.scapula", "not heard", "its adapter"],
            cut_off: 5..=8,
            jammed: None,
        },
        Lasting {
            robot: "horse-dynamixel.toml",
            faults: "[[fault]]\nkind = 'silent'\nat_s = 6.0\nbus = 'right_hind'\nid = 11",
            holds_after_s: coast_s.clone(),
            says: &["servo 11", "bus right_hind", "right_hind.stifle", "not heard"],
            cut_off: 11..=11,
            jammed: None,
        },
        // It receives everything, and its replies are damaged: it keeps its last goal, and then its torque goes
        // off.
        Lasting {
            robot: "horse.toml",
            faults: "[[fault]]\nkind = 'bit-flip'\nat_s = 6.0\nbus = 'main'\nid = 7",
            holds_after_s: coast_s,
            says: &["servo 7", "left_fore.elbow", "sent only damaged replies for", "loose plugs"],
            cut_off: NONE,
            jammed: Some(7),
        },
        // How long a jam takes to be noticed depends on where in its stride it jams: three strides at most.
        Lasting {
            robot: "horse.toml",
            faults: "[[fault]]\nkind = 'stuck'\nat_s = 6.0\nbus = 'main'\nid = 8",
            holds_after_s: 0.5..=6.0,
            says: &["servo 8", "bus main", "left_fore.carpus", "does not turn", "check that nothing blocks"],
            cut_off: NONE,
            jammed: Some(8),
        },
        Lasting {
            robot: "horse.toml",
            faults: "[[fault]]\nkind = 'low-voltage'\nat_s = 6.0\nvolts = 8.0",
            holds_after_s: fault_delay_s.clone(),
            says: &["servo 1", "bus main", "left_hind.pelvis", "8.0 V", "9.0 V", "charge the battery"],
            cut_off: NONE,
            jammed: None,
        },
        Lasting {
            robot: "horse.toml",
            faults: "[[fault]]\nkind = 'hot'\nat_s = 6.0\nbus = 'main'\nid = 4\ncelsius = 75",
            holds_after_s: fault_delay_s.clone(),
            says: &["servo 4", "bus main", "left_hind.hock", "75 C", "65 C", "let it cool"],
            cut_off: NONE,
            // A Feetech servo takes its torque off by itself when hot, so it need not arrive.
            jammed: Some(4),
        },
        Lasting {
            robot: "horse.toml",
            faults: "[[fault]]\nkind = 'overload'\nat_s = 6.0\nbus = 'main'\nid = 4",
            holds_after_s: fault_delay_s.clone(),
            says: &["servo 4", "bus main", "left_hind.hock", "alarm bits 0x20 (overload)", "check its load"],
            cut_off: NONE,
            // With its holding torque alone it need not arrive.
            jammed: Some(4),
        },
        Lasting {
            robot: "horse-dynamixel.toml",
            faults: "[[fault]]\nkind = 'hot'\nat_s = 6.0\nbus = 'left_hind'\nid = 4\ncelsius = 85",
            holds_after_s: fault_delay_s,
            says: &["servo 4", "bus left_hind", "left_hind.hock", "85 C", "75 C", "let it cool"],
            cut_off: NONE,
            jammed: Some(4),
        },
    ]
}

/// Walks into `faults` from the sitting pose, for so long in all.
fn watch_for(robot: &Robot, faults: &str, walk_for_s: f64) -> Watched {
    let watched = Scenario { faults, ..Scenario::from_sitting(robot, "walk", walk_for_s) }.watch();
    let at_fault = watched.first(|moment| moment.time_s >= FAULT_S - 0.1).map(|moment| moment.activity);
    assert_eq!(at_fault, Some(Activity::Walking), "the fault must come in mid-walk");
    watched
}

/// The same, for long enough to find any fault.
fn watch(robot: &Robot, faults: &str) -> Watched {
    watch_for(robot, faults, LONG_WALK_S)
}

/// Every servo except those in `except` is limp in the sitting pose, except the `jammed` one.
fn assert_sits_limp(robot: &Robot, end: &[Truth], except: &RangeInclusive<u8>, jammed: Option<u8>) {
    let sit_rad = Scenario::new(robot, "walk", 0.0).plan.sit_pose_rad;
    for ((joint, truth), sit_rad) in robot.joints.iter().zip(end).zip(sit_rad) {
        let servo = servo(joint);
        if except.contains(&servo.id.0) {
            continue;
        }
        assert!(!truth.torque_on, "{} still holds", joint.name);
        let off = truth.position - servo.count_of(sit_rad);
        assert!(
            Some(servo.id.0) == jammed || off.abs() <= AT_REST_COUNTS,
            "{} is {off} counts off the sitting pose",
            joint.name
        );
    }
}

#[test]
fn a_passing_fault_ends_in_a_completed_walk() {
    let robot = shipped("horse.toml");
    for case in passing_faults() {
        let watched = watch_for(&robot, case.faults, SHORT_WALK_S);
        let (report, what) = (&watched.report, case.faults);
        assert_eq!(report.outcome, Outcome::Completed, "{what}: {}", report.reason);
        assert_eq!(report.reason, "walked for the time asked");
        assert_eq!(watched.held_at_s().is_some(), case.holds, "{what}: held at {:?}", watched.held_at_s());
        let bus = &report.buses[0];
        assert!(case.missing.contains(&bus.missing), "{what}: {} missing", bus.missing);
        assert!(case.corrupt.contains(&bus.corrupt), "{what}: {} damaged", bus.corrupt);
        assert!(case.late_cycles.contains(&report.late_cycles), "{what}: {} late", report.late_cycles);
        watched.assert_goals_kept_limits(&robot);
        assert_sits_limp(&robot, watched.end(), &NONE, None);
        // While it was held it did not walk: the ordered time counts only motion.
        let walking_s = watched.moments.iter().filter(|moment| moment.activity == Activity::Walking).count()
            as f64
            / robot.rate_hz;
        assert!(
            walking_s >= SHORT_WALK_S + if case.holds { 0.4 } else { -0.3 },
            "{what}: walked {walking_s} s"
        );
    }
}

#[test]
fn one_flipped_bit_is_one_lost_reply() {
    for (file, bus, id, share) in
        [("horse.toml", "main", 5, 1), ("horse-dynamixel.toml", "right_fore", 13, 4)]
    {
        let robot = shipped(file);
        let for_s = robot.period_s();
        let faults = format!(
            "[[fault]]\nkind = 'bit-flip'\nat_s = {FAULT_S}\nfor_s = {for_s}\nbus = '{bus}'\nid = {id}"
        );
        let watched = watch_for(&robot, &faults, SHORT_WALK_S);
        assert_eq!(watched.report.outcome, Outcome::Completed);
        for reported in &watched.report.buses {
            let lost = reported.missing + reported.corrupt;
            // A fast reply is one packet: bytes after a damaged block of it cannot be trusted.
            let expected = if reported.name == bus { 1..=share } else { 0..=0 };
            assert!(expected.contains(&lost), "bus {}: {lost} replies lost", reported.name);
        }
    }
}

#[test]
fn a_lasting_fault_holds_then_takes_the_stop_action() {
    // Of the robot of 500 cycles a second one case, or all.
    let is_wanted =
        |case: &Lasting| is_full() || case.robot == "horse.toml" || case.faults.contains("unplugged");
    for case in lasting_faults().into_iter().filter(is_wanted) {
        let robot = shipped(case.robot);
        let watched = watch(&robot, case.faults);
        let (report, what) = (&watched.report, case.faults);
        assert_eq!(report.outcome, Outcome::StoppedBySafety, "{what}: {}", report.reason);
        for word in case.says {
            assert!(report.reason.contains(word), "{what}: '{}' does not say '{word}'", report.reason);
        }
        let held_s = watched.held_at_s().unwrap_or_else(|| panic!("{what}: never held"));
        let stopped_s = watched.stopped_at_s().unwrap_or_else(|| panic!("{what}: never stopped"));
        assert!(case.holds_after_s.contains(&(held_s - FAULT_S)), "{what}: held at {held_s} s");
        let held_for_s = stopped_s - held_s;
        // A silent servo makes every exchange last to its deadline, so cycles may be a little longer.
        let hold_s = robot.safety.hold_s;
        assert!((hold_s - SLACK_S..=1.2 * hold_s).contains(&held_for_s), "{what}: held for {held_for_s} s");
        watched.assert_goals_kept_limits(&robot);
        assert_sits_limp(&robot, watched.end(), &case.cut_off, case.jammed);
        for (joint, truth) in robot.joints.iter().zip(watched.end()) {
            // The simulated servos follow their last goals; no goal may have jumped.
            assert_eq!(truth.torque_on, case.cut_off.contains(&servo(joint).id.0), "{what}: {}", joint.name);
        }
    }
}

#[test]
fn the_stop_action_hold_keeps_torque_and_pose() {
    let has_torque = |case: &&Lasting| {
        let is_wanted = is_full() || case.robot == "horse.toml" || case.faults.contains("unplugged");
        is_wanted && (case.jammed.is_none() || case.faults.contains("bit-flip"))
    };
    for case in lasting_faults().iter().filter(has_torque) {
        let mut robot = shipped(case.robot);
        robot.stop_action = StopAction::Hold;
        let watched = watch(&robot, case.faults);
        assert_eq!(watched.report.outcome, Outcome::StoppedBySafety);
        watched.assert_goals_kept_limits(&robot);
        let stopped = watched.moments.iter().filter(|moment| moment.permission == Permission::Stop);
        let mut goals =
            stopped.map(|moment| moment.servos.iter().map(|servo| servo.goal).collect::<Vec<_>>());
        let first = goals.next();
        assert!(goals.clone().count() >= 3, "{}: the end must be looked at", case.faults);
        assert!(goals.all(|later| Some(later) == first), "{}: goals moved after the stop", case.faults);
        for (joint, truth) in robot.joints.iter().zip(watched.end()) {
            assert!(truth.torque_on, "{}: {} let go", case.faults, joint.name);
        }
    }
}

/// A servo that talks while the host sends damages the request for all: late replies can keep every servo from
/// receiving the end.
#[test]
fn servos_whose_replies_collide_with_requests_end_limp() {
    let robot = shipped("horse.toml");
    let watched = watch(&robot, "[[fault]]\nkind = 'slow'\nat_s = 6.0\nbus = 'main'\ndelay_ms = 1.83");
    let report = &watched.report;
    assert_eq!(report.outcome, Outcome::StoppedBySafety, "{}", report.reason);
    assert!(!report.is_end_heard && report.reason.contains("cut their power"), "{}", report.reason);
    for (joint, truth) in robot.joints.iter().zip(watched.end()) {
        assert!(!truth.torque_on, "{} still holds", joint.name);
    }
}

#[test]
fn a_loop_that_stalled_too_long_stops_the_robot() {
    let robot = shipped("horse.toml");
    let watched = watch(&robot, "[[fault]]\nkind = 'late-host'\nat_s = 6.0\ndelay_ms = 3000");
    assert_eq!(watched.report.outcome, Outcome::StoppedBySafety);
    assert!(watched.report.reason.contains("the loop stood still for 3.0"), "{}", watched.report.reason);
    assert!(watched.report.reason.contains("close other programs"), "{}", watched.report.reason);
    let stopped_s = watched.stopped_at_s();
    assert!(stopped_s.is_some_and(|s| (s - FAULT_S - 3.0).abs() < SLACK_S), "stopped at {stopped_s:?}");
    watched.assert_goals_kept_limits(&robot);
    assert_sits_limp(&robot, watched.end(), &NONE, None);
}

#[test]
fn a_joint_that_is_jammed_anywhere_in_its_stride_is_found() {
    let robot = shipped("horse.toml");
    let jams = [(2, 6.3), (3, 6.9), (4, 6.0), (7, 6.3), (12, 6.6), (15, 6.0), (16, 6.9)];
    for (id, at_s) in jams.into_iter().step_by(if is_full() { 1 } else { 3 }) {
        let faults = format!("[[fault]]\nkind = 'stuck'\nat_s = {at_s}\nbus = 'main'\nid = {id}");
        let watched = watch(&robot, &faults);
        assert_eq!(watched.report.outcome, Outcome::StoppedBySafety, "{faults}: {}", watched.report.reason);
        assert!(
            watched.report.reason.contains(&format!("servo {id} ")),
            "{faults}: {}",
            watched.report.reason
        );
        watched.assert_goals_kept_limits(&robot);
    }
}

#[test]
fn a_jam_that_is_cleared_during_the_hold_lets_the_robot_walk_on() {
    let robot = shipped("horse.toml");
    let watched = watch(&robot, "[[fault]]\nkind = 'stuck'\nat_s = 6.0\nfor_s = 2.0\nbus = 'main'\nid = 7");
    assert!(watched.held_at_s().is_some_and(|s| s < 8.0), "held at {:?}", watched.held_at_s());
    assert_eq!(watched.report.outcome, Outcome::Completed, "{}", watched.report.reason);
    watched.assert_goals_kept_limits(&robot);
    assert_sits_limp(&robot, watched.end(), &NONE, None);
}

#[test]
fn faults_at_any_time_of_a_run_end_it_safely() {
    let robot = shipped("horse.toml");
    let kinds = ["kind = 'silent'\nbus = 'main'\nid = 9", "kind = 'unplugged'"];
    // From the first cycles, limp, to the last, sitting down.
    for (number, at_ms) in (200..9_000).step_by(if is_full() { 600 } else { 1_200 }).enumerate() {
        for kind in if is_full() { &kinds[..] } else { &kinds[number % 2..=number % 2] } {
            let faults = format!("[[fault]]\nat_s = {}\n{kind}", f64::from(at_ms) * 1e-3);
            let scenario = Scenario { faults: &faults, ..Scenario::from_sitting(&robot, "trot", 2.0) };
            let watched = scenario.watch();
            let report = &watched.report;
            assert_ne!(report.outcome, Outcome::Failed, "{faults}: {}", report.reason);
            watched.assert_goals_kept_limits(&robot);
            let is_silent = kind.contains("silent");
            let cut_off = if is_silent { 9..=9 } else { 1..=16 };
            for (joint, truth) in robot.joints.iter().zip(watched.end()) {
                assert!(
                    !truth.torque_on || cut_off.contains(&servo(joint).id.0),
                    "{faults}: {} still holds",
                    joint.name
                );
            }
        }
    }
}
