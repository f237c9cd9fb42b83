//! If the loop dies, Dynamixel servos stop by themselves; if it only stalls, they continue.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

use std::time::Duration;

use hippocamp::bus::{Buses, Ports, SimPorts, watchdog_time};
use hippocamp::config;
use hippocamp::ik::Method;
use hippocamp::kinds::horse::HorseCapability;
use hippocamp::model::{Joint, Robot};
use hippocamp::motion::{Activity, Command, Order};
use hippocamp::run::Cycle;
use hippocamp::signals::Permission;
use hippocamp::simulation;
use hw_sim::{FaultScript, Shaft};

/// Register 98 of the X-series, Bus Watchdog.
const WATCHDOG: u16 = 98;
const TRIPPED: u8 = 0xFF;
const MS: Duration = Duration::from_millis(1);

fn horse() -> Robot {
    let robot = config::parse(include_str!("../config/horse-dynamixel.toml"), "horse").unwrap().robot;
    robot.without_body()
}

fn prepared(robot: &Robot, faults: &str) -> Buses<SimPorts> {
    let pose: Vec<f64> = robot.joints.iter().map(Joint::middle_rad).collect();
    let faults = FaultScript::from_toml(faults).unwrap();
    let world = simulation::world_from_pose(robot, &pose, 1, &faults).unwrap();
    let mut buses = Buses::new(robot, SimPorts::on_virtual_clock(world));
    buses.prepare(robot).unwrap();
    buses.arm_watchdogs(robot).unwrap();
    buses
}

fn trotting<'r>(robot: &'r Robot, faults: &str) -> Cycle<'r, SimPorts> {
    let horse = robot.motion.horse().unwrap();
    let capability = HorseCapability::of(robot, horse).unwrap();
    let trot = horse.gaits.iter().position(|gait| gait.name == "trot").unwrap();
    let plan = capability.plan(horse, Command::ahead(trot, 0.2));
    Cycle::new(robot, plan, Method::CcdThenFinish, 60.0, prepared(robot, faults))
}

/// Repeats the cycle at its rate for `time_s`.
fn run(robot: &Robot, cycle: &mut Cycle<'_, SimPorts>, time_s: f64) {
    let period = Duration::from_secs_f64(robot.period_s());
    let end = cycle.now() + Duration::from_secs_f64(time_s);
    loop {
        let deadline = cycle.now();
        if deadline >= end {
            return;
        }
        cycle.step(Order::Go);
        cycle.buses_mut().ports_mut().wait_until(deadline + period);
    }
}

fn wait(cycle: &mut Cycle<'_, SimPorts>, time: Duration) {
    let deadline = cycle.now() + time;
    cycle.begin(deadline);
}

fn watchdogs(robot: &Robot, ports: &SimPorts) -> Vec<u8> {
    let servos = robot.joints.iter().map(|joint| joint.servo.unwrap());
    servos.map(|servo| ports.world().register(servo.bus, servo.id.0, WATCHDOG).unwrap()).collect()
}

fn shafts(robot: &Robot, ports: &SimPorts) -> Vec<Shaft> {
    let servos = robot.joints.iter().map(|joint| joint.servo.unwrap());
    servos.map(|servo| ports.world().shaft(servo.bus, servo.id.0).unwrap()).collect()
}

/// A joint in its swing lags by about 7 degrees; a stopped joint lags by its whole swing.
fn off_goal_deg(cycle: &Cycle<'_, SimPorts>) -> f64 {
    let state = cycle.record().state;
    let errors =
        state.joints.iter().zip(&state.goal_rad).map(|(joint, goal)| (joint.position_rad - goal).abs());
    errors.fold(0.0, f64::max).to_degrees()
}

#[test]
fn the_time_is_ten_cycles_and_at_least_200_ms() {
    let mut robot = horse();
    for (rate_hz, ms) in [(500.0, 200), (50.0, 200), (49.0, 220), (20.0, 500), (4.0, 2500), (1.0, 2540)] {
        robot.rate_hz = rate_hz;
        assert_eq!(watchdog_time(&robot), ms * MS, "{rate_hz} Hz");
    }
}

#[test]
fn when_the_loop_dies_every_servo_stops_within_the_time() {
    let robot = horse();
    let mut cycle = trotting(&robot, "");
    run(&robot, &mut cycle, 8.0);
    assert_eq!(cycle.record().facts.activity, Activity::Walking);
    assert_eq!(watchdogs(&robot, cycle.buses_mut().ports_mut()), [10; 16]);
    // No more cycles: the program has died, and the servos still run. 1 ms is the step of the simulated clock.
    wait(&mut cycle, watchdog_time(&robot) + MS);
    let ports = cycle.buses_mut().ports_mut();
    assert_eq!(watchdogs(&robot, ports), [TRIPPED; 16]);
    let at_the_trip = shafts(&robot, ports);
    wait(&mut cycle, 1000 * MS);
    for (before, after) in at_the_trip.iter().zip(shafts(&robot, cycle.buses_mut().ports_mut())) {
        assert!(after.speed_rad_s.abs() < 1e-9, "{after:?}");
        assert!((after.position_counts - before.position_counts).abs() < 20.0, "{before:?} {after:?}");
    }
}

#[test]
fn a_robot_walks_on_after_a_stall_of_the_loop() {
    let robot = horse();
    let mut cycle = trotting(&robot, "");
    run(&robot, &mut cycle, 8.0);
    wait(&mut cycle, 500 * MS);
    assert_eq!(watchdogs(&robot, cycle.buses_mut().ports_mut()), [TRIPPED; 16]);
    run(&robot, &mut cycle, 3.0);
    assert_eq!(watchdogs(&robot, cycle.buses_mut().ports_mut()), [10; 16]);
    assert_eq!(cycle.record().facts.activity, Activity::Walking);
    assert_eq!(cycle.record().state.permission, Permission::Move);
    assert!(off_goal_deg(&cycle) < 10.0, "{}", off_goal_deg(&cycle));
}

#[test]
fn a_servo_or_adapter_that_was_away_for_a_while_works_again() {
    let out = "[[fault]]\nat_s = 6\nfor_s = 1\nkind = 'silent'\nbus = 'left_hind'\nid = 2\n\
               [[fault]]\nat_s = 8.5\nfor_s = 1\nkind = 'unplugged'\nbus = 'right_fore'\n";
    let robot = horse();
    let mut cycle = trotting(&robot, out);
    run(&robot, &mut cycle, 6.5);
    let world = cycle.buses_mut().ports_mut().world();
    assert_eq!(world.register(0, 2, WATCHDOG), Some(TRIPPED), "it has heard nothing for half a second");
    run(&robot, &mut cycle, 2.5);
    let world = cycle.buses_mut().ports_mut().world();
    assert_eq!(world.register(0, 2, WATCHDOG), Some(10));
    assert_eq!(world.register(3, 13, WATCHDOG), Some(TRIPPED));
    run(&robot, &mut cycle, 3.0);
    assert_eq!(watchdogs(&robot, cycle.buses_mut().ports_mut()), [10; 16]);
    assert_eq!(cycle.record().facts.activity, Activity::Walking);
    assert!(off_goal_deg(&cycle) < 10.0, "{}", off_goal_deg(&cycle));
}

#[test]
fn a_new_start_clears_a_watchdog_that_has_tripped_and_an_end_disarms_it() {
    let robot = horse();
    let mut cycle = trotting(&robot, "");
    run(&robot, &mut cycle, 3.0);
    wait(&mut cycle, 300 * MS);
    let buses = cycle.buses_mut();
    assert_eq!(watchdogs(&robot, buses.ports_mut()), [TRIPPED; 16]);
    buses.prepare(&robot).unwrap();
    assert_eq!(watchdogs(&robot, buses.ports_mut()), [0; 16]);
    assert!(shafts(&robot, buses.ports_mut()).iter().all(|shaft| !shaft.torque_on));
    buses.arm_watchdogs(&robot).unwrap();
    assert_eq!(watchdogs(&robot, buses.ports_mut()), [10; 16]);
    buses.disarm_watchdogs();
    assert_eq!(watchdogs(&robot, buses.ports_mut()), [0; 16]);
}

/// An end that holds: torque stays on, and no program talks to the servos any more.
#[test]
fn watchdogs_do_not_release_a_robot_that_holds_its_pose_at_the_end() {
    let robot = horse();
    let mut cycle = trotting(&robot, "");
    run(&robot, &mut cycle, 5.0);
    cycle.buses_mut().disarm_watchdogs();
    wait(&mut cycle, 3000 * MS);
    assert_eq!(watchdogs(&robot, cycle.buses_mut().ports_mut()), [0; 16]);
    assert!(shafts(&robot, cycle.buses_mut().ports_mut()).iter().all(|shaft| shaft.torque_on));
}

#[test]
fn feetech_servos_have_no_watchdog_and_get_no_write_for_it() {
    let robot = config::parse(include_str!("../config/horse.toml"), "horse").unwrap().robot;
    let robot = robot.without_body();
    let mut buses = prepared(&robot, "");
    let sent = |buses: &mut Buses<SimPorts>| buses.ports_mut().world().wire_statistics(0).unwrap();
    let before = sent(&mut buses);
    buses.arm_watchdogs(&robot).unwrap();
    buses.disarm_watchdogs();
    let after = sent(&mut buses);
    assert_eq!(format!("{before:?}"), format!("{after:?}"));
}
