//! The robot as URDF, for other programs.
//!
//! Names are those of the robot file: a joint keeps its name and moves the link `NAME.link`; the trunk is the
//! link `body`; each chain ends in the massless link `CHAIN.tip`. Frames, signs and zero angles are those of this
//! program. Inertias are estimates from masses and sizes: the links are slender rods, the trunk a box between the
//! roots of the limbs.

use std::fmt::Write;

use glam::{DMat3, DVec3, EulerRot};

use crate::model::{Chain, Joint, Robot};

/// Name of the trunk's link.
pub const BODY: &str = "body";

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

/// The URDF text of `robot`. A joint without a servo has effort and velocity limits of 0, since they are unknown.
///
/// # Errors
/// [`UrdfError`] if the robot is not a tree of hinges.
pub fn of_robot(robot: &Robot) -> Result<String, UrdfError> {
    if let Some(chain) = robot.chains.iter().find(|chain| chain.tendons.is_some()) {
        return Err(UrdfError::Cords { chain: chain.name.clone() });
    }
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escaped(&robot.name));
    let (low, high) = robot.root_extent();
    link(
        &mut text,
        BODY,
        robot.trunk_mass_kg,
        robot.trunk_center_m,
        box_inertia(robot.trunk_mass_kg, high - low),
    );
    for chain in &robot.chains {
        limb(&mut text, robot, chain);
    }
    text.push_str("</robot>\n");
    Ok(text)
}

fn limb(text: &mut String, robot: &Robot, chain: &Chain) {
    let mut parent = BODY.to_owned();
    let (mut origin_m, mut rotation) = (chain.root_m, chain.root_rotation);
    for joint in robot.joints_of(chain) {
        let child = format!("{}.link", joint.name);
        link(text, &child, joint.mass_kg, joint.center_m, rod_inertia(joint.mass_kg, joint.link_m));
        // Roll, pitch, yaw about fixed axes equal yaw, pitch, roll about moving axes.
        let (yaw, pitch, roll) = rotation.to_euler(EulerRot::ZYX);
        hinge(text, joint, &parent, &child, origin_m, DVec3::new(roll, pitch, yaw));
        (origin_m, rotation) = (joint.link_m, glam::DQuat::IDENTITY);
        parent = child;
    }
    let tip = format!("{}.tip", chain.name);
    let _ = writeln!(text, "  <link name=\"{}\"/>", escaped(&tip));
    let _ = writeln!(text, "  <joint name=\"{}\" type=\"fixed\">", escaped(&format!("{tip}.mount")));
    connection(text, &parent, &tip, origin_m, DVec3::ZERO);
    text.push_str("  </joint>\n");
}

fn hinge(text: &mut String, joint: &Joint, parent: &str, child: &str, origin_m: DVec3, rpy: DVec3) {
    let (low, high) = joint.range_rad;
    let (effort, velocity) = joint
        .servo
        .as_ref()
        .map_or((0.0, 0.0), |servo| (servo.model.stall_torque_nm, servo.model.no_load_speed_rad_s));
    let _ = writeln!(text, "  <joint name=\"{}\" type=\"revolute\">", escaped(&joint.name));
    connection(text, parent, child, origin_m, rpy);
    let _ = writeln!(text, "    <axis xyz=\"{}\"/>", numbers(joint.axis));
    let _ = writeln!(
        text,
        "    <limit lower=\"{low}\" upper=\"{high}\" effort=\"{effort}\" velocity=\"{velocity}\"/>"
    );
    text.push_str("  </joint>\n");
}

fn connection(text: &mut String, parent: &str, child: &str, origin_m: DVec3, rpy: DVec3) {
    let _ = writeln!(text, "    <parent link=\"{}\"/>", escaped(parent));
    let _ = writeln!(text, "    <child link=\"{}\"/>", escaped(child));
    let _ = writeln!(text, "    <origin xyz=\"{}\" rpy=\"{}\"/>", numbers(origin_m), numbers(rpy));
}

/// A link with its centre of mass (link frame, m) and its inertia about that point (kg m^2).
fn link(text: &mut String, name: &str, mass_kg: f64, center_m: DVec3, inertia: DMat3) {
    let _ = writeln!(text, "  <link name=\"{}\">", escaped(name));
    let _ = writeln!(text, "    <inertial>");
    let _ = writeln!(text, "      <origin xyz=\"{}\" rpy=\"0 0 0\"/>", numbers(center_m));
    let _ = writeln!(text, "      <mass value=\"{mass_kg}\"/>");
    let _ = writeln!(
        text,
        "      <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>",
        inertia.x_axis.x,
        inertia.x_axis.y,
        inertia.x_axis.z,
        inertia.y_axis.y,
        inertia.y_axis.z,
        inertia.z_axis.z
    );
    text.push_str("    </inertial>\n  </link>\n");
}

/// Inertia of a slender rod along `rod_m` about its middle: m/12 (l^2 1 - l l^T).
fn rod_inertia(mass_kg: f64, rod_m: DVec3) -> DMat3 {
    let along = DMat3::from_cols(rod_m * rod_m.x, rod_m * rod_m.y, rod_m * rod_m.z);
    (DMat3::from_diagonal(DVec3::splat(rod_m.length_squared())) - along) * (mass_kg / 12.0)
}

/// Inertia of a solid box with edges `size_m` about its middle.
fn box_inertia(mass_kg: f64, size_m: DVec3) -> DMat3 {
    let squares = size_m * size_m;
    let sums = DVec3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y);
    DMat3::from_diagonal(sums * (mass_kg / 12.0))
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
    fn a_rod_turns_easily_about_itself_only() {
        // 1.2 kg, 2 m upright: 1.2 * 4 / 12 = 0.4 about x and y, none about z.
        let inertia = rod_inertia(1.2, DVec3::new(0.0, 0.0, -2.0));
        assert!((inertia.x_axis.x - 0.4).abs() < 1e-12 && (inertia.y_axis.y - 0.4).abs() < 1e-12);
        assert!(inertia.z_axis.z.abs() < 1e-12);
        // A slanted rod is coupled: products of inertia are negative where both coordinates grow together.
        assert!(rod_inertia(1.2, DVec3::new(1.0, 0.0, 1.0)).x_axis.z < 0.0);
    }

    #[test]
    fn a_box_has_the_inertia_of_the_textbook() {
        // 12 kg, 1 by 2 by 3 m: 4 + 9, 1 + 9, 1 + 4.
        let inertia = box_inertia(12.0, DVec3::new(1.0, 2.0, 3.0));
        assert!((inertia * DVec3::ONE).distance(DVec3::new(13.0, 10.0, 5.0)) < 1e-12);
    }

    #[test]
    fn a_joint_name_cannot_break_the_urdf() {
        assert_eq!(escaped("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
    }
}
