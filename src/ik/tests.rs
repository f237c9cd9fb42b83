//! Tests of inverse kinematics, on chains made here.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use proptest::prelude::*;

use super::{Method, REACHED_M, Solver};
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
            ball: None,
            servo: None,
        })
        .collect();
    let chain = Chain {
        name: String::new(),
        root_m: DVec3::ZERO,
        root_rotation: DQuat::IDENTITY,
        joints: 0..joints.len(),
        tendons: None,
        foot: None,
    };
    (chain, joints)
}

fn four_bones(stiffness: [f64; 4]) -> (Chain, Vec<Joint>) {
    chain_of(&stiffness.map(|stiffness| (DVec3::Y, 0.25, (-PI, PI), stiffness)))
}

/// Tip by separate forward kinematics: bones in the x-z plane, angles summed from the root.
fn planar_tip(length_m: f64, angles: &[f64]) -> DVec3 {
    let mut sum = 0.0;
    angles.iter().fold(DVec3::ZERO, |tip, angle| {
        sum += angle;
        tip + length_m * DVec3::new(-f64::sin(sum), 0.0, -f64::cos(sum))
    })
}

/// Each joint's share of the total turn of a chain that starts straight and reaches for a point half its
/// length to the side and half below.
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
fn a_target_out_of_reach_gives_a_stretched_chain_that_stays() {
    // The target is 1.5 m away and the chain 1 m long.
    let target = DVec3::new(1.2, 0.0, -0.9);
    for (method, solves) in [(Method::Ccd { sweeps: 200 }, 200), (Method::CcdThenFinish, 1)] {
        let (chain, joints) = four_bones([0.5; 4]);
        let mut solver = Solver::new(&chain, &joints);
        let mut angles = [0.3, -0.2, 0.4, 0.1];
        for _ in 0..solves {
            solver.solve(method, target, 0.0, &mut angles);
        }
        let settled = angles;
        let solution = solver.solve(method, target, 0.0, &mut angles);
        assert!((solution.residual_m - 0.5).abs() < 1e-4, "{method:?} left {}", solution.residual_m);
        for (before, after) in settled.iter().zip(angles) {
            assert!((before - after).abs() < 1e-4, "{method:?} still moves");
        }
    }
}

#[test]
fn a_blocking_limit_gives_the_nearest_pose_of_a_dense_search() {
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
        let residual_m = solver.solve(Method::CcdThenFinish, target, 0.0, &mut angles).residual_m;
        assert!(angles.iter().all(|angle| (range.0..=range.1).contains(angle)));
        assert!(residual_m <= nearest_m + 1e-6, "{target}: {residual_m} m, the grid has {nearest_m} m");
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
        let residual_m = solver.solve(Method::CcdThenFinish, target, 0.0, &mut angles).residual_m;
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

/// Two bones of 0.3 m and 0.3 m whose middle joint bends both ways.
fn knee(first_range_rad: (f64, f64)) -> (Chain, Vec<Joint>) {
    chain_of(&[(DVec3::Y, 0.3, first_range_rad, 1.0), (DVec3::Y, 0.3, (-1.5, 1.5), 1.0)])
}

#[test]
fn a_pose_is_kept_as_long_as_it_reaches_the_target() {
    let (chain, joints) = knee((-0.8, 0.8));
    let mut solver = Solver::new(&chain, &joints);
    // Bent by 1.2 rad, the tip as seen from the root is 0.6 rad beyond the first bone, or before it: on its
    // way round the root it can be followed with either bend, each until the first joint meets its limit.
    let at = |phi: f64| 0.6 * 0.6_f64.cos() * DVec3::new(-phi.sin(), 0.0, -phi.cos());
    let mut angles = [-0.6, 1.2];
    let mut leaps = Vec::new();
    for step in 0..=140 {
        let phi = 0.01 * f64::from(step);
        let before = angles;
        let solution = solver.solve(Method::CcdThenFinish, at(phi), 0.1, &mut angles);
        assert!(solution.residual_m <= 1e-6, "{solution:?} at {phi}");
        if solution.is_new_branch {
            leaps.push(phi);
        } else {
            assert!(
                (angles[0] - before[0]).abs() < 0.02 && (angles[1] - before[1]).abs() < 0.02,
                "{angles:?}"
            );
        }
    }
    assert!(leaps.is_empty() && angles[1] > 0.0, "the bend it began with reaches all the way: {leaps:?}");
    for step in (-140..=140).rev() {
        let phi = 0.01 * f64::from(step);
        let solution = solver.solve(Method::CcdThenFinish, at(phi), 0.1, &mut angles);
        assert!(solution.residual_m <= 1e-6, "{solution:?} at {phi}");
        if solution.is_new_branch {
            leaps.push(phi);
        }
    }
    // phi - 0.6 < -0.8 from here on: only the other bend reaches.
    assert_eq!(leaps.len(), 1, "{leaps:?}");
    assert!((-0.21..-0.199).contains(&leaps[0]) && angles[1] < 0.0, "{leaps:?}");
}

#[test]
fn out_of_reach_a_pose_is_not_exchanged_for_an_equally_near_one() {
    // Straight ahead, one bend is as near as the other.
    let (chain, joints) = chain_of(&[
        (DVec3::Y, 0.3, (-0.8, 0.8), 1.0),
        (DVec3::Y, 0.3, (-1.5, 1.5), 1.0),
        (DVec3::Y, 0.0, (-0.1, 0.1), 1.0),
    ]);
    let mut solver = Solver::new(&chain, &joints);
    for bend in [-1.0, 1.0] {
        let mut angles = [-0.7 * bend, 1.4 * bend, 0.0];
        for _ in 0..20 {
            // Nearer to the root than the bent bones can get.
            let target = DVec3::new(0.0, 0.0, -0.1);
            let solution = solver.solve(Method::CcdThenFinish, target, 0.1, &mut angles);
            assert!(!solution.is_new_branch && angles[1] * bend > 0.0, "{solution:?} {angles:?}");
        }
    }
}

#[test]
fn a_solve_depends_only_on_its_arguments() {
    let (chain, joints) = four_bones([0.1, 0.3, 0.5, 1.0]);
    let fresh = Solver::new(&chain, &joints);
    let mut used = fresh.clone();
    for step in 0..200 {
        let phi = 0.3 * f64::from(step);
        // Every other one is out of reach.
        let target = (0.4 + 0.7 * f64::from(step % 2)) * DVec3::new(phi.sin(), 0.0, phi.cos());
        let start = [0.1 * phi.sin(), 0.2 * phi.cos(), -0.5, 0.9];
        let mut angles = [start; 2];
        let solutions = [
            fresh.clone().solve(Method::CcdThenFinish, target, 0.1, &mut angles[0]),
            used.solve(Method::CcdThenFinish, target, 0.1, &mut angles[1]),
        ];
        assert_eq!(angles[0].map(f64::to_bits), angles[1].map(f64::to_bits));
        assert_eq!(solutions[0].residual_m.to_bits(), solutions[1].residual_m.to_bits());
    }
}

#[test]
fn a_number_that_is_not_finite_changes_nothing() {
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

    /// A chain in a tilted plane, with axes along and against one direction and links also out of the plane.
    /// With one more hinge that cannot turn, across the others, it is solved in three dimensions.
    #[test]
    fn a_plane_and_space_agree(
        tilt in proptest::array::uniform3(-2.0..2.0), place in proptest::array::uniform3(-0.5..0.5),
        target in proptest::array::uniform3(-0.8..0.8), start in proptest::array::uniform3(-1.0..1.0),
        pull in 0.0..0.2,
    ) {
        let (mut chain, mut joints) = chain_of(&[
            (DVec3::Y, 0.3, (-1.0, 1.4), 0.3),
            (DVec3::NEG_Y, 0.25, (-1.2, 1.3), 1.0),
            (DVec3::Y, 0.2, (-1.5, 1.1), 0.6),
        ]);
        for joint in &mut joints {
            joint.link_m += DVec3::new(0.02, 0.05, 0.0);
        }
        chain.root_m = DVec3::from(place);
        chain.root_rotation = DQuat::from_scaled_axis(DVec3::from(tilt));
        let target = chain.root_m + DVec3::from(target);
        let tip = |angles: &[f64]| {
            let (mut rotation, mut tip) = (chain.root_rotation, chain.root_m);
            for (joint, angle) in joints.iter().zip(angles) {
                rotation *= DQuat::from_axis_angle(joint.axis, *angle);
                tip += rotation * joint.link_m;
            }
            tip
        };
        let mut in_plane = start;
        let solution = Solver::new(&chain, &joints).solve(Method::CcdThenFinish, target, pull, &mut in_plane);
        prop_assert!((tip(&in_plane).distance(target) - solution.residual_m).abs() < 1e-9);

        let (_, held) = chain_of(&[(DVec3::X, 0.0, (0.0, 0.0), 1.0)]);
        let joints: Vec<Joint> = joints.iter().chain(&held).cloned().collect();
        let mut in_space = [start[0], start[1], start[2], 0.0];
        let in_space_solution =
            Solver::new(&chain, &joints).solve(Method::CcdThenFinish, target, pull, &mut in_space);
        // The solver does not change to a pose that is nearer by less than the tolerance for a reached target.
        let difference_m = (solution.residual_m - in_space_solution.residual_m).abs();
        prop_assert!(difference_m < REACHED_M + 1e-6, "{solution:?}, in space {in_space_solution:?}");
    }

    /// Following answers as a solution does, which looks elsewhere, too: whether this branch of poses gets there.
    #[test]
    fn following_reaches_what_a_solution_reaches_on_its_branch(
        from in proptest::array::uniform4(-1.0..1.0), steps in proptest::array::uniform2(-0.03..0.03),
    ) {
        let (chain, joints) = chain_of(&[
            (DVec3::Y, 0.3, (-0.9, 1.2), 0.3),
            (DVec3::Y, 0.25, (-1.2, 0.4), 1.0),
            (DVec3::Y, 0.2, (-1.0, 1.1), 0.6),
            (DVec3::Y, 0.1, (-0.5, 1.1), 0.6),
        ]);
        let mut solver = Solver::new(&chain, &joints);
        let (mut angles, mut target) = (from, DVec3::new(0.2, 0.0, -0.6));
        solver.solve(Method::CcdThenFinish, target, 0.1, &mut angles);
        for _ in 0..30 {
            target += DVec3::new(steps[0], 0.0, steps[1]);
            let mut followed = angles;
            let solution = solver.solve(Method::CcdThenFinish, target, 0.1, &mut angles);
            let following = solver.follow(target, 0.1, &mut followed);
            let is_reached = solution.residual_m <= REACHED_M && !solution.is_new_branch;
            prop_assert_eq!(following.residual_m <= REACHED_M, is_reached);
            let is_same = followed.iter().zip(&angles).all(|(one, other)| (one - other).abs() < 1e-12);
            prop_assert!(!is_reached || is_same);
        }
    }
}
