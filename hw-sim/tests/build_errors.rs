//! The error for an impossible world says what was wrong, where, and what was expected.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::{BuildError, BusConfig, FaultScript, ServoConfig, World};

fn message(buses: &[BusConfig]) -> String {
    World::new(buses, FaultScript::default(), 0).err().unwrap().to_string()
}

#[test]
fn build_errors_have_clear_messages() {
    let good = || feetech_bus(vec![servo("STS3215-12V", 1)]);
    let with = |servo: ServoConfig| message(&[feetech_bus(vec![servo])]);
    let sts = || servo("STS3215-12V", 1);

    let unknown = BuildError::unknown_model("legs", 1, "STS9999").to_string();
    assert!(unknown.starts_with("bus `legs`, servo 1: no model `STS9999`; there are XL330-M288, XL430-W250"));
    assert!(unknown.ends_with("STS3215-7V4, STS3215-12V, STS3250, SCS0009"));
    assert_eq!(
        with(servo("XM430-W210", 1)),
        "bus `legs`, servo 1: XM430-W210 speaks dynamixel, the bus speaks feetech"
    );
    assert_eq!(
        with(servo("STS3250", 254)),
        "bus `legs`: id 254 is not possible; feetech servos have 0 to 253"
    );
    let dynamixel_253 = message(&[dynamixel_bus(vec![servo("XM430-W210", 253)])]);
    assert!(dynamixel_253.ends_with("dynamixel servos have 0 to 252"));
    let twice = message(&[feetech_bus(vec![sts(), sts()])]);
    assert_eq!(twice, "bus `legs`: two servos have id 1; ids are unique on a bus");
    assert!(message(&[good(), good()]).starts_with("two buses are named `legs`"));

    let odd = with(ServoConfig { return_delay_us: 3, ..sts() });
    assert_eq!(odd, "bus `legs`: return_delay_us of servo 1 is 3; expected an even number of 0 to 508");
    assert!(with(ServoConfig { return_delay_us: 510, ..sts() }).contains("510"));
    for position_counts in [f64::NAN, f64::INFINITY, -2e9] {
        assert!(with(ServoConfig { position_counts, ..sts() }).contains("position_counts of servo 1"));
    }
    for supply_v in [f64::NAN, 0.0, -5.0, f64::INFINITY] {
        assert!(message(&[BusConfig { supply_v, ..good() }]).contains("supply_v"));
    }
    for supply_ohm in [f64::NAN, -0.1, 11.0] {
        assert!(message(&[BusConfig { supply_ohm, ..good() }]).contains("supply_ohm"));
    }
}

#[test]
fn line_rates_are_those_of_the_protocol_and_of_every_model() {
    let baud = |bus: BusConfig, baud: u32| message(&[BusConfig { baud, ..bus }]);
    let feetech = baud(feetech_bus(vec![servo("STS3215-12V", 1)]), 2_000_000);
    assert!(
        feetech.starts_with("bus `legs`: 2000000 bit/s is not possible; its servos know 1000000, 500000")
    );
    let dynamixel = |model: &str| dynamixel_bus(vec![servo(model, 1)]);
    assert!(baud(dynamixel("XL330-M288"), 4_500_000).ends_with("3000000, 4000000"));
    world(BusConfig { baud: 4_500_000, ..dynamixel("XM430-W210") });
}
