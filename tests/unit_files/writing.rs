//! Unit files are read as they were written.

use hippocamp::config::{self, Unit, UnitBus, UnitImu, UnitJoint};
use hippocamp::model::Firmware;
use proptest::prelude::*;
use toml::value::Date;

use crate::{calibrated, parsed, robot, text_of};

#[test]
fn a_unit_file_is_written_as_a_person_would_write_it() {
    let unit = Unit {
        robot_file: "horse.toml".into(),
        calibrated_on: Some(Date { year: 2026, month: 3, day: 9 }),
        calibration_hash: Some("00ff".into()),
        buses: vec![UnitBus { name: "legs".into(), device: "/dev/serial/by-id/a".into() }],
        imu: Some(UnitImu {
            device: "/dev/serial/by-id/b".into(),
            baud: Some(115_200),
            rpy_deg: Some([0.0, 0.5, -90.0]),
            rates_reversed: None,
        }),
        joints: vec![UnitJoint {
            name: "left_hind.hip".into(),
            zero_count: -12.5,
            reversed: None,
            direction_checked: true,
            firmware: Some("3.10".parse().unwrap()),
        }],
    };
    assert_eq!(
        text_of(&unit, "golden"),
        "version = 1\nrobot_file = \"horse.toml\"\ncalibrated_on = 2026-03-09\ncalibration_hash = \"00ff\"\n\n\
         [[bus]]\nname = \"legs\"\ndevice = \"/dev/serial/by-id/a\"\n\n\
         [imu]\ndevice = \"/dev/serial/by-id/b\"\nbaud = 115200\nrpy_deg = [0.0, 0.5, -90.0]\n\n\
         [[joint]]\nname = \"left_hind.hip\"\nzero_count = -12.5\ndirection_checked = true\nfirmware = \"3.10\"\n"
    );
    assert_eq!(
        text_of(&Unit { robot_file: "a".into(), ..Unit::default() }, "empty"),
        "version = 1\nrobot_file = \"a\"\n"
    );
}

#[test]
fn every_write_keeps_the_file_before_and_a_link_its_target() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("keeps");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("true")).unwrap();
    let path = folder.join("true/horse.unit.toml");
    let mut unit = calibrated(&robot());
    assert_eq!(config::write_unit(&path, &unit).unwrap(), None);
    unit.joints[0].zero_count += 1.0;
    let old = config::write_unit(&path, &unit).unwrap().unwrap();
    assert_eq!(old, std::fs::canonicalize(&path).unwrap().with_extension("toml.1"));
    let zero = |path: &std::path::Path| config::load_unit(path).unwrap().unit.joints[0].zero_count;
    assert!((zero(&path) - zero(&old) - 1.0).abs() < 1e-12);
    #[cfg(unix)]
    {
        let link = folder.join("link.toml");
        std::os::unix::fs::symlink("true/horse.unit.toml", &link).unwrap();
        config::write_unit(&link, &unit).unwrap();
        assert!(link.is_symlink() && folder.join("true/horse.unit.toml.2").exists());
    }
}

/// Any that can be shown: others are refused.
fn any_text() -> impl Strategy<Value = String> {
    "[^\\p{C}\\p{Zl}\\p{Zp}]*[a-z]"
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_unit_round_trips_through_its_file(
        robot_file in any_text(),
        date in proptest::option::of((1u16..9999, 1u8..13, 1u8..29)),
        device in any_text(),
        zero_count in -1e9..1e9f64,
        roll_deg in -360.0..360.0f64,
        reversed in any::<Option<bool>>(),
        direction_checked in any::<bool>(),
        hash in proptest::option::of(any_text()),
        firmware in proptest::option::of((any::<u8>(), proptest::option::of(any::<u8>()))),
    ) {
        let firmware = firmware.map(|(major, minor)| Firmware { major, minor });
        let unit = Unit {
            robot_file,
            calibrated_on: date.map(|(year, month, day)| Date { year, month, day }),
            calibration_hash: hash,
            buses: vec![UnitBus { name: "a".into(), device: device.clone() }],
            imu: reversed.map(|_| UnitImu {
                device,
                baud: None,
                rpy_deg: Some([roll_deg, 0.0, 1.0]),
                rates_reversed: reversed,
            }),
            joints: vec![UnitJoint { name: "b".into(), zero_count, reversed, direction_checked, firmware }],
        };
        prop_assert_eq!(parsed(&text_of(&unit, "any")).unit, unit);
    }
}
