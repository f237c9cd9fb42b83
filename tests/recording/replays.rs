//! Replays of a recorded run.

use std::path::Path;
use std::process::Command;

use hippocamp::bus::{ServoGoal, Slot};
use hippocamp::recording::Recording;
use hippocamp::replay::replay;

use crate::common::{record, record_in_physics, record_with};
use crate::disk::recorded_on_a_stuck_disk;

/// A recording that nothing disturbed, for a test to change.
fn recording() -> Recording {
    Recording::parse(&record().1, "test").unwrap()
}

#[test]
fn a_replay_agrees_and_finds_what_the_run_reported() {
    let (report, bytes) = record();
    let replayed = replay(&Recording::parse(bytes, "test").unwrap()).unwrap();
    assert!(replayed.agrees(), "{replayed:?}");
    assert!(replayed.is_complete());
    assert_eq!((replayed.cycles, replayed.cycles_run_again), (report.cycles, report.cycles));
    assert_eq!((replayed.joints, replayed.feet), (report.joints, report.feet));
    assert_eq!((replayed.body, report.body), (None, None));
}

#[test]
fn a_replay_knows_what_the_simulated_body_did() {
    let (report, bytes) = record_in_physics();
    let replayed = replay(&Recording::parse(bytes, "test").unwrap()).unwrap();
    assert!(replayed.agrees(), "{replayed:?}");
    assert!(report.body.unwrap().distance_m > 0.05, "{:?}", report.body);
    assert_eq!(replayed.body, report.body);
}

#[test]
fn a_replay_agrees_on_a_run_with_lost_and_damaged_replies_and_a_late_host() {
    let (_, bytes) = record_with(
        "[[fault]]\nat_s = 3\nfor_s = 0.05\nkind = \"silent\"\nbus = \"main\"\nid = 5\n\
         [[fault]]\nat_s = 6\nfor_s = 0.08\nkind = \"bit-flip\"\n\
         [[fault]]\nat_s = 8\nkind = \"late-host\"\ndelay_ms = 35\n\
         [[fault]]\nat_s = 9\nfor_s = 0.4\nkind = \"silent\"\nbus = \"main\"\nid = 2\n",
    );
    let recording = Recording::parse(&bytes, "test").unwrap();
    let slots = || recording.samples.iter().flat_map(|sample| &sample.slots);
    assert!(slots().any(|slot| *slot == Slot::Missing) && slots().any(|slot| *slot == Slot::Corrupt));
    assert!(recording.samples.iter().any(|sample| sample.facts.is_held));
    let replayed = replay(&recording).unwrap();
    assert!(replayed.agrees(), "{replayed:?}");
}

#[test]
fn a_replay_names_cycle_and_joint_of_a_goal_that_was_changed() {
    let mut recording = recording();
    let ServoGoal::Move { position, .. } = &mut recording.samples[700].goals[6] else { panic!("limp") };
    *position += 1;
    let found = replay(&recording).unwrap().difference.unwrap();
    assert_eq!((found.cycle, found.joint), (700, Some(6)));
    assert!(found.what.starts_with("recorded goal count"), "{}", found.what);
}

#[test]
fn a_replay_names_cycle_and_joint_of_a_reply_that_was_changed() {
    let mut recording = recording();
    let Slot::Fresh(reply) = &mut recording.samples[321].slots[2] else { panic!("missing") };
    reply.position += 1;
    let found = replay(&recording).unwrap().difference.unwrap();
    assert_eq!((found.cycle, found.joint), (321, Some(2)));
}

#[test]
fn a_replay_finds_a_recorded_goal_outside_its_range() {
    let mut recording = recording();
    let servo = recording.robot.joints[1].servo.unwrap();
    // A joint's whole range further down, and a little more.
    let (low, high) = recording.robot.joints[1].range_rad;
    let counts = (servo.count_of(low) - servo.count_of(high)).abs();
    let outside = (0..4096).find(|count| f64::from(*count) > counts + 10.0).unwrap();
    let outside = if servo.reversed { outside } else { -outside };
    for sample in &mut recording.samples[600..700] {
        let ServoGoal::Move { position, .. } = &mut sample.goals[1] else { panic!("limp") };
        *position += outside;
    }
    let violations = replay(&recording).unwrap().violations;
    assert!(violations.iter().any(|found| found.contains("outside their joint's range")), "{violations:?}");
    assert!(violations.iter().any(|found| found.contains("rate limit")), "{violations:?}");
}

#[test]
fn after_a_dropped_cycle_only_invariants_are_judged() {
    let mut recording = recording();
    let cycles = recording.samples.len() as u64;
    recording.samples.drain(500..510);
    recording.samples.remove(900);
    let replayed = replay(&recording).unwrap();
    assert!(replayed.agrees() && !replayed.is_complete(), "{replayed:?}");
    assert_eq!((replayed.cycles, replayed.cycles_run_again), (cycles - 11, 500));
    assert_eq!(replayed.gaps, [500..=509, 910..=910]);

    // A goal far off, behind both gaps, is found by its rate.
    let ServoGoal::Move { position, .. } = &mut recording.samples[1000].goals[6] else { panic!("limp") };
    *position += 500;
    let replayed = replay(&recording).unwrap();
    assert!(replayed.violations.iter().any(|found| found.contains("rate limit")), "{replayed:?}");
    assert_eq!(replayed.difference, None);
}

#[test]
fn the_first_of_many_gaps_are_listed_and_all_are_counted() {
    let mut recording = recording();
    let mut number = 0;
    recording.samples.retain(|_| {
        number += 1;
        number > 600 || number % 2 == 0
    });
    let replayed = replay(&recording).unwrap();
    assert_eq!((replayed.gap_count, replayed.dropped, replayed.gaps.len()), (300, 300, 100));
    assert_eq!((replayed.gaps[0].clone(), replayed.gaps[99].clone()), (0..=0, 198..=198));
    assert!(!replayed.is_complete());
}

#[test]
fn cycles_dropped_at_the_beginning_and_at_the_end_are_missed_too() {
    let mut recording = recording();
    let cycles = recording.samples.len() as u64;
    recording.samples.truncate(recording.samples.len() - 3);
    recording.samples.remove(0);
    let replayed = replay(&recording).unwrap();
    assert!(replayed.agrees() && !replayed.is_complete(), "{replayed:?}");
    assert_eq!(replayed.gaps, [0..=0, cycles - 3..=cycles - 1]);
    assert_eq!(replayed.cycles_run_again, 0);
}

#[test]
fn a_recording_that_was_cut_is_not_complete() {
    let (_, bytes) = record();
    let replayed = replay(&Recording::parse(&bytes[..bytes.len() / 2], "test").unwrap()).unwrap();
    assert!(replayed.agrees() && replayed.is_cut_short && !replayed.is_complete(), "{replayed:?}");
    assert!(replayed.gaps.is_empty() && replayed.cycles_run_again > 0);
}

/// Exit code and standard output of `hippocamp replay` of a file with these bytes.
fn replayed_by_command(name: &str, bytes: &[u8]) -> (Option<i32>, String) {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&file, bytes).unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_hippocamp")).arg("replay").arg(&file).output().unwrap();
    (done.status.code(), String::from_utf8(done.stdout).unwrap())
}

#[test]
fn the_command_reports_what_it_could_not_judge_in_words_and_exit_code() {
    let (_, whole) = record();
    let (code, said) = replayed_by_command("whole.mcap", whole);
    assert_eq!(code, Some(0), "{said}");
    assert!(!said.contains("NOT JUDGED"), "{said}");

    let (code, said) = replayed_by_command("cut.mcap", &whole[..whole.len() / 2]);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("CUT SHORT") && said.contains("NOT JUDGED: the rest of the run"), "{said}");

    // The disk was stuck: cycles 200 to 499 of 500 are dropped.
    let (_, with_gap) = recorded_on_a_stuck_disk();
    let (code, said) = replayed_by_command("gap.mcap", &with_gap);
    assert_eq!(code, Some(4), "{said}");
    assert!(said.contains("300 cycles that were dropped from the recording: 200 to 499"), "{said}");
    assert!(said.contains("200 cycles run again, all goals the same"), "{said}");
}
