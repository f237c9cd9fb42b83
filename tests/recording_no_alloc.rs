//! Handing a cycle to the recorder allocates nothing: any allocation aborts this test.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use hippocamp::bus::{Buses, SimPorts};
use hippocamp::ik::Method;
use hippocamp::kinds::{self, MotionOptions};
use hippocamp::motion::Order;
use hippocamp::observe::Observer;
use hippocamp::plan::RunPlan;
use hippocamp::recording::{Recorder, RunHeader};
use hippocamp::run::Cycle;
use hippocamp::{config, simulation};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn recording_a_cycle_allocates_nothing_whether_it_is_taken_or_dropped() {
    for (file, stroke) in [("horse.toml", None), ("tentacle.toml", Some("swim")), ("figure.toml", None)] {
        let path = Path::new("config").join(file);
        let robot = config::load(&path).unwrap().robot.without_body();
        let asked = MotionOptions { stroke, ..MotionOptions::default() };
        let (motion, _) = kinds::of(&robot).unwrap().plan(&robot, &asked).unwrap();
        let plan = RunPlan { motion, method: Method::CcdThenFinish, move_for_s: 1.0, driver: None };
        let header = RunHeader::new(&robot, &plan, file, 0);
        let text = std::fs::read_to_string(&path).unwrap();
        let mut recorder =
            Recorder::start(&robot, header, text, "sink".to_owned(), std::io::sink(), false).unwrap();
        let world = simulation::world(&robot, 1, &hw_sim::FaultScript::default()).unwrap();
        let buses = Buses::new(&robot, SimPorts::on_virtual_clock(world));
        let mut cycle = Cycle::new(&robot, plan.motion, plan.method, plan.move_for_s, buses);
        // Long enough to stand up and move, and faster than a thread can write.
        for _ in 0..1500 {
            cycle.step(Order::Go);
            assert_no_alloc(|| recorder.observe(&cycle.record()));
        }
        let report = recorder.finish(Default::default());
        assert_eq!(report.records + report.dropped, 1500, "{file}");
    }
}
