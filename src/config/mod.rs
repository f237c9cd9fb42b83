//! Robot files and unit files: TOML that people write, checked as a whole.
//!
//! In: a file, or its text. Out: a [`Robot`] or a [`Unit`], or every fault of the file at once. The module touches
//! nothing but that file, and keeps the origin of every value, so that later checks can trace a fault back to it.
//!
//! A robot file describes all robots of a kind. The data of one built robot are in its unit file; [`UnitFile`] says
//! more.
//!
//! The schema of robot files, one for all rigs; lengths in mm, angles in degrees; each key's name ends in its unit.
//!
//! The page `docs/robot-file.md` says what each key means; it is generated from [`robot_file_keys`].
//!
//! | section | keys (those with a default in brackets) |
//! |---|---|
//! | top | `name`, `loop_rate_hz`, `stop_action` = `"hold"`, `"sit-then-limp"`, or (the same, of arms) `"park-then-limp"` |
//! | `[trunk]` | `mass_kg`, `center_mm` |
//! | `[[bus]]` | `name`, `protocol`, `baud`, (`adapter_latency_us` 1000), (`return_delay_us` 0), (`supply_mohm` 100); no bus at all: a robot on paper |
//! | `[[chain]]` | `name`, `root_mm`, (`root_rpy_deg` 0 0 0), (`foot` = { `radius_mm`, `width_mm` } or { `size_mm`, (`middle_mm` 0 0 0) }) |
//! | `[[chain.joint]]` | `name`, `axis`, `link_mm`, `range_deg`, `stiffness`, `mass_kg`, (`center_mm` middle of the link), `servo`, (`ball` none: its own range alone) |
//! | `[[arm]]` | `name`, `root_mm`, (`root_rpy_deg` 0 0 0), `joints`, (`hinges` 2), `link_mm`, (`taper` 0.01), `range_deg`, `twist_range_deg` of three hinges, (`stiffness` 0.5), `mass_kg`, `radius_mm`, (`role` 1), (`stroke_plane_deg` 0), (`park_lift_deg` 0): a chain of lift, sweep (and twist) hinges |
//! | `[[chain.joint.ball]]`, `[[arm.ball]]` | `lift_deg`, `sweep_deg`, (`twist_range_deg` -180 180): a corner of the region in which each joint may bend, beyond its hinges' ranges; none at all: the hinges' ranges alone |
//! | `[[arm.servos]]` | `model`, `bus`, `joints`, `first_id`, (`reversed` false): in a row from root to tip |
//! | `[arm.tendons]` | `cord_radius_mm`, `gap_mm`, `spool_radius_mm`, `bend_max_deg`, (`cord_turn_deg` 0), `pretension_mm`, (`slack_max_mm` 1): in the place of `hinges`, `range_deg`, `stiffness`; three sections, whose winches `servos` turn |
//! | `servo` | `model`, `bus`, `id`, (`reversed` false); none on a robot on paper |
//! | `[imu]` | (`rate_hz` 200), (`baud` 115200), (`rpy_deg` 0 0 0), (`delay_ms` 5), (`stale_s` 0.1), (`lost_speed_share` 0.5); none at all: no unit |
//! | `[imu.noise]` | (`acceleration_m_s2` 0.03), (`acceleration_bias_m_s2` 0.1), (`rate_deg_s` 0.1), (`rate_bias_deg_s` 0.1), (`angle_deg` 0.1), (`angle_drift_deg` 0.3): of a simulated unit |
//! | `[safety]` | (`rate_share` 0.7), (`acceleration_max_deg_s2` 10000), (`slow_rate_deg_s` 30), (`torque_share` 1), (`torque_ramp_s` 1), (`coast_s` 0.1), (`hold_s` 2), (`tracking_error_max_deg` 20), (`fault_delay_s` 0.5), (`temperature_max_c` 5 below the servo models' own), (`voltage_min_v` their own), (`tripped_servo` `"stop"` or `"freeze"`) |
//! | `[reflex]` | (`mode` `"reflex"`, `"passive"` or `"off"`), (`detector` `"lean"` or `"rate"`), (`roll_max_deg` 34), (`pitch_max_deg` 29), (`ahead_s` 0.14), (`rate_max_deg_s` 172), (`passive_torque_share` 0.2), (`rest_rate_deg_s` 20), (`rest_s` 0.5), (`get_ups_max` 3); no section: falls are not noticed; not of arms on a base |
//! | `[[reflex.pose]]` | `name`, `angles_deg` of all joints |
//! | `[[reflex.fall]]` | `direction` = `"forward"`, `"backward"`, `"left"`, `"right"` or `"twisting"`, with `[[reflex.fall.key]]`: `pose`, `at_s`, (`torque_share` 1) |
//! | `[[reflex.get_up]]` | `lying` = `"upright"`, `"front"`, `"back"`, `"left"`, `"right"` or `"over"`, with any `[[reflex.get_up.key]]` as above |
//! | `[yield]` | `load_share`, (`after_s` 0.2), (`torque_share` 0.1), (`for_s` 1), (`return_s` 2); of arms: gives way above that load |
//! | `[physics]` | of a simulated robot; no such section: joints turn freely: (`step_ms` 1), (`rotor_inertia_kg_m2` the servo models'), (`viscosity_nm_s` 0), (`stop_stiffness_nm_rad` 60), (`stop_damping_nm_s` 0.3); on legs `trunk_box_mm`, (`link_radius_mm` 8), (`friction` 0.8), (`slope_deg` 0), (`uphill_deg` 0) |
//! | `[[physics.step]]` | `at_mm`, `length_mm`, `height_mm`: a block across the way |
//! | `[balance]` | (`friction` that of `[physics]`, or 0.8), (`sag_correction` true), (`roll_rate_gain_s` 0.1), (`pitch_rate_gain_s` 0.05), (`heading_gain_m_s` 0.2), of a figure (`lean_brake_hz` 8) |
//! | `[motion]` | `kind` = `"horse"`, `legs` = { `left_hind`, `left_fore`, `right_hind`, `right_fore` }, `stand_height_mm`, `sit_height_mm`, `swing_time_s`, `swing_lift_mm`, `swing_ramp_share`, `acceleration_max_m_s2`, (`yaw_rate_max_deg_s` 20) |
//! | `[motion]` | `kind` = `"tentacle"`, `carried_by` = `"servos"`, `"water"` or `"counterweight"`, `carried_share` of all but the first, `stroke_time_s`, (`key_angles` `"smooth"` or `"linear"`), (`bending` `"smooth"` or `"ccd"`), (`variation_deg` 0), (`variation_seed` 1), (`reach_mm`), (`base_radius_mm`), (`clearance_mm` 5), (`grip_share` 0.15), (`pole` = { `point_mm`, `axis`, `radius_mm` }), (`path` = { `points_mm`, `speed_mm_s` }) |
//! | `[motion]` | `kind` = `"figure"`, `legs` = { `left`, `right` }, (`head` none), `stand_height_mm`, `sit_height_mm`, (`soft_stop_deg` 5), (`set_down_s` 5) |
//! | `[[motion.pose]]` | of a figure: `name`, `time_s`, (`height_mm` standing), (`pitch_deg` 0), (`roll_deg` 0), (`sway_mm` 0), (`turn` = [{ `joint`, `angle_deg` }] as in the pose `stand`) |
//! | `[[motion.gait]]` | `name`, `duty_factor`, and `phase_offsets` or `fore_hind_phase_offset` with `left_right_phase_offset`, (`vertical_oscillation_mm` 0), (`vertical_oscillations_per_stride` 2), (`vertical_oscillation_highest_at` 0), (`auto_froude_max` none: taken by name only); added to the built-in gaits, or in the place of the one of that name |

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
use crate::model::{Bus, IMU_LINE, Motion, OnTrip, Robot, SafetySettings, StopAction, TentacleMotion};
use crate::motion::StrokeCommand;
use crate::motion::tentacle::{TentaclePlan, winder};
pub use fault::{ConfigError, Fault};
use faults::Faults;
pub use keys::{Key, robot_file_keys};
pub(crate) use nearest::nearest;
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
        error => fault_without_key(&file_name, &format!("{expected}; this one cannot: {error}")).into(),
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
    let on_trip = safety.as_ref().map(|safety| safety.on_trip);
    if on_trip == Some(OnTrip::Freeze) && motion.as_ref().is_some_and(Motion::is_on_legs) {
        let expected = "\"stop\", or no such key: arms hang on without a joint, what stands on legs falls";
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
