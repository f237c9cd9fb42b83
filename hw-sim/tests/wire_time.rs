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
    // The register of the delay has no function in the STS series, by Feetech's table.
    for (model, delay_ns) in [("STS3215-12V", 0), ("SCS0009", 250_000)] {
        for baud in [57_600, 1_000_000] {
            let mut world = world(BusConfig { baud, ..feetech_bus(vec![delayed(model, 1, 250)]) });
            world.host_send(0, &feetech(1, 1, &[])).unwrap();
            let start = wire_ns(6, baud) + delay_ns;
            assert_eq!(arrival(&mut world, 6), (start + wire_ns(1, baud), start + wire_ns(6, baud)));
        }
    }
}

/// An exchange, and the bytes it must be made of by the protocol's own formulas.
struct Exchange {
    name: String,
    request: Vec<u8>,
    request_bytes: usize,
    reply_bytes: usize,
    /// How many return delays there are in it.
    delays: u64,
}

/// Every exchange takes its bytes times ten over the baud, and its return delays, within a hundredth.
fn check_exchanges(bus: &BusConfig, exchanges: &[Exchange], bauds: &[u32]) {
    for &baud in bauds {
        for delay_us in [0, 100, 500] {
            let servos = bus.servos.iter().map(|of| ServoConfig { return_delay_us: delay_us, ..of.clone() });
            let mut world = world(BusConfig { baud, servos: servos.collect(), ..bus.clone() });
            world.keep_requests();
            for Exchange { name, request, request_bytes, reply_bytes, delays } in exchanges {
                assert_eq!(request.len(), *request_bytes, "{name}");
                let start_ns = world.now_ns();
                world.host_send(0, request).unwrap();
                let mut end_ns = start_ns;
                if *reply_bytes > 0 {
                    end_ns = arrival(&mut world, *reply_bytes).1;
                }
                // Whatever comes after the last byte that was due has been too much.
                world.advance_to(world.now_ns() + 100 * MS);
                assert_eq!(received(&mut world, 0), [], "{name}");
                if *reply_bytes == 0 {
                    end_ns = world.requests(0).last().unwrap().at_ns;
                }
                #[allow(clippy::cast_precision_loss, reason = "times of a test are short")]
                let (took_s, expected_s) = (
                    (end_ns - start_ns) as f64 * 1e-9,
                    (request_bytes + reply_bytes) as f64 * 10.0 / f64::from(baud)
                        + *delays as f64 * f64::from(delay_us) * 1e-6,
                );
                let off = took_s / expected_s - 1.0;
                assert!(off.abs() < 0.01, "{name} at {baud} baud: {took_s} s and not {expected_s} s");
            }
        }
    }
}

#[test]
fn every_exchange_of_dynamixel_servos_takes_its_bytes_and_return_delays() {
    let goal = |bytes: u8| vec![0; usize::from(bytes)];
    let exchange = |name: String, request, request_bytes, reply_bytes, delays| Exchange {
        name,
        request,
        request_bytes,
        reply_bytes,
        delays,
    };
    for n in [1u8, 4, 16] {
        let ids: Vec<u8> = (1..=n).collect();
        let count = usize::from(n);
        let bus = dynamixel_bus(ids.iter().map(|&id| servo("XM430-W210", id)).collect());
        let mut exchanges = vec![
            exchange("ping".into(), dynamixel(1, &[1]), 10, 14, 1),
            exchange("ping of all".into(), dynamixel(0xFE, &[1]), 10, 14 * count, u64::from(n)),
        ];
        // Profile Acceleration and its neighbours may be written with any small number; Present Current and its
        // neighbours read.
        for l in [1u8, 4, 8] {
            let bytes = usize::from(l);
            let (address, data) = if l == 1 { (65, vec![1]) } else { (108, goal(l)) };
            let rows = |head: &[u8]| -> Vec<u8> {
                ids.iter().flat_map(|&id| [&[id], head, data.as_slice()].concat()).collect()
            };
            let asked =
                |head: &[u8]| -> Vec<u8> { ids.iter().flat_map(|&id| [&[id], head].concat()).collect() };
            let all = |instruction: u8, rest: &[u8]| dynamixel(0xFE, &[&[instruction], rest].concat());
            let (to, from) = ([address, 0, l, 0], [126, 0, l, 0]);
            let each = |frame: usize| count * (frame + bytes);
            exchanges.extend([
                exchange(format!("read of {l}"), dynamixel(1, &[2, 126, 0, l, 0]), 14, 11 + bytes, 1),
                exchange(
                    format!("write of {l}"),
                    dynamixel(1, &[&[3, address, 0], data.as_slice()].concat()),
                    12 + bytes,
                    11,
                    1,
                ),
                exchange(
                    format!("sync write of {l}"),
                    all(0x83, &[&to[..], &rows(&[])].concat()),
                    14 + each(1),
                    0,
                    0,
                ),
                exchange(
                    format!("sync read of {l}"),
                    all(0x82, &[&from[..], &asked(&[])].concat()),
                    14 + count,
                    each(11),
                    u64::from(n),
                ),
                exchange(
                    format!("fast sync read of {l}"),
                    all(0x8A, &[&from[..], &asked(&[])].concat()),
                    14 + count,
                    8 + each(4),
                    1,
                ),
                exchange(
                    format!("bulk read of {l}"),
                    all(0x92, &asked(&from)),
                    10 + 5 * count,
                    each(11),
                    u64::from(n),
                ),
                exchange(
                    format!("fast bulk read of {l}"),
                    all(0x9A, &asked(&from)),
                    10 + 5 * count,
                    8 + each(4),
                    1,
                ),
                exchange(format!("bulk write of {l}"), all(0x93, &rows(&to)), 10 + each(5), 0, 0),
                exchange(
                    format!("registered write of {l}"),
                    dynamixel(1, &[&[4, address, 0], data.as_slice()].concat()),
                    12 + bytes,
                    11,
                    1,
                ),
                exchange("action".into(), dynamixel(0xFE, &[5]), 10, 0, 0),
            ]);
        }
        check_exchanges(&bus, &exchanges, &[57_600, 1_000_000, 4_000_000]);
    }
}

#[test]
fn every_exchange_of_sts_servos_takes_its_bytes_alone() {
    let exchange = |name: String, request, request_bytes, reply_bytes| Exchange {
        name,
        request,
        request_bytes,
        reply_bytes,
        delays: 0,
    };
    for n in [1u8, 4, 16] {
        let ids: Vec<u8> = (1..=n).collect();
        let count = usize::from(n);
        let bus = feetech_bus(ids.iter().map(|&id| servo("STS3215-12V", id)).collect());
        let mut exchanges = vec![exchange("ping".into(), feetech(1, 1, &[]), 6, 6)];
        for l in [2u8, 7] {
            let bytes = usize::from(l);
            // Goals from 42 or 41 on.
            let address = if l == 2 { 42 } else { 41 };
            let data = vec![0; bytes];
            let rows: Vec<u8> = ids.iter().flat_map(|&id| [&[id], data.as_slice()].concat()).collect();
            let (goal, all) = ([&[address], data.as_slice()].concat(), ids.as_slice());
            exchanges.extend([
                exchange(format!("read of {l}"), feetech(1, 2, &[56, l]), 8, 6 + bytes),
                exchange(format!("write of {l}"), feetech(1, 3, &goal), 7 + bytes, 6),
                exchange(format!("registered write of {l}"), feetech(1, 4, &goal), 7 + bytes, 6),
                exchange("action".into(), feetech(0xFE, 5, &[]), 6, 0),
                exchange(
                    format!("sync write of {l}"),
                    feetech(0xFE, 0x83, &[&[address, l], rows.as_slice()].concat()),
                    8 + count * (1 + bytes),
                    0,
                ),
                exchange(
                    format!("sync read of {l}"),
                    feetech(0xFE, 0x82, &[&[56, l], all].concat()),
                    8 + count,
                    count * (6 + bytes),
                ),
            ]);
        }
        // Stored settings, unlocked; and at last the restart, which no servo answers.
        exchanges.extend([
            exchange("unlocking".into(), feetech(1, 3, &[55, 0]), 8, 6),
            exchange("parameter backup".into(), feetech(1, 9, &[]), 6, 6),
            exchange("status reset".into(), feetech(1, 10, &[]), 6, 6),
            exchange("calibration".into(), feetech(1, 11, &[]), 6, 6),
            exchange("calibration to a count".into(), feetech(1, 11, &[0, 8]), 8, 6),
            exchange("restart".into(), feetech(1, 8, &[]), 6, 0),
        ]);
        check_exchanges(&bus, &exchanges, &[57_600, 1_000_000]);
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
fn two_senders_at_once_garble_the_line() {
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
fn requests_are_logged_with_the_time_of_their_last_byte_if_wanted() {
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
