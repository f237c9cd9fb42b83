//! Shared parts of the tests of whole runs: the shipped robots, runs on simulated buses, and a watch on every
//! cycle.
#![allow(dead_code, reason = "each test binary uses a part of it")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

pub(crate) mod arm;
pub(crate) mod bare;
pub(crate) mod built;
pub(crate) mod frames;
pub(crate) mod reference;

mod spy;

use std::cell::{Ref, RefCell};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use hippocamp::bus::{PortError, Ports, SimPorts};
use hippocamp::ik::Method;
use hippocamp::kinds::horse::HorseCapability;
use hippocamp::model::servo_model::Register;
use hippocamp::model::{HorseMotion, Joint, Robot, Servo};
use hippocamp::motion::horse::HorsePlan;
use hippocamp::motion::{Activity, Command, Order};
use hippocamp::plan::RunPlan;
use hippocamp::run::run;
use hippocamp::signals::{Permission, TrueBody};
use hippocamp::telemetry::Report;
use hippocamp::units::Time;
use hippocamp::{config, simulation};
use hw_sim::{FaultScript, World};
#[allow(unused_imports, reason = "each test binary uses a part of it")]
pub(crate) use spy::Spy;

/// File names of the robots that can run.
pub(crate) const ROBOTS: [&str; 2] = ["horse.toml", "horse-dynamixel.toml"];
/// No run in these tests should take longer than this, s.
const LONGEST_RUN_S: f64 = 120.0;

/// True if `HIPPOCAMP_FULL` is set: tests then run their long form. Otherwise a test does the least that shows each
/// kind of fault.
pub(crate) fn is_full() -> bool {
    std::env::var_os("HIPPOCAMP_FULL").is_some()
}

/// A file in the folder `config`.
pub(crate) fn config_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config").join(name)
}

/// A shipped robot with its simulated joints turning freely.
pub(crate) fn shipped(name: &str) -> Robot {
    in_physics(name).without_body()
}

/// A shipped robot with its body on the ground.
pub(crate) fn in_physics(name: &str) -> Robot {
    config::load(&config_file(name)).unwrap_or_else(|error| panic!("{error}")).robot
}

/// The robot's motion.
pub(crate) fn horse_of(robot: &Robot) -> HorseMotion {
    let horse = robot.motion.horse().unwrap();
    horse.clone()
}

/// The capability of the horse `robot`.
pub(crate) fn capability(robot: &Robot) -> HorseCapability {
    HorseCapability::of(robot, &horse_of(robot)).unwrap_or_else(|error| panic!("{error}"))
}

/// A plan to walk `gait` at `share` of its top speed.
pub(crate) fn plan(robot: &Robot, gait: &str, share: f64) -> HorsePlan {
    let horse = horse_of(robot);
    let plan = capability(robot).plan(&horse, Command::default());
    let choice = plan.gait_choice(gait).unwrap_or_else(|| panic!("{gait}"));
    plan.at_share(choice, share)
}

/// The servo of a joint.
pub(crate) fn servo(joint: &Joint) -> &Servo {
    joint.servo.as_ref().unwrap_or_else(|| panic!("{} has no servo", joint.name))
}

/// Largest goal speed of a joint, counts/s.
pub(crate) fn rate_counts_s(robot: &Robot, joint: &Joint) -> f64 {
    robot.safety.rate_share * joint.no_load_speed_rad_s() / servo(joint).count_rad()
}

/// Lowest and highest goal count of a joint.
pub(crate) fn goal_counts(joint: &Joint) -> (f64, f64) {
    let (a, b) = joint.goal_range_rad();
    let (a, b) = (servo(joint).count_of(a), servo(joint).count_of(b));
    (a.min(b), a.max(b))
}

/// One run on simulated buses and a virtual clock.
pub(crate) struct Scenario<'r> {
    pub(crate) robot: &'r Robot,
    pub(crate) plan: HorsePlan,
    pub(crate) walk_for_s: f64,
    /// Start angles of the limp joints, rad; random by the seed if not given.
    pub(crate) pose: Option<Vec<f64>>,
    pub(crate) seed: u64,
    /// Fault script.
    pub(crate) faults: &'r str,
    /// The operator's order at each time since power-up, s.
    pub(crate) order: &'r dyn Fn(f64) -> Order,
}

impl<'r> Scenario<'r> {
    /// A walk of `gait` at nine tenths of its top speed, from a random pose, without faults.
    pub(crate) fn new(robot: &'r Robot, gait: &str, walk_for_s: f64) -> Scenario<'r> {
        Scenario {
            robot,
            plan: plan(robot, gait, 0.9),
            walk_for_s,
            pose: None,
            seed: 1,
            faults: "",
            order: &|_| Order::Go,
        }
    }

    /// The same from the sitting pose, which it always leaves after the same time.
    pub(crate) fn from_sitting(robot: &'r Robot, gait: &str, walk_for_s: f64) -> Scenario<'r> {
        let mut scenario = Scenario::new(robot, gait, walk_for_s);
        scenario.pose = Some(scenario.plan.sit_pose_rad.clone());
        scenario
    }

    fn world(&self) -> World {
        let faults = FaultScript::from_toml(self.faults).unwrap_or_else(|error| panic!("{error}"));
        match &self.pose {
            Some(pose) => simulation::world_from_pose(self.robot, pose, self.seed, &faults),
            None => simulation::world(self.robot, self.seed, &faults),
        }
        .unwrap_or_else(|error| panic!("{error}"))
    }

    /// Runs it; `look` gets the world and the robot's activity at the beginning of every cycle, and ends the run by
    /// returning true.
    fn run_and_look(
        &self,
        mut look: impl FnMut(&World, Activity, Permission) -> bool,
    ) -> (Report, SharedPorts) {
        let ports = SharedPorts::new(self.world());
        let eye = ports.clone();
        let report = run(self.robot, self.run_plan(), ports.clone(), |status| {
            let ports = eye.borrow();
            let time_s = Time(ports.world().now_ns()).as_secs_f64();
            // A panic here ends the run as failed, which no test accepts.
            assert!(time_s < LONGEST_RUN_S, "this run does not end");
            let is_enough = look(ports.world(), status.activity, status.permission);
            if is_enough { Order::StopAtOnce } else { (self.order)(time_s) }
        })
        .unwrap_or_else(|error| panic!("{error}"));
        (report, ports)
    }

    /// Runs it.
    pub(crate) fn run(&self) -> Report {
        self.run_and_look(|_, _, _| false).0
    }

    /// Runs it and returns the reason why it could not start, and the ports.
    pub(crate) fn fail_to_start(&self) -> (String, SharedPorts) {
        let ports = SharedPorts::new(self.world());
        match run(self.robot, self.run_plan(), ports.clone(), |_| Order::Go) {
            Ok(report) => panic!("it started: {}", report.reason),
            Err(error) => (error.to_string(), ports),
        }
    }

    fn run_plan(&self) -> RunPlan {
        RunPlan {
            motion: self.plan.clone().into(),
            method: Method::CcdThenFinish,
            move_for_s: self.walk_for_s,
            driver: None,
        }
    }

    /// Runs it and records every cycle.
    pub(crate) fn watch(&self) -> Watched {
        self.watch_until(Activity::Done)
    }

    /// Runs it and records every cycle until its activity is `last`; ignores the rest.
    pub(crate) fn watch_until(&self, last: Activity) -> Watched {
        let mut moments = Vec::new();
        let mut is_over = false;
        let (report, ports) = self.run_and_look(|world, activity, permission| {
            is_over |= activity == last && last != Activity::Done;
            if !is_over {
                moments.push(Moment::of(self.robot, world, activity, permission));
            }
            is_over
        });
        if is_over {
            return Watched { report, moments };
        }
        let (activity, permission) = moments
            .last()
            .map_or((Activity::Limp, Permission::Move), |last| (last.activity, last.permission));
        moments.push(Moment::of(self.robot, ports.borrow().world(), activity, permission));
        Watched { report, moments }
    }
}

/// A run with the true state at the beginning of each of its cycles, and at its end.
pub(crate) struct Watched {
    pub(crate) report: Report,
    pub(crate) moments: Vec<Moment>,
}

/// One moment, from the simulated servos themselves.
pub(crate) struct Moment {
    /// Time since power-up, s.
    pub(crate) time_s: f64,
    pub(crate) activity: Activity,
    pub(crate) permission: Permission,
    /// One for each joint, in the robot's order.
    pub(crate) servos: Vec<Truth>,
}

/// The true state of one servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Truth {
    /// Goal position register, counts.
    pub(crate) goal: i32,
    /// Torque limit register.
    pub(crate) torque_limit: i32,
    pub(crate) torque_on: bool,
    /// Shaft position, counts.
    pub(crate) position: f64,
}

impl Moment {
    fn of(robot: &Robot, world: &World, activity: Activity, permission: Permission) -> Moment {
        let servos = robot.joints.iter().map(|joint| {
            let servo = servo(joint);
            let registers = servo.model.registers;
            let shaft = world.shaft(servo.bus, servo.id.0).unwrap_or_else(|| panic!("{}", joint.name));
            Truth {
                goal: register(world, servo, registers.goal_position),
                torque_limit: register(world, servo, registers.torque_limit),
                torque_on: shaft.torque_on,
                position: shaft.position_counts,
            }
        });
        let time_s = Time(world.now_ns()).as_secs_f64();
        Moment { time_s, activity, permission, servos: servos.collect() }
    }
}

/// A register as the servo holds it; no register read here is ever negative.
fn register(world: &World, servo: &Servo, register: Register) -> i32 {
    let byte = |place: u8| {
        let address = register.address + u16::from(place);
        world.register(servo.bus, servo.id.0, address).unwrap_or_else(|| panic!("no register {address}"))
    };
    (0..register.bytes).rev().fold(0, |value, place| value << 8 | i32::from(byte(place)))
}

impl Watched {
    /// The first moment for which `is` holds.
    pub(crate) fn first(&self, is: impl Fn(&Moment) -> bool) -> Option<&Moment> {
        self.moments.iter().find(|moment| is(moment))
    }

    /// When safety first held the robot, s since power-up.
    pub(crate) fn held_at_s(&self) -> Option<f64> {
        self.first(|moment| moment.permission == Permission::Hold).map(|moment| moment.time_s)
    }

    /// When safety first ordered the stop action, s since power-up.
    pub(crate) fn stopped_at_s(&self) -> Option<f64> {
        self.first(|moment| moment.permission == Permission::Stop).map(|moment| moment.time_s)
    }

    /// The state of the servos after the run.
    pub(crate) fn end(&self) -> &[Truth] {
        self.moments.last().map_or(&[], |moment| &moment.servos)
    }

    /// Asserts that no goal register under torque left its range or moved faster than its rate, for a start inside
    /// the ranges, whichever of the sent goals the servos heard.
    pub(crate) fn assert_goals_kept_limits(&self, robot: &Robot) {
        assert_eq!(self.report.joints.range_violations, 0);
        assert_eq!(self.report.joints.rate_violations, 0);
        for (index, joint) in robot.joints.iter().enumerate() {
            let (low, high) = goal_counts(joint);
            let step = rate_counts_s(robot, joint) * robot.period_s() + 1.0;
            let goals = || self.moments.iter().map(|moment| (moment.time_s, moment.servos[index]));
            for (time_s, servo) in goals().filter(|(_, servo)| servo.torque_on) {
                let goal = f64::from(servo.goal);
                assert!(
                    goal >= low - 1e-6 && goal <= high + 1e-6,
                    "{} at {time_s:.3} s: goal {goal} is outside {low} to {high}",
                    joint.name
                );
            }
            for ((_, before), (time_s, now)) in goals().zip(goals().skip(1)) {
                let turn = f64::from((now.goal - before.goal).abs());
                // A servo that has just lost its torque does not move: after a reset its goal is the factory's.
                let goes = before.torque_on && now.torque_on;
                assert!(
                    !goes || turn <= step + 1e-6,
                    "{} at {time_s:.3} s: goal went {turn} counts in a cycle, at most {step} are allowed",
                    joint.name
                );
            }
        }
    }
}

/// Simulated ports that a run uses and a test looks at.
#[derive(Clone)]
pub(crate) struct SharedPorts(Rc<RefCell<SimPorts>>);

impl SharedPorts {
    /// Ports on a virtual clock.
    pub(crate) fn new(world: World) -> SharedPorts {
        SharedPorts(Rc::new(RefCell::new(SimPorts::on_virtual_clock(world))))
    }

    pub(crate) fn borrow(&self) -> Ref<'_, SimPorts> {
        self.0.borrow()
    }

    /// Puts a torque (N m) on the shaft of the servo at this index on a bus, until the next call.
    pub(crate) fn load(&self, bus: usize, place: usize, torque_nm: f64) {
        self.0.borrow_mut().world_mut().load(bus, place, torque_nm);
    }
}

impl Ports for SharedPorts {
    fn now(&mut self) -> Time {
        self.0.borrow_mut().now()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.0.borrow_mut().discard_input(bus)
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.0.borrow_mut().send(bus, bytes)
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.0.borrow_mut().receive(bus, into)
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        self.0.borrow_mut().receive_imu(into)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.0.borrow_mut().wait_for_input(deadline);
    }

    fn wait_until(&mut self, deadline: Time) {
        self.0.borrow_mut().wait_until(deadline);
    }

    fn true_body(&self) -> Option<TrueBody> {
        self.0.borrow().true_body()
    }
}
