//! The verdict of a run: on the true state of the simulated body, and with one margin spoilt at a time.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic")]

mod common;

use common::{Scenario, in_physics};
use hippocamp::config;
use hippocamp::telemetry::{
    BusReport, Followed, GroundPath, OutageReport, Outcome, RecordingReport, Report, Verdict, WalkTotals,
};

/// The findings, in the order of the report.
fn found(report: &Report) -> Vec<&'static str> {
    report.findings.iter().map(|finding| finding.what).collect()
}

/// A trot in physics that a horse can do.
fn good() -> Report {
    let robot = in_physics("horse.toml");
    Scenario::new(&robot, "trot", 5.0).run()
}

#[test]
fn a_trot_that_follows_its_order_is_good() {
    let report = good();
    assert_eq!((report.verdict, found(&report)), (Verdict::Good, vec![]), "{:?}", report.findings);
    let (asked, reached) = (report.asked.unwrap(), report.reached.unwrap());
    let body = report.body.unwrap();
    // The same path by the simulated body.
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

/// A twelve-servo dog with a heavy load on its left rolls over; its file has an IMU and no `[reflex]`.
#[test]
fn a_run_that_ends_fallen_has_not_completed() {
    let text = include_str!("robots/small-dog.toml");
    let loaded = text.replace("center_mm = [0, 0, 0]", "center_mm = [0, 60, 60]");
    assert_ne!(loaded, text);
    let robot = config::parse(&loaded, "loaded").unwrap().robot;
    let report = Scenario::new(&robot, "trot", 5.0).run();
    assert_eq!((report.outcome, report.verdict), (Outcome::Fallen, Verdict::Failed), "{}", report.reason);
}

/// A walk as asked, of this long, this far, and with these turns.
fn walked(forward_m: [f64; 2], turn_deg: [f64; 2]) -> WalkTotals {
    let way = |place: usize| GroundPath {
        speed_m_s: forward_m[place] / 10.0,
        turn_deg: turn_deg[place],
        side_m: 0.0,
        distance_m: forward_m[place],
    };
    let followed = |[asked, reached]: [f64; 2]| Followed { asked, reached };
    WalkTotals {
        time_s: 10.0,
        asked: way(0),
        reached: way(1),
        forward_m: followed(forward_m),
        turn_rad: followed(turn_deg.map(f64::to_radians)),
        flight_share: 0.0,
    }
}

#[test]
fn a_path_is_judged_by_the_order_at_each_moment() {
    let (robot, report) = (in_physics("horse.toml"), good());
    let judge = |walked: WalkTotals| found(&report.clone().judged(&robot, Some(walked)));
    let none: [&str; 0] = [];
    assert_eq!(judge(walked([1.0, 0.9], [0.0, 5.0])), none);
    assert_eq!(judge(walked([1.0, 0.5], [0.0, 5.0])), ["speed not as asked"]);
    assert_eq!(judge(walked([1.0, 2.0], [0.0, 5.0])), ["speed not as asked"]);
    assert_eq!(judge(walked([1.0, f64::NAN], [0.0, 5.0])), ["speed not as asked"]);
    assert_eq!(judge(walked([1.0, 0.9], [300.0, 115.0])), ["turn not as asked"]);
    assert_eq!(judge(walked([1.0, 0.9], [300.0, 250.0])), none);
    assert_eq!(judge(walked([1.0, 0.9], [0.0, -45.0])), ["turn not as asked"]);
    // Forward and back, half the ordered distance each time: the net distance says nothing.
    let to_and_fro =
        WalkTotals { forward_m: Followed { asked: 4.0, reached: 2.0 }, ..walked([0.0, 0.0], [0.0, 0.0]) };
    assert_eq!(judge(to_and_fro), ["speed not as asked"]);
    let mut aside = walked([1.0, 0.9], [0.0, 0.0]);
    aside.reached.side_m = -1.0;
    assert_eq!(judge(aside), ["it drifted sideways"]);
    // Starting and stopping do not count as walking.
    assert_eq!(judge(WalkTotals { time_s: 1.0, ..walked([1.0, 0.0], [0.0, 0.0]) }), none);
}

#[test]
fn each_margin_makes_a_run_poor_by_itself() {
    let (robot, report) = (in_physics("horse.toml"), good());
    let poor = |what: &str, change: &dyn Fn(&mut Report)| {
        let mut changed = report.clone();
        change(&mut changed);
        let judged = changed.judged(&robot, Some(walked([1.0, 0.9], [0.0, 0.0])));
        assert_eq!((judged.verdict, found(&judged)), (Verdict::Poor, vec![what]), "{:?}", judged.findings);
    };
    poor("the trunk leant", &|report| report.body.as_mut().unwrap().pitch_max_deg = 50.0);
    poor("safety changed goals", &|report| report.safety_interventions = report.cycles * 2);
    poor("safety held the robot", &|report| report.held_cycles = 30);
    poor("cycles began late", &|report| report.late_cycles = report.cycles / 10);
    poor("replies were lost", &|report| {
        let bus: &mut BusReport = &mut report.buses[0];
        bus.missing = bus.exchanges;
    });
    // Sixteen servos lose two whole exchanges of thousands.
    let mut hardly = report.clone();
    hardly.buses[0].missing = 32;
    assert_eq!(hardly.judged(&robot, None).verdict, Verdict::Good);
    poor("a joint was left without torque", &|report| {
        let outage =
            OutageReport { time_s: 1.0, joint: "left_hind.hip".to_owned(), reason: "hot".to_owned() };
        report.outages.push(outage);
    });
    poor("the recording is not complete", &|report| {
        let file = "walk.mcap".to_owned();
        report.recording = Some(RecordingReport { file, records: 10, dropped: 1, error: None });
    });
}

#[test]
fn a_run_that_did_not_complete_is_never_good() {
    let robot = in_physics("horse.toml");
    for outcome in [Outcome::StoppedBySafety, Outcome::Fallen, Outcome::Failed] {
        let judged = Report { outcome, ..good() }.judged(&robot, None);
        assert_eq!((judged.verdict, found(&judged)), (Verdict::Failed, vec!["the run did not complete"]));
    }
    let mut fell = good();
    fell.body.as_mut().unwrap().fell = true;
    assert_eq!(found(&fell.judged(&robot, None)), ["it fell"]);
}
