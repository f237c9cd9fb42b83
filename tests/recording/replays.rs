//! A recorded run judged again.

use hippocamp::bus::{ServoGoal, Slot};
use hippocamp::recording::Recording;
use hippocamp::replay::replay;

use crate::common::record;

fn recording(faults: &str) -> Recording {
    Recording::parse(&record(faults).1, "test").unwrap()
}

#[test]
fn a_replay_agrees_and_finds_what_the_run_reported() {
    let (report, bytes) = record("");
    let replayed = replay(&Recording::parse(&bytes, "test").unwrap()).unwrap();
    assert!(replayed.agrees(), "{replayed:?}");
    assert_eq!((replayed.cycles, replayed.first_gap), (report.cycles, None));
    assert_eq!((replayed.joints, replayed.feet), (report.joints, report.feet));
}

#[test]
fn a_replay_agrees_on_a_run_with_lost_and_damaged_replies_and_a_late_host() {
    let recording = recording(
        "[[fault]]\nat_s = 3\nfor_s = 0.05\nkind = \"silent\"\nbus = \"main\"\nid = 5\n\
         [[fault]]\nat_s = 6\nfor_s = 0.08\nkind = \"bit-flip\"\n\
         [[fault]]\nat_s = 8\nkind = \"late-host\"\ndelay_ms = 35\n\
         [[fault]]\nat_s = 9\nfor_s = 0.4\nkind = \"silent\"\nbus = \"main\"\nid = 2\n",
    );
    let slots = || recording.samples.iter().flat_map(|sample| &sample.slots);
    assert!(slots().any(|slot| *slot == Slot::Missing) && slots().any(|slot| *slot == Slot::Corrupt));
    assert!(recording.samples.iter().any(|sample| sample.is_held));
    let replayed = replay(&recording).unwrap();
    assert!(replayed.agrees(), "{replayed:?}");
}

#[test]
fn a_replay_names_cycle_and_joint_of_a_goal_that_was_changed() {
    let mut recording = recording("");
    let ServoGoal::Move { position, .. } = &mut recording.samples[700].goals[6] else { panic!("limp") };
    *position += 1;
    let found = replay(&recording).unwrap().difference.unwrap();
    assert_eq!((found.cycle, found.joint), (700, Some(6)));
    assert!(found.what.starts_with("recorded goal count"), "{}", found.what);
}

#[test]
fn a_replay_names_cycle_and_joint_of_a_reply_that_was_changed() {
    let mut recording = recording("");
    let Slot::Fresh(reply) = &mut recording.samples[321].slots[2] else { panic!("missing") };
    reply.position += 1;
    let found = replay(&recording).unwrap().difference.unwrap();
    assert_eq!((found.cycle, found.joint), (321, Some(2)));
}

#[test]
fn a_replay_finds_a_recorded_goal_outside_its_range() {
    let mut recording = recording("");
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
fn a_replay_ends_where_a_cycle_was_dropped_and_says_so() {
    let mut recording = recording("");
    recording.samples.remove(500);
    let replayed = replay(&recording).unwrap();
    assert_eq!((replayed.cycles, replayed.first_gap), (500, Some(500)));
    assert!(replayed.agrees());
}
