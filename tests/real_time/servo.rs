//! `hippocamp servo`.

use super::bench::{Bench, line};

const NO_TORQUE: [(&str, u16); 2] = [("STS3215-12V", 40), ("XM430-W210", 64)];

#[test]
fn registers_are_read_by_name_in_units() {
    let dynamixel = Bench::new(line("XM430-W210", 57_600, &[1]));
    let read = |bench: &Bench, name: &str| bench.good(&["servo", "read"], &["1", name]).trim().to_owned();
    // 1100 counts.
    assert_eq!(read(&dynamixel, "present_position"), "96.68 deg (1100)");
    assert_eq!(read(&dynamixel, "present_input_voltage"), "12 V (120)");
    assert_eq!(read(&dynamixel, "baud_rate"), "57600 baud (1)");
    assert_eq!(read(&dynamixel, "model_number"), "1030");
    let feetech = Bench::new(line("STS3215-12V", 1_000_000, &[1]));
    assert_eq!(read(&feetech, "present_position"), "96.68 deg (1100)");
    assert_eq!(read(&feetech, "present_input_voltage"), "12 V (120)");
    assert_eq!(read(&feetech, "temperature_limit"), "70 C (70)");
}

#[test]
fn without_a_name_all_registers_are_shown() {
    for (model, names) in [
        ("XL330-M288", ["pwm_slope", "present_current", "indirect_data_20"]),
        ("XL430-W250", ["shutdown", "present_load", "indirect_data_56"]),
        ("STS3215-12V", ["phase", "present_current", "homing_offset"]),
    ] {
        let bench = Bench::new(line(model, 1_000_000, &[2]));
        let text = bench.good(&["servo", "read"], &["2"]);
        names.iter().for_each(|name| assert!(text.contains(name), "{model}: {text}"));
    }
}

#[test]
fn a_wrong_register_name_gets_a_suggestion() {
    let bench = Bench::new(line("STS3215-12V", 1_000_000, &[1]));
    let (code, text) = bench.run(&["servo", "read"], &["1", "present_positon"]);
    assert_eq!(code, 1);
    assert!(text.contains("did you mean present_position?"), "{text}");
    let (_, text) = bench.run(&["servo", "read"], &["1", "colour"]);
    assert!(text.contains("it has firmware_major, ") && text.contains("present_temperature"), "{text}");
}

#[test]
fn settings_are_written_without_torque_and_last() {
    for (model, torque) in NO_TORQUE {
        let bench = Bench::new(line(model, 1_000_000, &[1]));
        bench.good(&["servo", "write"], &["1", "torque_enable", "1", "--yes"]);
        assert_eq!(bench.byte(1, torque), 1);
        let text = bench.good(&["servo", "write"], &["1", "temperature_limit", "60", "--yes"]);
        assert!(text.contains("temperature_limit from") && text.contains("to 60 C"), "{text}");
        assert_eq!(bench.byte(1, torque), 0, "{model}");
        bench.server.with_world(|world| {
            world.pull_servo_out(0, 0);
            world.plug_servo_in(0, 0);
        });
        assert_eq!(
            bench.good(&["servo", "read"], &["1", "temperature_limit"]).trim(),
            "60 C (60)",
            "{model}"
        );
    }
}

#[test]
fn nothing_is_written_without_consent_or_out_of_range() {
    let bench = Bench::new(line("XM430-W210", 1_000_000, &[1]));
    for arguments in [
        &["1", "temperature_limit", "60"][..],
        &["1", "temperature_limit", "101", "--yes"],
        &["1", "temperature_limit", "NaN", "--yes"],
        &["1", "present_position", "10", "--yes"],
        &["1", "max_position_limit", "-1", "--yes"],
    ] {
        let before = bench.byte(1, 31);
        let (code, text) = bench.run(&["servo", "write"], arguments);
        assert_ne!(code, 0, "{arguments:?}: {text}");
        assert_eq!(bench.byte(1, 31), before);
    }
}

#[test]
fn the_program_follows_a_new_id_and_rate_and_refuses_a_used_id() {
    for model in ["STS3215-12V", "XL330-M288"] {
        let bench = Bench::new(line(model, 1_000_000, &[1, 2]));
        let (code, text) = bench.run(&["servo", "id"], &["1", "2", "--yes"]);
        assert_eq!(code, 1, "{text}");
        assert!(text.contains("exists already"), "{text}");
        assert!(bench.good(&["servo", "id"], &["1", "17", "--yes"]).contains("it is servo 17"));
        let text = bench.good(&["servo", "baud"], &["17", "57600", "--yes"]);
        assert!(text.contains("it is servo 17") && text.contains("57600 baud)"), "{text}");
        bench.server.with_world(|world| {
            world.pull_servo_out(0, 0);
            world.plug_servo_in(0, 0);
        });
        // Found by itself, at its new rate.
        assert_eq!(bench.good(&["servo", "read"], &["17", "id"]).trim(), "17");
        if model.starts_with("STS") {
            assert_eq!(bench.byte(17, 55), 1, "locked again");
        }
    }
}

#[test]
fn the_present_shaft_position_becomes_the_middle() {
    for (model, id, is_possible) in
        [("STS3215-12V", 1, true), ("XM430-W210", 15, true), ("XM430-W210", 1, true)]
    {
        let bench = Bench::new(line(model, 1_000_000, &[id]));
        let (code, text) = bench.run(&["servo", "center"], &[&id.to_string(), "--yes"]);
        assert_eq!(code == 0, is_possible, "{model} {id}: {text}");
        assert!(text.contains("(2048)"), "{model} {id}: {text}");
    }
    // 3300 counts: 1252 off the middle, and Dynamixel accepts 1024.
    let bench = Bench::new(line("XM430-W210", 1_000_000, &[23]));
    let (code, text) = bench.run(&["servo", "center"], &["23", "--yes"]);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("accepts 1024: take its horn off"), "{text}");
}

/// A new STS servo counts whole turns: its shaft is turned back past the zero of its encoder, to -200.
#[test]
fn a_centre_that_is_a_turn_away_is_not_reported_as_done() {
    let bench = Bench::new(line("STS3215-12V", 1_000_000, &[1]));
    bench.server.with_world(|world| world.turn(0, 0, -200.0));
    while bench.server.with_world(|world| world.is_turning(0, 0)) {
        std::thread::yield_now();
    }
    let (code, text) = bench.run(&["servo", "center"], &["1", "--yes"]);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("its shaft reads -2048, and 2048 was promised: it counts whole turns"), "{text}");
}

#[test]
fn a_restart_forgets_volatile_registers_and_a_reset_also_settings() {
    let bench = Bench::new(line("XM430-W210", 1_000_000, &[7]));
    let write = |name: &str, value: &str| bench.good(&["servo", "write"], &["7", name, value, "--yes"]);
    let read = |name: &str| bench.good(&["servo", "read"], &["7", name]).trim().to_owned();
    write("temperature_limit", "60");
    write("position_p_gain", "300");
    write("torque_enable", "1");
    assert!(bench.good(&["servo", "reboot"], &["7", "--yes"]).contains("is back"));
    assert_eq!(
        (read("position_p_gain"), read("torque_enable"), read("temperature_limit")),
        ("800".into(), "0".into(), "60 C (60)".into())
    );
    assert!(
        bench
            .good(&["servo", "reset"], &["7", "--yes"])
            .contains("servo 7 (dynamixel, 1000000 baud) is back")
    );
    assert_eq!(read("temperature_limit"), "80 C (80)");
    assert_eq!(read("return_delay_time"), "500 us (250)");
}

#[test]
fn commands_work_on_a_noisy_line() {
    let faults = "[[fault]]\nkind = \"noise\"\nbus = \"line\"\nid = 3\nat_s = 0.0\n";
    for model in ["STS3215-12V", "XM430-W210"] {
        let bench = Bench::with_faults(line(model, 1_000_000, &[3]), faults);
        assert_eq!(bench.good(&["servo", "read"], &["3", "id"]).trim(), "3");
        bench.good(&["servo", "write"], &["3", "temperature_limit", "61", "--yes"]);
        let text = bench.good(&["scan"], &["--baud", "1000000", "--ids", "0-9"]);
        assert!(text.lines().any(|line| line.split_whitespace().nth(2) == Some("3")), "{text}");
    }
}

#[test]
fn a_servo_whose_answers_are_all_damaged_is_reported() {
    let faults = "[[fault]]\nkind = \"bit-flip\"\nbus = \"line\"\nid = 3\nat_s = 0.0\n";
    for model in ["STS3215-12V", "XM430-W210"] {
        let bench = Bench::with_faults(line(model, 1_000_000, &[3]), faults);
        let (code, text) = bench.run(&["servo", "read"], &["3", "id", "--baud", "1000000"]);
        assert_eq!(code, 1, "{text}");
        assert!(
            text.contains("only damaged answers") && text.contains("two servos may have this id"),
            "{text}"
        );
    }
}

#[test]
fn an_unusable_port_is_reported_with_its_remedy() {
    for (port, told) in
        [("/nowhere/at/all", "does not exist"), ("/dev/null", "cannot be used as a serial line")]
    {
        for command in [&["scan", port][..], &["servo", "read", port, "1"]] {
            let output =
                std::process::Command::new(env!("CARGO_BIN_EXE_hippocamp")).args(command).output().unwrap();
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(1), "{text}");
            assert!(text.contains(&format!("{port} {told}")), "{text}");
        }
    }
}
