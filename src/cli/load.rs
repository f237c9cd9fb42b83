//! Loading a robot file with everything that can be checked before a port is touched.

use std::path::Path;

use anyhow::Result;

use crate::capability::bus_costs;
use crate::capability::{Capability, CapabilityError, Load, PoseError, ReachError};
use crate::config::{self, ConfigError, Fault, RobotFile, UnitFile};
use crate::model::{Carrier, TentacleMotion};

/// A robot that can do what its file asks.
pub(super) struct Loaded {
    pub(super) file: RobotFile,
    pub(super) capability: Capability,
}

/// Loads the robot file at `path` without capability checks, for any rig, with the zero counts of `unit`: for
/// commands that talk to the servos but plan no motion.
pub(super) fn load_file(path: &Path, unit: Option<&UnitFile>) -> Result<RobotFile> {
    let mut file = config::load(path)?;
    if let Some(unit) = unit {
        unit.apply(&mut file.robot)?;
    }
    Ok(file)
}

/// Loads the robot file at `path`, with the zero counts of `unit`; faults of reach and of the loop's rate are
/// reported like all others.
pub(super) fn load(path: &Path, unit: Option<&UnitFile>) -> Result<Loaded> {
    let file = load_file(path, unit)?;
    let mut faults = Vec::new();
    for bus in bus_costs::of_robot(&file.robot) {
        let rate_hz = bus.highest_rate_hz();
        if file.robot.rate_hz > rate_hz {
            let expected = format!(
                "at most {rate_hz:.0} Hz: one exchange on bus {} takes {:.2} ms; use a higher baud, more buses, or \
                 an adapter with less latency",
                bus.name,
                bus.total().as_secs_f64() * 1e3
            );
            faults.push(file.fault("loop_rate_hz", expected));
        }
    }
    match Capability::of(&file.robot) {
        Ok(capability) => {
            if let Capability::Tentacle(tentacle, capability) = &capability {
                faults.extend(too_heavy(&file, tentacle, &capability.loads));
            }
            if faults.is_empty() {
                return Ok(Loaded { file, capability });
            }
        }
        Err(error) => faults.push(cannot(&file, &error)),
    }
    Err(ConfigError::of(faults).into())
}

/// The fault of a robot that cannot do what its file asks.
fn cannot(file: &RobotFile, error: &CapabilityError) -> Fault {
    match error {
        CapabilityError::Reach(ReachError::Unreachable { .. }) => {
            file.fault("motion.stand_height_mm", format!("a height the legs reach the ground from: {error}"))
        }
        CapabilityError::Reach(ReachError::CannotSwing { .. }) => {
            file.fault("motion.swing_lift_mm", format!("a lift the legs can do: {error}"))
        }
        CapabilityError::Reach(ReachError::CannotSit { .. })
        | CapabilityError::Pose(PoseError { pose: None, .. }) => {
            file.fault("motion.sit_height_mm", format!("a height the legs can fold to: {error}"))
        }
        CapabilityError::Pose(PoseError { pose: Some(pose), .. }) => file.fault(
            &format!("motion.pose[{pose}]"),
            format!(
                "a pose both legs reach the ground from, a little before the ends of their ranges: {error}"
            ),
        ),
    }
}

/// The fault of arms with a servo that cannot hold up its share of the weight, the part that nothing else carries.
/// Arms whose file says that they float must float: water that carries nearly all of them leaves the servos the
/// small rest.
fn too_heavy(file: &RobotFile, tentacle: &TentacleMotion, loads: &[Load]) -> Option<Fault> {
    let share = |load: &&Load| load.share_of_stall.unwrap_or(0.0);
    let worst = loads.iter().max_by(|a, b| share(a).total_cmp(&share(b)))?;
    (share(&worst) > 1.0).then(|| {
        let carried = match tentacle.carrier {
            Carrier::Servos => String::new(),
            Carrier::Water => format!(", of which water carries {:.0} %", tentacle.carried_share * 100.0),
            Carrier::Counterweight => {
                format!(", of which a counterweight carries {:.0} %", tentacle.carried_share * 100.0)
            }
        };
        let expected = format!(
            "arms that their servos can hold: stretched out level, {} would need {:.2} N m{carried}, {:.0} % of its \
             servo's stall torque; lighten the arm, name a stronger servo, or carry more of its weight (carried_by, \
             carried_share: 1 of what floats)",
            file.robot.joints[worst.joint].name,
            worst.torque_nm,
            share(&worst) * 100.0
        );
        let key = if tentacle.carrier == Carrier::Servos { "motion.carried_by" } else { "motion.carried_share" };
        file.fault(key, expected)
    })
}
