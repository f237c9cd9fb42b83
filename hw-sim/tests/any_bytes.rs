//! Decoders take any bytes; the clock may be cut any way; a long run is cheap.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::{BusConfig, FaultScript, Protocol, World};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// A million bytes in pieces, biased towards what packets are made of; then silence, then a good packet.
fn swamp(bus: BusConfig, marks: &[u8], good: &[u8], answer: &[u8]) {
    let mut world = world(bus);
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    for _ in 0..1000 {
        let noise: Vec<u8> = (0..1000)
            .map(
                |_| if rng.random_bool(0.4) { marks[rng.random_range(0..marks.len())] } else { rng.random() },
            )
            .collect();
        world.host_send(0, &noise).unwrap();
        world.advance_to(world.now_ns() + 10 * MS);
        received(&mut world, 0);
    }
    world.advance_to(world.now_ns() + 50 * MS);
    received(&mut world, 0);
    assert_eq!(exchange(&mut world, good), answer);
}

#[test]
fn a_million_random_bytes_do_not_upset_feetech_servos() {
    let bus = feetech_bus(vec![servo("STS3215-12V", 77)]);
    swamp(bus, &[0xFF, 0xFF, 1, 2, 4, 0x82, 0x83], &feetech(77, 1, &[]), &feetech(77, 0, &[]));
}

#[test]
fn a_million_random_bytes_do_not_upset_dynamixel_servos() {
    let bus = dynamixel_bus(vec![servo("XM430-W210", 77)]);
    let answer = dynamixel(77, &[0x55, 0, 0x06, 0x04, 46]);
    swamp(bus, &[0xFF, 0xFF, 0xFD, 0, 3, 0xFE], &dynamixel(77, &[1]), &answer);
}

/// Good framing around any contents gets past the checksum, into the instructions.
#[test]
fn any_well_framed_request_is_handled_without_a_panic() {
    let mut rng = Pcg64Mcg::seed_from_u64(8);
    let mut feetech_world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    let mut dynamixel_world = world(dynamixel_bus(vec![servo("XL330-M288", 1), servo("XL430-W250", 2)]));
    for _ in 0..20_000 {
        let id = [1, 2, 0xFE][rng.random_range(0..3)];
        let instruction = [1, 2, 3, 0x82, 0x83, 0x8A, rng.random()][rng.random_range(0..7)];
        let count = rng.random_range(0..40);
        // 0xFF would need stuffing; registers are reached without it.
        let parameters: Vec<u8> = (0..count).map(|_| rng.random_range(0..0xFF)).collect();
        feetech_world.host_send(0, &feetech(id, instruction, &parameters)).unwrap();
        let body = [&[instruction], parameters.as_slice()].concat();
        dynamixel_world.host_send(0, &dynamixel(id, &body)).unwrap();
        for world in [&mut feetech_world, &mut dynamixel_world] {
            world.advance_to(world.now_ns() + 3 * MS);
            received(world, 0);
        }
    }
}

/// All faults at once on two buses; `cut` says in which steps the host lets time pass.
fn chronicle(seed: u64, cut: &[u64]) -> Vec<Vec<u8>> {
    let script = "
        [[fault]]\nat_s = 0.010\nfor_s = 0.02\nkind = 'noise'
        [[fault]]\nat_s = 0.005\nfor_s = 0.02\nkind = 'bit-flip'
        [[fault]]\nat_s = 0.040\nfor_s = 0.01\nkind = 'echo'\nbus = 'legs'";
    let legs = feetech_bus((1..=4).map(|id| servo("STS3215-12V", id)).collect());
    let arms = BusConfig {
        name: "arms".into(),
        protocol: Protocol::Dynamixel,
        adapter_latency_us: 125,
        ..feetech_bus((1..=4).map(|id| servo("XM430-W210", id)).collect())
    };
    let mut world = World::new(&[legs, arms], FaultScript::from_toml(script).unwrap(), seed).unwrap();
    let mut record = vec![Vec::new(), Vec::new()];
    let mut steps = cut.iter().cycle();
    for cycle in 1..=8u64 {
        let goal = u8::try_from(cycle).unwrap();
        world.host_send(0, &feetech(0xFE, 0x83, &[42, 2, 1, 0, goal, 3, 0, goal])).unwrap();
        world.host_send(0, &feetech(1, 3, &[40, 1])).unwrap();
        world.host_send(0, &feetech(0xFE, 0x82, &[56, 8, 1, 2, 9, 3, 4])).unwrap();
        world.host_send(1, &dynamixel(1, &[3, 64, 0, 1])).unwrap();
        world.host_send(1, &dynamixel(0xFE, &[0x8A, 126, 0, 21, 0, 1, 2, 3, 4])).unwrap();
        while world.now_ns() < cycle * 10 * MS {
            let step = steps.next().unwrap();
            let next = (world.now_ns() + step).min(cycle * 10 * MS);
            if step.is_multiple_of(2) {
                world.advance_to(next);
            } else {
                world.advance_to_input(next);
            }
            for (bus, record) in record.iter_mut().enumerate() {
                record.extend(received(&mut world, bus));
            }
        }
    }
    record
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn the_same_bytes_come_however_time_is_divided(
        seed in any::<u64>(),
        cut in prop::collection::vec(1_000u64..3_000_000, 1..8),
    ) {
        prop_assert_eq!(chronicle(seed, &cut), chronicle(seed, &[10 * MS]));
    }
}

#[test]
fn another_seed_gives_other_faults() {
    assert_ne!(chronicle(1, &[MS]), chronicle(2, &[MS]));
}

#[test]
fn a_minute_of_requests_to_sixteen_servos_is_answered_in_full() {
    let mut world = world(feetech_bus((1..=16).map(|id| servo("STS3215-12V", id)).collect()));
    let ids: Vec<u8> = (1..=16).collect();
    let read = feetech(0xFE, 0x82, &[&[56, 8], ids.as_slice()].concat());
    let mut got = 0;
    for cycle in 0..6000u64 {
        let low = u8::try_from(cycle % 200).unwrap();
        let rows: Vec<u8> = ids.iter().flat_map(|&id| [id, low, 8]).collect();
        world.host_send(0, &feetech(0xFE, 0x83, &[&[42, 2], rows.as_slice()].concat())).unwrap();
        world.host_send(0, &read).unwrap();
        let deadline = (cycle + 1) * 10 * MS;
        while world.advance_to_input(deadline) {
            got += received(&mut world, 0).len();
        }
    }
    assert_eq!(got, 6000 * 16 * 14);
}
