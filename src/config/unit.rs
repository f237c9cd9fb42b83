//! Unit files: the data of one built robot, which no other of its kind shares.
//!
//! In: a file, or its text. Out: a [`Unit`], or every fault of the file at once. `unit_check` judges what it means
//! for a robot, and [`super::write_unit`] writes it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;
use toml::value::Date;

use super::fault::{ConfigError, Fault};
use super::number::Limits;
use super::reader::Section;
use super::source::Source;
use super::{parse_with, read_text};
use crate::model::{Firmware, IMU_BAUDS};

/// Most joints and buses of a unit: as many as in the largest robot file.
const JOINTS_MAX: usize = 2000;
const BUSES_MAX: usize = super::buses::BUSES_MAX;

/// The version of the schema below.
pub(super) const VERSION: u32 = 1;

/// The data of one built robot.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Unit {
    /// File name, without folders, of its robot file.
    pub robot_file: String,
    /// Day of the calibration; `None` before it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibrated_on: Option<Date>,
    /// [`Unit::hash`] at the end of the calibration; `None` before it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration_hash: Option<String>,
    /// Its serial lines.
    #[serde(rename = "bus", skip_serializing_if = "Vec::is_empty")]
    pub buses: Vec<UnitBus>,
    /// Its inertial measurement unit, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<UnitImu>,
    /// Its joints, as far as they have been calibrated.
    #[serde(rename = "joint", skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<UnitJoint>,
}

impl Unit {
    /// Paths of all its serial devices.
    pub fn devices(&self) -> impl Iterator<Item = &str> {
        let buses = self.buses.iter().map(|bus| bus.device.as_str());
        buses.chain(self.imu.iter().map(|imu| imu.device.as_str()))
    }
}

/// The device that a bus of the robot file is plugged into.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnitBus {
    /// Name of the bus.
    pub name: String,
    /// Path of its serial device.
    pub device: String,
}

/// The inertial measurement unit in this robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnitImu {
    /// Path of its serial device.
    pub device: String,
    /// Its line rate, bit/s; `None` if it is the robot file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baud: Option<u32>,
    /// Roll, pitch and yaw of the unit in the body, degrees; `None` if they are the robot file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rpy_deg: Option<[f64; 3]>,
    /// True if the unit reports its angular rates with the opposite sign; `None` if this was not checked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rates_reversed: Option<bool>,
}

/// Calibration of one joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnitJoint {
    /// Full name, such as `left_hind.hip`.
    pub name: String,
    /// Count at joint angle zero; may lie outside the servo's own range.
    pub zero_count: f64,
    /// True if the measurement showed that the servo is mounted so that its count falls in a positive joint turn;
    /// `None` if the robot file decides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reversed: Option<bool>,
    /// True once a person has confirmed that the joint turns as in the robot file: that the two fields above are
    /// right.
    pub direction_checked: bool,
    /// Firmware version of the servo at calibration, if known. A start warns of another version.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub firmware: Option<Firmware>,
}

/// A unit, and the file it came from.
///
/// The schema, version 1:
///
/// | section | keys (those that may be left out in brackets) |
/// |---|---|
/// | top | `version` = 1, `robot_file`, (`calibrated_on`, a date), (`calibration_hash`) |
/// | `[[bus]]` | `name`, `device` |
/// | `[imu]` | `device`, (`baud`, `rpy_deg` as in the robot file), (`rates_reversed` false) |
/// | `[[joint]]` | `name`, `zero_count`, (`reversed` as in the robot file), (`direction_checked` false), (`firmware`) |
///
/// Servos have no readable serial number; that of an adapter is in its path in `/dev/serial/by-id`.
/// [`default_unit_path`] finds the file unless the user names another.
#[derive(Debug, Clone)]
pub struct UnitFile {
    /// The unit.
    pub unit: Unit,
    pub(super) source: Source,
}

impl UnitFile {
    /// A fault at a key path such as `bus[0].device`, with its line and value.
    pub fn fault(&self, key: &str, expected: impl Into<String>) -> Fault {
        self.source.fault(key, expected)
    }
}

/// Default path of the unit file of a robot file: beside it, with `.unit.toml` in place of its `.toml`; for
/// `config/horse.toml` that is `config/horse.unit.toml`.
pub fn default_unit_path(robot_file: &Path) -> PathBuf {
    robot_file.with_extension("unit.toml")
}

/// Loads a unit file; its name in faults is the path as given.
///
/// # Errors
/// Every fault of the file, or one that says why it cannot be read.
pub fn load_unit(path: &Path) -> Result<UnitFile, ConfigError> {
    let text = read_text(path, "a unit file that can be read, such as config/horse.unit.toml")?;
    parse_unit(&text, &path.display().to_string())
}

/// Checks the text of a unit file; `file_name` is its name in faults.
///
/// # Errors
/// Every fault of the text. If the text is not TOML, only that fault; if the file has another version, only its
/// version.
pub fn parse_unit(text: &str, file_name: &str) -> Result<UnitFile, ConfigError> {
    let (unit, source) = parse_with(text, file_name, read_unit)?;
    Ok(UnitFile { unit, source })
}

fn read_unit(file: &Section<'_>) -> Option<Unit> {
    let version = file.integer("version", "the version of the unit file", 1..=u32::MAX);
    if version.is_some_and(|version| version != VERSION) {
        let advice = "the only version this program knows; use the program that wrote it";
        file.fault("version", format!("{VERSION}, {advice}"));
        file.allow_unknown_keys();
        return None;
    }
    let robot_file = file.text("robot_file", "the name of the robot file it was made for");
    let calibrated_on = file.date_if_set("calibrated_on", "the day of the calibration");
    let calibration_hash = file.text_if_set("calibration_hash", "what the calibration wrote here");
    let buses = read_buses(file);
    let imu = match file.has("imu") {
        true => file.section("imu", "the inertial measurement unit", read_imu).map(Some),
        false => Some(None),
    };
    let mut names = Names::default();
    let joints = file.list("joint", "the joints", JOINTS_MAX, |joint| read_joint(joint, &mut names));
    version?;
    Some(Unit {
        robot_file: robot_file?.to_owned(),
        calibrated_on: calibrated_on?,
        calibration_hash: calibration_hash?.map(str::to_owned),
        buses: buses?,
        imu: imu?,
        joints: joints.into_iter().collect::<Option<_>>()?,
    })
}

fn read_buses(file: &Section<'_>) -> Option<Vec<UnitBus>> {
    let (mut names, mut devices) = (Names::default(), Names::default());
    let buses = file.list("bus", "the buses' devices", BUSES_MAX, |bus| {
        let name = names.read(bus, "name", "the name of a bus of the robot file");
        let device = devices.read(bus, "device", "the path of the bus's serial device");
        Some(UnitBus { name: name?.to_owned(), device: device?.to_owned() })
    });
    buses.into_iter().collect()
}

fn read_imu(imu: &Section<'_>) -> Option<UnitImu> {
    let device = imu.text("device", "the path of the unit's serial device");
    let baud = match imu.has("baud") {
        true => read_imu_baud(imu).map(Some),
        false => Some(None),
    };
    let rpy_deg = match imu.has("rpy_deg") {
        true => imu
            .numbers("rpy_deg", "roll, pitch and yaw of the unit in the body, in degrees", Limits::ANGLE)
            .map(Some),
        false => Some(None),
    };
    let meaning = "whether the unit reports its turn rates with the opposite sign";
    let rates_reversed = match imu.has("rates_reversed") {
        true => imu.flag_or("rates_reversed", meaning, false).map(Some),
        false => Some(None),
    };
    Some(UnitImu {
        device: device?.to_owned(),
        baud: baud?,
        rpy_deg: rpy_deg?,
        rates_reversed: rates_reversed?,
    })
}

fn read_imu_baud(imu: &Section<'_>) -> Option<u32> {
    let words: Vec<String> = IMU_BAUDS.iter().map(u32::to_string).collect();
    let meaning = format!("the line's bits per second, one of {}", words.join(", "));
    let baud = imu.integer("baud", &meaning, 1..=u32::MAX)?;
    if !IMU_BAUDS.contains(&baud) {
        imu.fault("baud", meaning);
        return None;
    }
    Some(baud)
}

fn read_joint<'a>(joint: &Section<'a>, names: &mut Names<'a>) -> Option<UnitJoint> {
    let name = names.read(joint, "name", "the full name of a joint, such as \"left_hind.hip\"");
    let zero_count = joint.number("zero_count", "the servo's count at joint angle zero", Limits::Any);
    let meaning = "whether its servo is mounted so that a positive joint turn is a falling count";
    let reversed = match joint.has("reversed") {
        true => joint.flag_or("reversed", meaning, false).map(Some),
        false => Some(None),
    };
    let meaning = "whether the joint was seen to turn the right way";
    let direction_checked = joint.flag_or("direction_checked", meaning, false);
    let firmware = read_firmware(joint);
    Some(UnitJoint {
        name: name?.to_owned(),
        zero_count: zero_count?,
        reversed: reversed?,
        direction_checked: direction_checked?,
        firmware: firmware?,
    })
}

/// Reads the firmware: `Some(None)` if it is not set, `None` after a fault.
fn read_firmware(joint: &Section<'_>) -> Option<Option<Firmware>> {
    let meaning = "the servo's firmware version, such as \"46\" (Dynamixel) or \"3.10\" (Feetech)";
    let Some(text) = joint.text_if_set("firmware", meaning)? else { return Some(None) };
    let firmware = text.parse();
    if firmware.is_err() {
        joint.fault("firmware", meaning);
    }
    firmware.ok().map(Some)
}

/// Values of one key that may occur only once each.
#[derive(Default)]
struct Names<'a> {
    seen: BTreeMap<&'a str, usize>,
}

impl<'a> Names<'a> {
    fn read(&mut self, section: &Section<'a>, key: &'static str, meaning: &str) -> Option<&'a str> {
        let text = section.text(key, meaning)?;
        if let Some(line) = self.seen.get(text) {
            section.fault(key, format!("{meaning}, once only: line {line} has it already"));
            return None;
        }
        self.seen.insert(text, section.line(key));
        Some(text)
    }
}
