#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use glam::DVec3;

use super::{GRAVITY_M_S2, Sag, Sole, Standing, TrunkMotion};
use crate::config;
use crate::kinds::horse::HorseCapability;
use crate::model::Robot;
use crate::motion::Command;
use crate::signals::{FootTarget, JointTargets, State, Targets};

/// A supplied horse with soles across its legs, and its sitting posture.
fn horse() -> (Robot, Vec<Sole>, Vec<f64>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/horse.toml");
    let robot = config::load(&path).unwrap().robot;
    let points_m = vec![DVec3::Y * 0.015, DVec3::Y * -0.015];
    let soles = (0..4).map(|chain| Sole { chain, points_m: points_m.clone(), radius_m: 0.01 }).collect();
    let horse = robot.motion.horse().unwrap();
    let plan = HorseCapability::of(&robot, horse).unwrap().plan(horse, Command::default());
    (robot, soles, plan.sit_pose_rad)
}

fn mass_kg(robot: &Robot) -> f64 {
    robot.trunk_mass_kg + robot.joints.iter().map(|joint| joint.mass_kg).sum::<f64>()
}

#[test]
fn four_feet_carry_the_weight_and_nothing_else() {
    let (robot, soles, pose) = horse();
    let mut standing = Standing::new(&robot, &soles, 0.8);
    standing.solve(&pose, &TrunkMotion::default(), &[1.0; 4]);
    let sum: DVec3 = standing.forces_n().iter().sum();
    let weight_n = mass_kg(&robot) * GRAVITY_M_S2;
    assert!((sum - DVec3::Z * weight_n).length() < 1e-3 * weight_n, "{sum} of {weight_n} N");
    assert!(standing.miss_share() < 1e-3);
    for force in standing.forces_n() {
        assert!(force.z >= 0.0 && force.x.abs() + force.y.abs() <= 0.8 * force.z + 1e-9, "{force}");
    }
    // Left and right are mirror images, and so are their torques.
    for joint in 0..8 {
        let (left, right) = (standing.torques_nm()[joint], standing.torques_nm()[joint + 8]);
        assert!((left - right).abs() < 1e-3, "{joint}: {left}, {right} N m");
    }
}

#[test]
fn feet_push_the_trunk_towards_its_planned_acceleration() {
    let (robot, soles, pose) = horse();
    let mut standing = Standing::new(&robot, &soles, 0.8);
    let trunk = TrunkMotion { acceleration_m_s2: DVec3::new(1.0, -0.5, 0.3), ..TrunkMotion::default() };
    standing.solve(&pose, &trunk, &[1.0; 4]);
    let sum: DVec3 = standing.forces_n().iter().sum();
    let expected = (trunk.acceleration_m_s2 + DVec3::Z * GRAVITY_M_S2) * mass_kg(&robot);
    assert!((sum - expected).length() < 0.01, "{sum}, {expected}");
    // Nose down by 0.1 rad: in the body frame the ground pushes backwards by the same share of the weight.
    let trunk = TrunkMotion { pitch_rad: 0.1, ..TrunkMotion::default() };
    standing.solve(&pose, &trunk, &[1.0; 4]);
    let sum: DVec3 = standing.forces_n().iter().sum();
    let weight_n = mass_kg(&robot) * GRAVITY_M_S2;
    assert!((sum.x + weight_n * 0.1_f64.sin()).abs() < 0.01, "{sum}");
}

#[test]
fn a_foot_in_the_air_carries_nothing_and_one_that_lands_takes_over_smoothly() {
    let (robot, soles, pose) = horse();
    let mut standing = Standing::new(&robot, &soles, 0.8);
    let foot_n = |standing: &Standing, foot: usize| -> f64 {
        standing.forces_n()[2 * foot..2 * foot + 2].iter().map(|force| force.z).sum()
    };
    let mut before: Option<[f64; 4]> = None;
    let steps = 200;
    for step in 0..=steps {
        // The left hind foot lands; all others stand.
        let load = f64::from(step) / f64::from(steps);
        standing.solve(&pose, &TrunkMotion::default(), &[load, 1.0, 1.0, 1.0]);
        let now: [f64; 4] = std::array::from_fn(|foot| foot_n(&standing, foot));
        assert!(step > 0 || now[0] <= 0.0);
        if let Some(before) = before {
            let jump = now.iter().zip(before).map(|(now, before)| (now - before).abs()).fold(0.0, f64::max);
            assert!(jump < 0.6, "{jump} N at load {load}");
        }
        before = Some(now);
    }
    assert!(before.unwrap()[0] > 2.0, "{before:?}");
    // No foot bears load: limbs hang from a trunk that is held.
    standing.solve(&pose, &TrunkMotion::default(), &[0.0; 4]);
    assert!(standing.forces_n().iter().all(|force| force.length() <= 0.0));
}

#[test]
fn a_number_that_is_not_finite_leaves_no_trace() {
    let (robot, soles, pose) = horse();
    let mut standing = Standing::new(&robot, &soles, 0.8);
    standing.solve(&pose, &TrunkMotion::default(), &[1.0; 4]);
    let good = standing.torques_nm().to_vec();
    standing.solve(&vec![f64::NAN; pose.len()], &TrunkMotion::default(), &[1.0; 4]);
    standing.solve(&pose, &TrunkMotion::default(), &[1.0; 4]);
    for (torque, good) in standing.torques_nm().iter().zip(good) {
        assert!((torque - good).abs() < 1e-6);
    }
}

#[test]
fn sag_correction_puts_a_loaded_leg_on_its_target_and_keeps_goals_in_range() {
    let (robot, _, pose) = horse();
    let mut sag = Sag::new(&robot).unwrap();
    let (mut targets, mut joints, state) =
        (Targets::new(&robot), JointTargets::new(&robot), State::new(&robot));
    joints.angles_rad.copy_from_slice(&pose);
    sag.step(0.01, &targets, &state, &mut joints);
    assert!(joints.offset_rad.iter().all(|sag| sag.abs() <= 0.0), "nothing on a robot off its feet");
    targets.set_tips().feet.extend((0..4).map(|chain| FootTarget {
        chain,
        load_share: 1.0,
        ..FootTarget::default()
    }));
    let mut before = joints.offset_rad.clone();
    for _ in 0..200 {
        sag.step(0.01, &targets, &state, &mut joints);
        for (now, before) in joints.offset_rad.iter().zip(&before) {
            assert!((now - before).abs() < 0.001, "it comes in slowly");
        }
        before.copy_from_slice(&joints.offset_rad);
    }
    let goals: Vec<f64> = pose.iter().zip(&joints.offset_rad).map(|(angle, sag)| angle + sag).collect();
    for (joint, goal) in robot.joints.iter().zip(&goals) {
        let (low, high) = joint.goal_range_rad();
        assert!((low - 1e-12..=high + 1e-12).contains(goal), "{}", joint.name);
    }
    // Positions of servos that give way by torque over stiffness.
    let torques = sag.standing().torques_nm();
    let stands = |index: usize| {
        let model = robot.joints[index].servo.unwrap().model;
        goals[index] - torques[index] / model.stiffness_nm_rad(model.nominal_voltage_v)
    };
    for chain in &robot.chains {
        let tip = |angle: &dyn Fn(usize) -> f64| robot.tip_in_body(chain, chain.joints.clone().map(angle));
        let told = tip(&|index| pose[index]);
        let corrected = (tip(&stands) - told).length();
        let sagging = (tip(&|index| stands(index) - joints.offset_rad[index]) - told).length();
        assert!(corrected < 1e-4 && sagging > 1e-3, "{}: {corrected} m, {sagging} m", chain.name);
    }
    // Off its feet, the correction is zero at once.
    targets.set_pose();
    sag.step(0.01, &targets, &state, &mut joints);
    assert!(joints.offset_rad.iter().all(|sag| sag.abs() <= 0.0));
}

/// The correction for the robot's weight does not depend on whether a simulator has a body for it.
#[test]
fn sag_is_corrected_on_a_robot_whose_file_has_no_simulated_body() {
    let text = include_str!("../../config/horse.toml");
    let start = text.find("[physics]").unwrap();
    let end = start + text[start..].find("\n[balance]").unwrap();
    let bare = format!("{}{}", &text[..start], &text[end..]);
    let robot = crate::config::parse(&bare, "horse.toml").unwrap_or_else(|error| panic!("{error}")).robot;
    assert!(robot.physics.is_none() && robot.bears_weight);
    assert!((robot.balance.unwrap().friction - 0.8).abs() < 1e-12, "rubber on a dry floor");
    assert!(Sag::new(&robot).is_some());
    assert!(Sag::new(&robot.without_body()).is_none(), "joints that turn freely bear nothing");
}
