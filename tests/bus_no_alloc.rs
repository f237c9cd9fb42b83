//! After construction a bus' exchanges allocate nothing: any allocation aborts this test.

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use hippocamp::bus::timing::GroupRead;
use hippocamp::bus::{BusClient, ServoGoal, Slot};
use hippocamp::model::servo_model::{DYNAMIXEL_X, FEETECH_STS};
use hippocamp::model::{Bus, Protocol, Registers};
use hippocamp::units::ServoId;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const SERVOS: u8 = 16;

fn client(protocol: Protocol, registers: &'static Registers) -> BusClient {
    let bus =
        Bus { name: "bus".into(), protocol, baud: 1_000_000, adapter_latency_us: 1000, return_delay_us: 0 };
    let ids: Vec<ServoId> = (0..SERVOS).map(ServoId).collect();
    BusClient::new(&bus, registers, &ids)
}

fn feetech_replies() -> Vec<u8> {
    let reply = |id| {
        let mut reply = vec![0xFF, 0xFF, id, 10, 0, 0x00, 0x08, 0, 0, 0, 0, 120, 30];
        let sum = reply.iter().skip(2).fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        reply.push(!sum);
        reply
    };
    (0..SERVOS).flat_map(reply).collect()
}

fn crc(bytes: &[u8]) -> [u8; 2] {
    let step = |crc: u16| if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x8005 };
    let byte = |crc: u16, byte: &u8| (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| step(crc));
    bytes.iter().fold(0, byte).to_le_bytes()
}

/// Data that are stuffed in a plain reply.
const BLOCK: [u8; 21] = [0xFF, 0xFF, 0xFD, 0, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 120, 0, 30];

fn dynamixel_replies(read: GroupRead) -> Vec<u8> {
    match read {
        GroupRead::Plain => {
            let reply = |id| {
                let mut reply = vec![0xFF, 0xFF, 0xFD, 0, id, 26, 0, 0x55, 0, 0xFF, 0xFF, 0xFD, 0xFD];
                reply.extend(&BLOCK[3..]);
                reply.extend(crc(&reply));
                reply
            };
            (0..SERVOS).flat_map(reply).collect()
        }
        GroupRead::Fast => {
            let [low, high] = (1 + u16::from(SERVOS) * 25).to_le_bytes();
            let mut reply = vec![0xFF, 0xFF, 0xFD, 0, 0xFE, low, high, 0x55];
            for id in 0..SERVOS {
                reply.extend([0, id]);
                reply.extend(BLOCK);
                reply.extend(crc(&reply));
            }
            reply
        }
    }
}

/// Runs 300 exchanges of all kinds and returns how many of each kind were whole.
fn run(client: &mut BusClient, plain: &[u8], fast: &[u8]) -> (u32, u32) {
    // What needs most stuffing, so that the request is as long as it can be.
    let worst = [ServoGoal::Move { position: 0xFD_FFFF, torque_limit: 0xFFFF }; SERVOS as usize];
    let usual = [ServoGoal::Move { position: 2048, torque_limit: 800 }; SERVOS as usize];
    let mut whole = (0, 0);
    for cycle in 0..300usize {
        let read = client.group_read();
        let replies = if read == GroupRead::Fast { fast } else { plain };
        if cycle % 5 == 0 {
            client.renew_watchdog(127);
        }
        let request = client.begin_cycle(if cycle % 3 == 0 { &worst } else { &usual });
        assert!(!request.is_empty());
        match cycle % 120 {
            // Nothing but noise, far more than any reply.
            117 => (0..9).for_each(|_| client.feed(plain.get(3..).unwrap_or_default())),
            // A reply cut short.
            118 => client.feed(replies.get(..40).unwrap_or_default()),
            119 => {}
            _ => replies.chunks(7).for_each(|piece| client.feed(piece)),
        }
        if client.finish().iter().all(|slot| matches!(slot, Slot::Fresh(_))) {
            match read {
                GroupRead::Plain => whole.0 += 1,
                GroupRead::Fast => whole.1 += 1,
            }
        }
    }
    client.begin_watchdog(0);
    client.begin_read(ServoId(1), FEETECH_STS.model_number);
    client.finish_transaction();
    whole
}

#[test]
fn exchanges_do_not_allocate() {
    let mut feetech = client(Protocol::Feetech, &FEETECH_STS);
    let replies = feetech_replies();
    let (plain, fast) = assert_no_alloc(|| run(&mut feetech, &replies, &[]));
    assert_eq!((plain > 200, fast), (true, 0));

    let mut dynamixel = client(Protocol::Dynamixel, &DYNAMIXEL_X);
    let replies = [GroupRead::Plain, GroupRead::Fast].map(dynamixel_replies);
    let (plain, fast) = assert_no_alloc(|| run(&mut dynamixel, &replies[0], &replies[1]));
    assert!(plain >= 100 && fast >= 100, "both ways of reading were in use: {plain} plain, {fast} fast");
}
