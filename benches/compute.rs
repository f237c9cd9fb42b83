//! The controller's computations: inverse kinematics of a leg and of an arm, and a cycle's stages up to the bus.
//!
//! `cargo bench --bench compute`. Compare results of one run only: machines differ, and drift.

#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use std::path::Path;
use std::time::Duration;

use divan::{Bencher, black_box};
use glam::DVec3;
use hippocamp::bus::{Buses, PortError, Ports, SimPorts, Slot};
use hippocamp::config;
use hippocamp::counts::Goals;
use hippocamp::cycle::Controller;
use hippocamp::ik::{ArmSolver, Limbs, Method, Solver};
use hippocamp::kinds::figure::FigureCapability;
use hippocamp::kinds::horse::HorseCapability;
use hippocamp::model::{ArmGeometry, Bending, Robot};
use hippocamp::motion::horse::{Drive, HorsePlan, Velocity, Walk};
use hippocamp::motion::tentacle::key_angles::KeyInterpolation;
use hippocamp::motion::tentacle::strokes::swim;
use hippocamp::motion::tentacle::variation::Variation;
use hippocamp::motion::{Activity, Command, Order, posture_pull};
use hippocamp::observe::Observer;
use hippocamp::run::Cycle;
use hippocamp::signals::{ArmAim, ArmTarget, JointTargets, Targets};
use hippocamp::simulation;
use hippocamp::standing::{Sole, Standing, TrunkMotion};
use hippocamp::telemetry::Telemetry;
use hippocamp::units::Time;
use hw_sim::FaultScript;

fn main() {
    divan::main();
}

/// A horse that has been trotting for a while, and its plan.
fn trotting() -> (Robot, HorsePlan, Walk) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/horse.toml");
    let robot = config::load(&path).unwrap().robot;
    let horse = robot.motion.horse().unwrap().clone();
    let plan = HorseCapability::of(&robot, &horse).unwrap().plan(&horse, Command::default());
    let trot = horse.gaits.iter().position(|gait| gait.name == "trot").unwrap();
    let walk = Walk::cruising(&plan, trot, Velocity { speed_m_s: 0.13, yaw_rate_rad_s: 0.0 });
    (robot, plan, walk)
}

/// Targets of every cycle of one period.
fn targets_of_a_period() -> (Robot, HorsePlan, Vec<Targets>) {
    let (robot, plan, mut walk) = trotting();
    let dt_s = robot.period_s();
    let mut targets = Targets::new(&robot);
    targets.posture_pull = posture_pull(dt_s);
    let all = (0..90)
        .map(|cycle| {
            let s = 1.8 + f64::from(cycle) * dt_s;
            walk.advance(s);
            walk.write_level(&plan, s, &mut targets);
            targets.clone()
        })
        .collect();
    (robot, plan, all)
}

const METHODS: [(&str, Method); 2] =
    [("ccd+finish", Method::CcdThenFinish), ("ccd, 10 sweeps", Method::Ccd { sweeps: 10 })];

/// One leg, from one cycle's target to the next.
#[divan::bench(args = METHODS.map(|(name, _)| name))]
fn leg(bencher: Bencher, name: &str) {
    let method = METHODS.iter().find(|(known, _)| *known == name).unwrap().1;
    let (robot, plan, targets) = targets_of_a_period();
    let chain = &robot.chains[1];
    let mut solver = Solver::new(chain, robot.joints_of(chain));
    let mut angles = plan.sit_pose_rad[chain.joints.clone()].to_vec();
    let mut cycle = 0;
    bencher.bench_local(|| {
        cycle = (cycle + 1) % targets.len();
        let target = black_box(targets[cycle].tip_in_body(1).unwrap());
        solver.solve(method, target, targets[cycle].posture_pull, &mut angles)
    });
}

/// One leg whose target stays: only the finish, one step of it.
#[divan::bench]
fn leg_that_stands(bencher: Bencher) {
    let (robot, plan, targets) = targets_of_a_period();
    let chain = &robot.chains[1];
    let mut solver = Solver::new(chain, robot.joints_of(chain));
    let mut angles = plan.sit_pose_rad[chain.joints.clone()].to_vec();
    let target = &targets[0];
    bencher.bench_local(|| {
        solver.solve(
            Method::CcdThenFinish,
            black_box(target.tip_in_body(1).unwrap()),
            target.posture_pull,
            &mut angles,
        )
    });
}

/// One leg, from limp poses to targets out of its reach: sweeps, finish and the search of all cells.
#[divan::bench(args = [0, 1])]
fn leg_out_of_reach(bencher: Bencher, leg: usize) {
    let (robot, _, _) = targets_of_a_period();
    let chain = &robot.chains[leg];
    let joints = robot.joints_of(chain);
    let mut solver = Solver::new(chain, joints);
    let mut round = 0.0_f64;
    bencher.bench_local(|| {
        round += 1.0;
        let place = |share: f64| (0.5 * (1.0 + (share * round).sin())).clamp(0.0, 1.0);
        let mut angles: [f64; 4] = std::array::from_fn(|index| {
            let (low, high) = joints[index].goal_range_rad();
            low + place(0.7 + 0.31 * joints[index].stiffness) * (high - low)
        });
        let away = chain.length_m(joints) * (1.05 + 0.3 * place(1.3));
        let target = chain.root_m + away * DVec3::new((2.1 * round).sin(), 0.0, (2.1 * round).cos());
        solver.solve(Method::CcdThenFinish, black_box(target), 0.1, &mut angles)
    });
}

/// Four legs in one call.
#[divan::bench]
fn four_legs(bencher: Bencher) {
    let (robot, plan, targets) = targets_of_a_period();
    let mut limbs = Limbs::new(&robot, Method::CcdThenFinish);
    let mut joints = JointTargets::new(&robot);
    joints.angles_rad.copy_from_slice(&plan.sit_pose_rad);
    let mut cycle = 0;
    bencher.bench_local(|| {
        cycle = (cycle + 1) % targets.len();
        limbs.solve(black_box(&targets[cycle]), &mut joints);
    });
}

/// A horse that trots on command, and its command.
fn driven() -> (Robot, Drive, Command) {
    let (robot, plan, _) = trotting();
    let trot = plan.settings.gaits.iter().position(|gait| gait.name == "trot").unwrap();
    let command = Command::ahead(trot, 0.13);
    let mut drive = Drive::standing(plan);
    while !drive.does(command) {
        drive.step(robot.period_s(), Some(command));
    }
    (robot, drive, command)
}

/// Following an unchanged command: four legs' targets, and their inverse kinematics.
#[divan::bench]
fn targets_and_four_legs(bencher: Bencher) {
    let (robot, mut drive, command) = driven();
    let mut limbs = Limbs::new(&robot, Method::CcdThenFinish);
    let (mut targets, mut joints) = (Targets::new(&robot), JointTargets::new(&robot));
    targets.posture_pull = posture_pull(robot.period_s());
    joints.angles_rad.copy_from_slice(&drive.plan().sit_pose_rad);
    let height_m = drive.plan().settings.stand_height_m;
    bencher.bench_local(|| {
        drive.step(robot.period_s(), Some(black_box(command)));
        drive.write(height_m, &mut targets);
        limbs.solve(&targets, &mut joints);
    });
}

/// The cycle in which a new command comes: makes and checks plans until one fits, or none does now.
#[divan::bench(args = ["stand", "walk", "gallop-left", "auto"])]
fn a_new_command(bencher: Bencher, gait: &str) {
    let (robot, drive, command) = driven();
    let new = Command { gait: drive.plan().gait_choice(gait).unwrap(), yaw_rate_rad_s: 0.1, ..command };
    bencher
        .with_inputs(|| drive.clone())
        .bench_local_refs(|drive| drive.step(robot.period_s(), Some(black_box(new))));
}

/// Ports that answer each request at once with a stored answer: no wire, no wait.
struct Canned {
    replies: Vec<Vec<u8>>,
    pending: Vec<bool>,
}

impl Ports for Canned {
    fn now(&mut self) -> Time {
        Time(0)
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.pending[bus] = false;
        Ok(())
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        black_box(bytes);
        self.pending[bus] = true;
        Ok(())
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        if !std::mem::take(&mut self.pending[bus]) {
            return Ok(0);
        }
        let reply = &self.replies[bus];
        into[..reply.len()].copy_from_slice(reply);
        Ok(reply.len())
    }

    fn wait_for_input(&mut self, _: Time) {}

    fn wait_until(&mut self, _: Time) {}
}

/// Simulated ports that keep the last bytes received on each bus.
struct Tap {
    inner: SimPorts,
    received: Vec<Vec<u8>>,
}

impl Ports for Tap {
    fn now(&mut self) -> Time {
        self.inner.now()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.received[bus].clear();
        self.inner.discard_input(bus)
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.inner.send(bus, bytes)
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        let count = self.inner.receive(bus, into)?;
        self.received[bus].extend_from_slice(&into[..count]);
        Ok(count)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.inner.wait_for_input(deadline);
    }

    fn wait_until(&mut self, deadline: Time) {
        self.inner.wait_until(deadline);
    }
}

/// Encoding a cycle's requests and decoding all replies of 16 servos.
#[divan::bench(args = ["horse", "horse-dynamixel"])]
fn exchange_without_a_wire(bencher: Bencher, name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config").join(name).with_extension("toml");
    let robot = config::load(&path).unwrap().robot;
    let world = simulation::world(&robot, 1, &FaultScript::default()).unwrap();
    let received = vec![Vec::new(); robot.buses.len()];
    let goals = Goals::limp(&robot);
    let mut slots = vec![Slot::Missing; robot.joints.len()];
    let mut buses = Buses::new(&robot, Tap { inner: SimPorts::of(world, true), received });
    buses.exchange(&goals, &mut slots);
    let replies = buses.into_ports().received;
    let pending = vec![false; robot.buses.len()];
    let mut buses = Buses::new(&robot, Canned { replies, pending });
    buses.exchange(&goals, &mut slots);
    assert!(slots.iter().all(|slot| matches!(slot, Slot::Fresh(_))));
    bencher.bench_local(|| buses.exchange(&goals, &mut slots));
}

/// A second of a horse that walks in physics: controller, buses, servos and body, at steps of 1 and 2 ms.
#[divan::bench(args = [1, 2], sample_count = 20, sample_size = 1)]
fn a_second_in_physics(bencher: Bencher, step_ms: u32) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/horse.toml");
    let mut robot = config::load(&path).unwrap().robot;
    robot.physics.as_mut().unwrap().step_ms = step_ms;
    let horse = robot.motion.horse().unwrap().clone();
    let plan = HorseCapability::of(&robot, &horse).unwrap().plan(&horse, Command::default());
    let choice = plan.gait_choice("walk-steady").unwrap();
    let plan = plan.at_share(choice, 0.9);
    let world = simulation::world(&robot, 1, &FaultScript::default()).unwrap();
    let mut buses = Buses::new(&robot, SimPorts::on_virtual_clock(world));
    buses.prepare(&robot).unwrap();
    let mut deadline = buses.ports_mut().now();
    let mut cycle = Cycle::new(&robot, plan, Method::CcdThenFinish, f64::MAX, buses);
    let mut telemetry = Telemetry::new(&robot);
    let mut second = || {
        for _ in 0..100 {
            deadline = deadline + Duration::from_millis(10);
            cycle.begin(deadline);
            cycle.step(Order::Go);
            telemetry.observe(&cycle.record());
        }
        cycle.record().facts.activity
    };
    while second() != Activity::Walking {}
    bencher.bench_local(second);
}

/// Everything from the state to goals of 16 joints: a cycle without its exchange and records.
#[divan::bench]
fn stages_to_the_bus(bencher: Bencher) {
    let (robot, plan, _) = trotting();
    let trot = plan.settings.gaits.iter().position(|gait| gait.name == "trot").unwrap();
    let order = Order::Drive(Command::ahead(trot, 0.13));
    let mut controller = Controller::new(&robot, plan, Method::CcdThenFinish, f64::MAX);
    let mut cycle = || {
        controller.learn_from_goals();
        black_box(controller.decide(robot.period_s(), order));
    };
    // It gets up, and trots as fast as it was asked to.
    (0..2000).for_each(|_| cycle());
    bencher.bench_local(cycle);
}

/// The thesis' arm of 12 joints of two hinges, its solver, and a swimming stroke's targets, cycle by cycle.
fn swimming_arm() -> (ArmSolver, Vec<ArmTarget>) {
    let text = include_str!("../tests/common/thesis_arm.toml");
    let Robot { chains, joints, .. } = config::parse(text, "thesis arm").unwrap().robot;
    let chain = &chains[0];
    let arm = ArmGeometry::of(chain, &joints).unwrap();
    let stroke = swim::of_arm(KeyInterpolation::Smooth, Variation::new(1, 0, 0.05));
    let mut target = ArmTarget::new(chain, &joints);
    let targets = (0..500)
        .map(|cycle| {
            let phase = std::f64::consts::TAU * f64::from(cycle) / 500.0;
            target.ends_in_body = stroke.ends_in_arm(arm.group_lengths_m(), phase, 0.0);
            target.clone()
        })
        .collect();
    (ArmSolver::new(&arm, chain, &joints, Bending::Smooth, 0.01), targets)
}

/// One arm of 24 hinges on its stroke: ends of groups, or the tip alone.
#[divan::bench(args = ["ends", "tip"])]
fn arm(bencher: Bencher, aim: &str) {
    let (mut solver, mut targets) = swimming_arm();
    let aim = if aim == "tip" { ArmAim::Tip } else { ArmAim::Ends };
    targets.iter_mut().for_each(|target| target.aim = aim);
    let (mut angles, mut cycle) = ([0.0; 24], 0);
    bencher.bench_local(|| {
        cycle = (cycle + 1) % targets.len();
        solver.solve(black_box(&targets[cycle]), false, &mut angles)
    });
}

/// Eight arms.
#[divan::bench]
fn eight_arms(bencher: Bencher) {
    let (solver, targets) = swimming_arm();
    let mut arms: Vec<_> = (0..8).map(|arm| (solver.clone(), [0.0; 24], 60 * arm)).collect();
    bencher.bench_local(|| {
        for (solver, angles, cycle) in &mut arms {
            *cycle = (*cycle + 1) % targets.len();
            solver.solve(black_box(&targets[*cycle]), false, angles);
        }
    });
}

/// One arm that begins a motion, from straight.
#[divan::bench(args = ["ends", "tip"])]
fn arm_from_cold(bencher: Bencher, aim: &str) {
    let (mut solver, mut targets) = swimming_arm();
    let aim = if aim == "tip" { ArmAim::Tip } else { ArmAim::Ends };
    targets.iter_mut().for_each(|target| target.aim = aim);
    let mut cycle = 0;
    bencher.bench_local(|| {
        cycle = (cycle + 37) % targets.len();
        solver.solve(black_box(&targets[cycle]), true, &mut [0.0; 24])
    });
}

/// Eight arms that begin a motion in the same cycle, from straight.
#[divan::bench]
fn eight_arms_from_cold(bencher: Bencher) {
    let (solver, targets) = swimming_arm();
    let mut solvers = vec![solver; 8];
    let mut cycle = 0;
    bencher.bench_local(|| {
        cycle = (cycle + 37) % targets.len();
        for (arm, solver) in solvers.iter_mut().enumerate() {
            let target = &targets[(cycle + 60 * arm) % targets.len()];
            solver.solve(black_box(target), true, &mut [0.0; 24]);
        }
    });
}

/// Distributes the weight of a horse over its feet, from one cycle of a trot to the next; or without a previous
/// solution.
#[divan::bench(args = ["trot", "anew"])]
fn standing(bencher: Bencher, case: &str) {
    let (robot, plan, targets) = targets_of_a_period();
    let (mut limbs, mut joints) = (Limbs::new(&robot, Method::CcdThenFinish), JointTargets::new(&robot));
    joints.angles_rad.copy_from_slice(&plan.sit_pose_rad);
    let poses: Vec<(Vec<f64>, Vec<f64>)> = targets
        .iter()
        .map(|targets| {
            limbs.solve(targets, &mut joints);
            let loads = targets.feet().iter().map(|foot| if foot.is_swing { 0.0 } else { 1.0 });
            (joints.angles_rad.clone(), loads.collect())
        })
        .collect();
    let points_m = vec![DVec3::Y * 0.015, DVec3::Y * -0.015];
    let soles: Vec<Sole> =
        (0..4).map(|chain| Sole { chain, points_m: points_m.clone(), radius_m: 0.01 }).collect();
    let mut standing = Standing::new(&robot, &soles, 0.8);
    let mut cycle = 0;
    bencher.bench_local(|| {
        cycle = (cycle + 1) % poses.len();
        let (angles, loads) = &poses[cycle];
        if case == "anew" {
            standing.solve(angles, &TrunkMotion::default(), &[0.0; 4]);
        }
        standing.solve(black_box(angles), &TrunkMotion::default(), loads);
    });
}

/// Distributes the weight of a figure over the corners of its soles, from one cycle to the next on its way from
/// standing to leaning and back; or without a previous solution.
#[divan::bench(args = ["lean", "anew"])]
fn standing_figure(bencher: Bencher, case: &str) {
    const CYCLES: u32 = 300;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/figure.toml");
    let robot = config::load(&path).unwrap().robot;
    let figure = robot.motion.figure().unwrap();
    let plan = FigureCapability::of(&robot, figure).unwrap().plan(0);
    let lean = figure.poses.iter().position(|pose| pose.name == "lean-left").unwrap();
    let (from, to) = (&plan.pose_rad[0], &plan.pose_rad[lean]);
    let mut standing = Standing::new(&robot, &Sole::all_of(&robot), 0.8);
    let loads = vec![1.0; robot.chains.len()];
    let none = vec![0.0; robot.chains.len()];
    let mut angles = from.clone();
    let mut cycle = 0;
    bencher.bench_local(|| {
        cycle = (cycle + 1) % CYCLES;
        let share = 0.5 - 0.5 * (std::f64::consts::TAU * f64::from(cycle) / f64::from(CYCLES)).cos();
        for ((angle, from), to) in angles.iter_mut().zip(from).zip(to) {
            *angle = from + share * (to - from);
        }
        if case == "anew" {
            standing.solve(&angles, &TrunkMotion::default(), &none);
        }
        standing.solve(black_box(&angles), &TrunkMotion::default(), &loads);
    });
}
