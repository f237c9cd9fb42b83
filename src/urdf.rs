//! The robot as URDF, for other programs.
//!
//! Names are those of the robot file: a joint keeps its name and moves the link `NAME.link`; the trunk is the
//! link `body`; each chain ends in the link `CHAIN.tip`. Frames, signs and zero angles are those of this
//! program. Masses and inertias are those of the simulated body ([`crate::simulation`]); a tip gets a small share of
//! the last link's mass, since some programs give a link without mass 1 kg. Shapes are those that touch the ground in
//! the simulation: the trunk is a box, links are round rods, feet are round or plates.

use std::fmt::Write;

use glam::{DQuat, DVec3, EulerRot};

use crate::model::{Chain, Foot, Joint, Robot};
use crate::simulation::{self, mass};

/// Name of the trunk's link.
pub const BODY: &str = "body";

/// Thickness of the sole of a chain that ends in a point: share of the last link's radius.
const POINT_SHARE: f64 = 0.5;

/// Programs that read MuJoCo's extension of URDF keep every link, and the trunk's mass. Others skip it.
const MUJOCO: &str = "  <mujoco>\n    <compiler fusestatic=\"false\"/>\n  </mujoco>\n";

/// Why a robot has no URDF.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UrdfError {
    /// An arm bent by cords: its joints are winches, each of which bends all joints of a section and of those
    /// before it. A tree of independent hinges would be another robot.
    #[error("{chain} is bent by cords: its joints are winches, and URDF has hinges only")]
    Cords {
        /// Name of the arm.
        chain: String,
    },
}

/// Where several hinges share a place, the rods on both sides end this far before it, in radii, to the touch: these
/// links are not neighbours, so other programs would let them touch in every pose.
const GAP_RADII: f64 = 2.0;
/// The longest such gap, as a share of the rod's length.
const GAP_SHARE: f64 = 0.35;

#[derive(Clone, Copy)]
enum Shape {
    Box(DVec3),
    Ball(f64),
    /// A round rod along z: length and radius, m.
    Rod(f64, f64),
}

/// A shape, its middle, m, and its turn, in the frame of its link.
type Placed = (Shape, DVec3, DQuat);

/// The URDF text of `robot`. A joint without a servo has effort and velocity limits of 0, since they are unknown.
///
/// # Errors
/// [`UrdfError`] if the robot is not a tree of hinges.
pub fn of_robot(robot: &Robot) -> Result<String, UrdfError> {
    if let Some(chain) = robot.chains.iter().find(|chain| chain.tendons.is_some()) {
        return Err(UrdfError::Cords { chain: chain.name.clone() });
    }
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n{MUJOCO}", escaped(&robot.name));
    let trunk = (Shape::Box(mass::trunk_box_m(robot)), robot.trunk_center_m, DQuat::IDENTITY);
    link(&mut text, BODY, &mass::trunk(robot), [&[trunk], &[trunk]]);
    for (place, chain) in robot.chains.iter().enumerate() {
        limb(&mut text, robot, (place, chain));
    }
    text.push_str("</robot>\n");
    Ok(text)
}

fn limb(text: &mut String, robot: &Robot, (place, chain): (usize, &Chain)) {
    let mut parent = BODY.to_owned();
    let (mut origin_m, mut rotation) = (chain.root_m, chain.root_rotation);
    let joints = robot.joints_of(chain);
    let mut masses = mass::links(robot, place);
    let mut tip_mass = mass::Mass::ball(0.0, [0.0; 3], 0.0);
    if let (Some(last), Some(joint)) = (masses.last_mut(), joints.last()) {
        let radius_m = mass::link_radius_m(robot, place, joint);
        tip_mass = mass::Mass { center_m: [0.0; 3], ..mass::take_ball(last, joint.link_m, radius_m) };
    }
    let mut sole = Vec::new();
    for (number, (joint, mass)) in joints.iter().zip(&masses).enumerate() {
        let child = format!("{}.link", joint.name);
        let radius_m = mass::link_radius_m(robot, place, joint);
        let next = joints.get(number + 1);
        let gap_m = (GAP_RADII * radius_m).min(GAP_SHARE * joint.link_m.length());
        let is_shared = |first: Option<&Joint>| first.is_some_and(|joint| joint.link_m.length() <= 0.0);
        let before_m =
            if is_shared(number.checked_sub(1).map(|before| &joints[before])) { gap_m } else { 0.0 };
        let after_m = match (next, chain.foot) {
            // Over a plate it ends above the sole, as simulated.
            (None, Some(Foot::Plate { .. })) => 2.0 * radius_m,
            _ if is_shared(next) => gap_m,
            _ => 0.0,
        };
        let seen = rod(joint.link_m, radius_m, (0.0, 0.0));
        let touched = rod(joint.link_m, radius_m, (before_m, after_m));
        link(text, &child, mass, [seen.as_slice(), touched.as_slice()]);
        hinge(text, robot, joint, (&parent, &child), (origin_m, rotation));
        if next.is_none() {
            sole = foot(chain, radius_m);
        }
        (origin_m, rotation) = (joint.link_m, DQuat::IDENTITY);
        parent = child;
    }
    let tip = format!("{}.tip", chain.name);
    link(text, &tip, &tip_mass, [&sole, &sole]);
    let _ = writeln!(text, "  <joint name=\"{}\" type=\"fixed\">", escaped(&format!("{tip}.mount")));
    connection(text, (&parent, &tip), (origin_m, DQuat::IDENTITY));
    text.push_str("  </joint>\n");
}

/// The rod of a link, in its frame, without these lengths at its two ends, m; `None` if nothing is left.
fn rod(link_m: DVec3, radius_m: f64, (before_m, after_m): (f64, f64)) -> Option<Placed> {
    let whole_m = link_m.length();
    let length_m = whole_m - before_m - after_m;
    (length_m > 0.0).then(|| {
        let along = link_m / whole_m;
        let turn = DQuat::from_rotation_arc(DVec3::Z, along);
        (Shape::Rod(length_m, radius_m), along * (before_m + 0.5 * length_m), turn)
    })
}

/// The foot at a chain's tip, in the tip's frame; a small ball if it ends in a point.
fn foot(chain: &Chain, radius_m: f64) -> Vec<Placed> {
    // The axes of a foot are the trunk's when all angles are 0.
    let turn = chain.root_rotation.inverse();
    match chain.foot {
        None => vec![(Shape::Ball(POINT_SHARE * radius_m), DVec3::ZERO, DQuat::IDENTITY)],
        Some(Foot::Plate { size_m, middle_m }) => vec![(Shape::Box(size_m), turn * middle_m, turn)],
        Some(Foot::Round { radius_m, width_m }) => {
            let across = turn * DVec3::Y;
            let end = |side: f64| (Shape::Ball(radius_m), across * (0.5 * side * width_m), DQuat::IDENTITY);
            let mut sole = vec![end(1.0)];
            if width_m > 0.0 {
                let turn = DQuat::from_rotation_arc(DVec3::Z, across);
                sole.extend([end(-1.0), (Shape::Rod(width_m, radius_m), DVec3::ZERO, turn)]);
            }
            sole
        }
    }
}

fn hinge(text: &mut String, robot: &Robot, joint: &Joint, links: (&str, &str), place: (DVec3, DQuat)) {
    let (low, high) = joint.range_rad;
    let model = joint.servo.map(|servo| servo.model);
    let (effort, velocity, friction) = model.map_or((0.0, 0.0, 0.0), |model| {
        (model.stall_torque_nm, model.no_load_speed_rad_s, simulation::friction_nm(model))
    });
    let damping = robot.physics.as_ref().map_or(0.0, |physics| physics.viscosity_nm_s);
    let _ = writeln!(text, "  <joint name=\"{}\" type=\"revolute\">", escaped(&joint.name));
    connection(text, links, place);
    let _ = writeln!(text, "    <axis xyz=\"{}\"/>", numbers(joint.axis));
    let _ = writeln!(
        text,
        "    <limit lower=\"{low}\" upper=\"{high}\" effort=\"{effort}\" velocity=\"{velocity}\"/>"
    );
    let _ = writeln!(text, "    <dynamics damping=\"{damping}\" friction=\"{friction}\"/>");
    text.push_str("  </joint>\n");
}

fn connection(text: &mut String, (parent, child): (&str, &str), (origin_m, rotation): (DVec3, DQuat)) {
    let _ = writeln!(text, "    <parent link=\"{}\"/>", escaped(parent));
    let _ = writeln!(text, "    <child link=\"{}\"/>", escaped(child));
    let _ = writeln!(text, "    {}", origin(origin_m, rotation));
}

/// A link with its mass, and the shapes to see and to touch.
fn link(text: &mut String, name: &str, mass: &mass::Mass, [seen, touched]: [&[Placed]; 2]) {
    let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] =
        mass.inertia_kg_m2().map(|row| row.map(|value| value + 0.0));
    let _ = writeln!(text, "  <link name=\"{}\">", escaped(name));
    let _ = writeln!(text, "    <inertial>");
    let _ = writeln!(text, "      {}", origin(DVec3::from_array(mass.center_m), DQuat::IDENTITY));
    let _ = writeln!(text, "      <mass value=\"{}\"/>", mass.mass_kg);
    let _ = writeln!(
        text,
        "      <inertia ixx=\"{xx}\" ixy=\"{xy}\" ixz=\"{xz}\" iyy=\"{yy}\" iyz=\"{yz}\" izz=\"{zz}\"/>"
    );
    text.push_str("    </inertial>\n");
    for (kind, shapes) in [("visual", seen), ("collision", touched)] {
        for (shape, middle_m, turn) in shapes {
            let _ = writeln!(text, "    <{kind}>\n      {}", origin(*middle_m, *turn));
            let shape = match shape {
                Shape::Box(edges_m) => format!("<box size=\"{}\"/>", numbers(*edges_m)),
                Shape::Ball(radius_m) => format!("<sphere radius=\"{radius_m}\"/>"),
                Shape::Rod(length_m, radius_m) => {
                    format!("<cylinder radius=\"{radius_m}\" length=\"{length_m}\"/>")
                }
            };
            let _ = writeln!(text, "      <geometry>{shape}</geometry>\n    </{kind}>");
        }
    }
    text.push_str("  </link>\n");
}

fn origin(place_m: DVec3, rotation: DQuat) -> String {
    // Roll, pitch, yaw about fixed axes equal yaw, pitch, roll about moving axes.
    let (yaw, pitch, roll) = rotation.to_euler(EulerRot::ZYX);
    format!("<origin xyz=\"{}\" rpy=\"{}\"/>", numbers(place_m), numbers(DVec3::new(roll, pitch, yaw)))
}

fn numbers(v: DVec3) -> String {
    // Adding zero makes -0 a plain 0.
    let v = v + DVec3::ZERO;
    format!("{} {} {}", v.x, v.y, v.z)
}

fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_name_cannot_break_the_urdf() {
        assert_eq!(escaped("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
    }
}
