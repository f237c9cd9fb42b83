//! `hippocamp imu`: sets up and shows the inertial measurement unit of a built robot.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result};

use super::calibrate::AtTerminal;
use super::{BadInput, COMPLETED, ImuArguments, ImuCommand, interrupt, ports, unit};
use crate::bus::serial::Device;
use crate::bus::{Ports, SerialPorts};
use crate::calibration::{FoundImu, set_up_imu};
use crate::config::{self, Unit, UnitImu, default_unit_path, write_unit};
use crate::imu::{Imu, SerialImu};
use crate::model::{ImuSettings, Robot};
use crate::output::{Outputs, WriteMode};

/// Time between two lines of `show`.
const SHOW_EVERY: Duration = Duration::from_millis(200);
/// Looks between two lines: often enough that the input buffer does not overflow.
const LOOKS: u32 = 10;

/// Carries out the command; returns the exit code.
pub(super) fn imu(command: &ImuCommand) -> Result<u8> {
    match command {
        ImuCommand::Setup(options) => setup(options),
        ImuCommand::Show { options, for_s } => show(options, *for_s),
    }
}

/// A robot, and the device of its inertial measurement unit.
struct Place {
    robot: Robot,
    settings: ImuSettings,
    device: Device,
    unit: Option<Unit>,
    unit_path: PathBuf,
}

fn place(options: &ImuArguments) -> Result<Place> {
    let mut robot = config::load(&options.robot)?.robot;
    let path = options.robot.display();
    if robot.imu.is_none() {
        return Err(BadInput(format!("{path}: {} has no section [imu]: add one", robot.name)).into());
    }
    let unit_path = options.unit.clone().unwrap_or_else(|| default_unit_path(&options.robot));
    let unit = if unit_path.exists() { unit::find(&options.robot, Some(&unit_path))? } else { None };
    if let Some(unit) = &unit {
        unit.apply(&mut robot)?;
    }
    let port = ports::imu_port(unit.as_ref(), &options.ports);
    let settings = robot.imu.clone();
    let (Some(port), Some(settings)) = (port, settings) else {
        let unit_path = unit_path.display();
        let said =
            format!("the unit's device is not known: --port imu=PATH, or device in [imu] of {unit_path}");
        return Err(BadInput(said).into());
    };
    let device = Device::of_imu(&settings, std::path::absolute(port.path())?);
    Ok(Place { robot, settings, device, unit: unit.map(|file| file.unit), unit_path })
}

fn setup(options: &ImuArguments) -> Result<u8> {
    let place = place(options)?;
    let mut outputs = Outputs::of_reading([&options.robot]);
    outputs.claim("the unit file", &place.unit_path, WriteMode::UnitFile)?;
    // The settings come from the robot file, whatever the unit file says of an earlier IMU.
    let wanted = config::load(&options.robot)?.robot.imu.unwrap_or(place.settings);
    let mut line = SerialImu::open(&Device { baud: wanted.baud, ..place.device.clone() })?;
    let mut person = AtTerminal::new(place.unit_path.clone(), true)?;
    let found = set_up_imu(&mut line, &wanted, &mut person)?;
    let unit = noted(place.unit, &options.robot, &place.device.path, &found);
    write_unit(&place.unit_path, &unit)
        .with_context(|| format!("{} could not be written", place.unit_path.display()))?;
    let [roll, pitch, yaw] = found.rpy_deg;
    say!(
        "{}: the unit is turned by roll {roll:.1}, pitch {pitch:.1}, yaw {yaw:.1} degrees{}; kept in {}.",
        place.robot.name,
        if found.rates_reversed { ", and reports its turn rates with the opposite sign" } else { "" },
        place.unit_path.display()
    );
    say!(
        "Check with 'hippocamp imu show' that pitch grows as the nose goes down, and roll as the left side goes up."
    );
    Ok(COMPLETED)
}

/// The unit file, updated with the IMU found.
fn noted(unit: Option<Unit>, robot_file: &Path, device: &Path, found: &FoundImu) -> Unit {
    let robot_file = robot_file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Unit {
        imu: Some(UnitImu {
            device: device.display().to_string(),
            baud: Some(found.baud),
            rpy_deg: Some(found.rpy_deg),
            rates_reversed: found.rates_reversed.then_some(true),
        }),
        ..unit.unwrap_or(Unit { robot_file, ..Unit::default() })
    }
}

fn show(options: &ImuArguments, for_s: Option<f64>) -> Result<u8> {
    let stop = interrupt::catch()?;
    let place = place(options)?;
    let mut lines = SerialPorts::open_with_imu(&[], Some(&place.device))?;
    let mut imu = Imu::new(&place.robot);
    let begun = lines.now();
    let mut next = begun;
    while !stop.load(std::sync::atomic::Ordering::Relaxed) {
        for _ in 0..LOOKS {
            next = next + SHOW_EVERY / LOOKS;
            lines.wait_until(next);
            imu.read(&mut lines);
        }
        let reading = imu.reading();
        if imu.is_gone() {
            say!("{} is gone", place.device.path.display());
        } else if !reading.is_known || reading.age_s > place.settings.stale_s {
            let baud = place.settings.baud;
            match imu.kinds().missing() {
                Some(words) => say!("at {baud} bit/s {words}"),
                None => say!("not heard at {baud} bit/s"),
            }
        } else {
            let rate = reading.rate_rad_s.map(f64::to_degrees);
            say!(
                "roll {:6.1}  pitch {:6.1}  yaw {:6.1} degrees   turns {:6.1} {:6.1} {:6.1} degrees/s   {:4.1} ms old",
                reading.roll_rad.to_degrees(),
                reading.pitch_rad.to_degrees(),
                reading.yaw_rad.to_degrees(),
                rate.x,
                rate.y,
                rate.z,
                reading.age_s * 1e3
            );
        }
        if for_s.is_some_and(|for_s| next.since(begun).as_secs_f64() >= for_s) {
            break;
        }
    }
    Ok(COMPLETED)
}
