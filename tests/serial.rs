//! Both robots over serial lines: pseudo-terminals with simulated servos, in real time.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;
use std::time::Duration;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use hippocamp::bus::serial::{Device, OpenCause};
use hippocamp::bus::{PortError, Ports, SerialPorts, StartError};
use hippocamp::config;
use hippocamp::ik::Method;
use hippocamp::kinds::horse::HorseCapability;
use hippocamp::model::Robot;
use hippocamp::motion::{Activity, Command, Order};
use hippocamp::plan::RunPlan;
use hippocamp::platform::{monotonic, request_real_time, thread_time};
use hippocamp::run::run;
use hippocamp::signals::Permission;
use hippocamp::signals::Status;
use hippocamp::simulation;
use hippocamp::telemetry::{Outcome, Report};
use hippocamp::units::Time;
use hw_sim::FaultScript;
use hw_sim::pty::PtyServer;
use tempfile::TempDir;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

/// A robot, how it is to walk, and its servos behind pseudo-terminals.
struct Rig {
    robot: Robot,
    plan: RunPlan,
    devices: Vec<Device>,
    server: PtyServer,
    /// Holds the links to the terminals.
    _folder: TempDir,
}

fn rig(file: &str) -> Rig {
    let mut robot = config::load(&Path::new("config").join(file)).unwrap().robot;
    // As fast as permitted: the tests wait for all of it.
    robot.safety.slow_rate_rad_s *= 3.0;
    robot.safety.torque_ramp_s = 0.2;
    let horse = robot.motion.horse().unwrap();
    let capability = HorseCapability::of(&robot, horse).unwrap();
    let horse = capability.plan(horse, Command::ahead(0, 0.05));
    let plan = RunPlan { motion: horse.into(), method: Method::CcdThenFinish, move_for_s: 1.0, driver: None };
    let folder = tempfile::tempdir().unwrap();
    // The terminal takes the adapter's place, so that the latency the robot file allows for is the terminal's.
    let mut without_adapters = Robot { physics: None, ..robot.clone() };
    for bus in &mut without_adapters.buses {
        bus.adapter_latency_us = 0;
    }
    let world = simulation::world(&without_adapters, 1, &FaultScript::default()).unwrap();
    // Servos of a real line do not wait for a processor.
    let server = PtyServer::start_prepared(world, folder.path(), || drop(request_real_time(None))).unwrap();
    let devices =
        robot.buses.iter().zip(server.paths()).map(|(bus, path)| Device::of(bus, path.clone())).collect();
    Rig { robot, plan, devices, server, _folder: folder }
}

impl Rig {
    fn run(&self, order: impl FnMut(&Status) -> Order) -> Result<Report, StartError> {
        run(&self.robot, self.plan.clone(), SerialPorts::open(&self.devices).unwrap(), order)
    }

    /// How many of all servos truly have torque.
    fn with_torque(&self) -> usize {
        let has_torque = |bus: usize, id: u8| {
            self.server.with_world(|world| world.shaft(bus, id).is_some_and(|shaft| shaft.torque_on))
        };
        let servos = self.robot.joints.iter().filter_map(|joint| joint.servo);
        servos.filter(|servo| has_torque(servo.bus, servo.id.0)).count()
    }
}

/// Walks and completes, on a machine that may be busy.
fn walks(file: &str) {
    let rig = rig(file);
    let mut most_with_torque = 0;
    let report = rig
        .run(|status| {
            if status.activity == Activity::Walking && most_with_torque == 0 {
                most_with_torque = rig.with_torque();
            }
            Order::Go
        })
        .unwrap();
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!((most_with_torque, rig.with_torque()), (rig.robot.joints.len(), 0));
    assert_eq!(report.joints.range_violations, 0);
    for (bus, report) in report.buses.iter().enumerate() {
        let servos = rig.robot.joints.iter().filter_map(|joint| joint.servo).filter(|servo| servo.bus == bus);
        let replies = report.exchanges * u64::try_from(servos.count()).unwrap();
        // None, if this machine did nothing else: a simulated servo that has to wait for a processor answers late.
        let lost = report.missing + report.corrupt;
        assert!(lost * 5 < replies, "{lost} of {replies} replies missing or damaged on bus {bus}");
    }
}

#[test]
fn the_feetech_horse_walks() {
    walks("horse.toml");
}

#[test]
fn the_dynamixel_horse_walks_on_four_lines() {
    walks("horse-dynamixel.toml");
}

#[test]
fn at_another_rate_no_servo_answers_and_the_start_says_so() {
    let mut rig = rig("horse.toml");
    rig.robot.buses[0].baud = 500_000;
    rig.devices[0].baud = 500_000;
    let error = rig.run(|_| Order::Go).unwrap_err();
    assert!(error.to_string().contains("500000 baud"), "{error}");
    let statistics = rig.server.with_world(|world| world.wire_statistics(0)).unwrap();
    assert_eq!(statistics.bytes_from_servos, 0);
}

#[test]
fn swapped_adapters_are_detected() {
    let mut rig = rig("horse-dynamixel.toml");
    let first = rig.devices[0].path.clone();
    rig.devices[0].path = std::mem::replace(&mut rig.devices[1].path, first);
    let error = rig.run(|_| Order::Go).unwrap_err();
    assert!(error.to_string().contains("left_hind"), "{error}");
    assert_eq!(rig.with_torque(), 0);
}

#[test]
fn a_port_gone_for_good_ends_the_run_safely_and_without_spinning() {
    let rig = rig("horse-dynamixel.toml");
    let ports = SerialPorts::open(&rig.devices).unwrap();
    let Rig { robot, plan, devices, server, _folder } = rig;
    let mut server = Some(server);
    let mut gone_at = None;
    let report = run(&robot, plan, ports, |status| {
        if status.activity == Activity::Walking && server.is_some() {
            server = None;
            gone_at = Some((monotonic(), thread_time()));
        }
        Order::Go
    })
    .unwrap();
    let (gone_at, used) = gone_at.unwrap();
    let (took, used) = (monotonic() - gone_at, thread_time() - used);
    assert_eq!(report.outcome, Outcome::StoppedBySafety, "{}", report.reason);
    assert!(report.reason.contains("heard"), "{}", report.reason);
    assert!(used < took / 2, "the loop computed for {used:?} of {took:?}");
    assert!(matches!(SerialPorts::open(&devices).unwrap_err().faults[3].cause, OpenCause::NotThere { .. }));
}

#[test]
fn an_adapter_unplugged_and_put_back_is_found_again() {
    // Unplugged for a moment while the robot rises: it holds, and continues when its servos answer again.
    let rig = rig("horse-dynamixel.toml");
    let right_fore = rig.robot.buses.iter().position(|bus| bus.name == "right_fore").unwrap();
    let (mut is_out, mut has_held) = (false, false);
    let report = rig
        .run(|status| {
            if status.activity == Activity::Rising && !is_out {
                is_out = true;
                rig.server.with_world(|world| world.unplug(right_fore, 300_000_000));
            }
            has_held |= status.permission == Permission::Hold;
            Order::Go
        })
        .unwrap();
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert!(has_held);
    assert_eq!(rig.with_torque(), 0, "the servos behind the adapter heard the end too");
}

#[test]
fn a_line_that_reappears_under_the_same_path_is_used_again() {
    let Rig { robot, devices, server, _folder: folder, .. } = rig("horse.toml");
    let mut ports = SerialPorts::open(&devices).unwrap();
    let deadline = ports.now() + Duration::from_secs(60);
    assert_no_alloc(|| assert_answers_a_ping(&mut ports, deadline));

    drop(server);
    assert_no_alloc(|| {
        ports.wait_for_input(deadline);
        assert_eq!(ports.discard_input(0), Err(PortError::Gone { bus: 0 }));
    });

    let world = simulation::world(&robot, 1, &FaultScript::default()).unwrap();
    let _server = PtyServer::start(world, folder.path()).unwrap();
    assert_no_alloc(|| {
        while ports.discard_input(0).is_err() {
            assert!(ports.now() < deadline, "the line does not come back");
            let soon = ports.now() + Duration::from_millis(20);
            ports.wait_for_input(soon);
        }
        assert_answers_a_ping(&mut ports, deadline);
    });
}

/// A ping of servo 1, and its answer (Feetech wiki, protocol ft-scs).
fn assert_answers_a_ping(ports: &mut SerialPorts, deadline: Time) {
    ports.send(0, &[0xFF, 0xFF, 0x01, 0x02, 0x01, 0xFB]).unwrap();
    let mut answer = [0; 6];
    let mut count = 0;
    while count < answer.len() && ports.now() < deadline {
        ports.wait_for_input(deadline);
        count += ports.receive(0, &mut answer[count..]).unwrap();
    }
    assert_eq!(answer, [0xFF, 0xFF, 0x01, 0x02, 0x00, 0xFC]);
}
