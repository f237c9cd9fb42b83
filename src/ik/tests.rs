//! What inverse kinematics must do, on chains made here.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use proptest::prelude::*;

use super::{Method, Solver};
use crate::model::{Chain, Joint};

/// A chain that hangs straight down from the origin; each joint is (axis, link length, range, stiffness).
fn chain_of(joints: &[(DVec3, f64, (f64, f64), f64)]) -> (Chain, Vec<Joint>) {
    let joints: Vec<Joint> = joints
        .iter()
        .map(|&(axis, length_m, range_rad, stiffness)| Joint {
            name: String::new(),
            axis,
            link_m: DVec3::NEG_Z * length_m,
            range_rad,
            stiffness,
            mass_kg: 0.0,
            center_m: DVec3::ZERO,
            servo: None,
        })
        .collect();
    let chain = Chain {
        name: String::new(),
        root_m: DVec3::ZERO,
        root_rotation: DQuat::IDENTITY,
        joints: 0..joints.len(),
    };
    (chain, joints)
}

fn four_bones(stiffness: [f64; 4]) -> (Chain, Vec<Joint>) {
    chain_of(&stiffness.map(|stiffness| (DVec3::Y, 0.25, (-PI, PI), stiffness)))
}

/// Tip by forward kinematics of its own: bones in the x-z plane, angles summed from the root.
fn planar_tip(length_m: f64, angles: &[f64]) -> DVec3 {
    let mut sum = 0.0;
    angles.iter().fold(DVec3::ZERO, |tip, angle| {
        sum += angle;
        tip + length_m * DVec3::new(-f64::sin(sum), 0.0, -f64::cos(sum))
    })
}

/// Each joint's share of the whole turn of a chain that starts straight and reaches for a point half its
/// length away to the side and half below.
fn shares(method: Method, stiffness: [f64; 4]) -> ([f64; 4], f64) {
    let (chain, joints) = four_bones(stiffness);
    let mut solver = Solver::new(&chain, &joints);
    let target = DVec3::new(0.5, 0.0, -0.5);
    let mut angles = [0.0; 4];
    let residual_m = solver.solve(method, target, 0.0, &mut angles).residual_m;
    assert!((planar_tip(0.25, &angles).distance(target) - residual_m).abs() < 1e-12, "the residual is true");
    let whole: f64 = angles.iter().map(|angle| angle.abs()).sum();
    (angles.map(|angle| angle.abs() / whole), residual_m)
}

#[test]
fn figure_3_6_the_tip_leads_where_ratios_rise_towards_it() {
    for method in [Method::Ccd { sweeps: 200 }, Method::CcdThenFinish] {
        let (shares, residual_m) = shares(method, [0.1, 0.3, 0.5, 1.0]);
        assert!(residual_m <= 1e-4, "{method:?} left {residual_m} m");
        assert!(shares[3] > shares[2] && shares[2] > shares[1] && shares[1] > shares[0], "{shares:?}");
        assert!(shares[3] > 0.4, "{shares:?}");
    }
}

#[test]
fn figure_3_7_the_third_bone_leads_where_it_alone_is_soft() {
    for method in [Method::Ccd { sweeps: 200 }, Method::CcdThenFinish] {
        let (shares, residual_m) = shares(method, [0.02, 0.1, 1.0, 0.1]);
        assert!(residual_m <= 1e-4, "{method:?} left {residual_m} m");
        assert!(shares[2] > 0.5, "{shares:?}");
        assert!(shares[0] < 0.1, "{shares:?}");
    }
}

#[test]
fn out_of_reach_ends_stretched_at_the_target_and_stays() {
    for method in [Method::Ccd { sweeps: 200 }, Method::CcdThenFinish] {
        let (chain, joints) = four_bones([0.5; 4]);
        let mut solver = Solver::new(&chain, &joints);
        let target = DVec3::new(1.2, 0.0, -0.9);
        let mut angles = [0.3, -0.2, 0.4, 0.1];
        for _ in 0..200 {
            solver.solve(method, target, 0.0, &mut angles);
        }
        let settled = angles;
        let solution = solver.solve(method, target, 0.0, &mut angles);
        // The target is 1.5 m away and the chain 1 m long.
        assert!((solution.residual_m - 0.5).abs() < 1e-4, "{method:?} left {}", solution.residual_m);
        for (before, after) in settled.iter().zip(angles) {
            assert!((before - after).abs() < 1e-4, "{method:?} still moves");
        }
    }
}

#[test]
fn a_limit_that_bars_the_way_gives_the_nearest_pose_found_by_dense_search() {
    let range = (-0.6, 0.9);
    let (chain, joints) = chain_of(&[(DVec3::Y, 0.4, range, 1.0), (DVec3::Y, 0.3, range, 0.5)]);
    let mut solver = Solver::new(&chain, &joints);
    let steps = 600;
    let grid = |step: i32| range.0 + (range.1 - range.0) * f64::from(step) / f64::from(steps);
    let tip = |a: f64, b: f64| {
        DVec3::new(-0.4 * a.sin() - 0.3 * (a + b).sin(), 0.0, -0.4 * a.cos() - 0.3 * (a + b).cos())
    };
    for target in [(-0.9, -0.1), (0.5, 0.1), (-0.2, -0.3), (0.3, -0.8), (-0.2, -0.5), (-0.69, -0.2)] {
        let target = DVec3::new(target.0, 0.0, target.1);
        let nearest_m = (0..=steps)
            .flat_map(|a| (0..=steps).map(move |b| (a, b)))
            .map(|(a, b)| tip(grid(a), grid(b)).distance(target))
            .fold(f64::INFINITY, f64::min);
        let mut angles = [0.1, 0.1];
        let mut residual_m = f64::INFINITY;
        for _ in 0..20 {
            residual_m = solver.solve(Method::CcdThenFinish, target, 0.0, &mut angles).residual_m;
        }
        assert!(angles.iter().all(|angle| (range.0..=range.1).contains(angle)));
        assert!(residual_m <= nearest_m + 1e-3, "{target}: {residual_m} m, the grid has {nearest_m} m");
    }
}

#[test]
fn a_chain_in_space_reaches_in_space() {
    // Two hinges in one place make a ball joint without twist: an arm of three of them.
    let ball = [(DVec3::Y, 0.0, (-1.2, 1.2), 1.0), (DVec3::X, 0.3, (-1.2, 1.2), 1.0)];
    let (chain, joints) = chain_of(&[ball, ball, ball].concat());
    let mut solver = Solver::new(&chain, &joints);
    for target in [(0.3, 0.2, -0.6), (-0.2, 0.4, -0.5), (0.0, -0.5, -0.55), (0.4, 0.4, -0.4)] {
        let target = DVec3::new(target.0, target.1, target.2);
        let mut angles = [0.05; 6];
        let mut residual_m = f64::INFINITY;
        for _ in 0..10 {
            residual_m = solver.solve(Method::CcdThenFinish, target, 0.0, &mut angles).residual_m;
        }
        // Rotations composed by hand, as matrices.
        let mut rotation = glam::DMat3::IDENTITY;
        let mut tip = DVec3::ZERO;
        for pair in angles.chunks(2) {
            rotation *= glam::DMat3::from_rotation_y(pair[0]) * glam::DMat3::from_rotation_x(pair[1]);
            tip += rotation * DVec3::new(0.0, 0.0, -0.3);
        }
        assert!(residual_m < 1e-5 && tip.distance(target) < 1e-5, "{target}: {residual_m} m");
    }
}

#[test]
fn what_is_not_a_number_changes_nothing() {
    let (chain, joints) = four_bones([0.5; 4]);
    let mut solver = Solver::new(&chain, &joints);
    let mut angles = [0.1, 0.2, 0.3, 0.4];
    let solution = solver.solve(Method::CcdThenFinish, DVec3::new(f64::NAN, 0.0, 0.0), 0.1, &mut angles);
    assert!(solution.residual_m.is_infinite());
    assert_eq!(angles.map(f64::to_bits), [0.1, 0.2, 0.3, 0.4].map(f64::to_bits));
}

proptest! {
    #[test]
    fn the_residual_is_the_true_distance_and_ranges_hold(
        x in -1.2..1.2, z in -1.2..1.2,
        start in proptest::array::uniform4(-3.0..3.0), low in -2.0..-0.1, high in 0.1..2.0, pull in 0.0..0.5,
    ) {
        let (chain, joints) = chain_of(&[(DVec3::Y, 0.25, (low, high), 0.7); 4]);
        let mut solver = Solver::new(&chain, &joints);
        let target = DVec3::new(x, 0.0, z);
        for method in [Method::Ccd { sweeps: 10 }, Method::CcdThenFinish] {
            let mut angles = start;
            let solution = solver.solve(method, target, pull, &mut angles);
            prop_assert!(angles.iter().all(|angle| (low..=high).contains(angle)));
            prop_assert!((planar_tip(0.25, &angles).distance(target) - solution.residual_m).abs() < 1e-9);
        }
    }
}
