//! Any bytes to simulated servos of both protocols: no panic in a decoder or in a servo; and a good request after
//! the bytes is found, at the latest once a false header among them has timed out.
#![no_main]

use hw_sim::{BusConfig, FaultScript, Protocol, ServoConfig, World, requests_in};
use libfuzzer_sys::fuzz_target;

/// Ping of servo 1 (e-manual, Protocol 2.0; Feetech wiki, protocol ft-scs).
const DYNAMIXEL: [u8; 10] = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E];
const FEETECH: [u8; 6] = [0xFF, 0xFF, 0x01, 0x02, 0x01, 0xFB];
/// More than the longest packet.
const SILENCE: [u8; 1100] = [0; 1100];

fuzz_target!(|bytes: &[u8]| {
    for (protocol, model, ping) in [
        (Protocol::Dynamixel, "XM430-W210", DYNAMIXEL.as_slice()),
        (Protocol::Feetech, "STS3215-12V", FEETECH.as_slice()),
    ] {
        let found = requests_in(protocol, &[bytes, &SILENCE, ping].concat());
        assert_eq!(found.last(), Some(&(1, 1, vec![])));
        let servo = |id| ServoConfig { model: model.into(), id, return_delay_us: 0, position_counts: 2048.0 };
        let bus = BusConfig {
            name: "line".into(),
            protocol,
            baud: 1_000_000,
            adapter_latency_us: 0,
            supply_v: 12.0,
            supply_ohm: 0.0,
            servos: vec![servo(1), servo(2)],
        };
        let mut world = World::new(&[bus], FaultScript::default(), 1).expect("a bus that can be");
        world.host_send(0, bytes).expect("plugged in");
        world.advance_to(100_000_000);
    }
});
