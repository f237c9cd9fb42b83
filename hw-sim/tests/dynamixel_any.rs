//! Dynamixel servos survive any well-framed packet, however absurd.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const INSTRUCTIONS: [u8; 15] = [1, 2, 3, 4, 5, 6, 8, 0x10, 0x20, 0x82, 0x83, 0x8A, 0x92, 0x93, 0x9A];
/// Model numbers by place on the bus (e-manual).
const SERVOS: [(&str, u16); 4] =
    [("XL330-M288", 1200), ("XL430-W250", 1060), ("XM430-W210", 1030), ("XM430-W350", 1020)];

/// Bytes that often mean something: addresses, small numbers, keys. Never FD, so that nothing needs stuffing.
fn byte(rng: &mut Pcg64Mcg) -> u8 {
    const TELLING: &[u8] = &[
        0, 0, 0, 1, 1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 12, 16, 20, 60, 63, 64, 68, 98, 100, 102, 104, 108, 112,
        116, 168, 208, 224, 0x43, 0x54, 0x52, 0x4C, 0x44, 0x58, 0x22, 0xFE, 0xFF,
    ];
    if rng.random_bool(0.8) { TELLING[rng.random_range(0..TELLING.len())] } else { rng.random_range(0..0xFD) }
}

/// Parameters of a request: anything, or an address and data, or one of the two instructions with a key.
fn parameters(rng: &mut Pcg64Mcg, instruction: u8) -> Vec<u8> {
    let count = rng.random_range(0..24);
    let mut bytes: Vec<u8> = (0..count).map(|_| byte(rng)).collect();
    match instruction {
        2..=4 if count > 1 => bytes[1] = 0,
        0x10 => bytes.splice(0..0, [1, 0x44, 0x58, 0x4C, 0x22]).for_each(drop),
        0x20 => bytes = vec![rng.random_range(0..4), 0x43, 0x54, 0x52, 0x4C],
        0x82 | 0x83 | 0x8A if count > 3 => (bytes[1], bytes[2], bytes[3]) = (0, rng.random_range(0..6), 0),
        _ => {}
    }
    bytes
}

#[test]
fn any_requests_leave_servos_recoverable_by_a_factory_reset() {
    let mut rng = Pcg64Mcg::seed_from_u64(20);
    let servos = (1..).zip(SERVOS).map(|(id, (model, _))| servo(model, id));
    let mut world = world(dynamixel_bus(servos.collect()));
    for round in 0..20_000 {
        let id = [1, 2, 3, 4, 5, 0xFE][rng.random_range(0..6)];
        let instruction = INSTRUCTIONS[rng.random_range(0..INSTRUCTIONS.len())];
        let body = [vec![instruction], parameters(&mut rng, instruction)].concat();
        world.host_send(0, &dynamixel(id, &body)).unwrap();
        world.advance_to(world.now_ns() + 4 * MS);
        received(&mut world, 0);
        if round % 500 == 499 {
            // The last answers take their time; and the servos lose ids and rates now and then.
            world.advance_to(world.now_ns() + 50 * MS);
            received(&mut world, 0);
            for (place, id) in (0..SERVOS.len()).zip(1..) {
                world.make_new(0, place);
                for other in 0..SERVOS.len() {
                    world.pull_servo_out(0, other);
                }
                world.plug_servo_in(0, place);
                world.set_host_baud(0, 57_600);
                let answer = exchange(&mut world, &dynamixel(1, &[1]));
                let [low, high] = SERVOS[place].1.to_le_bytes();
                assert_eq!(answer[9..11], [low, high], "round {round}, {}", SERVOS[place].0);
                let shaft = world.shaft_at(0, place).unwrap();
                assert!(shaft.position_counts.is_finite() && shaft.torque_nm.is_finite(), "{shaft:?}");
                dynamixel_write(&mut world, 1, 7, &[id]);
                exchange(&mut world, &dynamixel(id, &[3, 8, 0, 3]));
            }
            (0..SERVOS.len()).for_each(|place| world.plug_servo_in(0, place));
            world.set_host_baud(0, 1_000_000);
            let found = exchange(&mut world, &dynamixel(0xFE, &[1]));
            assert_eq!(found.len(), 4 * 14, "all four, under their ids at their rate");
        }
    }
}
