//! One bus: checks its device, the servos on it, and the settings of each.

use std::sync::atomic::{AtomicBool, Ordering};

use super::lines::Lines;
use crate::bus::serial::Device;
use crate::model::{Joint, Protocol, Robot, Servo as JointServo};
use crate::service::{Access, Address, Found, Pass, ServiceError, ServicePort, Servo, scan_bauds};
use crate::units::ServoId;

/// The id of a servo out of the box, for both makers.
const FACTORY_ID: ServoId = ServoId(1);
/// A servo this close to its limit is hot, degrees Celsius.
const NEARLY_HOT_C: f64 = 10.0;
/// If servos on one supply measure voltages this far apart, V, a wire between them is bad.
const SAG_V: f64 = 0.6;

/// Examines a bus; true if all its servos answer.
pub(super) fn examine(
    robot: &Robot,
    bus: usize,
    device: &Device,
    stop: &AtomicBool,
    lines: &mut Lines<'_>,
) -> bool {
    let about = format!("bus {}", robot.buses[bus].name);
    let mut port = match ServicePort::open(&device.path) {
        Ok(port) => port,
        Err(error) => {
            let said = error.to_string();
            let (found, cure) = said.split_once(": ").unwrap_or((&said, "use another path"));
            lines.fault(&about, found, cure);
            return false;
        }
    };
    lines.ok(&about, format!("{} opens, and no other program uses it", device.path.display()));
    let (protocol, baud) = (robot.buses[bus].protocol, robot.buses[bus].baud);
    let all: Vec<ServoId> = (0..=Protocol::ID_MAX).map(ServoId).collect();
    let pass = match port.scan(protocol, baud, &all, stop) {
        Ok(pass) => pass,
        Err(error) => {
            lines.fault(&about, error.to_string(), "use another adapter, or another rate");
            return false;
        }
    };
    if port.is_echoing() {
        lines.warning(
            &about,
            "the adapter returns what it is sent (echo)",
            "nothing to do: hippocamp drops the echo; other programs may be confused by it",
        );
    } else {
        lines.ok(&about, "no echo");
    }
    tell_strangers(robot, bus, &about, &pass, lines);

    let mut is_whole = true;
    let mut volts: Vec<(f64, String)> = Vec::new();
    for joint in robot.joints.iter().filter(|joint| joint.servo.is_some_and(|servo| servo.bus == bus)) {
        let Some(servo) = joint.servo else { continue };
        if stop.load(Ordering::Relaxed) {
            return false;
        }
        let who = format!("servo {} of joint {} on bus {}", servo.id, joint.name, robot.buses[bus].name);
        let found = pass.found.iter().find(|found| found.address.id == servo.id);
        match found {
            Some(found) if found.is_twin => {
                lines.fault(&who, "more than one servo has this id", twin_cure(servo.id));
                is_whole = false;
            }
            Some(found) => match one_servo(robot, joint, &servo, &mut port, *found, &who, lines) {
                Ok(seen_v) => volts.push((seen_v, who)),
                Err(error) => {
                    lines.fault(&who, error.to_string(), "check its plug and its power, and ask again");
                    is_whole = false;
                }
            },
            None => {
                absent(&mut port, robot, &servo, &pass, &who, stop, lines);
                is_whole = false;
            }
        }
    }
    tell_sag(&about, &volts, lines);
    is_whole
}

fn twin_cure(id: ServoId) -> String {
    format!("unplug all servos but one that has id {id}, and give it another with 'hippocamp servo id'")
}

fn tell_strangers(robot: &Robot, bus: usize, about: &str, pass: &Pass, lines: &mut Lines<'_>) {
    let is_own = |id: ServoId| {
        robot.joints.iter().filter_map(|joint| joint.servo).any(|servo| servo.bus == bus && servo.id == id)
    };
    let strangers: Vec<String> = pass
        .found
        .iter()
        .filter(|found| !is_own(found.address.id))
        .map(|found| {
            let model = found.identity.model_names().unwrap_or_else(|| "an unknown model".to_owned());
            format!("{} ({model})", found.address.id)
        })
        .collect();
    if !strangers.is_empty() {
        lines.warning(
            about,
            format!("it has servos that are not in the robot file: id {}", strangers.join(", ")),
            "name them in the robot file, give them the id they should have ('hippocamp servo id'), or unplug them",
        );
    }
}

/// Searches for a servo that does not answer at its address.
fn absent(
    port: &mut ServicePort,
    robot: &Robot,
    servo: &JointServo,
    pass: &Pass,
    who: &str,
    stop: &AtomicBool,
    lines: &mut Lines<'_>,
) {
    let bus = &robot.buses[servo.bus];
    if pass.damaged.contains(&servo.id) {
        return lines.fault(
            who,
            "only damaged answers come from its id: two servos may have it, or a plug is loose",
            twin_cure(servo.id),
        );
    }
    let others = scan_bauds(bus.protocol).iter().copied().filter(|baud| *baud != bus.baud);
    for baud in others {
        let Ok(pass) = port.scan(bus.protocol, baud, &[servo.id, FACTORY_ID], stop) else { continue };
        if let Some(found) = pass.found.iter().find(|found| found.address.id == servo.id) {
            return lines.fault(
                who,
                format!("it is set to {} baud, and its bus to {}", found.address.baud, bus.baud),
                "'hippocamp setup' sets it, or 'hippocamp servo baud'",
            );
        }
        if let Some(found) = pass.found.first() {
            return lines.fault(
                who,
                format!(
                    "no answer; but a servo with factory settings answers (id {FACTORY_ID}, {} baud)",
                    found.address.baud
                ),
                "'hippocamp setup' gives it its id and rate",
            );
        }
    }
    lines.fault(
        who,
        format!("no answer at {} baud, nor at any other rate", bus.baud),
        "check its power, its plug and the plugs before it, and its id ('hippocamp scan')",
    );
}

/// Examines a servo that answers; returns the supply voltage it measures, V.
fn one_servo(
    robot: &Robot,
    joint: &Joint,
    servo: &JointServo,
    port: &mut ServicePort,
    found: Found,
    who: &str,
    lines: &mut Lines<'_>,
) -> Result<f64, ServiceError> {
    let address = Address { id: servo.id, ..found.address };
    let mut of = port.known_servo(address, found.identity);
    let before = lines.count();
    let identity = found.identity;
    let model = identity.model_names().unwrap_or_else(|| format!("model number {}", identity.model_number));
    if identity.model_number != servo.model.model_number {
        lines.fault(
            who,
            format!("it is {model}, and the robot file says {}", servo.model.name),
            "name its model in the robot file, or exchange it",
        );
        // A different model may have different registers.
        return Ok(of.read("present_input_voltage")?.physical);
    }
    if let Some(expected) = servo.firmware.filter(|expected| *expected != identity.firmware) {
        lines.warning(
            who,
            format!("firmware {}, and {expected} when it was calibrated", identity.firmware),
            "an update can reset what a servo was set to: 'hippocamp setup', and calibrate it again",
        );
    }
    settings(robot, joint, servo, &mut of, who, lines)?;
    let volts = state(robot, joint, servo, &mut of, who, lines)?;
    if lines.count() == before {
        let celsius = of.read("present_temperature")?;
        lines.ok(who, format!("{model}, firmware {}, {volts:.1} V, {celsius}", identity.firmware));
    }
    Ok(volts)
}

/// Compares its settings with what the loop needs.
fn settings(
    robot: &Robot,
    joint: &Joint,
    servo: &JointServo,
    of: &mut Servo<'_>,
    who: &str,
    lines: &mut Lines<'_>,
) -> Result<(), ServiceError> {
    const SETUP: &str = "'hippocamp setup' sets it";
    let bus = &robot.buses[servo.bus];
    let series = of.identity().series;
    // SCS servos have no such register.
    if let Some(position_mode) = series.wanted("operating_mode") {
        let mode = of.read("operating_mode")?.raw;
        if mode != position_mode {
            lines.fault(who, format!("operating mode {mode}: position control is {position_mode}"), SETUP);
        }
    }
    // Feetech: reserved on STS (wiki), honoured by some.
    let delay_us = 2 * of.read("return_delay_time")?.raw;
    let is_delay_sure = series.registers.return_delay.is_some();
    if is_delay_sure && delay_us != i64::from(bus.return_delay_us) {
        lines.fault(
            who,
            format!(
                "it waits {delay_us} us before it answers, and return_delay_us is {}",
                bus.return_delay_us
            ),
            SETUP,
        );
    }
    let level_register = of.register("status_return_level")?;
    let level = of.read_raw(&level_register)?;
    let (_, level_of_all) = level_register.range;
    if level < level_of_all {
        lines.warning(
            who,
            format!("status return level {level}: it does not answer writes"),
            match level_register.access {
                Access::Volatile => format!("'hippocamp servo reboot' takes it back to {level_of_all}"),
                Access::Setting | Access::Fixed => SETUP.to_owned(),
            },
        );
    }
    let (low, high) = (of.read("min_position_limit")?.raw, of.read("max_position_limit")?.raw);
    let counts = joint.goal_range_rad();
    let (a, b) = (servo.count_of(counts.0), servo.count_of(counts.1));
    let (lowest, highest) = (a.min(b).round(), a.max(b).round());
    #[allow(clippy::cast_precision_loss, reason = "counts of a turn")]
    let (low, high) = (low as f64, high as f64);
    if lowest < low || highest > high {
        lines.fault(
            who,
            format!("it takes goals from count {low} to {high}; the joint's range is {lowest} to {highest}"),
            "'hippocamp setup' opens its limits: the joint's range is kept by this program",
        );
    }
    if of.register("lock").is_ok() && of.read("lock")?.raw == 0 {
        lines.warning(who, "its settings are unlocked: a disturbed line could change them", SETUP);
    }
    let full = of.register(series.torque_ceiling)?;
    let limit = of.read_raw(&full)?;
    let permitted = robot.safety.torque_share * f64::from(servo.model.torque_limit_full);
    #[allow(clippy::cast_precision_loss, reason = "at most 1000")]
    let is_too_little = (limit as f64) < permitted.floor();
    // On SCS every cycle writes this register, so it is no setting.
    if is_too_little && full.register != servo.model.registers.torque_limit {
        lines.warning(
            who,
            format!(
                "{} is {limit}: it has less torque than the {permitted:.0} that torque_share permits",
                full.name
            ),
            "raise it, or lower torque_share",
        );
    }
    Ok(())
}

/// Checks its present state; returns the supply voltage it measures, V.
fn state(
    robot: &Robot,
    joint: &Joint,
    servo: &JointServo,
    of: &mut Servo<'_>,
    who: &str,
    lines: &mut Lines<'_>,
) -> Result<f64, ServiceError> {
    let registers = servo.model.registers;
    let alarms = of.read("hardware_error_status")?.raw;
    if alarms != 0 {
        let words = registers.alarm_words(u8::try_from(alarms).unwrap_or(u8::MAX));
        lines.fault(
            who,
            format!("it raises an alarm: {words}"),
            "remove the cause, then switch its power off and on, or 'hippocamp servo reboot'",
        );
    }
    let volts = of.read("present_input_voltage")?.physical;
    let lowest_v = robot.buses[servo.bus].voltage_min_v;
    if volts < lowest_v || servo.model.is_too_much(volts) {
        lines.fault(
            who,
            format!("it sees {volts:.1} V, and needs {lowest_v:.1} to {:.1} V", servo.model.voltage_max_v),
            "charge the battery, or check the supply, its wires, and that the servo is the right model",
        );
    }
    let celsius = of.read("present_temperature")?.physical;
    if celsius > robot.safety.temperature_c {
        lines.fault(
            who,
            format!("{celsius:.0} C: the limit is {:.0}", robot.safety.temperature_c),
            "let it cool",
        );
    } else if celsius > robot.safety.temperature_c - NEARLY_HOT_C {
        let words = format!("{celsius:.0} C: near the limit, {:.0}", robot.safety.temperature_c);
        lines.warning(who, words, "let it cool before a long run");
    }
    if of.read("torque_enable")?.raw != 0 {
        lines.warning(
            who,
            "it has torque",
            "a run makes it limp first: hold the robot then, or put it on its stand",
        );
    }
    let count = of.read("present_position")?.raw;
    let (first, last) = servo.model.count_range;
    if !(i64::from(first)..=i64::from(last)).contains(&count) {
        lines.fault(
            who,
            format!("it stands at count {count}, and takes goals from {first} to {last}"),
            format!("turn {} by hand towards the middle of its range", joint.name),
        );
    }
    Ok(volts)
}

fn tell_sag(about: &str, volts: &[(f64, String)], lines: &mut Lines<'_>) {
    let lowest = volts.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let highest = volts.iter().max_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(lowest), Some(highest)) = (lowest, highest) else { return };
    if highest.0 - lowest.0 > SAG_V {
        lines.warning(
            about,
            format!("{} sees {:.1} V, {} sees {:.1} V", lowest.1, lowest.0, highest.1, highest.0),
            "a wire or plug between them is bad, or too thin",
        );
    }
}
