#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod ends;

use std::sync::LazyLock;

use hw_sim::ServoTruth;

use super::{Ended, Finding, Judge, Violation};
use crate::bus::{StartError, TransactionError};
use crate::config;
use crate::model::{Robot, StopAction};
use crate::motion::Activity;
use crate::signals::Permission;
use crate::signals::Status;
use crate::telemetry::{Outcome, Report};
use crate::trial::campaign::{Episode, Subject};

/// The joint whose servo the tests write to: a hock, with a range of 110 degrees.
const HOCK: usize = 3;

static SUBJECT: LazyLock<Subject> = LazyLock::new(|| {
    let robot = config::parse(include_str!("../../../../../config/horse.toml"), "horse.toml").unwrap().robot;
    let kind = crate::kinds::of(&robot).unwrap();
    Subject::new(robot, kind).unwrap()
});

/// Servos whose registers the tests write directly, before a judge.
struct Bench {
    robot: Robot,
    judge: Judge,
    now_s: f64,
    truths: Vec<ServoTruth>,
}

impl Bench {
    /// All limp in the middle of their ranges, checked once.
    fn new() -> Bench {
        let robot = SUBJECT.robot().clone();
        let truths = robot.joints.iter().map(|joint| {
            let middle = joint.servo.unwrap().count_of(joint.middle_rad());
            ServoTruth { position_counts: middle, is_reachable: true, ..ServoTruth::default() }
        });
        let mut bench =
            Bench { judge: Judge::new(&robot, 10.0), now_s: 0.0, truths: truths.collect(), robot };
        bench.look();
        bench
    }

    /// With torque on at the hock, in place.
    fn awake() -> Bench {
        let mut bench = Bench::new();
        let middle = bench.range().0.midpoint(bench.range().1);
        bench.tell(middle, 1000);
        bench.tell(middle, 1000);
        assert_eq!(bench.found(), []);
        bench
    }

    /// Permitted goals of the hock, counts.
    fn range(&self) -> (f64, f64) {
        let joint = &self.robot.joints[HOCK];
        let (a, b) = joint.goal_range_rad();
        let (a, b) = (joint.servo.unwrap().count_of(a), joint.servo.unwrap().count_of(b));
        (a.min(b), a.max(b))
    }

    /// Degrees as counts.
    fn counts(&self, degrees: f64) -> f64 {
        degrees.to_radians() / self.robot.joints[HOCK].servo.unwrap().count_rad()
    }

    fn servo(&mut self) -> &mut ServoTruth {
        &mut self.truths[HOCK]
    }

    fn look(&mut self) {
        self.now_s += self.robot.period_s();
        let truths = &self.truths;
        // One bus, with its servos in the order of the joints.
        self.judge.look_at(self.now_s, |_, place| truths[place]);
    }

    /// A cycle in which the hock takes a goal, and has torque.
    #[allow(clippy::cast_possible_truncation, reason = "a few thousand counts")]
    fn tell(&mut self, goal: f64, torque_limit: i64) {
        let servo = self.servo();
        servo.goal = goal.round() as i64;
        servo.goal_taken = Some(servo.goal);
        servo.goals_taken += 1;
        (servo.torque_on, servo.torque_limit) = (true, torque_limit);
        self.look();
    }

    fn found(&self) -> Vec<Violation> {
        self.judge.findings().iter().map(|finding| finding.wrong).collect()
    }

    fn end(&mut self, ended: &Ended) -> Vec<Finding> {
        let mut episode = Episode::draw(&SUBJECT, 1, 1);
        episode.faults.clear();
        self.judge.judge_end(&self.robot, &episode, ended);
        self.judge.findings().to_vec()
    }
}

fn report(change: impl FnOnce(&mut Report)) -> Ended {
    let mut episode = Episode::draw(&SUBJECT, 1, 1);
    (episode.end_s, episode.has_physics) = (0.0, false);
    episode.faults.clear();
    episode.orders.clear();
    let mut report = super::super::stage::report_of(&SUBJECT, &episode).unwrap();
    change(&mut report);
    Ended::Reported(Box::new(report))
}

#[test]
fn a_goal_outside_its_range_is_found_and_one_at_its_end_is_not() {
    let mut bench = Bench::awake();
    let (low, high) = bench.range();
    let step = bench.counts(1.0);
    // In steps within the rate, up to the end.
    let mut goal = low.midpoint(high);
    while goal + step < high {
        goal += step;
        bench.servo().position_counts = goal;
        bench.tell(goal, 1000);
    }
    bench.tell(high, 1000);
    assert_eq!(bench.found(), []);
    bench.tell(high + 2.0, 1000);
    assert_eq!(bench.found(), [Violation::Range]);
}

#[test]
fn a_joint_that_starts_outside_is_brought_in_and_not_taken_further_out() {
    let mut bench = Bench::new();
    let (low, _) = bench.range();
    let outside = (low - bench.counts(8.0)).round();
    bench.servo().position_counts = outside;
    bench.look();
    for goal in [outside, outside, outside + 3.0, outside + 6.0] {
        bench.tell(goal, 500);
    }
    assert_eq!(bench.found(), []);
    // The shaft has followed; then out again.
    bench.servo().position_counts = outside + 6.0;
    bench.tell(outside + 2.0, 500);
    assert_eq!(bench.found(), [Violation::Range]);
}

#[test]
fn after_a_loss_of_torque_the_first_goal_must_be_inside_even_where_the_joint_hangs_outside() {
    let mut bench = Bench::awake();
    let (low, _) = bench.range();
    let servo = bench.servo();
    (servo.torque_on, servo.goal, servo.goal_taken) = (false, 0, None);
    bench.look();
    let outside = low - bench.counts(3.0);
    bench.servo().position_counts = outside;
    bench.look();
    bench.tell(outside, 0);
    assert_eq!(bench.found(), [Violation::Range]);
}

#[test]
fn a_jump_of_the_goal_is_found_after_any_silence_and_at_any_shaft_position() {
    let middle = |bench: &Bench| bench.range().0.midpoint(bench.range().1).round();
    // The rate is 189 degrees per second: 1.9 degrees per cycle.
    let mut bench = Bench::awake();
    bench.tell(middle(&bench) + bench.counts(1.8), 1000);
    assert_eq!(bench.found(), []);
    bench.tell(middle(&bench) + bench.counts(4.5), 1000);
    assert_eq!(bench.found(), [Violation::Rate]);

    // One lost write permits two steps; a hundred lost writes permit no more.
    let mut bench = Bench::awake();
    bench.look();
    bench.tell(middle(&bench) + bench.counts(3.7), 1000);
    assert_eq!(bench.found(), []);
    (0..100).for_each(|_| bench.look());
    bench.tell(middle(&bench) + bench.counts(3.7 + 4.5), 1000);
    assert_eq!(bench.found(), [Violation::Rate]);

    // Back to the shaft's position, which is off its goal: with torque, without.
    for (limit, found) in [(1000, &[Violation::Rate][..]), (0, &[])] {
        let mut bench = Bench::awake();
        bench.servo().position_counts -= bench.counts(10.0);
        bench.look();
        let shaft = bench.servo().position_counts;
        bench.tell(shaft, limit);
        assert_eq!(bench.found(), found);
    }
}

/// The servo's watchdog makes it hold its position, which is outside: from there the joint is brought in.
#[test]
fn a_joint_that_its_servo_holds_outside_may_be_brought_in() {
    for holds_itself in [true, false] {
        let mut bench = Bench::awake();
        let (low, _) = bench.range();
        let outside = (low - bench.counts(2.0)).round();
        bench.servo().position_counts = outside;
        if holds_itself {
            #[allow(clippy::cast_possible_truncation, reason = "a few thousand counts")]
            let held = outside as i64;
            bench.servo().goal = held;
        }
        bench.look();
        bench.tell(outside + 1.0, 1000);
        assert_eq!(bench.found().is_empty(), holds_itself);
    }
}

#[test]
fn a_servo_that_obeys_a_request_for_another_is_excused() {
    let mut bench = Bench::awake();
    let (_, high) = bench.range();
    bench.servo().is_misled = true;
    bench.tell(high + 50.0, 1000);
    bench.servo().is_misled = false;
    bench.tell(high - 100.0, 1000);
    assert_eq!(bench.found(), []);
}

#[test]
fn a_thrown_shaft_counts_as_a_snap_and_a_slowly_pushed_one_does_not() {
    for (torque_limit, is_snap) in [(1000, true), (30, false)] {
        let mut bench = Bench::new();
        let from = bench.servo().position_counts;
        bench.tell(from + bench.counts(12.0), torque_limit);
        bench.servo().position_counts = from + bench.counts(3.0);
        bench.look();
        assert_eq!(bench.found(), [], "it is on its way");
        bench.servo().position_counts = from + bench.counts(6.0);
        bench.look();
        assert_eq!(bench.found() == [Violation::Snap], is_snap, "at {torque_limit}");
    }
}
