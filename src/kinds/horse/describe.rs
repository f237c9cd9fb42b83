//! Describes in words the reach of a horse's legs, and the speeds of its gaits.

use std::fmt::{self, Write};

use super::{Horse, HorseCapability, load};
use crate::model::{Gait, HorseMotion, LEG_NAMES, Robot};

/// Lines of its legs and gaits.
pub(super) fn legs_and_gaits(horse: &Horse, robot: &Robot) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = write_legs(&mut text, &horse.capability);
    let _ = write_gaits(&mut text, robot, &horse.settings, &horse.capability);
    let _ = load::write(&mut text, robot, &load::of_joints(robot, &horse.standing()));
    text
}

fn write_legs(text: &mut String, capability: &HorseCapability) -> fmt::Result {
    writeln!(text, "\n{:<24} {:>16}  neutral foot point, mm from the body's origin", "leg", "E mm")?;
    for (name, reach) in LEG_NAMES.iter().zip(&capability.reaches) {
        let place = reach.neutral_in_body * 1e3;
        writeln!(
            text,
            "{name:<24} {:>16.1}  forward {:.1}, left {:.1}, up {:.1}",
            reach.half_excursion_m * 1e3,
            place.x,
            place.y,
            place.z
        )?;
    }
    writeln!(text, "{:<24} {:>16.1}", "all legs", capability.half_excursion_m() * 1e3)
}

fn write_gaits(
    text: &mut String,
    robot: &Robot,
    horse: &HorseMotion,
    capability: &HorseCapability,
) -> fmt::Result {
    writeln!(text, "\n{:<24} {:>16}  {:>15}  limited by", "gait", "by reach m/s", "by servos m/s")?;
    for (gait, top) in horse.gaits.iter().zip(&capability.top_speeds) {
        let limit = if capability.stays_on_ground && gait.has_flight() {
            "; leaves the ground: see --physics"
        } else {
            ""
        };
        let joint = top.joint.map_or("the legs' reach".to_owned(), |joint| {
            format!("the speed or acceleration of {}", robot.joints[joint].name)
        });
        let by_servos =
            if robot.buses.is_empty() { "-".to_owned() } else { format!("{:.3}", top.by_servos_m_s) };
        writeln!(text, "{:<24} {:>16.3}  {by_servos:>15}  {joint}{limit}", gait.name, top.by_reach_m_s)?;
    }
    write_own_gaits(text, &horse.gaits)
}

/// The gaits that come from the robot file, if there are any.
fn write_own_gaits(text: &mut String, gaits: &[Gait]) -> fmt::Result {
    let built_in = Gait::built_in();
    let own = gaits.iter().filter(|gait| !built_in.contains(gait)).map(|gait| {
        let is_replaced = built_in.iter().any(|known| known.name == gait.name);
        format!("{}{}", gait.name, if is_replaced { " (in the place of the built-in one)" } else { "" })
    });
    let own: Vec<String> = own.collect();
    if own.is_empty() { Ok(()) } else { writeln!(text, "from the robot file: {}", own.join(", ")) }
}
