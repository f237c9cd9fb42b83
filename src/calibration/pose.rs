//! The marked pose, and words for the direction in which the end of a limb moves when a joint turns.
//!
//! The marked pose is the middle of every joint's range. A person finds it halfway between a joint's ends; a
//! straight arm of a rig is in it; and a horn sits best there, furthest from the seam of its encoder on both sides.

use glam::{DQuat, DVec3};

use crate::model::{Joint, Robot};

/// Small turn for the direction of motion, rad.
const PROBE_RAD: f64 = 1e-4;
/// An end that moves less than this share of its limb's length per radian turns on the spot.
const ON_THE_SPOT: f64 = 0.1;

/// The marked pose, rad, in the order of the joints.
pub fn marked_pose_rad(robot: &Robot) -> Vec<f64> {
    robot.joints.iter().map(Joint::middle_rad).collect()
}

/// Direction in which the end of its limb moves when joint number `joint` turns forward from the marked pose, in
/// words that follow "its end goes"; and the direction when it turns back.
pub fn ways(robot: &Robot, joint: usize) -> [String; 2] {
    let Some(chain) = robot.chains.iter().find(|chain| chain.joints.contains(&joint)) else {
        return ["forward".to_owned(), "back".to_owned()];
    };
    let tip = |turn_rad: f64| {
        let angles = chain
            .joints
            .clone()
            .map(|index| robot.joints[index].middle_rad() + if index == joint { turn_rad } else { 0.0 });
        robot.tip_in_body(chain, angles)
    };
    let way = (tip(PROBE_RAD) - tip(-PROBE_RAD)) / (2.0 * PROBE_RAD);
    let length_m = chain.length_m(robot.joints_of(chain));
    if way.length() < ON_THE_SPOT * length_m {
        let mut rotation = chain.root_rotation;
        for index in chain.joints.start..joint {
            let before = &robot.joints[index];
            rotation *= DQuat::from_axis_angle(before.axis, before.middle_rad());
        }
        let seen_from = side(
            rotation * robot.joints[joint].axis,
            ["the front", "behind"],
            ["the left", "the right"],
            ["above", "below"],
        );
        return ["anticlockwise", "clockwise"].map(|turn| format!("{turn}, seen from {seen_from}"));
    }
    [way, -way].map(|way| side(way, ["forward", "back"], ["left", "right"], ["up", "down"]).to_owned())
}

/// The name of the side of the body that `way` points to most.
fn side<'w>(way: DVec3, x: [&'w str; 2], y: [&'w str; 2], z: [&'w str; 2]) -> &'w str {
    let size = way.abs();
    let (part, names) = if size.x >= size.y && size.x >= size.z {
        (way.x, x)
    } else if size.y >= size.z {
        (way.y, y)
    } else {
        (way.z, z)
    };
    if part >= 0.0 { names[0] } else { names[1] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn horse() -> Robot {
        crate::config::parse(include_str!("../../config/horse.toml"), "horse.toml").unwrap().robot
    }

    #[test]
    fn a_hanging_leg_swings_back_when_it_turns_forward_about_the_left() {
        let robot = horse();
        // REP-103: a positive turn about +y takes -z to -x.
        let hip = robot.joints.iter().position(|joint| joint.name == "left_hind.hip").unwrap();
        assert_eq!(ways(&robot, hip), ["back", "forward"]);
    }

    #[test]
    fn a_joint_that_turns_about_its_own_limb_is_described_by_its_rotation() {
        let mut robot = horse();
        // A chain that hangs straight down, and turns about itself.
        for joint in &mut robot.joints[..4] {
            joint.range_rad = (-0.5, 0.5);
        }
        robot.joints[0].axis = DVec3::NEG_Z;
        assert_eq!(ways(&robot, 0), ["anticlockwise, seen from below", "clockwise, seen from below"]);
        robot.joints[0].axis = DVec3::X;
        assert_eq!(ways(&robot, 0), ["left", "right"]);
    }
}
