//! The effect of a unit file on its robot, and when a robot counts as calibrated.

use std::f64::consts::TAU;
use std::path::Path;

use hippocamp::config::{self, ConfigError, Unit};
use hippocamp::model::servo_model::ServoModel;
use hippocamp::units::ServoId;
use toml::value::Date;

use crate::{DAY, GOOD, ROBOT_FILE, calibrated, parsed, robot, text_of};

#[test]
fn a_good_unit_file_is_read_completely() {
    let unit = parsed(GOOD).unit;
    assert_eq!(unit.robot_file, "horse-dynamixel.toml");
    assert_eq!(unit.calibrated_on, Some(Date { year: 2026, month: 2, day: 28 }));
    assert_eq!(unit.buses[1].device, "/dev/ttyUSB1");
    let (hip, carpus) = (&unit.joints[0], &unit.joints[1]);
    assert_eq!((hip.zero_count.to_bits(), hip.direction_checked), (2950f64.to_bits(), true));
    assert_eq!(hip.firmware.map(|version| version.to_string()).as_deref(), Some("46"));
    assert_eq!((carpus.zero_count.to_bits(), carpus.direction_checked), (2700.5f64.to_bits(), false));
    assert_eq!(carpus.firmware, None);
}

#[test]
fn a_unit_file_is_searched_beside_its_robot_file() {
    for (robot_file, unit_file) in [
        ("config/horse.toml", "config/horse.unit.toml"),
        ("horse.toml", "horse.unit.toml"),
        ("/a.b/horse", "/a.b/horse.unit.toml"),
    ] {
        assert_eq!(config::default_unit_path(Path::new(robot_file)), Path::new(unit_file));
    }
}

#[test]
fn zero_counts_replace_those_of_the_robot_file_and_nothing_else_changes() {
    let mut applied = robot();
    parsed(GOOD).apply(&mut applied).unwrap();
    for (before, after) in robot().joints.iter().zip(&applied.joints) {
        let (before_servo, after_servo) = (before.servo.unwrap(), after.servo.unwrap());
        let expected = match after.name.as_str() {
            "left_hind.hip" => 2950.0,
            "right_fore.carpus" => 2700.5,
            _ => before_servo.zero_count,
        };
        assert_eq!(after_servo.zero_count.to_bits(), expected.to_bits());
        assert_eq!((before_servo.id, before_servo.bus), (after_servo.id, after_servo.bus));
        assert_eq!(before_servo.reversed, after_servo.reversed);
    }
}

/// The hip's range is -100 to -70 degrees: 1137.8 to 796.4 counts below its zero count.
#[test]
fn a_range_across_the_seam_of_the_encoder_is_refused_on_both_sides() {
    let hip = |zero_count: f64| {
        let mut applied = robot();
        let text = GOOD.replace("zero_count = 2950", &format!("zero_count = {zero_count}"));
        parsed(&text).apply(&mut applied).map(|()| applied.joints[1].servo.unwrap().zero_count)
    };
    let (lowest, highest) = (100.0 / 360.0 * 4096.0, 4095.0 + 70.0 / 360.0 * 4096.0);
    for good in [lowest + 0.01, 2950.0, highest - 0.01] {
        assert_eq!(hip(good).unwrap().to_bits(), good.to_bits());
    }
    for bad in [lowest - 0.01, highest + 0.01, -1e8, 1e8] {
        let error = hip(bad).unwrap_err();
        let [fault] = error.faults.as_slice() else { panic!("{error}") };
        assert_eq!((fault.key.as_str(), fault.line), ("joint[0].zero_count", 16), "{fault}");
        assert!(fault.expected.starts_with("a count from 1138 to 4891: "), "{fault}");
        assert!(fault.expected.contains("left_hind.hip would turn over counts"), "{fault}");
        assert!(fault.expected.contains("XM430-W210 (0 to 4095); take off its horn"), "{fault}");
    }
}

#[test]
fn a_reversed_servo_has_its_travel_on_the_other_side() {
    // right_fore.carpus: 0 to 120 degrees, counts falling: 1365.3 counts below its zero count.
    let carpus = |zero_count: f64| {
        let text = GOOD.replace("zero_count = 2700.5", &format!("zero_count = {zero_count}"));
        parsed(&text).apply(&mut robot())
    };
    assert!(robot().joints[15].servo.unwrap().reversed);
    assert!(carpus(120.0 / 360.0 * 4096.0 + 0.01).is_ok());
    assert!(carpus(4095.0).is_ok());
    assert!(carpus(120.0 / 360.0 * 4096.0 - 0.01).is_err());
    assert!(carpus(4095.01).is_err());
}

#[test]
fn parts_that_the_robot_lacks_are_reported_and_nothing_is_applied() {
    let text = GOOD
        .replace("name = \"right_fore\"\n", "name = \"right_for\"\n")
        .replace("left_hind.hip", "left_hind.hop")
        .replace("right_fore.carpus", "tail");
    let mut applied = robot();
    let error = parsed(&text).apply(&mut applied).unwrap_err();
    let keys: Vec<_> = error.faults.iter().map(|fault| fault.key.as_str()).collect();
    assert_eq!(keys, ["bus[1].name", "joint[0].name", "joint[1].name"]);
    assert!(error.faults[0].expected.contains("did you mean right_fore?"), "{error}");
    assert!(error.faults[1].expected.contains("did you mean left_hind.hip?"), "{error}");
    assert!(error.faults[2].expected.contains("it has left_hind.pelvis, left_hind.hip,"), "{error}");
    let zeros = |robot: &hippocamp::model::Robot| {
        robot.joints.iter().map(|joint| joint.servo.unwrap().zero_count.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(zeros(&applied), zeros(&robot()));
}

fn check(unit: &Unit, test: &str) -> Result<(), ConfigError> {
    parsed(&text_of(unit, test)).check_calibrated(&robot(), Path::new(ROBOT_FILE))
}

fn said(unit: &Unit, test: &str) -> String {
    check(unit, test).unwrap_err().to_string()
}

#[test]
fn a_complete_calibration_is_applied() {
    let robot = robot();
    let unit = calibrated(&robot);
    check(&unit, "whole").unwrap();
    let mut applied = robot.clone();
    parsed(&text_of(&unit, "whole")).apply(&mut applied).unwrap();
    for (joint, entry) in applied.joints.iter().zip(&unit.joints) {
        let servo = joint.servo.unwrap();
        // The middle of the range is 7.25 counts, less the joint's number, from the middle of the servo.
        let middle = servo.count_of(joint.middle_rad());
        assert!((middle - 2048.0).abs() < 9.0, "{}: {middle}", joint.name);
        assert!((servo.count_of(0.0) - entry.zero_count).abs() < 1e-9);
        assert!((servo.count_of(TAU / 4.0) - entry.zero_count).abs() > 1000.0);
    }
}

#[test]
fn a_reversed_servo_is_taken_as_it_was_measured() {
    let robot = robot();
    let mut unit = calibrated(&robot);
    let servo = robot.joints[1].servo.unwrap();
    unit.joints[1].reversed = Some(!servo.reversed);
    assert!(said(&unit, "reversed").contains("calibration_hash"), "an edit is noticed");
    // Where the middle of its range is, stays.
    unit.joints[1].zero_count = 4096.0 - unit.joints[1].zero_count;
    unit.seal(&robot, DAY);
    let mut applied = robot.clone();
    let file = parsed(&text_of(&unit, "reversed"));
    file.apply(&mut applied).unwrap();
    file.check_calibrated(&applied, Path::new(ROBOT_FILE)).unwrap();
    let built = applied.joints[1].servo.unwrap();
    assert_eq!(built.reversed, !servo.reversed);
    assert!((built.count_of(-1.5) - servo.count_of(-1.5)).abs() > 10.0, "counts run the other way");
    assert!(
        applied
            .joints
            .iter()
            .zip(&robot.joints)
            .enumerate()
            .all(|(index, (a, b))| { index == 1 || a.servo.unwrap().reversed == b.servo.unwrap().reversed })
    );
}

#[test]
fn everything_that_is_not_calibrated_is_reported() {
    let error = parsed(GOOD).check_calibrated(&robot(), Path::new("elsewhere/pony.toml")).unwrap_err();
    let said = error.to_string();
    assert!(
        said.contains("robot_file = \"horse-dynamixel.toml\": expected \"pony.toml\", the robot file"),
        "{said}"
    );
    let missing = "[[joint]] \"left_hind.pelvis\", \"left_hind.stifle\", \"left_hind.hock\" and 11 more is not set: expected every";
    assert!(said.contains(missing), "{said}");
    assert!(said.contains("joint[1].direction_checked is not set: expected true"), "{said}");
    // The joints, one direction, one robot file.
    assert_eq!(error.faults.len(), 3, "{said}");

    let mut unit = calibrated(&robot());
    unit.calibrated_on = None;
    assert!(self::said(&unit, "undated").contains("calibrated_on is not set"));
    // After the setup of its servos and before its calibration: one line, not one for each joint.
    unit.joints.clear();
    let error = check(&unit, "set-up").unwrap_err();
    assert_eq!(error.faults.len(), 1, "{error}");
    assert!(error.to_string().contains("a calibration, and its 16 joints; calibrate this robot"), "{error}");
}

#[test]
fn an_edit_of_the_unit_file_after_the_calibration_is_noticed() {
    let robot = robot();
    let good = calibrated(&robot);
    let spoilt: [fn(&mut Unit); 5] = [
        |unit| unit.joints[3].zero_count += 1.0,
        |unit| unit.joints[3].firmware = Some("47".parse().unwrap()),
        |unit| unit.calibrated_on = Some(Date { day: DAY.day + 1, ..DAY }),
        |unit| unit.calibration_hash = None,
        |unit| {
            let first = unit.joints[0].zero_count;
            unit.joints[0].zero_count = unit.joints[4].zero_count;
            unit.joints[4].zero_count = first;
        },
    ];
    for spoil in spoilt {
        let mut unit = good.clone();
        spoil(&mut unit);
        let said = said(&unit, "edited");
        assert!(said.contains("calibration_hash") && said.contains("calibrate again"), "{said}");
    }
    // An adapter on another plug, or entries in another order, are no other calibration.
    let mut unit = good.clone();
    unit.buses[0].device = "/dev/serial/by-id/another".to_owned();
    unit.joints.reverse();
    check(&unit, "moved").unwrap();
}

#[test]
fn an_edit_of_the_robot_file_that_makes_the_calibration_doubtful_is_noticed() {
    let file = parsed(&text_of(&calibrated(&robot()), "robot-edited"));
    let check = |robot: &hippocamp::model::Robot| file.check_calibrated(robot, Path::new(ROBOT_FILE));
    let edits: [fn(&mut hippocamp::model::Servo); 4] = [
        |servo| servo.reversed = !servo.reversed,
        |servo| servo.id = ServoId(99),
        |servo| servo.bus = 3 - servo.bus,
        |servo| servo.model = ServoModel::named("XM430-W350").unwrap(),
    ];
    for edit in edits {
        let mut robot = robot();
        edit(robot.joints[5].servo.as_mut().unwrap());
        assert!(check(&robot).unwrap_err().to_string().contains("calibration_hash"));
    }
    // A narrower range, or another loop rate, leaves the calibration as it is; so does applying it.
    let mut robot = robot();
    robot.joints[5].range_rad.0 += 0.01;
    robot.rate_hz = 100.0;
    file.apply(&mut robot).unwrap();
    check(&robot).unwrap();
}

#[test]
fn devices_with_unstable_names_and_indistinguishable_buses_get_a_warning() {
    let said = |text: &str, robot: &hippocamp::model::Robot| -> Vec<String> {
        parsed(text).warnings(robot).iter().map(ToString::to_string).collect()
    };
    let warnings = said(GOOD, &robot());
    assert_eq!(
        warnings,
        [
            "good.unit.toml:12: bus[1].device = \"/dev/ttyUSB1\": expected a path in /dev/serial/by-id: this one \
          changes with the order of plugging in"
        ]
    );
    let stable = GOOD.replace("/dev/ttyUSB1", "/dev/ttyAMA0");
    assert_eq!(said(&stable, &robot()).len(), 0);

    let mut twins = robot();
    for joint in &mut twins.joints {
        let servo = joint.servo.as_mut().unwrap();
        servo.id = ServoId((servo.id.0 - 1) % 4);
    }
    let warnings = said(&stable, &twins);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("ids that differ from those of bus left_hind"), "{warnings:?}");
    // With one servo of another model, a swap would be noticed.
    twins.joints[0].servo.as_mut().unwrap().model = ServoModel::named("XM430-W350").unwrap();
    assert_eq!(said(&stable, &twins).len(), 0);
}
