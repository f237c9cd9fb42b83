//! The smallest servos in physics, and rotors from none to huge: the simulated body stays stable, or says that it is not.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{Scenario, in_physics, plan};
use hippocamp::bus::{PortError, Ports, SimPorts};
use hippocamp::config;
use hippocamp::ik::Method;
use hippocamp::model::Robot;
use hippocamp::motion::Order;
use hippocamp::plan::RunPlan;
use hippocamp::run::run;
use hippocamp::signals::TrueBody;
use hippocamp::simulation;
use hippocamp::telemetry::{Outcome, Report};
use hippocamp::units::Time;
use hw_sim::FaultScript;

/// A cat on eight SCS0009: 1024 counts in 300 degrees, and a rotor of 1e-4 kg m^2.
fn cat() -> Robot {
    config::parse(include_str!("robots/small-cat.toml"), "cat").unwrap().robot
}

fn walk(robot: &Robot, for_s: f64, faults: &str) -> Report {
    Scenario { faults, ..Scenario::new(robot, "walk", for_s) }.run()
}

/// Its joints used to lie 60 degrees beyond their stops at the start, since the body took its encoders for those of larger
/// servos; the stops then threw it to 4e17 m.
#[test]
fn a_cat_on_the_smallest_servos_stands_and_walks() {
    let report = walk(&cat(), 1.0, "");
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    let body = report.body.unwrap();
    assert!(!body.fell && body.roll_max_deg < 15.0 && body.pitch_max_deg < 15.0, "{body:?}");
}

#[test]
fn a_rotor_of_any_inertia_keeps_the_body_stable() {
    for rotor_kg_m2 in [1e-9, 1e-5, 1.0] {
        for mut robot in [cat(), in_physics("horse.toml")] {
            robot.physics.as_mut().unwrap().rotor_inertia_kg_m2 = Some(rotor_kg_m2);
            let report = walk(&robot, 0.1, "");
            // Huge rotors are too much for small servos, but the body remains where it was.
            assert!(report.outcome != Outcome::Failed, "{rotor_kg_m2}: {}", report.reason);
            let body = report.body.unwrap();
            assert!(body.distance_m.abs() < 0.5, "{rotor_kg_m2}: {body:?}");
        }
    }
}

/// A servo of a robot file is as `setup` leaves it: Feetech's phase (18) counts one turn only. A new one has 28 there.
#[test]
fn the_servos_of_a_robot_have_been_set_up() {
    let robot = in_physics("horse.toml");
    let mut world = simulation::world(&robot, 1, &FaultScript::default()).unwrap();
    assert!((1..=16).all(|id| world.register(0, id, 18) == Some(12)));
    world.make_new(0, 0);
    assert_eq!(world.register(0, 1, 18), Some(28), "a new servo has id 1");
}

/// Simulated ports whose body is unstable from a time on.
struct Unstable(SimPorts, Time);

impl Ports for Unstable {
    fn now(&mut self) -> Time {
        self.0.now()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.0.discard_input(bus)
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.0.send(bus, bytes)
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.0.receive(bus, into)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.0.wait_for_input(deadline);
    }

    fn wait_until(&mut self, deadline: Time) {
        self.0.wait_until(deadline);
    }

    fn true_body(&self) -> Option<TrueBody> {
        let is_unstable = self.0.world().now_ns() >= self.1.0;
        self.0.true_body().map(|body| TrueBody { is_unstable, ..body })
    }
}

#[test]
fn a_body_whose_numbers_run_away_ends_the_run_as_a_fault_of_the_simulation() {
    let robot = in_physics("horse.toml");
    let world = simulation::world(&robot, 1, &FaultScript::default()).unwrap();
    let ports = Unstable(SimPorts::on_virtual_clock(world), Time(3_000_000_000));
    let motion = plan(&robot, "walk", 0.9).into();
    let plan = RunPlan { motion, method: Method::CcdThenFinish, move_for_s: 1.0, driver: None };
    let report = run(&robot, plan, ports, |_| Order::Go).unwrap();
    assert_eq!(report.outcome, Outcome::Failed);
    assert!(report.reason.contains("a fault of the simulation, not of the robot"), "{}", report.reason);
    assert!((2.8..3.1).contains(&report.duration_s), "{}", report.duration_s);
}
