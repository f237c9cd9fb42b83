//! Describes in words the poses of a figure, and the weight on its joints.

use std::fmt::{self, Write};

use super::{Figure, FigureCapability};
use crate::kinds::loads;
use crate::model::{FigureMotion, Robot};

/// Lines of its poses and loads.
pub(super) fn poses_and_loads(figure: &Figure, robot: &Robot) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = write_poses(&mut text, &figure.settings, &figure.capability);
    let _ = writeln!(text, "\nWeight held in the heaviest of these poses, shared by both feet:");
    text + &loads::table(robot, &figure.capability.loads)
}

/// The poses of a figure, and where its centre of mass is over its feet.
fn write_poses(text: &mut String, figure: &FigureMotion, capability: &FigureCapability) -> fmt::Result {
    writeln!(
        text,
        "\n{:<24} {:>16}  {:>9}  centre of mass, mm from the middle between the soles",
        "pose", "height mm", "time s"
    )?;
    for (pose, center) in figure.poses.iter().zip(&capability.centers_m) {
        let center = *center * 1e3;
        writeln!(
            text,
            "{:<24} {:>16.1}  {:>9.2}  forward {:.1}, left {:.1}, up {:.1}",
            pose.name,
            pose.height_m * 1e3,
            pose.time_s,
            center.x,
            center.y,
            center.z
        )?;
    }
    Ok(())
}
