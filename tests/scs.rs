//! Servos of Feetech's SCS series: 10 bit, the high byte first, asked one by one. A horse of them walks.

mod common;

use common::{Scenario, config_file};
use hippocamp::config;
use hippocamp::model::Robot;
use hippocamp::telemetry::Outcome;

/// `config/horse.toml` with other servos, at a rate at which 16 of them can be asked one by one: a read of 8 bytes and
/// a reply of 14 each, 10 us a byte.
fn horse() -> Robot {
    let path = config_file("horse.toml");
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{error}"));
    let text = text
        .replace("STS3215-12V", "SCS0009")
        .replace("loop_rate_hz = 100", "loop_rate_hz = 50")
        .replace("baud = 1000000", "baud = 1000000\nadapter_latency_us = 125");
    config::parse(&text, "horse").unwrap_or_else(|error| panic!("{error}")).robot.without_body()
}

#[test]
fn a_horse_of_scs_servos_walks() {
    let robot = horse();
    let report = Scenario::new(&robot, "walk", 5.0).run();
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    let bus = &report.buses[0];
    assert_eq!((bus.missing, bus.corrupt), (0, 0));
    assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0));
    assert!(report.joints.tracking_error_max_deg < 15.0, "{:?}", report.joints);
    // 16 requests of 8 bytes and 16 replies of 6 + 8 in each exchange.
    assert_eq!(bus.bytes_in, bus.exchanges * 16 * 14);
    let wire_us = 10 * (16 * (8 + 14) + 2 * (8 + 16 * 3) + 8 + 16 * 2);
    let expected_us = wire_us + 16 * 125;
    assert!(
        bus.exchange_us.max >= expected_us && bus.exchange_us.p50 < expected_us + 500,
        "{:?}",
        bus.exchange_us
    );
}

#[test]
fn a_silent_scs_servo_costs_only_its_own_turn() {
    let robot = horse();
    let faults = "[[fault]]\nkind = 'silent'\nat_s = 6.0\nfor_s = 0.06\nbus = 'main'\nid = 3";
    let report = Scenario { faults, ..Scenario::from_sitting(&robot, "walk", 5.0) }.run();
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!((report.buses[0].missing, report.buses[0].corrupt), (3, 0));
}

#[test]
fn one_bus_has_one_series() {
    let text = std::fs::read_to_string(config_file("horse.toml")).unwrap_or_else(|error| panic!("{error}"));
    let mixed = text.replacen("STS3215-12V", "SCS0009", 1);
    let error = config::parse(&mixed, "horse").map(|_| ()).expect_err("two series").to_string();
    assert!(error.contains("a model of the series of SCS0009, which is on this bus before it"), "{error}");
}
