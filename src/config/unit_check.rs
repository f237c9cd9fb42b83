//! Checks a unit file against its robot: does it fit, is it calibrated, what is unwise.

use std::fmt::Write;
use std::hash::Hasher;
use std::path::Path;

use fnv::FnvHasher;
use glam::DVec3;
use toml::value::Date;

use super::fault::{ConfigError, Fault};
use super::limb::rotation;
use super::nearest::nearest;
use super::unit::{Unit, UnitFile, UnitImu, UnitJoint};
use crate::model::{ImuSettings, Joint, Robot, Servo};

/// Rounding error that does not count as crossing the end of the counts.
const ROUNDING_COUNTS: f64 = 1e-6;

/// Prefixes of device names that the system assigns in the order of plugging in.
const UNSTABLE_DEVICES: [&str; 2] = ["/dev/ttyUSB", "/dev/ttyACM"];

/// Most joints that a fault names.
const NAMED_MAX: usize = 3;

impl Unit {
    /// Hash of the calibration: robot file name, date, every joint's entry, and how the robot file says its servo
    /// is connected (axis, model, bus, id, reversed). So it detects a later edit of either file that makes a
    /// checked direction or zero count doubtful. It leaves devices out: an adapter may move to another plug.
    /// FNV-1a, 64 bits (crate `fnv`), as 16 hexadecimal digits: it detects slips, not malice.
    pub fn hash(&self, robot: &Robot) -> String {
        let mut text = String::new();
        let mut joints: Vec<&UnitJoint> = self.joints.iter().collect();
        joints.sort_by(|a, b| a.name.cmp(&b.name));
        let date = self.calibrated_on.map(|date| date.to_string());
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{:?} {date:?}", self.robot_file);
        for joint in joints {
            let UnitJoint { name, zero_count, reversed, direction_checked, firmware } = joint;
            let bits = zero_count.to_bits();
            let _ = write!(text, "{name:?} {bits:016x} {direction_checked} {firmware:?}");
            let described = robot.joints.iter().find(|of| of.name == *name);
            // A reversed axis reverses the joint as `reversed` does.
            let axis = described.map(|of| of.axis.to_array().map(f64::to_bits));
            let _ = write!(text, " {axis:?}");
            if let Some(servo) = described.and_then(|of| of.servo) {
                let (model, bus) = (servo.model.name, robot.buses.get(servo.bus).map(|bus| &bus.name));
                let reversed = reversed.unwrap_or(servo.reversed);
                let _ = write!(text, " {model:?} {bus:?} {} {reversed}", servo.id);
            }
            text.push('\n');
        }
        let mut hasher = FnvHasher::default();
        hasher.write(text.as_bytes());
        format!("{:016x}", hasher.finish())
    }

    /// Completes a calibration done on `day`: later changes of the joints will be noticed.
    pub fn seal(&mut self, robot: &Robot, day: Date) {
        self.calibrated_on = Some(day);
        self.calibration_hash = Some(self.hash(robot));
    }
}

impl UnitJoint {
    /// The `servo` of the robot file with the measured values of the built one.
    pub(crate) fn of(&self, servo: &Servo) -> Servo {
        Servo {
            zero_count: self.zero_count,
            reversed: self.reversed.unwrap_or(servo.reversed),
            firmware: self.firmware,
            ..*servo
        }
    }
}

impl UnitImu {
    /// Replaces the robot file's settings with the known values of this IMU.
    fn apply(&self, settings: &mut ImuSettings) {
        settings.baud = self.baud.unwrap_or(settings.baud);
        if let Some(rpy_deg) = self.rpy_deg {
            settings.rotation = rotation(DVec3::from_array(rpy_deg));
        }
        if self.rates_reversed == Some(true) {
            settings.rate_sign = -1.0;
        }
    }
}

impl UnitFile {
    /// Gives each servo of `robot` its zero count, its mounting direction if that was measured, and its firmware at
    /// calibration.
    ///
    /// # Errors
    /// Every bus and joint that the robot does not have, and every joint whose range would cross the seam of its
    /// servo's encoder. `robot` is then unchanged.
    pub fn apply(&self, robot: &mut Robot) -> Result<(), ConfigError> {
        let mut faults = self.stranger_buses(robot);
        let mut calibrations = Vec::new();
        for (place, entry) in self.unit.joints.iter().enumerate() {
            let found = robot.joints.iter().position(|joint| joint.name == entry.name);
            match found.map(|index| (index, &robot.joints[index])) {
                Some((index, joint @ Joint { servo: Some(servo), .. })) => {
                    let servo = entry.of(servo);
                    match travel_fault(joint, &servo) {
                        None => calibrations.push((index, servo)),
                        Some(expected) => {
                            faults.push(self.fault(&format!("joint[{place}].zero_count"), expected));
                        }
                    }
                }
                _ => {
                    let names: Vec<&str> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
                    let key = format!("joint[{place}].name");
                    faults.push(self.stranger(&key, &entry.name, "a joint with a servo", &names));
                }
            }
        }
        if self.unit.imu.is_some() && robot.imu.is_none() {
            faults.push(self.fault("imu", "no [imu], as in the robot file; or add [imu] to the robot file"));
        }
        if !faults.is_empty() {
            return Err(ConfigError::of(faults));
        }
        for (index, servo) in calibrations {
            robot.joints[index].servo = Some(servo);
        }
        if let (Some(entry), Some(settings)) = (&self.unit.imu, &mut robot.imu) {
            entry.apply(settings);
        }
        Ok(())
    }

    /// Checks that `robot`, loaded from `robot_file`, may move on real servos: the unit file was made for that
    /// robot file, has every joint, each with its direction checked, and was not changed since.
    ///
    /// # Errors
    /// Every condition that is not met.
    pub fn check_calibrated(&self, robot: &Robot, robot_file: &Path) -> Result<(), ConfigError> {
        let mut faults = Vec::new();
        let file_name = robot_file.file_name().unwrap_or_default().to_string_lossy();
        if self.unit.robot_file != file_name {
            let expected =
                format!("{file_name:?}, the robot file it is used with; calibrate each robot with its own");
            faults.push(self.fault("robot_file", expected));
        }
        let on_servos = || robot.joints.iter().filter(|joint| joint.servo.is_some());
        let missing: Vec<String> = on_servos()
            .filter(|joint| !self.unit.joints.iter().any(|entry| entry.name == joint.name))
            .map(|joint| format!("{:?}", joint.name))
            .collect();
        let has_none = !missing.is_empty() && missing.len() == on_servos().count();
        if self.unit.calibrated_on.is_none() {
            let joints = if has_none { format!(", and its {} joints", missing.len()) } else { String::new() };
            let expected = format!("the day of a calibration{joints}; calibrate this robot");
            faults.push(self.fault("calibrated_on", expected));
        }
        // A robot that is not calibrated at all has said so.
        let is_said = has_none && self.unit.calibrated_on.is_none();
        if !missing.is_empty() && !is_said {
            let named = missing.iter().take(NAMED_MAX).cloned().collect::<Vec<_>>().join(", ");
            let more = missing.len().saturating_sub(NAMED_MAX);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            faults.push(self.fault(&format!("[[joint]] {named}{more}"), "every joint; calibrate these"));
        }
        for (place, entry) in self.unit.joints.iter().enumerate().filter(|(_, of)| !of.direction_checked) {
            let expected = format!("true: check that {} turns the way its robot file says", entry.name);
            faults.push(self.fault(&format!("joint[{place}].direction_checked"), expected));
        }
        // An incomplete calibration has no hash to compare.
        if faults.is_empty() && self.unit.calibration_hash != Some(self.unit.hash(robot)) {
            faults.push(self.fault(
                "calibration_hash",
                "the hash its calibration wrote: since then a zero count or a direction check was changed here, \
                 or a servo's model, bus, id or direction in the robot file; calibrate again",
            ));
        }
        if faults.is_empty() { Ok(()) } else { Err(ConfigError::of(faults)) }
    }

    /// Things that work but may go wrong later: devices whose names change, buses that could be swapped unnoticed.
    pub fn warnings(&self, robot: &Robot) -> Vec<Fault> {
        let mut warnings = Vec::new();
        for (place, bus) in self.unit.buses.iter().enumerate() {
            let key = format!("bus[{place}].device");
            if UNSTABLE_DEVICES.iter().any(|start| bus.device.starts_with(start)) {
                let expected = "a path in /dev/serial/by-id: this one changes with the order of plugging in";
                warnings.push(self.fault(&key, expected));
            }
            let earlier = self.unit.buses[..place].iter().find(|of| is_lookalike(robot, &of.name, &bus.name));
            if let Some(earlier) = earlier {
                let expected = format!(
                    "ids that differ from those of bus {}: the models are the same too, so that a swap of the two \
                     devices could not be noticed; give every servo of the robot an id of its own",
                    earlier.name
                );
                warnings.push(self.fault(&key, expected));
            }
        }
        warnings
    }

    fn stranger_buses(&self, robot: &Robot) -> Vec<Fault> {
        let names: Vec<&str> = robot.buses.iter().map(|bus| bus.name.as_str()).collect();
        let strangers =
            self.unit.buses.iter().enumerate().filter(|(_, bus)| !names.contains(&bus.name.as_str()));
        strangers
            .map(|(place, bus)| self.stranger(&format!("bus[{place}].name"), &bus.name, "a bus", &names))
            .collect()
    }

    fn stranger(&self, key: &str, name: &str, what: &str, names: &[&str]) -> Fault {
        let advice = match nearest(name, names.iter().copied()) {
            Some(near) if near != name => format!("did you mean {near}?"),
            _ => format!("it has {}", names.join(", ")),
        };
        self.fault(key, format!("{what} of the robot file; {advice}"))
    }
}

/// The fault if the joint's range does not lie within the counts of `servo`.
fn travel_fault(joint: &Joint, servo: &Servo) -> Option<String> {
    let (low, high) = joint.range_rad;
    let (a, b) = (servo.count_of(low), servo.count_of(high));
    let (first, last) = (f64::from(servo.model.count_range.0), f64::from(servo.model.count_range.1));
    let is_inside = |count: f64| (first - ROUNDING_COUNTS..=last + ROUNDING_COUNTS).contains(&count);
    if is_inside(a) && is_inside(b) {
        return None;
    }
    let lowest = (servo.zero_count + first - a.min(b)).ceil();
    let highest = (servo.zero_count + last - a.max(b)).floor();
    Some(format!(
        "a count from {lowest} to {highest}: with this one {} would turn over counts {:.0} to {:.0}, beyond the \
         seam of the encoder of its {} ({first} to {last}); take off its horn, mount it so that the middle of \
         the joint's range is near count {:.0}, and calibrate again",
        joint.name,
        a.min(b),
        a.max(b),
        servo.model.name,
        servo.model.middle_count()
    ))
}

/// True if the servos on two buses of these names could not be told apart by their replies.
fn is_lookalike(robot: &Robot, a: &str, b: &str) -> bool {
    let identities = |name: &str| {
        let bus = robot.buses.iter().position(|bus| bus.name == name)?;
        let servos = robot.joints.iter().filter_map(|joint| joint.servo).filter(|servo| servo.bus == bus);
        let mut ids: Vec<_> = servos.map(|servo| (servo.id, servo.model.model_number)).collect();
        ids.sort_unstable();
        let bus = &robot.buses[bus];
        Some((bus.protocol, bus.baud, ids))
    };
    identities(a).is_some() && identities(a) == identities(b)
}
