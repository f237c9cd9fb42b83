//! Servos that restart during a run, by a glitch of their supply or by order: the settings that they lost are
//! written again before they get goals, and their torque rises from zero.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::cell::RefCell;

use common::{SharedPorts, servo, shipped};
use hippocamp::ik::Method;
use hippocamp::kinds::tentacle::TentacleCapability;
use hippocamp::model::servo_model::Register;
use hippocamp::model::{Protocol, Robot};
use hippocamp::motion::{Order, Stroke, StrokeCommand};
use hippocamp::plan::RunPlan;
use hippocamp::run::run;
use hippocamp::signals::Permission;
use hippocamp::signals::Status;
use hippocamp::simulation;
use hippocamp::telemetry::{Outcome, Report};
use hw_sim::{FaultScript, World};

/// Registers of one servo at the beginning of a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    time_s: f64,
    has_torque: bool,
    /// Torque limit, share of the most.
    limit: f64,
    /// The first of its registers with changed start values.
    setting: i64,
    permission: Permission,
}

/// The value of a register.
fn read(world: &World, bus: usize, id: u8, register: Register) -> i64 {
    let bytes = (0..register.bytes)
        .map(|place| world.register(bus, id, register.address + u16::from(place)).unwrap_or_default());
    bytes.rev().fold(0, |value, byte| value << 8 | i64::from(byte))
}

/// A slow ramp of the servo's own: Profile Velocity and Profile Acceleration; acceleration.
fn slow(robot: &Robot) -> &'static [(u16, i64)] {
    match servo(&robot.joints[2]).model.protocol {
        Protocol::Dynamixel => &[(112, 20), (108, 5)],
        Protocol::Feetech => &[(41, 1)],
    }
}

/// A walk of arms with `faults`, parked from 20 to 32 s, in which the servo of the arms' joint number 2 starts with these
/// registers; and its registers in every cycle.
fn watched(robot: &Robot, faults: &str, starts_with: &[(u16, i64)]) -> (Report, Vec<Seen>) {
    let tentacle = robot.motion.tentacle().unwrap();
    let motion = TentacleCapability::of(robot, tentacle).plan(robot, tentacle, StrokeCommand::default());
    let plan =
        RunPlan { motion: motion.into(), method: Method::CcdThenFinish, move_for_s: 1e9, driver: None };
    let servo = *servo(&robot.joints[2]);
    let place = robot.joints[..2].iter().filter(|joint| joint.servo.unwrap().bus == servo.bus).count();
    let mut world = simulation::world(robot, 1, &FaultScript::from_toml(faults).unwrap()).unwrap();
    for (address, value) in starts_with {
        world.starts_with(servo.bus, place, *address, *value);
    }
    let setting = servo.model.registers.preparation.iter().find(|(to, _)| to.address == starts_with[0].0);
    let ports = SharedPorts::new(world);
    let eye = ports.clone();
    let seen = RefCell::new(Vec::new());
    let report = run(robot, plan, ports, |status: &Status| {
        let ports = eye.borrow();
        let (world, id) = (ports.world(), servo.id.0);
        let limit = read(world, servo.bus, id, servo.model.registers.torque_limit);
        seen.borrow_mut().push(Seen {
            time_s: status.time_s,
            has_torque: world.shaft(servo.bus, id).unwrap().torque_on,
            limit: limit as f64 / f64::from(servo.model.torque_limit_full),
            setting: setting.map_or(0, |(register, _)| read(world, servo.bus, id, *register)),
            permission: status.permission,
        });
        let stroke = match status.time_s {
            ..20.0 => Stroke::of("walk"),
            20.0..32.0 => Stroke::PARK,
            _ => return Order::Stop,
        };
        Order::Perform(StrokeCommand::of(stroke))
    });
    (report.unwrap(), seen.into_inner())
}

/// From the first moment after `since_s` without torque: the torque rises from zero as at the start, and the servo
/// never has torque with its power-on settings.
fn assert_wakes_gently(robot: &Robot, seen: &[Seen], since_s: f64) {
    let limp =
        seen.iter().position(|seen| seen.time_s > since_s && !seen.has_torque).expect("it lost its torque");
    let woke = limp + seen[limp..].iter().position(|seen| seen.has_torque).expect("it got torque again");
    let began_s = seen[woke].time_s;
    for seen in &seen[woke..] {
        assert_eq!(seen.setting, 0, "{seen:?}: a ramp of its own");
        let share = (seen.time_s - began_s + 2.0 * robot.period_s()) / robot.safety.torque_ramp_s;
        assert!(!seen.has_torque || seen.limit <= share, "{seen:?}: {share} at most");
    }
    assert!(seen[limp..].iter().any(|seen| seen.limit > 0.99), "and comes to all of it");
    assert!(seen[limp..].iter().any(|seen| seen.setting != 0), "it did start otherwise");
}

const GLITCH: &str = "[[fault]]\nkind = 'reset'\nat_s = 12.0\nbus = 'BUS'\nid = 3\n";

fn of(robot: &Robot, faults: &str) -> String {
    faults.replace("BUS", &robot.buses[0].name)
}

/// Twelve geared hinges keep their angles: only its torque register shows that it restarted.
#[test]
fn a_servo_that_lost_its_supply_for_a_moment_is_set_up_again_and_its_torque_rises_again() {
    for file in ["tentacle.toml", "octopus.toml"] {
        let robot = shipped(file);
        let (report, seen) = watched(&robot, &of(&robot, GLITCH), slow(&robot));
        assert_eq!(report.outcome, Outcome::Completed, "{file}: {}", report.reason);
        assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0), "{file}");
        // The time of the faults began as the servos were looked for, a little before the run.
        assert_wakes_gently(&robot, &seen, 11.5);
        let held = |seen: &&Seen| seen.time_s > 11.5 && seen.permission == Permission::Hold;
        let stray = seen.iter().filter(held).find(|seen| !(11.5..20.0).contains(&seen.time_s));
        assert_eq!(stray, None, "{file}: held for nothing");
        assert!(seen.iter().any(|seen| held(&seen)), "{file}: nobody moves on meanwhile");
    }
}

#[test]
fn a_servo_that_was_restarted_is_set_up_again() {
    let overload = "[[fault]]\nkind = 'overload'\nat_s = 12.0\nfor_s = 2.0\nbus = 'BUS'\nid = 3\n";
    let robot = shipped("tentacle.toml");
    let (report, seen) = watched(&robot, &of(&robot, overload), slow(&robot));
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!(report.servo_restarts, 1);
    assert_wakes_gently(&robot, &seen, 19.0);
}

/// Hardware Error Status (70) reports electrical shock: no restart clears that, and none is tried though the arms
/// are parked.
#[test]
fn a_servo_with_another_alarm_than_overload_stays_frozen_and_is_named() {
    let robot = shipped("tentacle.toml");
    let (report, seen) = watched(&robot, &of(&robot, GLITCH), &[(70, 0x10)]);
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!(report.servo_restarts, 0);
    let [outage] = &report.outages[..] else { panic!("{:?}", report.outages) };
    assert_eq!(outage.joint, "arm.lift_2");
    for words in ["servo 3 on bus root", "electrical shock", "stays without torque"] {
        assert!(outage.reason.contains(words), "{}", outage.reason);
    }
    assert!((12.0..14.0).contains(&outage.time_s), "{outage:?}");
    assert!(seen.iter().filter(|seen| seen.time_s > 14.0).all(|seen| !seen.has_torque));
}

/// Its replies are lost, but it receives everything.
#[test]
fn a_servo_that_was_only_silent_keeps_its_torque() {
    let damaged = "[[fault]]\nkind = 'garbled'\nat_s = 12.0\nfor_s = 0.6\nbus = 'BUS'\nid = 3\n";
    for file in ["tentacle.toml", "octopus.toml"] {
        let robot = shipped(file);
        let (report, seen) = watched(&robot, &of(&robot, damaged), slow(&robot));
        assert_eq!(report.outcome, Outcome::Completed, "{file}: {}", report.reason);
        assert!(
            seen.iter().any(|seen| seen.time_s > 11.5 && seen.permission == Permission::Hold),
            "{file}: it was missed"
        );
        let walks = seen.iter().filter(|seen| (11.0..32.0).contains(&seen.time_s));
        let weakest = walks.map(|seen| if seen.has_torque { seen.limit } else { 0.0 }).fold(1.0, f64::min);
        assert!(weakest > 0.99, "{file}: down to {weakest}");
    }
}
