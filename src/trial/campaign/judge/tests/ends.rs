//! The judge's view of the ends of runs.

use super::*;

#[test]
fn no_servo_gains_torque_after_the_run() {
    let mut bench = Bench::awake();
    assert_eq!(bench.end(&Ended::GivenUp), []);
    let goal = bench.servo().goal;
    bench.look();
    assert_eq!(bench.found(), []);
    #[allow(clippy::cast_precision_loss, reason = "a few thousand counts")]
    bench.tell(goal as f64, 1000);
    assert_eq!(bench.found(), [Violation::Moved]);
    bench.servo().torque_on = false;
    bench.look();
    bench.servo().torque_on = true;
    bench.look();
    assert_eq!(bench.found(), [Violation::Moved; 2]);
    let servo = bench.servo();
    (servo.torque_on, servo.torque_nm) = (false, 0.0);
    bench.look();
    bench.servo().torque_nm = 0.1;
    bench.look();
    assert_eq!(bench.found(), [Violation::Moved; 3], "a motor turns without torque");
}

#[test]
fn torque_after_a_limp_end_is_found_unless_the_report_names_an_unreachable_servo() {
    for (is_reachable, is_told, found) in [
        (true, false, vec![Violation::Torque]),
        (true, true, vec![Violation::Torque]),
        (false, true, vec![]),
        (false, false, vec![Violation::Torque, Violation::Report]),
    ] {
        let mut bench = Bench::awake();
        bench.robot.stop_action = StopAction::SitThenLimp;
        bench.servo().is_reachable = is_reachable;
        (0..200).for_each(|_| bench.look());
        // An unreachable servo costs one reply per check.
        let ended = report(|report| {
            report.is_end_heard = !is_told;
            report.buses[0].missing = if is_reachable { 0 } else { 200 };
        });
        let mut told: Vec<Violation> = bench.end(&ended).iter().map(|finding| finding.wrong).collect();
        // The bench's episode has no fault that costs replies, so the judge also objects to the lost ones.
        told.retain(|wrong| *wrong != Violation::Report || !is_reachable && !is_told);
        told.dedup();
        assert_eq!(told, found, "reachable {is_reachable}, told {is_told}");
    }
    let mut bench = Bench::awake();
    let error = StartError::Transaction(TransactionError::NoServo { joint: 0 });
    let found = bench.end(&Ended::NotStarted(error));
    assert_eq!(found[0].wrong, Violation::Torque);
    assert!(found[0].what.contains("never began"), "{}", found[0].what);
}

#[test]
fn a_report_without_interventions_is_wrong_if_goals_left_their_limits() {
    let mut bench = Bench::awake();
    let (_, high) = bench.range();
    bench.tell(high + 50.0, 1000);
    bench.servo().torque_on = false;
    bench.look();
    let ended = report(|report| report.outcome = Outcome::Completed);
    let found: Vec<Violation> = bench.end(&ended).iter().map(|finding| finding.wrong).collect();
    assert_eq!(found, [Violation::Range, Violation::Report]);

    // Some lost replies are not counted, and some counted ones were not lost.
    let mut bench = Bench::new();
    bench.servo().is_reachable = false;
    (0..500).for_each(|_| bench.look());
    let found = bench.end(&report(|_| {}));
    assert!(found[0].what.contains("could not be reached 500 times"), "{found:?}");
    let found = Bench::new().end(&report(|report| report.buses[0].corrupt = 500));
    assert!(found[0].what.contains("nothing went wrong with any"), "{found:?}");
}

#[test]
fn a_panic_is_found_wherever_it_happened() {
    let in_loop = report(|report| report.reason = "the loop panicked: this is a defect".to_owned());
    for ended in [in_loop, Ended::Panicked("a panic".to_owned())] {
        assert_eq!(Bench::new().end(&ended)[0].wrong, Violation::Panic);
    }
}

#[test]
fn holds_and_runs_end() {
    let status =
        |time_s, permission| Status { time_s, activity: Activity::Walking, permission, ..Status::LIMP };
    let mut bench = Bench::new();
    // Hold after hold, each as long as permitted.
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
    assert_eq!(bench.found(), [Violation::Endless]);
    let mut bench = Bench::new();
    assert!(!bench.judge.note(&status(40.0, Permission::Stop)));
    assert!(bench.judge.note(&status(150.0, Permission::Stop)));
    assert_eq!(bench.found(), [Violation::Endless]);
}
