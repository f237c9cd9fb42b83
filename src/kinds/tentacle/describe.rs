//! Describes in words the lengths of arms, the tempo of their strokes, and the weight on their joints.

use std::fmt::{self, Write};

use super::{Tentacle, TentacleCapability};
use crate::kinds::loads::{self, LASTING_SHARE, Load};
use crate::model::{ArmGeometry, Robot, TentacleMotion, WeightSupport};
use crate::motion::tentacle::strokes::STROKES;

/// Lines of its arms, strokes and loads.
pub(super) fn arms_and_strokes(tentacle: &Tentacle, robot: &Robot) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = write_arms(&mut text, robot, &tentacle.settings);
    let _ = write_tempos(&mut text, &tentacle.settings, &tentacle.capability);
    let _ = write_loads(&mut text, robot, &tentacle.settings, &tentacle.capability.loads);
    text
}

fn write_arms(text: &mut String, robot: &Robot, tentacle: &TentacleMotion) -> fmt::Result {
    writeln!(text, "\n{:<24} {:>16}  {:>9}  root, mm from the body's origin", "arm", "length mm", "joints")?;
    for arm in &tentacle.arms {
        let chain = &robot.chains[arm.chain];
        let (length_m, root) = (chain.length_m(robot.joints_of(chain)), chain.root_m * 1e3);
        writeln!(
            text,
            "{:<24} {:>16.1}  {:>9}  forward {:.1}, left {:.1}, up {:.1}",
            chain.name,
            length_m * 1e3,
            ArmGeometry::of(chain, robot.joints_of(chain)).map_or(0, |geometry| geometry.joints.len()),
            root.x,
            root.y,
            root.z
        )?;
    }
    Ok(())
}

fn write_tempos(
    text: &mut String,
    tentacle: &TentacleMotion,
    capability: &TentacleCapability,
) -> fmt::Result {
    writeln!(text, "\n{:<24} {:>16}  {:>9}", "stroke", "at tempo 1, s", "tempo max")?;
    let tempos = STROKES.iter().zip(&capability.tempo_max);
    for (stroke, tempo) in tempos.filter(|(stroke, _)| stroke.is_rhythmic) {
        writeln!(text, "{:<24} {:>16.2}  {tempo:>9.2}", stroke.name, tentacle.stroke_time_s)?;
    }
    Ok(())
}

/// The load that each joint holds up in its worst pose.
fn write_loads(text: &mut String, robot: &Robot, tentacle: &TentacleMotion, of: &[Load]) -> fmt::Result {
    let carried = match tentacle.carrier {
        WeightSupport::Servos => "its servos alone".to_owned(),
        WeightSupport::Water => format!("water, {:.0} %,", tentacle.carried_share * 100.0),
        WeightSupport::Counterweight => format!("a counterweight, {:.0} %,", tentacle.carried_share * 100.0),
    };
    writeln!(text, "\nWeight carried by {carried} stretched out level:")?;
    text.push_str(&loads::table(robot, of));
    let heavy = of.iter().filter(|load| load.is_heavy()).count();
    if heavy > 0 {
        writeln!(
            text,
            "WARNING: {heavy} joints would hold more than {:.0} % of stall torque: they get hot if the arm stays so; carry \
             more of its weight (motion.carried_by, carried_share)",
            LASTING_SHARE * 100.0
        )?;
    }
    Ok(())
}

/// The fault of arms with a servo that cannot hold up its share of the weight, the part that nothing else carries:
/// the key at fault, and what was expected. Arms whose file says that they float must float: water that carries
/// nearly all of them leaves the servos the small rest.
pub(super) fn too_heavy(tentacle: &Tentacle, robot: &Robot) -> Option<(String, String)> {
    let (settings, loads) = (&tentacle.settings, &tentacle.capability.loads);
    let share = |load: &&Load| load.share_of_stall.unwrap_or(0.0);
    let worst = loads.iter().max_by(|a, b| share(a).total_cmp(&share(b)))?;
    (share(&worst) > 1.0).then(|| {
        let carried = match settings.carrier {
            WeightSupport::Servos => String::new(),
            WeightSupport::Water => format!(", of which water carries {:.0} %", settings.carried_share * 100.0),
            WeightSupport::Counterweight => {
                format!(", of which a counterweight carries {:.0} %", settings.carried_share * 100.0)
            }
        };
        let expected = format!(
            "arms that their servos can hold: stretched out level, {} would need {:.2} N m{carried}, {:.0} % of its \
             servo's stall torque; lighten the arm, name a stronger servo, or carry more of its weight (carried_by, \
             carried_share: 1 of what floats)",
            robot.joints[worst.joint].name,
            worst.torque_nm,
            share(&worst) * 100.0
        );
        let key = if settings.carrier == WeightSupport::Servos { "motion.carried_by" } else { "motion.carried_share" };
        (key.to_owned(), expected)
    })
}
