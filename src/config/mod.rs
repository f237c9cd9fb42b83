//! Robot files and unit files: TOML that people write, checked as a whole.
//!
//! In: a file, or its text. Out: a [`Robot`] or a [`Unit`], or every fault of the file at once. The module touches
//! nothing but that file, and keeps the origin of every value, so that later checks can trace a fault back to it.
//!
//! A robot file describes all robots of a kind. The data of one built robot are in its unit file; [`UnitFile`] says
//! more.
//!
//! The page `docs/robot-file.md` lists every key of robot files with its meaning, unit and default. It is generated from
//! [`robot_file_keys`], which the readers here fill.

mod arms;
mod balance;
mod ball;
mod buses;
mod chains;
mod fault;
mod faults;
mod figure;
mod gaits;
mod imu;
mod keys;
mod legs;
mod limb;
mod mixups;
mod motion;
mod nearest;
mod number;
mod physics;
mod reader;
mod reflex;
mod safety;
mod script;
mod servos;
mod source;
mod strokes;
mod tendons;
mod unique;
mod unit;
mod unit_check;
mod unit_write;

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use toml::de::DeTable;

use crate::ik::Clearance;
use crate::input::{self, InputError};
use crate::model::{
    Bus, IMU_LINE, Motion, Robot, SafetySettings, StopAction, TentacleMotion, TrippedServoPolicy,
};
use crate::motion::StrokeCommand;
use crate::motion::tentacle::{TentaclePlan, winder};
pub use fault::{ConfigError, Fault};
use faults::Faults;
pub use keys::{Key, robot_file_keys};
pub(crate) use nearest::{did_you_mean, nearest};
use number::Limits;
use reader::{File, Section};
pub use script::{load_script, parse_script};
use source::{Lines, Source};
pub use unit::{Unit, UnitBus, UnitFile, UnitImu, UnitJoint, default_unit_path, load_unit, parse_unit};
pub use unit_write::{rewrite_unit, write_unit};

/// At lower rates no loop can hold a robot.
const LOOP_RATE_SMALLEST_HZ: f64 = 10.0;
/// More cycles a second than any servo bus carries.
const LOOP_RATE_LARGEST_HZ: f64 = 1000.0;

const STOP_ACTIONS: [(&str, StopAction); 3] = [
    ("hold", StopAction::Hold),
    ("sit-then-limp", StopAction::SitThenLimp),
    ("park-then-limp", StopAction::SitThenLimp),
];

/// A robot, and the file it came from.
#[derive(Debug, Clone)]
pub struct RobotFile {
    /// The robot.
    pub robot: Robot,
    source: Source,
}

impl RobotFile {
    /// The text it was read from.
    pub fn text(&self) -> &str {
        self.source.text()
    }

    /// A fault at a key path such as `motion.stand_height_mm` or `chain[1].joint[3].range_deg` (list indices from
    /// 0), with its line and value: for faults that only later checks can find.
    pub fn fault(&self, key: &str, expected: impl Into<String>) -> Fault {
        self.source.fault(key, expected)
    }
}

/// Loads a robot file; its name in faults is the path as given.
///
/// # Errors
/// Every fault of the file, or one that says why it cannot be read.
pub fn load(path: &Path) -> Result<RobotFile, ConfigError> {
    let text = read_text(path, "a robot file that can be read, such as config/horse.toml")?;
    parse(&text, &path.display().to_string())
}

/// Text of the file at `path`; if it cannot be read, `expected` says what should be there.
fn read_text(path: &Path, expected: &str) -> Result<String, ConfigError> {
    let file_name = path.display().to_string();
    input::read_text(path).map_err(|error| match error {
        InputError::NotText { line } => {
            let expected = "text in UTF-8; save the file in that encoding";
            Fault { line, ..fault_without_key(&file_name, expected) }.into()
        }
        error => {
            let is_missing =
                matches!(&error, InputError::Io(error) if error.kind() == std::io::ErrorKind::NotFound);
            let advice = if is_missing { nearest::did_you_mean_file(path) } else { String::new() };
            fault_without_key(&file_name, &format!("{expected}; this one cannot: {error}{advice}")).into()
        }
    })
}

/// Checks the text of a robot file; `file_name` is its name in faults.
///
/// # Errors
/// Every fault of the text. If the text is not TOML, only that fault.
pub fn parse(text: &str, file_name: &str) -> Result<RobotFile, ConfigError> {
    let (robot, source) = parse_with(text, file_name, read_robot)?;
    Ok(RobotFile { robot, source })
}

/// The result of `read` on the text, and the places of its keys; or every fault.
fn parse_with<T>(
    text: &str,
    file_name: &str,
    read: impl FnOnce(&Section<'_>) -> Option<T>,
) -> Result<(T, Source), ConfigError> {
    let (document, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        return Err(syntax_faults(text, file_name, &errors));
    }
    let document = document.get_ref();
    let file = File::new(Source::new(file_name, text, document));
    let content = file.read(document, read);
    match (content, file.finish()) {
        (Some(content), (source, None)) => Ok((content, source)),
        (_, (_, Some(error))) => Err(error),
        (None, (source, None)) => Err(source.fault("", "a file that can be read").into()),
    }
}

fn read_robot(file: &Section<'_>) -> Option<Robot> {
    let name = file.text("name", "the robot's name");
    let rate_hz = file.number(
        "loop_rate_hz",
        "the loop's cycles a second",
        Limits::FromTo(LOOP_RATE_SMALLEST_HZ, LOOP_RATE_LARGEST_HZ),
    );
    let stop_action = file.choice("stop_action", "what the robot does when it stops", &STOP_ACTIONS);
    let trunk = file.section("trunk", "mass and centre of the trunk", read_trunk);

    let buses = buses::read(file);
    let mut servos = servos::ServoPlaces::new(&buses);
    let chains = chains::read(file, &mut servos);
    let all_read = chains.iter().all(|chain| chain.limb.is_some());
    servos.refuse_idle_buses(file, all_read);
    let imu = imu::read(file, rate_hz);
    if matches!(imu, Some(Some(_)))
        && let Some(bus) = buses.iter().position(|bus| bus.name == Some(IMU_LINE))
    {
        file.fault(
            &format!("bus[{bus}].name"),
            "another name: the inertial measurement unit's line has this one",
        );
    }
    let models = std::mem::take(&mut servos.models);
    let (safety, voltage_min_v) = safety::read(file, &models).unzip();
    let voltages_v = safety::voltages(file, &buses, &models, voltage_min_v.flatten());
    mixups::refuse(file, &chains);
    let motion = motion::read(file, &chains);
    let physics = physics::read(file, &chains, motion.as_ref());
    let balance = balance::read(file, &chains, motion.as_ref(), physics.as_ref().and_then(Option::as_ref));
    let tripped_servo = safety.as_ref().map(|safety| safety.tripped_servo);
    if tripped_servo == Some(TrippedServoPolicy::Freeze) && motion.as_ref().is_some_and(Motion::is_on_legs) {
        let expected = "\"stop\", or no such key: arms can do without a joint, but a robot on legs falls";
        file.fault("safety.tripped_servo", expected);
    }
    if let Some(rate_hz) = rate_hz {
        refuse_times_within_a_few_cycles(file, rate_hz, safety.as_ref(), motion.as_ref());
    }

    let yielding = reflex::read_yield(file, &chains, motion.as_ref());
    let limbs = chains.into_iter().map(|chain| chain.limb).collect::<Option<_>>();
    let limbs = limbs.map(limb::assemble);
    let joints = limbs.as_ref().map(|(_, joints)| joints.as_slice());
    let reflex = reflex::read(file, joints, motion.as_ref());
    let (chains, joints) = limbs?;
    let (trunk_mass_kg, trunk_center_m) = trunk?;
    let robot = Robot {
        name: name?.to_owned(),
        rate_hz: rate_hz?,
        trunk_mass_kg,
        trunk_center_m,
        chains,
        joints,
        buses: buses
            .into_iter()
            .zip(voltages_v)
            .map(|(entry, voltage_min_v)| Some(Bus { voltage_min_v, ..entry.bus? }))
            .collect::<Option<_>>()?,
        motion: motion?,
        safety: safety?,
        physics: physics?,
        bears_weight: true,
        balance: balance?,
        stop_action: stop_action?,
        imu: imu?,
        reflex: reflex?,
        yielding: yielding?,
    };
    if let Some(tentacle) = robot.motion.tentacle()
        && let Some(pole) = tentacle.pole
        && let Err(reason) = winder::check(&robot, tentacle, pole)
    {
        file.fault("motion.pole", format!("{POLE_MEANING}: {reason}"));
    }
    if let Some(tentacle) = robot.motion.tentacle() {
        refuse_crowded_arms(file, &robot, tentacle);
    }
    Some(robot)
}

/// Refuses arms that, when parked, are closer together than their clearance: they would push each other for ever.
fn refuse_crowded_arms(file: &Section<'_>, robot: &Robot, tentacle: &TentacleMotion) {
    let parked_rad = TentaclePlan::new(robot, tentacle, StrokeCommand::default()).park_pose_rad;
    let Some((arm, other, missing_m)) = Clearance::new(robot, tentacle).too_near(&parked_rad) else { return };
    let name = |arm: usize| &robot.chains[tentacle.arms[arm].chain].name;
    let of = other.map_or("the base".to_owned(), |other| format!("arm {}", name(other)));
    let expected = format!(
        "at least {:.1} mm less, or roots further apart: parked, this arm, {}, is nearer to {of} than motion.clearance_mm \
         allows",
        missing_m * 1000.0,
        name(arm)
    );
    file.fault(&format!("arm[{arm}].radius_mm"), expected);
}

/// Description of a valid pole.
const POLE_MEANING: &str = "a pole that an arm can wind round";

/// Fewest cycles that a servo may miss, or a hold may last: with less, ordinary jitter would stop the robot.
const PATIENCE_CYCLES: f64 = 2.0;
/// Fewest cycles of a swing: fewer do not make a curve.
const SWING_CYCLES: f64 = 10.0;

/// Refuses times that are too short compared with a cycle.
fn refuse_times_within_a_few_cycles(
    file: &Section<'_>,
    rate_hz: f64,
    safety: Option<&SafetySettings>,
    motion: Option<&Motion>,
) {
    let refuse = |key: &str, value_s: Option<f64>, cycles: f64| {
        if value_s.is_some_and(|value_s| value_s * rate_hz < cycles * (1.0 - 1e-9)) {
            let least_s = cycles / rate_hz;
            file.fault(key, format!("at least {cycles} cycles of the loop, {least_s} s at {rate_hz} Hz"));
        }
    };
    refuse("safety.coast_s", safety.map(|settings| settings.coast_s), PATIENCE_CYCLES);
    refuse("safety.hold_s", safety.map(|settings| settings.hold_s), PATIENCE_CYCLES);
    let swing_time_s = motion.and_then(Motion::horse).map(|horse| horse.swing_time_s);
    refuse("motion.swing_time_s", swing_time_s, SWING_CYCLES);
}

/// Mass in kg and centre in m.
fn read_trunk(section: &Section<'_>) -> Option<(f64, DVec3)> {
    let mass_kg = section.number("mass_kg", "the trunk's mass in kg", Limits::MASS);
    let center = section.vector("center_mm", "the centre of the trunk's mass in the body, in mm");
    Some((mass_kg?, meters(center?)))
}

/// Millimetres to metres. Uses a division: 190 mm then gives the nearest number to 0.19 m.
fn meters(millimeters: DVec3) -> DVec3 {
    millimeters / 1000.0
}

fn syntax_faults(text: &str, file_name: &str, errors: &[toml::de::Error]) -> ConfigError {
    let lines = Lines::of(text);
    // Further faults in one line usually follow from the first.
    let mut first_in_line: BTreeMap<usize, &toml::de::Error> = BTreeMap::new();
    for error in errors {
        first_in_line.entry(lines.line_of(start_of(error))).or_insert(error);
    }
    let mut faults = Faults::default();
    for (line, error) in first_in_line {
        faults.note(line, || {
            let message = error.message().trim_end_matches(", expected nothing");
            let column = Some(lines.column_of(text, start_of(error)));
            Fault { line, column, ..fault_without_key(file_name, &format!("TOML; {message}")) }
        });
    }
    faults.finish().unwrap_or_else(|| fault_without_key(file_name, "TOML").into())
}

fn start_of(error: &toml::de::Error) -> usize {
    error.span().map_or(0, |span| span.start)
}

fn fault_without_key(file_name: &str, expected: &str) -> Fault {
    Fault {
        file: file_name.to_owned(),
        line: 0,
        column: None,
        key: String::new(),
        value: None,
        expected: expected.to_owned(),
    }
}
