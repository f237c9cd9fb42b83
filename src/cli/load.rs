//! Loading a robot file with everything that can be checked before a port is touched.

use std::path::Path;

use anyhow::Result;

use crate::capability::bus_costs;
use crate::capability::{HorseCapability, ReachError};
use crate::config::{self, ConfigError, RobotFile, UnitFile};
use crate::model::{HorseMotion, Motion};

/// A robot that can do what its file says.
pub(super) struct Loaded {
    pub(super) file: RobotFile,
    pub(super) horse: HorseMotion,
    pub(super) capability: HorseCapability,
}

/// Loads the robot file at `path` as it stands, of whatever rig, with the zero counts of `unit`: for commands that ask
/// the servos but plan no motion.
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
    let Motion::Horse(horse) = &file.robot.motion;
    let horse = horse.clone();
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
    match HorseCapability::of(&file.robot, &horse) {
        Ok(capability) if faults.is_empty() => return Ok(Loaded { file, horse, capability }),
        Ok(_) => {}
        Err(error @ ReachError::Unreachable { .. }) => {
            faults.push(file.fault(
                "motion.stand_height_mm",
                format!("a height the legs reach the ground from: {error}"),
            ));
        }
        Err(error @ ReachError::CannotSwing { .. }) => {
            faults.push(file.fault("motion.swing_lift_mm", format!("a lift the legs can do: {error}")));
        }
        Err(error @ ReachError::CannotSit { .. }) => {
            faults
                .push(file.fault("motion.sit_height_mm", format!("a height the legs can fold to: {error}")));
        }
    }
    Err(ConfigError { faults }.into())
}
