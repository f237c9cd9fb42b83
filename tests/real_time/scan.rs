//! `hippocamp scan`.

use super::bench::{Bench, line};

#[test]
fn every_servo_is_found_at_any_rate() {
    let bench = Bench::new(line("XM430-W210", 1_000_000, &[3, 7, 252]));
    // One of them out of the box: id 1, 57600 baud.
    bench.server.with_world(|world| world.make_new(0, 1));
    let text = bench.good(&["scan"], &["--protocol", "dynamixel", "--baud", "1000000", "--baud", "57600"]);
    let lines: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert_eq!(lines[0][..6], ["dynamixel", "57600", "1", "XM430-W210", "(1030)", "46"], "{text}");
    assert_eq!(lines[1][..3], ["dynamixel", "1000000", "3"], "{text}");
    assert_eq!(lines[2][..3], ["dynamixel", "1000000", "252"], "{text}");
    // The supply the world has, and about room temperature.
    assert_eq!(lines[2][6], "12", "{text}");
    assert!((20..40).contains(&lines[2][7].parse().unwrap()), "{text}");
}

#[test]
fn an_unusual_rate_is_scanned_and_protocols_are_distinguished() {
    let bench = Bench::new(line("STS3215-12V", 76_800, &[1, 9]));
    let text = bench.good(&["scan"], &["--baud", "76800", "--baud", "57600", "--ids", "0-20"]);
    assert!(text.contains("STS3215-7V4 or STS3215-12V (777)"), "{text}");
    assert_eq!(text.matches("feetech").count(), 2, "{text}");
    assert!(!text.contains("dynamixel"), "{text}");
}

#[test]
fn a_scan_without_servos_has_its_own_exit_code() {
    let bench = Bench::new(line("STS3215-12V", 1_000_000, &[9]));
    let (code, text) = bench.run(&["scan"], &["--baud", "1000000", "--ids", "1-8"]);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("no servo answered"), "{text}");
}

#[test]
fn two_servos_with_one_id_are_noticed() {
    for (model, baud) in [("STS3215-12V", 1_000_000), ("XM430-W210", 57_600)] {
        let bench = Bench::new(line(model, baud, &[5, 6, 7]));
        bench.server.with_world(|world| (0..2).for_each(|place| world.make_new(0, place)));
        let (_, text) = bench.run(&["scan"], &["--baud", &baud.to_string(), "--ids", "0-9"]);
        // A real host understands some answers of two Feetech servos with one id (servolab).
        let is_noticed = ["only damaged answers from id 1", "two servos have this id"];
        assert!(is_noticed.iter().any(|words| text.contains(words)), "{text}");
        assert!(text.lines().any(|line| line.split_whitespace().nth(2) == Some("7")), "{text}");
    }
}

#[test]
fn an_echo_is_noticed_and_is_not_taken_for_a_servo() {
    for (model, faults) in [("STS3215-12V", ECHO), ("XM430-W210", ECHO)] {
        let bench = Bench::with_faults(line(model, 1_000_000, &[4]), faults);
        let text = bench.good(&["scan"], &["--baud", "1000000", "--ids", "0-20"]);
        assert!(text.contains("returns what it is sent"), "{text}");
        assert_eq!(text.lines().filter(|line| line.contains("1000000")).count(), 1, "{text}");
        // The other commands handle it too.
        assert!(bench.good(&["servo", "read"], &["4", "id"]).starts_with('4'));
    }
}

const ECHO: &str = "[[fault]]\nkind = \"echo\"\nbus = \"line\"\nat_s = 0.0\n";
