//! Bad unit files: each is a small change to the good one, with the expected message.

use std::path::Path;

use hippocamp::config::{self, ConfigError};
use proptest::prelude::*;

use crate::GOOD;

/// What is replaced, by what, and the fault it makes: key, value, words. In the new text `@` (taken out again)
/// marks the line the fault must stand on.
type Bad = (&'static str, &'static str, &'static str, Option<&'static str>, &'static [&'static str]);

const BAD: &[Bad] = &[
    ("version = 1", "@", "version", None, &["the version of the unit file", "a whole number"]),
    ("version = 1", "@version = 0", "version", Some("0"), &["a whole number from 1"]),
    (
        "version = 1",
        "@version = 2",
        "version",
        Some("2"),
        &["1, the only version", "use the program that wrote"],
    ),
    ("version = 1", "@version = \"1\"", "version", Some("\"1\""), &["a whole number"]),
    ("robot_file = \"horse-dynamixel.toml\"", "@", "robot_file", None, &["robot file it was made for"]),
    ("\"horse-dynamixel.toml\"", "@\" \"", "robot_file", Some("\" \""), &["a text in quotes"]),
    ("= 2026-02-28", "= @\"2026-02-28\"", "calibrated_on", Some("\"2026-02-28\""), &["without quotes"]),
    ("= 2026-02-28", "= @2026-02-28T10:00:00", "calibrated_on", Some("2026-02-28T10:00:00"), &["2026-01-31"]),
    ("= \"0123456789abcdef\"", "= @7", "calibration_hash", Some("7"), &["what the calibration wrote"]),
    (
        "name = \"right_fore\"",
        "@name = \"left_hind\"",
        "bus[1].name",
        Some("\"left_hind\""),
        &["line 7 has it"],
    ),
    ("name = \"right_fore\"\n", "@", "bus[1].name", None, &["name of a bus of the robot file"]),
    ("device = \"/dev/ttyUSB1\"", "@baud = 9600", "bus[1].baud", Some("9600"), &["known are name, device"]),
    ("\"/dev/ttyUSB1\"", "@\"\"", "bus[1].device", Some("\"\""), &["path of the bus's serial device"]),
    (
        "\"/dev/ttyUSB1\"",
        "@\"/dev/serial/by-id/usb-FTDI_USB__-__Serial_Converter_FT1-if00-port0\"",
        "bus[1].device",
        Some("\"/dev/serial/by-id/usb-FTDI_USB__-__Serial_Converter_FT1-if0..."),
        &["once only", "line 8 has it"],
    ),
    (
        "name = \"right_fore.carpus\"",
        "@name = \"left_hind.hip\"",
        "joint[1].name",
        Some("\"left_hind.hip\""),
        &["line 15 has it"],
    ),
    ("zero_count = 2950\n", "@", "joint[0].zero_count", None, &["count at joint angle zero", "a number"]),
    ("= 2700.5", "= @nan", "joint[1].zero_count", Some("nan"), &["finite"]),
    ("= 2700.5", "= @\"2700\"", "joint[1].zero_count", Some("\"2700\""), &["a number"]),
    ("_checked = true", "_checked = @1", "joint[0].direction_checked", Some("1"), &["true or false"]),
    (
        "direction_checked",
        "@direction_check",
        "joint[0].direction_check",
        Some("true"),
        &["did you mean direction_checked"],
    ),
    ("= \"46\"", "= @46", "joint[0].firmware", Some("46"), &["firmware version", "a text in quotes"]),
    (
        "= \"46\"",
        "= @\"46b\"",
        "joint[0].firmware",
        Some("\"46b\""),
        &["firmware version", "\"3.10\" (Feetech)"],
    ),
];

fn refused(text: &str) -> ConfigError {
    match config::parse_unit(text, "bad.unit.toml") {
        Ok(_) => panic!("this file was taken for good:\n{text}"),
        Err(error) => error,
    }
}

fn spoil(old: &str, new: &str) -> String {
    assert_eq!(GOOD.matches(old).count(), 1, "{old:?} must stand in the file once");
    GOOD.replace(old, new)
}

#[test]
fn each_fault_names_line_key_value_and_what_was_expected() {
    for &(old, new, key, value, said) in BAD {
        let marked = spoil(old, new);
        let error = refused(&marked.replace('@', ""));
        let fault = error.faults.iter().find(|fault| fault.key == key);
        let fault = fault.unwrap_or_else(|| panic!("{key} is not told of: {error}"));
        assert_eq!((fault.file.as_str(), fault.value.as_deref()), ("bad.unit.toml", value), "{fault}");
        // A missing key is reported at its section.
        if value.is_some() {
            let line = marked[..marked.find('@').unwrap()].matches('\n').count() + 1;
            assert_eq!(fault.line, line, "{fault}");
        }
        for words in said {
            assert!(fault.expected.contains(words), "{words:?} is not in: {fault}");
        }
    }
}

#[test]
fn all_faults_are_told_at_once() {
    let text = spoil("= 2700.5", "= inf")
        .replace("version = 1", "version = true")
        .replace("_checked = true", "_checked = 3")
        .replace("\"/dev/ttyUSB1\"", "5");
    let faults = refused(&text).faults;
    let keys: Vec<_> = faults.iter().map(|fault| fault.key.as_str()).collect();
    assert_eq!(keys, ["version", "bus[1].device", "joint[0].direction_checked", "joint[1].zero_count"]);
}

#[test]
fn a_file_of_another_version_is_refused_for_that_only() {
    let text = spoil("version = 1", "version = 7\nhorn = \"new\"").replace("zero_count", "zero");
    let faults = refused(&text).faults;
    assert_eq!(faults.iter().map(|fault| fault.key.as_str()).collect::<Vec<_>>(), ["version"]);
}

#[test]
fn unreadable_files_and_text_that_is_not_toml_are_refused() {
    let absent = config::load_unit(Path::new("config/hrose.unit.toml")).unwrap_err().to_string();
    assert!(absent.starts_with("config/hrose.unit.toml: expected a unit file that can be read"), "{absent}");
    let said = refused(&spoil("version = 1", "version = 1.1.1")).to_string();
    assert!(said.starts_with("bad.unit.toml:1:14: expected TOML"), "{said}");
}

proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(place in 0..GOOD.len(), cut in 0usize..40, put in "[ -~\n]{0,12}") {
        let end = (place + cut).min(GOOD.len());
        let _ = config::parse_unit(&format!("{}{put}{}", &GOOD[..place], &GOOD[end..]), "any.toml");
    }
}
