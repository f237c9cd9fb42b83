//! Two arms that are ordered to go through each other.

use super::*;
use crate::config;

const TEXT: &str = include_str!("../../../../config/octopus.toml");

fn robot() -> (Robot, TentacleMotion) {
    let robot = config::parse(TEXT, "octopus").unwrap().robot;
    let tentacle = robot.motion.tentacle().unwrap().clone();
    (robot, tentacle)
}

/// Least distance of the first two arms, skin to skin, between points along their links, m.
fn apart_m(robot: &Robot, angles: &[f64]) -> f64 {
    let along = |chain: usize| -> Vec<DVec3> {
        let chain = &robot.chains[chain];
        let ends = robot.places_in_body(chain, angles[chain.joints.clone()].iter().copied());
        let links = ends.windows(2).skip(4);
        links.flat_map(|pair| (0..=10).map(|part| pair[0].lerp(pair[1], f64::from(part) / 10.0))).collect()
    };
    let (a, b) = (along(0), along(1));
    let pairs = a.iter().flat_map(|a| b.iter().map(|b| a.distance(*b)));
    pairs.fold(f64::INFINITY, f64::min) - 0.03
}

#[test]
fn arms_that_are_swept_into_each_other_stop_at_the_distance_and_part_again() {
    let (robot, tentacle) = robot();
    let mut clearance = Clearance::new(&robot, &tentacle);
    let dt_s = robot.period_s();
    let mut before: Option<[Vec<f64>; 2]> = None;
    let (mut least_m, mut is_turned_aside) = (f64::INFINITY, false);
    for cycle in 0..1200 {
        // The first arm to the left and the second to the right, there and back, in six seconds each way.
        let share = 0.5 - 0.5 * (std::f64::consts::TAU * f64::from(cycle) / 1200.0).cos();
        let mut wanted = vec![0.0; robot.joints.len()];
        wanted[1] = 0.9 * share;
        wanted[6 + 1] = -0.9 * share;
        let mut angles = wanted.clone();
        clearance.keep(Mode::Strokes, &mut angles);
        least_m = least_m.min(apart_m(&robot, &angles));
        is_turned_aside |= (angles[1] - wanted[1]).abs() > 0.1;
        if let Some([last, earlier]) = &before {
            for ((now, last), earlier) in angles.iter().zip(last).zip(earlier) {
                let acceleration = (now - 2.0 * last + earlier) / (dt_s * dt_s);
                assert!(acceleration.abs() < 40.0, "{acceleration} rad/s^2 in cycle {cycle}");
            }
        }
        before = Some([angles.clone(), before.map_or(angles, |[last, _]| last)]);
    }
    assert!(is_turned_aside, "they never met");
    let wanted_m = tentacle.clearance_m;
    assert!((wanted_m..1.5 * wanted_m).contains(&least_m), "{least_m} m, {wanted_m} m wanted");
    // For a while nothing is asked of the arms: their deviation has faded.
    let mut angles = vec![0.0; robot.joints.len()];
    for _ in 0..1000 {
        angles.fill(0.0);
        clearance.keep(Mode::Strokes, &mut angles);
    }
    assert!(angles.iter().all(|angle| angle.abs() < 1e-6), "{angles:?}");
}

#[test]
fn arms_that_keep_clear_reach_their_targets_exactly() {
    let (robot, tentacle) = robot();
    let mut clearance = Clearance::new(&robot, &tentacle);
    for cycle in 0..300 {
        let swing = 0.4 - 0.4 * (0.05 * f64::from(cycle)).cos();
        let wanted: Vec<f64> =
            (0..robot.joints.len()).map(|joint| if joint % 2 == 0 { swing } else { 0.0 }).collect();
        let mut angles = wanted.clone();
        clearance.keep(Mode::Strokes, &mut angles);
        assert!(angles.iter().zip(&wanted).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

#[test]
fn a_pose_moves_no_arm_that_already_lies_on_another() {
    let (robot, tentacle) = robot();
    let mut clearance = Clearance::new(&robot, &tentacle);
    let mut tangled = vec![0.0; robot.joints.len()];
    (tangled[1], tangled[7]) = (1.0, -1.0);
    assert!(apart_m(&robot, &tangled) < tentacle.clearance_m);
    for _ in 0..50 {
        let mut angles = tangled.clone();
        clearance.keep(Mode::Pose, &mut angles);
        assert_eq!(angles, tangled);
    }
}
