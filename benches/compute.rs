//! What the controller computes: inverse kinematics of a leg, and a cycle's stages up to the bus.
//!
//! `cargo bench --bench compute`. Compare figures of one run only: machines differ, and drift.

#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use std::path::Path;

use divan::{Bencher, black_box};
use hippocamp::capability::HorseCapability;
use hippocamp::config;
use hippocamp::counts::{self, Goals};
use hippocamp::ik::{Limbs, Method, Solver};
use hippocamp::model::{Motion, Robot};
use hippocamp::motion::horse::{HorsePlan, Walk};
use hippocamp::motion::posture_pull;
use hippocamp::safety::Safety;
use hippocamp::signals::{Aim, JointState, JointTargets, State, Targets};

fn main() {
    divan::main();
}

/// A horse that has been trotting for a while, and its plan.
fn trotting() -> (Robot, HorsePlan, Walk) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/horse.toml");
    let robot = config::load(&path).unwrap().robot;
    let Motion::Horse(horse) = robot.motion.clone();
    let gait = horse.gaits.iter().find(|gait| gait.name == "trot").unwrap();
    let mut plan = HorseCapability::of(&robot, &horse).unwrap().plan(&horse, gait);
    plan.speed_m_s = 0.13;
    let walk = Walk::cruising(&plan, plan.speed_m_s);
    (robot, plan, walk)
}

/// Targets of every cycle of one period.
fn targets_of_a_period() -> (Robot, HorsePlan, Vec<Targets>) {
    let (robot, plan, mut walk) = trotting();
    let dt_s = robot.period_s();
    let mut targets = Targets::new(&robot);
    targets.aim = Aim::Tips;
    targets.posture_pull = posture_pull(dt_s);
    let all = (0..90)
        .map(|cycle| {
            let s = 1.8 + f64::from(cycle) * dt_s;
            walk.advance(s);
            walk.write(&plan, s, plan.settings.stand_height_m, &mut targets);
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
        let target = black_box(targets[cycle].tips_in_body[1]);
        solver.solve(method, target, targets[cycle].posture_pull, &mut angles)
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

/// Walk, inverse kinematics, safety and counts of 16 joints: a cycle without its exchange and records.
#[divan::bench]
fn stages_to_the_bus(bencher: Bencher) {
    let (robot, plan, mut walk) = trotting();
    let dt_s = robot.period_s();
    let mut limbs = Limbs::new(&robot, Method::CcdThenFinish);
    let (mut targets, mut joints) = (Targets::new(&robot), JointTargets::new(&robot));
    targets.aim = Aim::Tips;
    targets.posture_pull = posture_pull(dt_s);
    joints.angles_rad.copy_from_slice(&plan.sit_pose_rad);
    let mut safety = Safety::new(&robot);
    let mut goals = Goals::limp(&robot);
    let mut state = State::new(&robot);
    for (joint, position_rad) in state.joints.iter_mut().zip(&plan.sit_pose_rad) {
        *joint = JointState {
            is_known: true,
            position_rad: *position_rad,
            voltage_v: 12.0,
            temperature_c: 30.0,
            ..JointState::default()
        };
    }
    let mut s = 1.8;
    bencher.bench_local(|| {
        s += dt_s;
        walk.advance(s);
        walk.write(&plan, s, plan.settings.stand_height_m, &mut targets);
        limbs.solve(&targets, &mut joints);
        let command = safety.check(dt_s, dt_s, &joints, &mut state);
        counts::goals(&robot, command, &mut goals);
        for (joint, goal) in state.joints.iter_mut().zip(&state.goal_rad) {
            joint.position_rad = *goal;
        }
    });
}
