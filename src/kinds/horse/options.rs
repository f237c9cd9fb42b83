//! The plan of the gait and speed that a user asked for.

use super::Horse;
use crate::config::did_you_mean;
use crate::kinds::{MotionOptions, Refusal};
use crate::model::Robot;
use crate::motion::horse::HorsePlan;
use crate::motion::{Command, GaitChoice};

/// Share of the top speed at which a robot walks if the user names no speed.
const DEFAULT_SPEED_SHARE: f64 = 0.9;

/// A plan for the gait and speed asked for, limited to what the robot can do; and a remark if it is limited.
pub(super) fn plan(
    horse: &Horse,
    robot: &Robot,
    asked: &MotionOptions<'_>,
) -> Result<(HorsePlan, Option<String>), Refusal> {
    if asked.stroke.is_some() || asked.pose.is_some() {
        let said = "--stroke, --pose: those are for arms and figures; a horse goes by --gait and --speed";
        return Err(Refusal(said.to_owned()));
    }
    let standing = horse.standing();
    let choice = gait(asked.gait, &standing)?;
    let plan = standing.at_share(choice, DEFAULT_SPEED_SHARE);
    let top_m_s = plan.top_speed_m_s(choice);
    let joint = match choice {
        GaitChoice::Gait(gait) => horse.capability.top_speeds[gait].joint,
        GaitChoice::Stand | GaitChoice::Auto => None,
    };
    let joint = joint.map(|joint| robot.joints[joint].name.as_str());
    let name = plan.gait_name(choice);
    if top_m_s <= 0.0 && choice != GaitChoice::Stand {
        return Err(Refusal(format!(
            "{} cannot {name}: even on the spot {} would pass its speed or acceleration limit; a longer \
             swing_time_s or a lower swing_lift_mm asks less of it",
            robot.name,
            joint.unwrap_or("a joint")
        )));
    }
    let mut remark = flight_remark(&plan, choice);
    let speed_m_s = match asked.speed_m_s {
        None => plan.command.speed_m_s,
        Some(speed) if !speed.is_finite() => {
            return Err(Refusal(format!(
                "--speed {speed}: expected a speed in m/s, negative to go backwards"
            )));
        }
        Some(speed) if choice != GaitChoice::Stand => {
            let pace = plan.pace(choice);
            let held = speed.clamp(-pace.backward_m_s, pace.forward_m_s);
            if (held - speed).abs() > 0.0 {
                let limit = joint.map_or("the legs reach no further".to_owned(), |joint| {
                    format!("{joint} can turn no faster")
                });
                remark = Some(format!("{speed} m/s is too fast for {name}: held at {held:.3} m/s ({limit})"));
            }
            held
        }
        Some(speed) => speed,
    };
    let command = Command { speed_m_s, ..plan.command };
    Ok((HorsePlan { command, ..plan }, remark))
}

/// A remark on a gait that leaves the ground, for a robot that does not.
fn flight_remark(plan: &HorsePlan, choice: GaitChoice) -> Option<String> {
    let GaitChoice::Gait(index) = choice else { return None };
    let gait = plan.settings.gaits.get(index).filter(|gait| plan.stays_on_ground && gait.has_flight())?;
    Some(format!(
        "{} leaves the ground for {:.0} % of each stride, but position servos do not lift the robot: it will go much \
         slower than planned ('hippocamp check --physics' measures how fast)",
        gait.name,
        100.0 * gait.flight_share()
    ))
}

fn gait(wanted: Option<&str>, plan: &HorsePlan) -> Result<GaitChoice, Refusal> {
    let names = || plan.settings.gaits.iter().map(|gait| gait.name.as_str());
    let Some(wanted) = wanted else { return Ok(GaitChoice::Gait(0)) };
    plan.gait_choice(wanted).ok_or_else(|| {
        let all = names().collect::<Vec<_>>().join(", ");
        let advice = did_you_mean(wanted, names().chain(["auto", "stand"]));
        Refusal(format!("--gait {wanted}: expected auto, stand, or one of {all}{advice}"))
    })
}
