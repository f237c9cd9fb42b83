//! Tests of an arm's inverse kinematics, on arms made here.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::{ArmSolution, ArmSolver};
use crate::config;
use crate::model::ball_joint::{Corner, SwingTwist};
use crate::model::{ArmGeometry, BallJoint, Bending, Chain, Joint, Robot};
use crate::signals::{ArmAim, ArmTarget};

const PERIOD_S: f64 = 0.01;

/// The thesis' arm of 12 joints of two hinges each, with its root at an arbitrary position and orientation.
struct Rig {
    chain: Chain,
    joints: Vec<Joint>,
    arm: ArmGeometry,
}

impl Rig {
    fn new(range_rad: f64) -> Rig {
        let text = include_str!("../../../tests/common/thesis_arm.toml");
        let Robot { mut chains, mut joints, .. } = config::parse(text, "thesis arm").unwrap().robot;
        joints.iter_mut().for_each(|joint| joint.range_rad = (-range_rad, range_rad));
        let mut chain = chains.remove(0);
        chain.root_m = DVec3::new(0.3, -0.2, 1.1);
        chain.root_rotation = DQuat::from_scaled_axis(DVec3::new(0.3, 0.8, -0.5));
        let arm = ArmGeometry::of(&chain, &joints).unwrap();
        Rig { chain, joints, arm }
    }

    fn solver(&self, bending: Bending) -> ArmSolver {
        ArmSolver::new(&self.arm, &self.chain, &self.joints, bending, PERIOD_S)
    }

    /// Ends of all links and orientation of the last, by separate forward kinematics.
    fn places(&self, angles: &[f64]) -> (Vec<DVec3>, DQuat) {
        let (mut place, mut rotation) = (self.chain.root_m, self.chain.root_rotation);
        let mut places = Vec::new();
        for (joint, angle) in self.joints.iter().zip(angles) {
            rotation *= DQuat::from_axis_angle(joint.axis, *angle);
            place += rotation * joint.link_m;
            if joint.link_m.length() > 0.0 {
                places.push(place);
            }
        }
        (places, rotation)
    }

    fn target(&self, aim: ArmAim, angles: &[f64]) -> ArmTarget {
        let (places, rotation) = self.places(angles);
        ArmTarget {
            aim,
            ends_in_body: [places[3], places[7], places[11]],
            direction_in_body: rotation * DVec3::X,
            places_in_body: places,
            faced_in_body: None,
            change: 0,
        }
    }
}

/// Poses within `share` of the ranges.
fn poses(rig: &Rig, share: f64) -> impl FnMut() -> Vec<f64> {
    let limits: Vec<f64> = rig.joints.iter().map(|joint| share * joint.range_rad.1).collect();
    let mut source = Pcg64Mcg::seed_from_u64(7);
    let mut draw = move || (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    move || limits.iter().map(|limit| limit * (2.0 * draw() - 1.0)).collect()
}

#[test]
fn tips_are_reached_from_a_cold_start() {
    for range_deg in [45.0_f64, 90.0] {
        let rig = Rig::new(range_deg.to_radians());
        let mut solver = rig.solver(Bending::Smooth);
        let mut pose = poses(&rig, 1.0);
        for index in 0..2000 {
            let target = rig.target(ArmAim::Tip, &pose());
            let mut angles = vec![0.0; 24];
            let solution = solver.solve(&target, true, &mut angles);
            let (places, _) = rig.places(&angles);
            let miss_m = places[11].distance(target.ends_in_body[2]);
            assert!(miss_m < 1e-3 * 5.67, "{index}: {miss_m} m left within {range_deg} degrees");
            assert!((solution.tip_residual_m - miss_m).abs() < 1e-9, "the residual is true");
        }
    }
}

#[test]
fn tips_are_reached_from_a_direction() {
    let rig = Rig::new(PI / 3.0);
    let mut solver = rig.solver(Bending::Smooth);
    let mut pose = poses(&rig, 0.6);
    for index in 0..300 {
        let target = rig.target(ArmAim::TipAlong, &pose());
        let mut angles = vec![0.0; 24];
        solver.solve(&target, true, &mut angles);
        let (places, rotation) = rig.places(&angles);
        assert!(places[11].distance(target.ends_in_body[2]) < 1e-3 * 5.67, "{index}");
        let off = (rotation * DVec3::X).angle_between(target.direction_in_body);
        assert!(off < 0.02, "{index}: points {off} rad aside");
    }
}

#[test]
fn positions_of_all_links_are_followed_exactly() {
    let rig = Rig::new(1.5);
    let mut solver = rig.solver(Bending::Smooth);
    let mut pose = poses(&rig, 0.6);
    for _ in 0..300 {
        let wanted = pose();
        let target = rig.target(ArmAim::Places, &wanted);
        let mut angles = vec![0.0; 24];
        let solution = solver.solve(&target, false, &mut angles);
        assert!(solution.residual_m < 1e-9, "{solution:?}");
        assert!(angles.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-6), "and there is but one pose");
    }
}

#[test]
fn both_rules_bring_group_ends_to_their_targets() {
    let rig = Rig::new(1.5);
    let mut pose = poses(&rig, 0.25);
    for bending in [Bending::Ccd, Bending::Smooth] {
        let mut solver = rig.solver(bending);
        for index in 0..200 {
            let target = rig.target(ArmAim::Ends, &pose());
            let mut angles = vec![0.01; 24];
            let mut solution = solver.solve(&target, true, &mut angles);
            for _ in 0..20 {
                solution = solver.solve(&target, false, &mut angles);
            }
            assert!(solution.residual_m < 0.02 * 5.67, "{bending:?} {index}: {solution:?}");
            let (places, _) = rig.places(&angles);
            let misses = [3, 7, 11].map(|link| places[link].distance(target.places_in_body[link]));
            let largest_m = misses.into_iter().fold(0.0, f64::max);
            assert!((largest_m - solution.residual_m).abs() < 1e-9, "the residual is true");
        }
    }
}

#[test]
fn a_low_stiffness_ratio_at_the_root_moves_the_tip_and_vice_versa() {
    // For one group whose end moves sideways: the shares of its last and its first joint in the turns.
    let shares = |ratios: [f64; 4]| {
        let mut rig = Rig::new(1.5);
        for (ball, ratio) in ratios.into_iter().enumerate() {
            rig.joints[2 * ball..2 * ball + 2].iter_mut().for_each(|joint| joint.stiffness = ratio);
        }
        let mut aside = vec![0.0; 24];
        (0..4).for_each(|ball| aside[2 * ball + 1] = 0.3);
        let target = rig.target(ArmAim::Ends, &aside);
        let mut angles = vec![0.0; 24];
        rig.solver(Bending::Ccd).solve(&target, true, &mut angles);
        let whole: f64 = (0..4).map(|ball| angles[2 * ball + 1].abs()).sum();
        [angles[1].abs() / whole, angles[5].abs() / whole]
    };
    let (rising, falling) = (shares([0.1, 0.3, 0.6, 1.0]), shares([1.0, 0.6, 0.3, 0.1]));
    assert!(rising[0] < falling[0] && rising[1] > falling[1], "{rising:?}, the other way round {falling:?}");
}

#[test]
fn ranges_hold_for_any_target() {
    let mut rig = Rig::new(0.5);
    let corner = |y: f64, z: f64| Corner { swing: DVec2::new(y, z), twist_rad: (-0.1, 0.1) };
    let range =
        BallJoint::new(vec![corner(-0.15, -0.15), corner(0.2, -0.1), corner(0.1, 0.2), corner(-0.1, 0.1)])
            .unwrap();
    for joint in rig.arm.joints.iter_mut().step_by(2) {
        joint.range = Some(range.clone());
    }
    let mut pose = poses(&rig, 1.0);
    for bending in [Bending::Ccd, Bending::Smooth] {
        let mut solver = rig.solver(bending);
        let mut angles = vec![0.0; 24];
        for index in 0..400 {
            let aim = [ArmAim::Ends, ArmAim::Tip, ArmAim::TipAlong, ArmAim::Places][index % 4];
            let mut target = rig.target(aim, &pose());
            target.ends_in_body[2] *= 1.0 + 0.5 * (index % 3) as f64;
            let ArmSolution { residual_m, .. } = solver.solve(&target, index % 7 == 0, &mut angles);
            assert!(residual_m.is_finite());
            assert!(angles.iter().all(|angle| (-0.5..=0.5).contains(angle)), "{angles:?}");
            for pair in angles.chunks(2).step_by(2) {
                let turn = DQuat::from_rotation_y(-pair[0]) * DQuat::from_rotation_z(pair[1]);
                let swing = SwingTwist::of(turn).swing;
                let off = range.nearest_swing(swing).distance(swing);
                assert!(off < 1e-9, "{bending:?} {index}: {swing} is outside by {off}");
            }
        }
    }
}

#[test]
fn a_third_hinge_twists_within_the_range_and_moves_no_place() {
    let mut rig = Rig::new(1.2);
    let mut joints = Vec::new();
    for pair in rig.joints.chunks(2) {
        let mut sweep = pair[1].clone();
        let link_m = std::mem::take(&mut sweep.link_m);
        let twist = Joint { axis: DVec3::X, link_m, ..sweep.clone() };
        joints.extend([pair[0].clone(), sweep, twist]);
    }
    rig.chain.joints = 0..joints.len();
    rig.joints = joints;
    rig.arm = ArmGeometry::of(&rig.chain, &rig.joints).unwrap();
    let mut pose = poses(&rig, 0.4);
    let mut solver = rig.solver(Bending::Smooth);
    for _ in 0..100 {
        let target = rig.target(ArmAim::Places, &pose());
        let mut angles = vec![0.0; 36];
        assert!(solver.solve(&target, true, &mut angles).residual_m < 1e-9);
        assert!(angles.iter().skip(2).step_by(3).all(|twist| *twist == 0.0));
    }
}

#[test]
fn a_number_that_is_not_finite_changes_nothing() {
    let rig = Rig::new(1.0);
    let mut solver = rig.solver(Bending::Smooth);
    for aim in [ArmAim::Ends, ArmAim::Tip, ArmAim::TipAlong, ArmAim::Places] {
        let mut target = rig.target(aim, &[0.1; 24]);
        target.ends_in_body[2].y = f64::NAN;
        target.places_in_body[5].z = f64::INFINITY;
        let mut angles = [0.2; 24];
        assert!(solver.solve(&target, true, &mut angles).residual_m.is_infinite());
        assert_eq!(angles.map(f64::to_bits), [0.2; 24].map(f64::to_bits));
    }
}
