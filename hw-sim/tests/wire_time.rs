//! When bytes arrive: 10 bits a byte, return delays, adapter latency, guard times.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::{BusConfig, Protocol, ServoConfig, World};

/// Nanoseconds of `bytes` at `baud`, rounded up.
fn wire_ns(bytes: u64, baud: u32) -> u64 {
    (bytes * 10 * S).div_ceil(u64::from(baud))
}

/// Time of the first and of the last byte of a reply of `count` bytes.
fn arrival(world: &mut World, count: usize) -> (u64, u64) {
    assert!(world.advance_to_input(world.now_ns() + S));
    let first = world.now_ns();
    let mut last = first;
    let mut got = 0;
    while world.advance_to_input(world.now_ns() + S) {
        last = world.now_ns();
        got += received(world, 0).len();
        if got >= count {
            break;
        }
    }
    assert_eq!(got, count);
    (first, last)
}

fn delayed(model: &str, id: u8, return_delay_us: u32) -> ServoConfig {
    ServoConfig { return_delay_us, ..servo(model, id) }
}

#[test]
fn a_reply_takes_bytes_times_ten_over_baud_plus_the_return_delay() {
    for baud in [57_600, 1_000_000, 4_000_000] {
        for delay_us in [0, 250, 500] {
            let bus = dynamixel_bus(vec![delayed("XM430-W210", 1, delay_us)]);
            let mut world = world(BusConfig { baud, ..bus });
            let delay_ns = u64::from(delay_us) * 1000;
            world.advance_to(1_234_567);
            world.host_send(0, &dynamixel(1, &[1])).unwrap();
            let start = 1_234_567 + wire_ns(10, baud) + delay_ns;
            assert_eq!(arrival(&mut world, 14), (start + wire_ns(1, baud), start + wire_ns(14, baud)));
        }
    }
    for baud in [57_600, 1_000_000] {
        let mut world = world(BusConfig { baud, ..feetech_bus(vec![delayed("STS3215-12V", 1, 250)]) });
        world.host_send(0, &feetech(1, 1, &[])).unwrap();
        let start = wire_ns(6, baud) + 250_000;
        assert_eq!(arrival(&mut world, 6), (start + wire_ns(1, baud), start + wire_ns(6, baud)));
    }
}

#[test]
fn adapter_latency_shifts_every_byte() {
    let bus = feetech_bus(vec![servo("STS3215-12V", 1)]);
    let mut world = world(BusConfig { adapter_latency_us: 1000, ..bus });
    world.host_send(0, &feetech(1, 1, &[])).unwrap();
    assert_eq!(arrival(&mut world, 6), (1_070_000, 1_120_000));
}

#[test]
fn sync_read_pays_every_return_delay_and_fast_sync_read_one() {
    let servos = || (1..=16).map(|id| delayed("XM430-W210", id, 500)).collect();
    let ids: Vec<u8> = (1..=16).collect();
    let mut world = world(dynamixel_bus(servos()));
    world.host_send(0, &dynamixel(0xFE, &[&[0x82, 132, 0, 4, 0], ids.as_slice()].concat())).unwrap();
    let (_, last) = arrival(&mut world, 240);
    assert_eq!(last, wire_ns(30 + 240, 1_000_000) + 16 * 500_000);
    let start = world.now_ns();
    world.host_send(0, &dynamixel(0xFE, &[&[0x8A, 132, 0, 4, 0], ids.as_slice()].concat())).unwrap();
    let (_, last) = arrival(&mut world, 136);
    assert_eq!(last - start, wire_ns(30 + 136, 1_000_000) + 500_000);
}

#[test]
fn a_silent_servo_costs_its_reply_and_the_guard_time() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 2)]));
    world.host_send(0, &feetech(0xFE, 0x82, &[56, 2, 1, 2])).unwrap();
    // Request 10 bytes, missing reply 8 and 100 µs, reply 8.
    assert_eq!(arrival(&mut world, 8).1, wire_ns(10 + 8 + 8, 1_000_000) + 100_000);
}

#[test]
fn host_bytes_queue_behind_each_other() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    world.host_send(0, &feetech(0xFE, 3, &[41, 1])).unwrap();
    world.host_send(0, &feetech(1, 1, &[])).unwrap();
    assert_eq!(arrival(&mut world, 6).1, wire_ns(8 + 6 + 6, 1_000_000));
}

#[test]
fn two_talkers_at_once_garble() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    world.host_send(0, &feetech(1, 1, &[])).unwrap();
    // The servo answers from 60 to 120 µs; the host talks again at 85 µs.
    world.advance_to(85_000);
    world.host_send(0, &feetech(1, 1, &[])).unwrap();
    world.advance_to(10 * MS);
    let reply = received(&mut world, 0);
    let clean = feetech(1, 0, &[]);
    assert_eq!(reply.len(), 6, "a garbled request gets no answer");
    assert_eq!(reply[..2], clean[..2], "done before the host began");
    for place in 2..6 {
        assert_ne!(reply[place], clean[place]);
    }
    assert_eq!(world.wire_statistics(0).unwrap().bytes_garbled, 4 + 4);
    assert_eq!(exchange(&mut world, &feetech(1, 1, &[])), clean, "the line recovers");
}

#[test]
fn statistics_count_bytes_and_busy_time() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    exchange(&mut world, &feetech(1, 1, &[]));
    let statistics = world.wire_statistics(0).unwrap();
    assert_eq!((statistics.bytes_from_host, statistics.bytes_from_servos), (6, 6));
    assert_eq!(statistics.busy_ns, 120_000);
}

#[test]
fn buses_run_at_the_same_time_and_input_on_any_of_them_ends_the_wait() {
    let feetech_one = feetech_bus(vec![servo("STS3215-12V", 1)]);
    let dynamixel_one = BusConfig {
        name: "arms".into(),
        protocol: Protocol::Dynamixel,
        baud: 4_000_000,
        ..feetech_bus(vec![servo("XM430-W210", 1)])
    };
    let mut world = World::new(&[feetech_one, dynamixel_one], hw_sim::FaultScript::default(), 0).unwrap();
    world.host_send(0, &feetech(1, 1, &[])).unwrap();
    world.host_send(1, &dynamixel(1, &[1])).unwrap();
    assert!(world.advance_to_input(S));
    assert_eq!(world.now_ns(), wire_ns(11, 4_000_000));
    assert_eq!((world.host_pending(0), world.host_pending(1)), (0, 1));
    assert!(world.advance_to_input(S), "at once while bytes lie there");
    assert_eq!(world.now_ns(), wire_ns(11, 4_000_000));
    received(&mut world, 1);
    world.advance_to(S);
    received(&mut world, 0);
    received(&mut world, 1);
    assert!(!world.advance_to_input(2 * S));
    assert_eq!(world.now_ns(), 2 * S);
}

#[test]
fn a_request_is_kept_with_the_time_its_last_byte_had_crossed_if_anybody_wants_it() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    world.host_send(0, &feetech(1, 1, &[])).unwrap();
    world.advance_to(S);
    assert!(world.requests(0).is_empty());
    world.keep_requests();
    world.host_send(0, &feetech(1, 3, &[41, 9])).unwrap();
    world.advance_to(2 * S);
    let [request] = world.requests(0) else { panic!("{:?}", world.requests(0)) };
    assert_eq!((request.at_ns, request.id, request.instruction), (S + 80_000, 1, 3));
    assert_eq!(request.parameters, [41, 9]);
}
