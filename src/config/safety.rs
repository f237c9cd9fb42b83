//! `[safety]`: limits that hold for every motion; every key has a default.

use super::buses::BusEntry;
use super::number::Limits;
use super::reader::Section;
use crate::model::{SafetySettings, ServoModel, TrippedServoPolicy};

const ON_TRIP: [(&str, TrippedServoPolicy); 2] =
    [("stop", TrippedServoPolicy::Stop), ("freeze", TrippedServoPolicy::Freeze)];

/// A key of `[safety]`. Its own limits keep every safety limit effective: the meaning says why they end where they
/// do.
struct Setting {
    key: &'static str,
    meaning: &'static str,
    limits: Limits,
    default: f64,
}

/// The default leaves a servo some torque to follow with.
const RATE_SHARE: Setting = Setting {
    key: "rate_share",
    meaning: "a share of the no-load speed",
    limits: Limits::AboveToMost(0.0, 1.0),
    default: 0.7,
};
/// The default is above what the built-in gaits ask of a small robot, and below what a jump in the goal would ask.
/// The upper limit: no-load speed, some 8 rad/s, in 5 ms, a tenth of a geared servo's time constant.
const ACCELERATION_MAX: Setting = Setting {
    key: "acceleration_max_deg_s2",
    meaning: "the largest joint acceleration in degrees/s^2 (beyond what any servo has, it would limit nothing)",
    limits: Limits::AboveToMost(0.0, 100_000.0),
    default: 10_000.0,
};
/// The default is a quarter turn in three seconds: slow enough to step back from.
const SLOW_RATE: Setting = Setting {
    key: "slow_rate_deg_s",
    meaning: "the joint speed of start-up and sitting in degrees/s (a person may have a hand on the robot; and it \
              must get up within minutes)",
    limits: Limits::FromTo(1.0, 90.0),
    default: 30.0,
};
const TORQUE_SHARE: Setting = Setting {
    key: "torque_share",
    meaning: "a share of the stall torque",
    limits: Limits::AboveToMost(0.0, 1.0),
    default: 1.0,
};
/// The default is long enough for a limp robot to settle into the grip.
const TORQUE_RAMP: Setting = Setting {
    key: "torque_ramp_s",
    meaning: "the time of the torque's rise in s (in less, a limp robot jerks; in more, it hangs half held)",
    limits: Limits::FromTo(0.2, 10.0),
    default: 1.0,
};
/// The default is ten cycles at 100 Hz: a few lost replies pass unnoticed.
const COAST: Setting = Setting {
    key: "coast_s",
    meaning: "how long a servo may be silent before a hold, in s (in longer, a silent leg takes a whole step)",
    limits: Limits::AboveToMost(0.0, 0.5),
    default: 0.1,
};
/// The default gives time for a plug to be put back.
const HOLD: Setting = Setting {
    key: "hold_s",
    meaning: "how long a hold lasts before the stop action, in s (servos that hold something up heat up meanwhile)",
    limits: Limits::AboveToMost(0.0, 30.0),
    default: 2.0,
};
/// The default is twice the lag of a healthy servo in a trot.
const TRACKING_ERROR_MAX: Setting = Setting {
    key: "tracking_error_max_deg",
    meaning: "the largest difference between goal and measurement in degrees (a joint that is further off does not \
              follow its goal)",
    limits: Limits::AboveToMost(0.0, 45.0),
    default: 20.0,
};
/// The default rides out the shock of a footfall and the dip of a supply. The upper limit: after two seconds of
/// overload a Feetech servo switches its torque off by itself (register 35, protection time).
const FAULT_DELAY: Setting = Setting {
    key: "fault_delay_s",
    meaning: "how long the robot tolerates a fault, in s (a jammed servo takes its stall current meanwhile)",
    limits: Limits::FromTo(0.0, 2.0),
    default: 0.5,
};

/// Margin below the temperature at which the first servo would switch off: the robot stops before that.
const TEMPERATURE_MARGIN_C: f64 = 5.0;

/// Reads `[safety]`, and its voltage limit for buses that set none, V; `models` are the servo models in use, each with its
/// bus.
///
/// The temperature limit defaults to a little below the lowest of the models' own limits. Without servos it is infinite.
pub(super) fn read(
    file: &Section<'_>,
    models: &[(usize, &ServoModel)],
) -> Option<(SafetySettings, Option<f64>)> {
    file.section_or_empty("safety", "the safety limits", |section| read_settings(section, models))
}

fn read_settings(
    section: &Section<'_>,
    models: &[(usize, &ServoModel)],
) -> Option<(SafetySettings, Option<f64>)> {
    let voltage_min_v = read_voltage(section);
    let number =
        |setting: &Setting| section.number_or(setting.key, setting.meaning, setting.limits, setting.default);
    let rate_share = number(&RATE_SHARE);
    let acceleration = number(&ACCELERATION_MAX);
    let slow_rate = number(&SLOW_RATE);
    let torque_share = number(&TORQUE_SHARE);
    let torque_ramp_s = number(&TORQUE_RAMP);
    let coast_s = number(&COAST);
    let hold_s = number(&HOLD);
    let fault_delay_s = number(&FAULT_DELAY);
    let tracking_error = number(&TRACKING_ERROR_MAX);
    section.describe_default(
        "tripped_servo",
        "what the robot does about a servo that raises an alarm: one of \"stop\", \"freeze\" (arms only)",
        "\"stop\"",
    );
    let tripped_servo = match section.has("tripped_servo") {
        true => section.choice(
            "tripped_servo",
            "what the robot does about a servo that raises an alarm",
            &ON_TRIP,
        ),
        false => Some(TrippedServoPolicy::Stop),
    };
    let settings = SafetySettings {
        temperature_c: read_temperature(section, models)?,
        rate_share: rate_share?,
        acceleration_rad_s2: acceleration?.to_radians(),
        slow_rate_rad_s: slow_rate?.to_radians(),
        torque_share: torque_share?,
        torque_ramp_s: torque_ramp_s?,
        coast_s: coast_s?,
        hold_s: hold_s?,
        tracking_error_rad: tracking_error?.to_radians(),
        fault_delay_s: fault_delay_s?,
        tripped_servo: tripped_servo?,
    };
    Some((settings, voltage_min_v?))
}

/// A servo shuts itself off at its own limit, so a higher one would never act.
fn read_temperature(section: &Section<'_>, models: &[(usize, &ServoModel)]) -> Option<f64> {
    let lowest =
        models.iter().map(|(_, model)| f64::from(model.temperature_max_c)).fold(f64::INFINITY, f64::min);
    let limits =
        if models.is_empty() { Limits::AboveToMost(0.0, 1000.0) } else { Limits::AboveToMost(0.0, lowest) };
    section.describe_default("temperature_max_c", "", "5 below the lowest of the servo models' own");
    let meaning = "the highest servo temperature in degrees C, not above the servos' own limit";
    section.number_or("temperature_max_c", meaning, limits, lowest - TEMPERATURE_MARGIN_C)
}

/// The limit for the buses that set none themselves, V; `Some(None)` if it is not set either.
fn read_voltage(section: &Section<'_>) -> Option<Option<f64>> {
    let meaning = "the lowest supply voltage in V, within what the servos allow";
    section.describe_default("voltage_min_v", meaning, "on each bus the highest of its servo models' own");
    if !section.has("voltage_min_v") {
        return Some(None);
    }
    section.number("voltage_min_v", meaning, Limits::FromTo(0.0, 1000.0)).map(Some)
}

/// The lowest supply voltage of each bus, V. It must lie within what each of the bus's servos allows.
pub(super) fn voltages(
    file: &Section<'_>,
    buses: &[BusEntry<'_>],
    models: &[(usize, &ServoModel)],
    of_all: Option<f64>,
) -> Vec<f64> {
    let limit = |(place, bus): (usize, &BusEntry<'_>)| {
        let models = || models.iter().filter(|(on, _)| *on == place).map(|(_, model)| *model);
        let most = models().max_by(|a, b| a.voltage_min_v.total_cmp(&b.voltage_min_v))?;
        let least = models().min_by(|a, b| a.voltage_max_v.total_cmp(&b.voltage_max_v))?;
        let name = bus.name.unwrap_or_default();
        if most.voltage_min_v >= least.voltage_max_v {
            file.fault(
                &format!("bus[{place}].name"),
                format!(
                    "servos that one supply can feed: {} needs {} V or more, {} takes {} V or less; give them buses and \
                     supplies of their own",
                    most.name, most.voltage_min_v, least.name, least.voltage_max_v
                ),
            );
            return None;
        }
        let fits = |limit_v: f64| (most.voltage_min_v..least.voltage_max_v).contains(&limit_v);
        let (key, limit_v) = match (bus.voltage_min_v, of_all) {
            (Some(limit_v), _) => (format!("bus[{place}].voltage_min_v"), limit_v),
            (None, Some(limit_v)) => ("safety.voltage_min_v".to_owned(), limit_v),
            (None, None) => return Some(most.voltage_min_v),
        };
        if !fits(limit_v) {
            file.fault(
                &key,
                format!(
                    "from {} to below {} V for the servos of bus {name}; each [[bus]] may have a voltage_min_v of its own",
                    most.voltage_min_v, least.voltage_max_v
                ),
            );
        }
        Some(limit_v)
    };
    buses.iter().enumerate().map(|entry| limit(entry).unwrap_or(0.0)).collect()
}
