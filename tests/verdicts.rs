//! Whether a run says that it was good: by the truth of the simulated body, and by one thing at a time that is not.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic")]

mod common;

use std::path::Path;

use common::{Scenario, in_physics};
use hippocamp::config;
use hippocamp::telemetry::{BusReport, OutageReport, Outcome, RecordingReport, Report, Verdict};

/// What was found, in the order of the report.
fn found(report: &Report) -> Vec<&'static str> {
    report.findings.iter().map(|finding| finding.what).collect()
}

/// A trot in physics that a horse can do.
fn good() -> Report {
    let robot = in_physics("horse.toml");
    Scenario::new(&robot, "trot", 5.0).run()
}

#[test]
fn a_trot_that_goes_as_asked_is_good() {
    let report = good();
    assert_eq!((report.verdict, found(&report)), (Verdict::Good, vec![]), "{:?}", report.findings);
    let (asked, reached) = (report.asked.unwrap(), report.reached.unwrap());
    let body = report.body.unwrap();
    // The body's own account of the same way.
    assert!((reached.speed_m_s - body.mean_speed_m_s).abs() < 0.01, "{reached:?}, {body:?}");
    assert!(asked.distance_m > 0.3 && (reached.distance_m / asked.distance_m - 1.0).abs() < 0.3);
}

#[test]
fn a_canter_that_crawls_is_poor_and_the_finding_says_why() {
    let robot = in_physics("horse.toml");
    let report = Scenario::new(&robot, "canter", 5.0).run();
    assert_eq!((report.outcome, report.verdict), (Outcome::Completed, Verdict::Poor));
    let speed = report.findings.iter().find(|finding| finding.what == "speed not as asked").unwrap();
    assert!(speed.likely_cause.contains("leaves the ground"), "{speed:?}");
    let (asked, reached) = (report.asked.unwrap(), report.reached.unwrap());
    assert!(reached.speed_m_s < 0.5 * asked.speed_m_s, "{asked:?}, {reached:?}");
}

/// A twelve-servo dog whose servos are too weak rolls over in a trot; its file has an IMU and no `[reflex]`.
#[test]
fn a_run_that_ends_fallen_has_not_completed() {
    let robot = config::load(Path::new("tests/robots/small-dog.toml")).unwrap().robot;
    let report = Scenario::new(&robot, "trot", 15.0).run();
    assert_eq!((report.outcome, report.verdict), (Outcome::Fallen, Verdict::Failed), "{}", report.reason);
}

#[test]
fn each_margin_makes_a_run_poor_by_itself() {
    let report = good();
    let poor = |what: &str, change: &dyn Fn(&mut Report)| {
        let mut changed = report.clone();
        change(&mut changed);
        let judged = changed.judged(16, 0.0);
        assert_eq!((judged.verdict, found(&judged)), (Verdict::Poor, vec![what]), "{:?}", judged.findings);
    };
    let asked = report.asked.unwrap();
    poor("speed not as asked", &|report| report.asked.as_mut().unwrap().distance_m = 2.0 * asked.distance_m);
    poor("speed not as asked", &|report| report.reached.as_mut().unwrap().distance_m = f64::NAN);
    poor("turn not as asked", &|report| report.asked.as_mut().unwrap().turn_deg = 90.0);
    poor("turn not as asked", &|report| report.reached.as_mut().unwrap().turn_deg = -45.0);
    poor("it went aside", &|report| report.reached.as_mut().unwrap().side_m = -1.0);
    poor("the trunk leant", &|report| report.body.as_mut().unwrap().pitch_max_deg = 50.0);
    poor("safety changed goals", &|report| report.safety_interventions = report.cycles * 2);
    poor("safety held the robot", &|report| report.held_cycles = 3);
    poor("cycles began late", &|report| report.late_cycles = report.cycles / 10);
    poor("replies were lost", &|report| {
        let bus: &mut BusReport = &mut report.buses[0];
        bus.missing = bus.exchanges;
    });
    poor("a joint was left without torque", &|report| {
        let outage =
            OutageReport { time_s: 1.0, joint: "left_hind.hip".to_owned(), reason: "hot".to_owned() };
        report.outages.push(outage);
    });
    poor("the recording is not whole", &|report| {
        let file = "walk.mcap".to_owned();
        report.recording = Some(RecordingReport { file, records: 10, dropped: 1, error: None });
    });
}

#[test]
fn what_did_not_complete_is_no_good_run_whatever_else_was_well() {
    for outcome in [Outcome::StoppedBySafety, Outcome::Fallen, Outcome::Failed] {
        let judged = Report { outcome, ..good() }.judged(16, 0.0);
        assert_eq!((judged.verdict, found(&judged)), (Verdict::Failed, vec!["the run did not complete"]));
    }
    let mut fell = good();
    fell.body.as_mut().unwrap().fell = true;
    assert_eq!(found(&fell.judged(16, 0.0)), ["it fell"]);
}
