//! The full-size reference horse: the thesis' numbers (Takizawa 2005) on legs of its own kind.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use glam::DVec3;
use hippocamp::config;
use hippocamp::ik::{Limbs, Method};
use hippocamp::kinds::horse::HorseCapability;
use hippocamp::model::{HorseMotion, Robot};
use hippocamp::motion::horse::{Velocity, Walk};
use hippocamp::motion::{Command, posture_pull};
use hippocamp::signals::{JointTargets, Targets};

fn thoroughbred() -> (Robot, HorseMotion) {
    let file = config::load(Path::new("config/thoroughbred.toml")).unwrap();
    let horse = file.robot.motion.horse().unwrap().clone();
    (file.robot, horse)
}

#[test]
fn every_foot_reaches_the_thesis_0_8_m_fore_and_aft() {
    let (robot, horse) = thoroughbred();
    let capability = HorseCapability::of(&robot, &horse).unwrap();
    for reach in &capability.reaches {
        assert!(reach.half_excursion_m >= 0.8, "{reach:?}");
    }
}

#[test]
fn top_speeds_are_what_the_reach_allows() {
    // V <= 2E (1 - alpha) / (P alpha), less the overshoot of the swing with a ramp share of 0.1; at E = 0.8 m:
    // walk 2.26, trot 5.10, canter 10.85, gallop 13.3 m/s.
    let (robot, horse) = thoroughbred();
    let capability = HorseCapability::of(&robot, &horse).unwrap();
    for (name, expected) in [("walk", 2.26), ("trot", 5.10), ("canter", 10.85), ("gallop", 13.3)] {
        let gait = horse.gaits.iter().position(|gait| gait.name == name).unwrap();
        let plan = capability.plan(&horse, Command::default());
        let top_m_s = plan.top_speed_by_reach_m_s(gait, 0.8 / 0.99);
        assert!((top_m_s / expected - 1.0).abs() < 0.005, "{name}: {top_m_s}");
    }
}

/// Lift-off times of the first whole stride, by leg, as the solved joints show them.
fn lift_offs(robot: &Robot, horse: &HorseMotion, name: &str) -> [f64; 4] {
    let capability = HorseCapability::of(robot, horse).unwrap();
    let gait = horse.gaits.iter().position(|gait| gait.name == name).unwrap();
    let plan = capability.plan(horse, Command::default());
    let period_s = horse.gaits[gait].period_s(horse.swing_time_s);
    let top = Velocity { speed_m_s: capability.top_speeds[gait].by_reach_m_s, yaw_rate_rad_s: 0.0 };
    let mut walk = Walk::cruising(&plan, gait, top);
    let mut limbs = Limbs::new(robot, Method::CcdThenFinish);
    let (mut targets, mut joints) = (Targets::new(robot), JointTargets::new(robot));
    let dt_s = 0.002;
    targets.posture_pull = posture_pull(dt_s);
    joints.angles_rad.copy_from_slice(&plan.sit_pose_rad);
    let mut lift_offs = [f64::NAN; 4];
    let (mut stood, mut was_up): ([Option<DVec3>; 4], [Option<bool>; 4]) = ([None; 4], [None; 4]);
    // One stride to settle, then two to look at.
    for step in 0..u32::MAX {
        let s = f64::from(step) * dt_s;
        if s > 3.0 * period_s {
            break;
        }
        walk.advance(s);
        walk.write_level(&plan, s, &mut targets);
        limbs.solve(&targets, &mut joints);
        if s < period_s {
            continue;
        }
        for (leg, &chain) in horse.legs.iter().enumerate() {
            let chain = &robot.chains[chain];
            let angles = &joints.angles_rad[chain.joints.clone()];
            for (joint, angle) in robot.joints_of(chain).iter().zip(angles) {
                assert!((joint.range_rad.0..=joint.range_rad.1).contains(angle), "{name}: {}", joint.name);
            }
            let foot = robot.tip_in_body(chain, angles.iter().copied()) + targets.trunk_in_world;
            let miss = foot.distance(targets.tip_in_body(horse.legs[leg]).unwrap() + targets.trunk_in_world);
            assert!(miss <= 1e-4, "{name}: leg {leg} misses by {miss} m at {s} s");
            // Twice what inverse kinematics may leave.
            let is_up = foot.z > 2e-4;
            if was_up[leg] == Some(false) && is_up && lift_offs[leg].is_nan() {
                lift_offs[leg] = s;
            }
            was_up[leg] = Some(is_up);
            if targets.feet()[leg].is_swing {
                stood[leg] = None;
            } else {
                let slip = foot.distance(*stood[leg].get_or_insert(foot));
                assert!(slip <= 2e-4, "{name}: leg {leg} slips {slip} m at {s} s");
            }
        }
    }
    lift_offs
}

#[test]
fn solved_legs_step_in_the_order_and_beats_of_each_gait() {
    let (robot, horse) = thoroughbred();
    // Phase offsets after the left hind as shares of the period, legs in the order LH LF RH RF (2.2, 3.3; ours:
    // rotary, left).
    let expected = [
        ("walk", [0.0, 0.2, 0.5, 0.7]),
        ("trot", [0.0, 0.5, 0.5, 0.0]),
        ("canter", [0.0, 0.2, 0.2, 0.4]),
        ("canter-left", [0.0, 0.2, 0.8, 0.0]),
        ("gallop", [0.0, 0.35, 0.2, 0.55]),
        ("gallop-left", [0.0, 0.35, 0.8, 0.15]),
        ("rotary-gallop", [0.0, 0.55, 0.2, 0.35]),
        ("rotary-gallop-left", [0.0, 0.15, 0.8, 0.35]),
    ];
    for (name, phase_offsets) in expected {
        let gait = horse.gaits.iter().find(|gait| gait.name == name).unwrap();
        let period_s = gait.period_s(0.3);
        let times = lift_offs(&robot, &horse, name);
        for leg in 0..4 {
            let phase_offset = ((times[leg] - times[0]) / period_s).rem_euclid(1.0);
            let error = (phase_offset - phase_offsets[leg] + 0.5).rem_euclid(1.0) - 0.5;
            assert!(
                error.abs() < 0.02,
                "{name}: leg {leg} lifts {phase_offset} of a period after the left hind"
            );
        }
    }
}

#[test]
fn the_thesis_check_values_of_period_and_stride() {
    // 3.1: V 15 m/s, P 0.3 s, alpha 0.25 give T 0.4 s and S 6 m.
    let (_, horse) = thoroughbred();
    let gallop = horse.gaits.iter().find(|gait| gait.name == "gallop").unwrap();
    assert!((horse.swing_time_s - 0.3).abs() < 1e-12 && (gallop.duty_factor - 0.25).abs() < 1e-12);
    assert!((gallop.period_s(horse.swing_time_s) - 0.4).abs() < 1e-12);
    assert!((gallop.stride_m(15.0, horse.swing_time_s) - 6.0).abs() < 1e-12);
}

/// Worst distances of hind and fore feet from their targets, m, at the top speed of each of the thesis' gaits, 60 cycles a
/// second, over four strides after one to settle.
fn worst_misses_m(robot: &Robot, horse: &HorseMotion, method: Method) -> [[f64; 4]; 2] {
    let capability = HorseCapability::of(robot, horse).unwrap();
    let plan = capability.plan(horse, Command::default());
    let mut worst_m = [[0.0_f64; 4]; 2];
    for (column, name) in ["walk", "trot", "canter", "gallop"].into_iter().enumerate() {
        let gait = horse.gaits.iter().position(|gait| gait.name == name).unwrap();
        let top = Velocity { speed_m_s: capability.top_speeds[gait].by_reach_m_s, yaw_rate_rad_s: 0.0 };
        let mut walk = Walk::cruising(&plan, gait, top);
        let mut limbs = Limbs::new(robot, method);
        let (mut targets, mut joints) = (Targets::new(robot), JointTargets::new(robot));
        targets.posture_pull = posture_pull(1.0 / 60.0);
        joints.angles_rad.copy_from_slice(&plan.sit_pose_rad);
        let period_s = horse.gaits[gait].period_s(horse.swing_time_s);
        for step in 0..u32::MAX {
            let s = f64::from(step) / 60.0;
            if s > 5.0 * period_s {
                break;
            }
            walk.advance(s);
            walk.write_level(&plan, s, &mut targets);
            limbs.solve(&targets, &mut joints);
            for (leg, &chain) in horse.legs.iter().enumerate().filter(|_| s > period_s) {
                let chain = &robot.chains[chain];
                let foot = robot.tip_in_body(chain, joints.angles_rad[chain.joints.clone()].iter().copied());
                let miss_m = foot.distance(targets.tip_in_body(horse.legs[leg]).unwrap());
                worst_m[leg % 2][column] = worst_m[leg % 2][column].max(miss_m);
            }
        }
    }
    worst_m
}

/// Sweeps alone, as in the thesis, leave a residual; the table of docs/ik.md.
#[test]
fn the_finish_removes_the_residual_of_sweeps_alone() {
    let (robot, horse) = thoroughbred();
    let mut without = robot.clone();
    without.joints.iter_mut().for_each(|joint| joint.stiffness = 1.0);
    println!(
        "[sweeps]\n| method | hind: walk | trot | canter | gallop | fore: walk | trot | canter | gallop |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let row = |name: &str, robot: &Robot, method: Method| {
        let worst_m = worst_misses_m(robot, &horse, method);
        let cells = worst_m.as_flattened().iter().map(|miss_m| match 1e3 * miss_m {
            ..0.001 => "< 0.001".to_owned(),
            miss_mm @ 0.001..0.1 => format!("{miss_mm:.3}"),
            miss_mm @ 0.1..10.0 => format!("{miss_mm:.1}"),
            miss_mm => format!("{miss_mm:.0}"),
        });
        println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
        worst_m
    };
    for sweeps in [10, 100] {
        let method = Method::Ccd { sweeps };
        let plain = row(&format!("CCD, {sweeps} sweeps, no stiffness"), &without, method);
        let stiff = row(&format!("CCD, {sweeps} sweeps"), &robot, method);
        let least_m = if sweeps == 10 { 5e-3 } else { 0.0 };
        assert!(plain.as_flattened().iter().chain(stiff.as_flattened()).all(|miss_m| *miss_m > least_m));
    }
    let ours = row("as above", &robot, Method::CcdThenFinish);
    assert!(ours.as_flattened().iter().all(|miss_m| *miss_m < 1e-6), "{ours:?}");
}
