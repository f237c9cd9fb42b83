//! Observers of a run: each gets every cycle, may stop the run, and gets the end.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{plan, shipped};
use hippocamp::bus::SimPorts;
use hippocamp::ik::Method;
use hippocamp::motion::{Activity, Order};
use hippocamp::observe::{CycleRecord, End, Observer, Outcome};
use hippocamp::plan::RunPlan;
use hippocamp::run::run_observed;
use hippocamp::signals::Status;
use hippocamp::simulation;
use hippocamp::telemetry::Report;

/// Observes, and objects after so many cycles.
struct Onlooker {
    enough: u64,
    cycles: u64,
    /// Activity of the last cycle.
    activity: Activity,
    ends: Vec<(Outcome, u64, bool)>,
}

impl Onlooker {
    fn new(enough: u64) -> Onlooker {
        Onlooker { enough, cycles: 0, activity: Activity::Limp, ends: Vec::new() }
    }
}

impl Observer for Onlooker {
    fn observe(&mut self, cycle: &CycleRecord<'_>) {
        assert!(self.ends.is_empty(), "a cycle after the end");
        assert_eq!(cycle.facts.times.number, self.cycles);
        // The operator saw the cycle before.
        assert_eq!(cycle.status.activity, self.activity);
        (self.cycles, self.activity) = (self.cycles + 1, cycle.facts.activity);
    }

    fn objection(&self) -> Option<&'static str> {
        (self.cycles >= self.enough).then_some("a test has seen enough")
    }

    fn end(&mut self, end: &mut End, has_stopped_run: bool) {
        assert_eq!(self.activity, Activity::Done, "the robot has stopped");
        self.ends.push((end.outcome, end.cycles, has_stopped_run));
        end.reason += ", heard";
    }
}

/// A walk of a second, and the objections that its operator saw.
fn walk(observers: &mut [&mut dyn Observer]) -> (Report, Vec<&'static str>) {
    let robot = shipped("horse.toml");
    let motion = plan(&robot, "walk", 0.9).into();
    let plan = RunPlan { motion, method: Method::CcdThenFinish, move_for_s: 1.0, driver: None };
    let world = simulation::world(&robot, 1, &hw_sim::FaultScript::default()).unwrap();
    let mut seen = Vec::new();
    let operator = |status: &Status| {
        seen.extend(status.objection);
        Order::Go
    };
    let report = run_observed(&robot, &plan, SimPorts::on_virtual_clock(world), observers, operator).unwrap();
    seen.dedup();
    (report, seen)
}

#[test]
fn every_observer_gets_every_cycle_and_the_end() {
    let (mut first, mut second) = (Onlooker::new(u64::MAX), Onlooker::new(u64::MAX));
    let (report, seen) = walk(&mut [&mut first, &mut second]);
    assert_eq!(
        (report.outcome, report.reason.as_str()),
        (Outcome::Completed, "walked for the time asked, heard, heard")
    );
    assert!(seen.is_empty());
    for onlooker in [first, second] {
        assert_eq!(onlooker.cycles, report.cycles);
        assert_eq!(onlooker.ends, [(Outcome::Completed, report.cycles, false)]);
    }
}

#[test]
fn an_observer_that_objects_stops_the_robot_as_an_operator_would() {
    let (mut first, mut second) = (Onlooker::new(u64::MAX), Onlooker::new(600));
    let (report, seen) = walk(&mut [&mut first, &mut second]);
    assert_eq!(report.outcome, Outcome::Failed);
    assert_eq!(report.reason, "stopped because a test has seen enough, heard, heard");
    assert_eq!(seen, ["a test has seen enough"]);
    assert!(report.is_end_heard && report.cycles > 600, "{} cycles", report.cycles);
    assert_eq!(first.ends, [(Outcome::Failed, report.cycles, false)]);
    assert_eq!(second.ends, [(Outcome::Failed, report.cycles, true)]);
}
