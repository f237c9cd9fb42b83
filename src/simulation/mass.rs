//! How heavy each part of a robot file is and how its mass lies, for the simulated body and for URDF.
//!
//! The file gives masses and their centres. A link's mass lies like that of a round rod, a link without length is a
//! ball, and the trunk is a box. A link without mass, as of hinges that share a place with the next, gets a small ball
//! about its hinge from its neighbour, since a joint between two parts needs mass on both sides. The ball lies on all
//! axes of that place, so that the mass, the centre of mass and the inertia of the whole robot are the same in every
//! pose.

use std::f64::consts::PI;

use glam::DVec3;
pub(crate) use hw_sim::body::Mass;

use crate::model::{Chain, Joint, Robot};

/// Share of a link's mass that becomes a ball at one of its ends.
const BALL_SHARE: f64 = 0.01;
/// Least mass of such a ball, kg: programs take much less for none.
const BALL_MIN_KG: f64 = 1e-6;
/// A ball where no neighbour has mass to give, kg. The robot weighs so much more than its file says.
const LONE_BALL_KG: f64 = 1e-4;
/// Density of a link of unknown radius, kg/m^3: that of water.
const DENSITY_KG_M3: f64 = 1000.0;
/// Radius of a link of unknown radius that has no mass, m: that of a servo's horn with its bracket.
const HORN_RADIUS_M: f64 = 0.008;

/// Edges of the trunk's box, m: those of `[physics]`; or a cube as large as the base of arms; or the box between the
/// limbs' roots. An edge that roots do not span is as long as the shortest that they do.
pub(crate) fn trunk_box_m(robot: &Robot) -> DVec3 {
    if let Some(edges_m) = robot.physics.as_ref().and_then(|physics| physics.trunk_box_m) {
        return edges_m;
    }
    if let Some(radius_m) = robot.motion.tentacle().and_then(|tentacle| tentacle.base_radius_m) {
        return DVec3::splat(2.0 * radius_m);
    }
    let (low, high) = robot.root_extent();
    let edges_m = high - low;
    let spanned = edges_m.to_array().into_iter().filter(|edge| *edge > 1e-3);
    let shortest_m = spanned.reduce(f64::min).unwrap_or(0.1);
    edges_m.max(DVec3::splat(shortest_m))
}

/// The mass of the trunk, body frame.
pub(crate) fn trunk(robot: &Robot) -> Mass {
    Mass::cuboid(robot.trunk_mass_kg, robot.trunk_center_m.to_array(), trunk_box_m(robot).to_array())
}

/// Radius of the round rod that stands for this joint's link, m: the arm's; or that of `[physics]`; or that of a rod
/// as dense as water.
pub(crate) fn link_radius_m(robot: &Robot, place: usize, joint: &Joint) -> f64 {
    let arm =
        robot.motion.tentacle().and_then(|tentacle| tentacle.arms.iter().find(|arm| arm.chain == place));
    if let Some(arm) = arm {
        return arm.radius_m;
    }
    if let Some(physics) = &robot.physics {
        return physics.link_radius_m;
    }
    let (volume_m3, length_m) = (joint.mass_kg / DENSITY_KG_M3, joint.link_m.length());
    match (volume_m3 > 0.0, length_m > 0.0) {
        (false, _) => HORN_RADIUS_M,
        (true, true) => (volume_m3 / (PI * length_m)).sqrt(),
        (true, false) => (0.75 * volume_m3 / PI).cbrt(),
    }
}

/// The mass of every link of the chain at `place`, root first, each in its joint's frame. All are above 0.
pub(crate) fn links(robot: &Robot, place: usize) -> Vec<Mass> {
    let chain: &Chain = &robot.chains[place];
    let joints = robot.joints_of(chain);
    let radius_m = |joint: &Joint| link_radius_m(robot, place, joint);
    let rod = |joint: &Joint| {
        let (center_m, along_m) = (joint.center_m.to_array(), joint.link_m.to_array());
        Mass::rod(joint.mass_kg, center_m, along_m, radius_m(joint))
    };
    let mut masses: Vec<Mass> = joints.iter().map(rod).collect();
    // From the tip inwards, so that a neighbour outwards has mass by then. The tip itself has none.
    for (number, joint) in joints.iter().enumerate().rev().filter(|(_, joint)| joint.mass_kg <= 0.0) {
        masses[number] = match (number + 1 < joints.len(), number.checked_sub(1)) {
            // The next link's hinge lies at this link's end.
            (true, _) => {
                let ball = take_ball(&mut masses[number + 1], DVec3::ZERO, radius_m(joint));
                Mass { center_m: joint.link_m.to_array(), ..ball }
            }
            // This link's hinge lies at the end of the link before.
            (false, Some(before)) => {
                let ball = take_ball(&mut masses[before], joints[before].link_m, radius_m(joint));
                Mass { center_m: [0.0; 3], ..ball }
            }
            (false, None) => Mass::ball(LONE_BALL_KG, [0.0; 3], radius_m(joint)),
        };
    }
    masses
}

/// Takes a ball about `place_m` out of `from`: a hundredth of its mass, or less if the rest could not exist. If `from`
/// can give nothing there, the ball is new and light.
pub(crate) fn take_ball(from: &mut Mass, place_m: DVec3, radius_m: f64) -> Mass {
    let shares = [BALL_SHARE, 0.1 * BALL_SHARE, 0.01 * BALL_SHARE];
    let mut shares = shares.into_iter().filter(|share| share * from.mass_kg >= BALL_MIN_KG);
    let split = shares.find_map(|share| from.split(share, place_m.to_array(), radius_m));
    let Some((rest, ball)) = split else { return Mass::ball(LONE_BALL_KG, place_m.to_array(), radius_m) };
    *from = rest;
    ball
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn robot(text: &str) -> Robot {
        crate::config::parse(text, "robot.toml").unwrap().robot
    }

    /// Mass, mass times centre, and trace of the inertia about the body's origin of the first chain's links with these
    /// masses at these angles: kg, kg m, kg m^2.
    fn weighed(robot: &Robot, masses: &[Mass], angles: &[f64]) -> (f64, DVec3, f64) {
        let chain = &robot.chains[0];
        let (mut place, mut turn) = (chain.root_m, chain.root_rotation);
        let (mut mass_kg, mut moment, mut trace) = (0.0, DVec3::ZERO, 0.0);
        for ((mass, joint), angle) in masses.iter().zip(robot.joints_of(chain)).zip(angles) {
            turn *= glam::DQuat::from_axis_angle(joint.axis, *angle);
            let center_m = place + turn * DVec3::from_array(mass.center_m);
            mass_kg += mass.mass_kg;
            moment += mass.mass_kg * center_m;
            trace +=
                mass.principal_kg_m2.iter().sum::<f64>() + 2.0 * mass.mass_kg * center_m.length_squared();
            place += turn * joint.link_m;
        }
        (mass_kg, moment, trace)
    }

    #[test]
    fn hinges_in_one_place_have_mass_and_the_arm_weighs_and_turns_as_before() {
        let robot = robot(include_str!("../../config/tentacle.toml"));
        let masses = links(&robot, 0);
        // Every second hinge has no mass in the file.
        let rods: Vec<Mass> = robot
            .joints_of(&robot.chains[0])
            .iter()
            .map(|joint| Mass::rod(joint.mass_kg, joint.center_m.to_array(), joint.link_m.to_array(), 0.018))
            .collect();
        assert!(rods[0].mass_kg <= 0.0 && masses.iter().all(|mass| mass.mass_kg > 4e-4));
        let angles: Vec<f64> = (0..24_u32).map(|joint| f64::from(joint).sin()).collect();
        let (before, after) = (weighed(&robot, &rods, &angles), weighed(&robot, &masses, &angles));
        assert!((before.0 - after.0).abs() < 1e-12 && before.1.distance(after.1) < 1e-12);
        assert!((before.2 - after.2).abs() < 1e-12, "{before:?} {after:?}");
    }

    #[test]
    fn a_last_link_without_mass_takes_some_from_the_one_before() {
        let text = include_str!("../../config/horse.toml").replace("mass_kg = 0.064375", "mass_kg = 0.05");
        let light = |text: &str, nth: usize| {
            let (at, _) = text.match_indices("mass_kg = 0.05").nth(nth).unwrap();
            format!("{}mass_kg = 0.00{}", &text[..at], &text[at + "mass_kg = 0.05".len()..])
        };
        let robot = robot(&light(&text, 3));
        assert!(robot.joints[3].mass_kg <= 0.0);
        let masses = links(&robot, 0);
        assert!((masses[3].mass_kg - 5e-4).abs() < 1e-12 && masses[3].principal_kg_m2[0] > 0.0);
        assert!((masses.iter().map(|mass| mass.mass_kg).sum::<f64>() - 0.15).abs() < 1e-12);
    }

    #[test]
    fn links_of_a_limb_without_any_mass_can_be_moved() {
        let text = include_str!("../../config/horse.toml").replace("mass_kg = 0.064375", "mass_kg = 0");
        let masses = links(&robot(&text), 0);
        assert!(masses.iter().all(|mass| mass.mass_kg >= BALL_MIN_KG && mass.principal_kg_m2[0] > 1e-12));
    }

    #[test]
    fn a_trunk_that_the_file_gives_no_box_is_no_plate() {
        // The limbs' roots span no height.
        let edges_m = trunk_box_m(&robot(include_str!("../../config/thoroughbred.toml")));
        assert!(edges_m.min_element() > 0.2, "{edges_m}");
        let edges_m = trunk_box_m(&robot(include_str!("../../config/tentacle.toml")));
        assert!(edges_m.distance(DVec3::splat(0.08)) < 1e-12, "{edges_m}");
    }
}
