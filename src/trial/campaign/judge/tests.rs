#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::LazyLock;

use hw_sim::ServoTruth;

use super::{Ended, Finding, Judge, Wrong};
use crate::bus::{StartError, TransactionError};
use crate::config;
use crate::model::{Robot, StopAction};
use crate::motion::Activity;
use crate::run::Status;
use crate::signals::Permission;
use crate::telemetry::{Outcome, Report};
use crate::trial::campaign::{Episode, Subject};

/// The joint whose servo is written to: a hip, from -100 to 30 degrees or so.
const HIP: usize = 1;

static SUBJECT: LazyLock<Subject> = LazyLock::new(|| {
    let robot = config::parse(include_str!("../../../../config/horse.toml"), "horse.toml").unwrap().robot;
    let capability = crate::capability::Capability::of(&robot).unwrap();
    Subject::new(robot, capability).unwrap()
});

/// Servos whose registers are written by hand, before a judge.
struct Bench {
    robot: Robot,
    judge: Judge,
    now_s: f64,
    truths: Vec<ServoTruth>,
}

impl Bench {
    /// All limp in the middle of their ranges, looked at once.
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

    /// With torque on the hip, where it is.
    fn awake() -> Bench {
        let mut bench = Bench::new();
        let middle = bench.range().0.midpoint(bench.range().1);
        bench.tell(middle, 1000);
        bench.tell(middle, 1000);
        assert_eq!(bench.found(), []);
        bench
    }

    /// Goals of the hip, counts.
    fn range(&self) -> (f64, f64) {
        let joint = &self.robot.joints[HIP];
        let (a, b) = joint.goal_range_rad();
        let (a, b) = (joint.servo.unwrap().count_of(a), joint.servo.unwrap().count_of(b));
        (a.min(b), a.max(b))
    }

    /// Degrees as counts.
    fn counts(&self, degrees: f64) -> f64 {
        degrees.to_radians() / self.robot.joints[HIP].servo.unwrap().count_rad()
    }

    fn servo(&mut self) -> &mut ServoTruth {
        &mut self.truths[HIP]
    }

    fn look(&mut self) {
        self.now_s += self.robot.period_s();
        let truths = &self.truths;
        // One bus, its servos in the order of the joints.
        self.judge.look_at(self.now_s, |_, place| truths[place]);
    }

    /// A cycle in which the hip takes a goal, and has torque.
    #[allow(clippy::cast_possible_truncation, reason = "a few thousand counts")]
    fn tell(&mut self, goal: f64, torque_limit: i64) {
        let servo = self.servo();
        servo.goal = goal.round() as i64;
        servo.goal_taken = Some(servo.goal);
        servo.goals_taken += 1;
        (servo.torque_on, servo.torque_limit) = (true, torque_limit);
        self.look();
    }

    fn found(&self) -> Vec<Wrong> {
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
    // In steps that keep the rate, up to the end.
    let mut goal = low.midpoint(high);
    while goal + step < high {
        goal += step;
        bench.servo().position_counts = goal;
        bench.tell(goal, 1000);
    }
    bench.tell(high, 1000);
    assert_eq!(bench.found(), []);
    bench.tell(high + 2.0, 1000);
    assert_eq!(bench.found(), [Wrong::Range]);
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
    // The shaft has followed; out again.
    bench.servo().position_counts = outside + 6.0;
    bench.tell(outside + 2.0, 500);
    assert_eq!(bench.found(), [Wrong::Range]);
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
    assert_eq!(bench.found(), [Wrong::Range]);
}

#[test]
fn a_leap_is_found_however_long_the_servo_heard_nothing_and_wherever_its_shaft_is() {
    let middle = |bench: &Bench| bench.range().0.midpoint(bench.range().1).round();
    // The rate is 189 degrees a second: 1.9 degrees a cycle.
    let mut bench = Bench::awake();
    bench.tell(middle(&bench) + bench.counts(1.8), 1000);
    assert_eq!(bench.found(), []);
    bench.tell(middle(&bench) + bench.counts(4.5), 1000);
    assert_eq!(bench.found(), [Wrong::Rate]);

    // One lost write is two steps; a hundred are no more.
    let mut bench = Bench::awake();
    bench.look();
    bench.tell(middle(&bench) + bench.counts(3.7), 1000);
    assert_eq!(bench.found(), []);
    (0..100).for_each(|_| bench.look());
    bench.tell(middle(&bench) + bench.counts(3.7 + 4.5), 1000);
    assert_eq!(bench.found(), [Wrong::Rate]);

    // Back to where the shaft is, which hangs off its goal: with torque, without.
    for (limit, found) in [(1000, &[Wrong::Rate][..]), (0, &[])] {
        let mut bench = Bench::awake();
        bench.servo().position_counts -= bench.counts(10.0);
        bench.look();
        let shaft = bench.servo().position_counts;
        bench.tell(shaft, limit);
        assert_eq!(bench.found(), found);
    }
}

#[test]
fn a_servo_that_obeys_what_was_meant_for_another_is_excused() {
    let mut bench = Bench::awake();
    let (_, high) = bench.range();
    bench.servo().is_misled = true;
    bench.tell(high + 50.0, 1000);
    bench.servo().is_misled = false;
    bench.tell(high - 100.0, 1000);
    assert_eq!(bench.found(), []);
}

#[test]
fn a_shaft_that_is_thrown_is_a_snap_and_one_that_is_pushed_slowly_is_none() {
    for (torque_limit, is_snap) in [(1000, true), (30, false)] {
        let mut bench = Bench::new();
        let from = bench.servo().position_counts;
        bench.tell(from + bench.counts(12.0), torque_limit);
        bench.servo().position_counts = from + bench.counts(3.0);
        bench.look();
        assert_eq!(bench.found(), [], "it is on its way");
        bench.servo().position_counts = from + bench.counts(6.0);
        bench.look();
        assert_eq!(bench.found() == [Wrong::Snap], is_snap, "at {torque_limit}");
    }
}

#[test]
fn nothing_comes_alive_after_the_run() {
    let mut bench = Bench::awake();
    assert_eq!(bench.end(&Ended::GivenUp), []);
    let goal = bench.servo().goal;
    bench.look();
    assert_eq!(bench.found(), []);
    #[allow(clippy::cast_precision_loss, reason = "a few thousand counts")]
    bench.tell(goal as f64, 1000);
    assert_eq!(bench.found(), [Wrong::Moved]);
    bench.servo().torque_on = false;
    bench.look();
    bench.servo().torque_on = true;
    bench.look();
    assert_eq!(bench.found(), [Wrong::Moved; 2]);
    let servo = bench.servo();
    (servo.torque_on, servo.torque_nm) = (false, 0.0);
    bench.look();
    bench.servo().torque_nm = 0.1;
    bench.look();
    assert_eq!(bench.found(), [Wrong::Moved; 3], "a motor turns without torque");
}

#[test]
fn torque_after_a_limp_end_is_found_unless_the_report_tells_of_a_servo_that_cannot_be_reached() {
    for (is_reachable, is_told, found) in [
        (true, false, vec![Wrong::Torque]),
        (true, true, vec![Wrong::Torque]),
        (false, true, vec![]),
        (false, false, vec![Wrong::Torque, Wrong::Report]),
    ] {
        let mut bench = Bench::awake();
        bench.robot.stop_action = StopAction::SitThenLimp;
        bench.servo().is_reachable = is_reachable;
        (0..200).for_each(|_| bench.look());
        // The servo that is told of cost as many replies.
        let ended = report(|report| {
            report.is_end_heard = !is_told;
            report.buses[0].missing = if is_reachable { 0 } else { 200 };
        });
        let mut told: Vec<Wrong> = bench.end(&ended).iter().map(|finding| finding.wrong).collect();
        // What nothing befell cost no replies: that is another finding, of this bench alone.
        told.retain(|wrong| *wrong != Wrong::Report || !is_reachable && !is_told);
        told.dedup();
        assert_eq!(told, found, "reachable {is_reachable}, told {is_told}");
    }
    let mut bench = Bench::awake();
    let error = StartError::Transaction(TransactionError::NoServo { joint: 0 });
    let found = bench.end(&Ended::NotStarted(error));
    assert_eq!(found[0].wrong, Wrong::Torque);
    assert!(found[0].what.contains("never began"), "{}", found[0].what);
}

#[test]
fn a_report_that_counts_nothing_where_goals_left_their_limits_is_untrue() {
    let mut bench = Bench::awake();
    let (_, high) = bench.range();
    bench.tell(high + 50.0, 1000);
    bench.servo().torque_on = false;
    bench.look();
    let ended = report(|report| report.outcome = Outcome::Completed);
    let found: Vec<Wrong> = bench.end(&ended).iter().map(|finding| finding.wrong).collect();
    assert_eq!(found, [Wrong::Range, Wrong::Report]);

    // Replies that were lost and are not counted, and some that were not and are.
    let mut bench = Bench::new();
    bench.servo().is_reachable = false;
    (0..500).for_each(|_| bench.look());
    let found = bench.end(&report(|_| {}));
    assert!(found[0].what.contains("could not be reached 500 times"), "{found:?}");
    let found = Bench::new().end(&report(|report| report.buses[0].corrupt = 500));
    assert!(found[0].what.contains("nothing befell any"), "{found:?}");
}

#[test]
fn a_panic_is_found_wherever_it_was() {
    let in_loop = report(|report| report.reason = "the loop panicked: this is a defect".to_owned());
    for ended in [in_loop, Ended::Panicked("a panic".to_owned())] {
        assert_eq!(Bench::new().end(&ended)[0].wrong, Wrong::Panic);
    }
}

#[test]
fn holds_and_runs_end() {
    let status = |time_s, permission| Status {
        time_s,
        activity: Activity::Walking,
        permission,
        speed_m_s: 0.0,
        yaw_rate_rad_s: 0.0,
        gait: None,
        stroke: None,
        frozen: 0,
        outage: None,
        late_cycles: 0,
        hottest_c: 0.0,
        lowest_v: 0.0,
        is_imu_lost: false,
        is_recording_lost: false,
    };
    let mut bench = Bench::new();
    // Hold after hold, each as long as it may be.
    for hold in 0..4 {
        let at_s = 4.0 * f64::from(hold);
        for (after_s, permission) in
            [(0.0, Permission::Hold), (2.2, Permission::Hold), (2.3, Permission::Move)]
        {
            assert!(!bench.judge.note(&status(at_s + after_s, permission)));
        }
    }
    assert!(!bench.judge.note(&status(20.0, Permission::Hold)));
    assert!(bench.judge.note(&status(45.0, Permission::Hold)));
    assert_eq!(bench.found(), [Wrong::Endless]);
    let mut bench = Bench::new();
    assert!(!bench.judge.note(&status(40.0, Permission::Stop)));
    assert!(bench.judge.note(&status(150.0, Permission::Stop)));
    assert_eq!(bench.found(), [Wrong::Endless]);
}
