//! The unit file during set-up: notes the devices, and removes what a new servo makes invalid.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::cli::BadInput;
use crate::cli::ports::PortOption;
use crate::cli::unit;
use crate::config::{Unit, UnitBus, UnitFile, default_unit_path, write_unit};
use crate::output::{Outputs, WriteMode};

/// The unit file as read, and its changes to write.
pub(super) struct UnitNotes {
    path: PathBuf,
    file: Option<UnitFile>,
    unit: Unit,
}

impl UnitNotes {
    /// The unit file of `robot_file`, or the one named; it need not exist yet.
    ///
    /// # Errors
    /// If it exists but is no unit file, or belongs to another robot.
    pub(super) fn open(robot_file: &Path, named: Option<&Path>) -> Result<UnitNotes> {
        let path = named.map_or_else(|| default_unit_path(robot_file), Path::to_owned);
        Outputs::of_reading([robot_file]).claim("the unit file", &path, WriteMode::UnitFile)?;
        let robot_name = robot_file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let file = if path.exists() { unit::find(robot_file, Some(&path))? } else { None };
        let unit = match &file {
            Some(file) if file.unit.robot_file != robot_name => {
                let fault = file.fault("robot_file", format!("{robot_name:?}, or another --unit"));
                return Err(BadInput(fault.to_string()).into());
            }
            Some(file) => file.unit.clone(),
            None => Unit { robot_file: robot_name, ..Unit::default() },
        };
        Ok(UnitNotes { path, file, unit })
    }

    /// Its path.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Its content as read.
    pub(super) fn file(&self) -> Option<&UnitFile> {
        self.file.as_ref()
    }

    /// Notes the device of every bus.
    pub(super) fn set_devices(&mut self, devices: &[PortOption]) -> Result<()> {
        let buses: Vec<UnitBus> =
            devices.iter().filter(|port| port.is_bus()).map(PortOption::to_unit_bus).collect();
        if buses == self.unit.buses {
            return Ok(());
        }
        self.unit.buses = buses;
        self.write()
    }

    /// Removes the calibration of `joint`, which a new servo has made invalid.
    pub(super) fn forget_calibration(&mut self, joint: &str) -> Result<()> {
        let count = self.unit.joints.len();
        self.unit.joints.retain(|entry| entry.name != joint);
        if self.unit.joints.len() == count {
            return Ok(());
        }
        say!("{joint}: its calibration is removed from {}", self.path.display());
        self.write()
    }

    fn write(&self) -> Result<()> {
        write_unit(&self.path, &self.unit)
            .with_context(|| format!("{} could not be written", self.path.display()))?;
        Ok(())
    }
}
