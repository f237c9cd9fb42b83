//! Loading a robot file with everything that can be checked before a port is touched.

use std::path::Path;

use anyhow::Result;

use crate::bus::costs;
use crate::config::{self, ConfigError, RobotFile, UnitFile};
use crate::kinds::{self, Kind};

/// A robot that can do what its file asks.
pub(super) struct Loaded {
    pub(super) file: RobotFile,
    pub(super) kind: Box<dyn Kind>,
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
    for bus in costs::of_robot(&file.robot) {
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
    match kinds::of(&file.robot) {
        Ok(kind) => {
            faults.extend(
                kind.faults(&file.robot).into_iter().map(|(key, expected)| file.fault(&key, expected)),
            );
            if faults.is_empty() {
                return Ok(Loaded { file, kind });
            }
        }
        Err(error) => {
            let (key, expected) = error.fault();
            faults.push(file.fault(&key, expected));
        }
    }
    Err(ConfigError::of(faults).into())
}
