use proptest::prelude::*;

use super::*;
use crate::bus::Feedback;
use crate::bus::dynamixel::DYNAMIXEL_X;
use crate::bus::feetech::FEETECH_STS;
use crate::bus::testing::{dynamixel_fast, dynamixel_status, feetech_status, slow_crc};
use crate::model::Protocol;

const IDS: [ServoId; 2] = [ServoId(1), ServoId(2)];
const MOVING: [ServoGoal; 2] = [
    ServoGoal::Move { position: 150, torque_limit: 400 },
    ServoGoal::Move { position: 170, torque_limit: 400 },
];
/// Replies of the Feetech wiki, `ft-scs`, example 8.
const STS_REPLIES: [u8; 28] = [
    0xFF, 0xFF, 0x01, 0x0A, 0x00, 0x00, 0x08, 0x00, 0x00, 0x00, 0x00, 0x79, 0x1E, 0x55, //
    0xFF, 0xFF, 0x02, 0x0A, 0x00, 0xFF, 0x07, 0x00, 0x00, 0x00, 0x00, 0x77, 0x23, 0x53,
];

fn client_with(protocol: Protocol, ids: &[ServoId]) -> BusClient {
    let bus = Bus {
        name: "legs".into(),
        protocol,
        baud: 1_000_000,
        adapter_latency_us: 1000,
        return_delay_us: 20,
        voltage_min_v: 0.0,
        supply_ohm: 0.0,
    };
    let registers = match protocol {
        Protocol::Feetech => &FEETECH_STS,
        Protocol::Dynamixel => &DYNAMIXEL_X,
    };
    BusClient::new(&bus, registers, ids)
}

fn client(protocol: Protocol) -> BusClient {
    client_with(protocol, &IDS)
}

fn at(position: i32, voltage_decivolt: u16, temperature_c: u8) -> Slot {
    Slot::Fresh(Feedback { position, voltage_decivolt, temperature_c, ..Feedback::default() })
}

fn sts_slots() -> [Slot; 2] {
    [at(2048, 121, 30), at(2047, 119, 35)]
}

/// One exchange that receives `replies` in one piece.
fn exchange(client: &mut BusClient, replies: &[u8]) -> Vec<Slot> {
    client.begin_cycle(&MOVING);
    client.feed(replies);
    client.finish().to_vec()
}

/// A Dynamixel feedback block, 126 to 146: load, speed, position, voltage, temperature.
fn block(load: i16, speed: i32, position: i32) -> Vec<u8> {
    let mut block = load.to_le_bytes().to_vec();
    block.extend(speed.to_le_bytes());
    block.extend(position.to_le_bytes());
    block.extend([0; 8]);
    block.extend([120, 0, 41]);
    block
}

fn block_slot(load: i32, speed: i32, position: i32, alarms: u8) -> Slot {
    Slot::Fresh(Feedback { position, speed, load, voltage_decivolt: 120, temperature_c: 41, alarms })
}

fn dynamixel_replies(is_fast: bool) -> Vec<u8> {
    let blocks = [block(-3, -200, 2048), block(7, 100, -5)];
    if is_fast {
        dynamixel_fast(&[(1, 0, &blocks[0]), (2, 0x80, &blocks[1])])
    } else {
        [dynamixel_status(1, 0, &blocks[0]), dynamixel_status(2, 0x80, &blocks[1])].concat()
    }
}

fn dynamixel_slots() -> [Slot; 2] {
    [block_slot(-3, -200, 2048, 0), block_slot(7, 100, -5, 0x80)]
}

/// A client whose bus has answered the plain read long enough for the fast one.
fn fast_client() -> BusClient {
    let mut client = client(Protocol::Dynamixel);
    for _ in 0..50 {
        assert_eq!(client.group_read(), GroupRead::Plain);
        assert_eq!(exchange(&mut client, &dynamixel_replies(false)), dynamixel_slots());
    }
    assert_eq!(client.group_read(), GroupRead::Fast);
    client
}

#[test]
fn a_feetech_cycle_on_the_wire() {
    let mut client = client(Protocol::Feetech);
    let goals = [ServoGoal::Move { position: 2048, torque_limit: 1000 }, ServoGoal::Limp];
    let packet = |body: &[u8]| {
        let sum = body.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        [&[0xFF, 0xFF], body, &[!sum]].concat()
    };
    let expected = [
        packet(&[0xFE, 7, 0x83, 48, 2, 1, 0xE8, 0x03]),
        packet(&[0xFE, 7, 0x83, 42, 2, 1, 0x00, 0x08]),
        packet(&[0xFE, 8, 0x83, 40, 1, 1, 1, 2, 0]),
        vec![0xFF, 0xFF, 0xFE, 0x06, 0x82, 0x38, 0x08, 0x01, 0x02, 0x36],
    ]
    .concat();
    assert_eq!(client.begin_cycle(&goals), expected);
    assert_eq!(client.begin_cycle(&goals), expected, "everything is said anew");
}

#[test]
fn a_dynamixel_cycle_on_the_wire() {
    let mut client = client(Protocol::Dynamixel);
    let packet = |body: &[u8]| {
        let mut packet = vec![0xFF, 0xFF, 0xFD, 0x00, 0xFE, u8::try_from(body.len() + 2).unwrap(), 0];
        packet.extend(body);
        packet.extend(slow_crc(&packet));
        packet
    };
    let expected = [
        packet(&[0x83, 100, 0, 2, 0, 1, 0x90, 1, 2, 0x90, 1]),
        // ROBOTIS e-manual, sync write example.
        vec![
            0xFF, 0xFF, 0xFD, 0x00, 0xFE, 0x11, 0x00, 0x83, 0x74, 0x00, 0x04, 0x00, //
            0x01, 0x96, 0x00, 0x00, 0x00, 0x02, 0xAA, 0x00, 0x00, 0x00, 0x82, 0x87,
        ],
        packet(&[0x83, 64, 0, 1, 0, 1, 1, 2, 1]),
        packet(&[0x82, 126, 0, 21, 0, 1, 2]),
    ]
    .concat();
    assert_eq!(client.begin_cycle(&MOVING), expected);
    assert_eq!(client.cycle_bytes(), (expected.len(), 2 * (11 + 21)));

    let mut client = fast_client();
    let fast = [&expected[..expected.len() - 16], &packet(&[0x8A, 126, 0, 21, 0, 1, 2])].concat();
    assert_eq!(client.begin_cycle(&MOVING), fast);
    assert_eq!(client.cycle_bytes(), (fast.len(), 8 + 2 * (4 + 21)));
}

#[test]
fn missing_goals_mean_limp() {
    let mut client = client(Protocol::Feetech);
    let limp = client.begin_cycle(&[ServoGoal::Limp; 2]).to_vec();
    assert_eq!(limp.len(), (8 + 2 * 2) + (8 + 2), "torque enable and sync read only");
    assert_eq!(client.begin_cycle(&[]), limp);
}

#[test]
fn a_bus_without_servos_sends_nothing() {
    let mut client = client_with(Protocol::Feetech, &[]);
    assert!(client.begin_cycle(&[]).is_empty());
    assert!(client.is_complete());
    assert!(client.finish().is_empty());
    assert_eq!(client.counters(), Counters::default());
}

#[test]
fn replies_fill_the_slots() {
    let mut sts = client(Protocol::Feetech);
    assert_eq!(exchange(&mut sts, &STS_REPLIES), sts_slots());
    // Position -2, speed -100, load -50, overload alarm.
    let data = [0x02, 0x80, 0x64, 0x80, 0x32, 0x04, 120, 40];
    let reply = feetech_status(2, 0x20, &data);
    let feedback = Feedback {
        position: -2,
        speed: -100,
        load: -50,
        voltage_decivolt: 120,
        temperature_c: 40,
        alarms: 0x20,
    };
    assert_eq!(exchange(&mut sts, &reply), [Slot::Missing, Slot::Fresh(feedback)]);
    let mut dynamixel = client(Protocol::Dynamixel);
    assert_eq!(exchange(&mut dynamixel, &dynamixel_replies(false)), dynamixel_slots());
}

#[test]
fn replies_may_come_in_any_pieces_with_or_without_echo() {
    for protocol in [Protocol::Feetech, Protocol::Dynamixel] {
        let mut client = client(protocol);
        let (replies, slots) = match protocol {
            Protocol::Feetech => (STS_REPLIES.to_vec(), sts_slots()),
            Protocol::Dynamixel => (dynamixel_replies(false), dynamixel_slots()),
        };
        let echo = client.begin_cycle(&MOVING).to_vec();
        for echo in [&[][..], &echo] {
            let received = [echo, &replies].concat();
            // Each client runs so few cycles that the read stays plain.
            let mut client = client_with(protocol, &IDS);
            for split in 0..=received.len() {
                if split % 40 == 0 {
                    client = client_with(protocol, &IDS);
                }
                let (first, second) = received.split_at(split);
                client.begin_cycle(&MOVING);
                client.feed(first);
                assert_eq!(client.is_complete(), split == received.len());
                client.feed(second);
                assert!(client.is_complete());
                assert_eq!(client.finish(), slots, "split at {split}");
            }
        }
    }
}

#[test]
fn each_servo_has_a_result_of_its_own() {
    let mut client = client(Protocol::Feetech);
    let (one, two) = (&STS_REPLIES[..14], &STS_REPLIES[14..]);
    let [fresh_one, fresh_two] = sts_slots();
    let mut flipped = one.to_vec();
    flipped[6] ^= 1;
    assert_eq!(exchange(&mut client, two), [Slot::Missing, fresh_two]);
    assert_eq!(exchange(&mut client, one), [fresh_one, Slot::Missing]);
    assert_eq!(exchange(&mut client, &[&flipped, two].concat()), [Slot::Corrupt, fresh_two]);
    assert_eq!(exchange(&mut client, &[two, one].concat()), [fresh_one, fresh_two], "by id, not by order");
    assert_eq!(exchange(&mut client, &[&flipped, one, two].concat()), [fresh_one, fresh_two]);
    assert_eq!(exchange(&mut client, &[one, &flipped].concat()), [fresh_one, Slot::Missing]);
    assert_eq!(exchange(&mut client, &[]), [Slot::Missing; 2], "nothing is kept from the last exchange");
    let counters = client.counters();
    assert_eq!((counters.exchanges, counters.missing, counters.corrupt), (7, 5, 1));
    assert_eq!(counters.bytes_in, 14 + 14 + 28 + 28 + 42 + 28);
    assert_eq!(counters.bytes_out, 7 * ((8 + 2 * 3) * 2 + (8 + 2 * 2) + (8 + 2)));
}

#[test]
fn replies_of_the_wrong_shape_are_corrupt() {
    let mut sts = client(Protocol::Feetech);
    assert_eq!(exchange(&mut sts, &feetech_status(1, 0, &[0; 7])), [Slot::Corrupt, Slot::Missing]);
    assert_eq!(exchange(&mut sts, &feetech_status(2, 0, &[])), [Slot::Missing, Slot::Corrupt]);
    let mut dynamixel = client(Protocol::Dynamixel);
    // Error 4, data range, without data; and the same with data, which no servo should send.
    assert_eq!(exchange(&mut dynamixel, &dynamixel_status(1, 4, &[])), [Slot::Corrupt, Slot::Missing]);
    let refusal = dynamixel_status(1, 4, &block(0, 0, 0));
    assert_eq!(exchange(&mut dynamixel, &refusal), [Slot::Corrupt, Slot::Missing]);
}

#[test]
fn replies_of_unknown_ids_are_counted_and_ignored() {
    let mut client = client(Protocol::Feetech);
    let stranger = feetech_status(9, 0, &[0; 8]);
    assert_eq!(exchange(&mut client, &[&stranger, &STS_REPLIES[..]].concat()), sts_slots());
    assert_eq!(client.unknown_replies(), 1);
}

#[test]
fn no_flipped_bit_gives_a_wrong_fresh_slot() {
    let mut received = 0;
    for bit in 0..STS_REPLIES.len() * 8 {
        let mut bytes = STS_REPLIES;
        bytes[bit / 8] ^= 1 << (bit % 8);
        let slots = exchange(&mut client(Protocol::Feetech), &bytes);
        for (slot, expected) in slots.iter().zip(sts_slots()) {
            assert!(!matches!(slot, Slot::Fresh(_)) || *slot == expected, "bit {bit}: {slots:?}");
        }
        received += slots.iter().zip(sts_slots()).filter(|(slot, expected)| *slot == expected).count();
        assert!(slots.iter().any(|slot| matches!(slot, Slot::Fresh(_))), "bit {bit} took both servos");
    }
    assert_eq!(received, STS_REPLIES.len() * 8, "a flipped bit costs one servo of two");

    for is_fast in [false, true] {
        let replies = dynamixel_replies(is_fast);
        let tested = if is_fast { fast_client() } else { client(Protocol::Dynamixel) };
        assert_eq!(tested.group_read() == GroupRead::Fast, is_fast);
        for bit in 0..replies.len() * 8 {
            let mut client = if is_fast { fast_client() } else { client(Protocol::Dynamixel) };
            let mut bytes = replies.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            let slots = exchange(&mut client, &bytes);
            for (slot, expected) in slots.iter().zip(dynamixel_slots()) {
                assert!(!matches!(slot, Slot::Fresh(_)) || *slot == expected, "bit {bit}: {slots:?}");
            }
        }
    }
}

#[test]
fn a_damaged_fast_reply_keeps_its_good_blocks_and_the_next_read_is_plain() {
    let replies = dynamixel_replies(true);
    assert_eq!(exchange(&mut fast_client(), &replies), dynamixel_slots());
    for length in 0..replies.len() {
        let mut client = fast_client();
        let slots = exchange(&mut client, &replies[..length]);
        let first = if length >= 8 + 25 { dynamixel_slots()[0] } else { Slot::Missing };
        assert_eq!(slots, [first, Slot::Missing], "cut at {length}");
        assert_eq!(client.group_read(), GroupRead::Plain);
        let one = &dynamixel_replies(false)[32..];
        assert_eq!(exchange(&mut client, one), [Slot::Missing, dynamixel_slots()[1]]);
    }
}

#[test]
fn a_fast_reply_is_decoded_after_the_echo_of_its_request() {
    let mut client = fast_client();
    let echo = client.begin_cycle(&MOVING).to_vec();
    client.feed(&[echo, dynamixel_replies(true)].concat());
    assert!(client.is_complete());
    assert_eq!(client.finish(), dynamixel_slots());
}

#[test]
fn feetech_transactions_match_the_wiki() {
    let mut client = client(Protocol::Feetech);
    // Feetech wiki, ft-scs, examples 1 and 2 (asked for a third byte: see `read_bytes`).
    assert_eq!(client.begin_ping(ServoId(1)), [0xFF, 0xFF, 0x01, 0x02, 0x01, 0xFB]);
    client.feed(&[0xFF, 0xFF, 0x01, 0x02, 0x00, 0xFC]);
    assert!(client.is_complete());
    assert_eq!(client.finish_transaction(), Answer::Done { value: 0, alarms: 0 });

    let request = client.begin_read(ServoId(1), FEETECH_STS.present_position).to_vec();
    assert_eq!(request, [0xFF, 0xFF, 0x01, 0x04, 0x02, 0x38, 0x03, 0xBD]);
    client.feed(&request);
    assert!(!client.is_complete());
    client.feed(&feetech_status(1, 0x04, &[0x18, 0x05, 0x77]));
    assert_eq!(client.finish_transaction(), Answer::Done { value: 1304, alarms: 4 });

    let request = client.begin_write(ServoId(1), FEETECH_STS.goal_position, -5).to_vec();
    assert_eq!(request, [0xFF, 0xFF, 0x01, 0x05, 0x03, 42, 0x05, 0x80, 0x47]);
    client.feed(&feetech_status(2, 0, &[]));
    assert!(!client.is_complete(), "another servo's answer is none");
    client.feed(&feetech_status(1, 0, &[]));
    assert_eq!(client.finish_transaction(), Answer::Done { value: 0, alarms: 0 });
    assert_eq!(client.counters(), Counters::default(), "transactions are not counted");
}

#[test]
fn a_false_header_delays_an_answer_at_most_until_the_deadline() {
    let mut client = client(Protocol::Feetech);
    client.begin_read(ServoId(1), FEETECH_STS.present_position);
    // A report's header, which announces more bytes than follow.
    client.feed(&[0xFF, 0xFF, 0x01, 0x0A]);
    client.feed(&feetech_status(1, 0, &[0x18, 0x05, 0x77])[..]);
    let at_the_deadline = client.finish_transaction();
    assert_eq!(at_the_deadline, Answer::Done { value: 1304, alarms: 0 });
}

#[test]
fn an_echo_alone_counts_as_silence() {
    for protocol in [Protocol::Feetech, Protocol::Dynamixel] {
        let mut client = client(protocol);
        let register = client.registers().goal_position;
        let echo = client.begin_read(ServoId(1), register).to_vec();
        client.feed(&echo);
        assert_eq!(client.finish_transaction(), Answer::Missing);
        let echo = client.begin_write(ServoId(1), register, 1).to_vec();
        client.feed(&echo);
        assert_eq!(client.finish_transaction(), Answer::Missing);
    }
}

/// With noise before it, an echo is not recognised as one; it must still never pass for an answer.
#[test]
fn an_echo_within_noise_is_no_answer() {
    for protocol in [Protocol::Feetech, Protocol::Dynamixel] {
        for noise in [&[][..], &[0x00], &[0xFF]] {
            let mut client = client(protocol);
            let registers = client.registers();
            for register in [registers.torque_enable, registers.goal_position, registers.model_number] {
                let echo = client.begin_read(ServoId(1), register).to_vec();
                client.feed(&[noise, &echo].concat());
                assert!(!matches!(client.finish_transaction(), Answer::Done { .. }));
                let echo = client.begin_write(ServoId(1), register, 1).to_vec();
                client.feed(&[noise, &echo].concat());
                assert!(!matches!(client.finish_transaction(), Answer::Done { .. }));
            }
            let echo = client.begin_ping(ServoId(1)).to_vec();
            client.feed(&[noise, &echo].concat());
            assert_eq!(client.finish_transaction(), Answer::Missing);
        }
    }
}

#[test]
fn dynamixel_transactions_match_the_manual() {
    let mut client = client(Protocol::Dynamixel);
    assert_eq!(client.begin_ping(ServoId(1)), [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E]);
    client.feed(&[0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00, 0x06, 0x04, 0x26, 0x65, 0x5D]);
    assert_eq!(client.finish_transaction(), Answer::Done { value: 0, alarms: 0 });
    assert_eq!(
        client.begin_read(ServoId(1), DYNAMIXEL_X.present_position),
        [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x02, 0x84, 0x00, 0x04, 0x00, 0x1D, 0x15]
    );
    client.feed(&dynamixel_status(1, 0x80, &[0xFF, 0xFF, 0xFF, 0xFF]));
    assert_eq!(client.finish_transaction(), Answer::Done { value: -1, alarms: 0x80 });
    client.begin_write(ServoId(1), DYNAMIXEL_X.torque_enable, 1);
    client.feed(&dynamixel_status(1, 0x84, &[]));
    assert_eq!(client.finish_transaction(), Answer::Refused { error: 4 });
    client.begin_read(ServoId(1), DYNAMIXEL_X.torque_enable);
    let mut reply = dynamixel_status(1, 0, &[1]);
    reply[9] ^= 1;
    client.feed(&reply);
    assert_eq!(client.finish_transaction(), Answer::Corrupt);
    client.begin_read(ServoId(1), DYNAMIXEL_X.torque_enable);
    assert_eq!(client.finish_transaction(), Answer::Missing);
}

#[test]
fn a_request_has_the_length_that_its_cost_assumes() {
    for protocol in [Protocol::Feetech, Protocol::Dynamixel] {
        for servos in [1, 2, 16, 80, 81, 161, 242] {
            let ids: Vec<ServoId> = (0..servos).map(ServoId).collect();
            let goals = vec![ServoGoal::Move { position: 2048, torque_limit: 800 }; ids.len()];
            let mut client = client_with(protocol, &ids);
            assert_eq!(client.begin_cycle(&goals).len(), client.cycle_bytes().0, "{servos} servos");
        }
    }
}

#[test]
fn the_deadline_is_later_than_the_expected_time() {
    let mut client = client(Protocol::Feetech);
    client.begin_cycle(&MOVING);
    // 50 + 28 bytes, 20 us for each servo, 1000 us adapter.
    assert_eq!(client.cycle_bytes(), (50, 28));
    assert_eq!(client.cycle_time(), Duration::from_micros(780 + 40 + 1000));
    assert_eq!(client.reply_deadline(), Duration::from_micros(1820 + 455 + 200));
}

fn any_goal() -> impl Strategy<Value = ServoGoal> {
    prop_oneof![
        Just(ServoGoal::Limp),
        Just(ServoGoal::Keep),
        (any::<i32>(), any::<u16>())
            .prop_map(|(position, torque_limit)| ServoGoal::Move { position, torque_limit }),
        // Values that need the most stuffing.
        Just(ServoGoal::Move { position: 0xFD_FFFF, torque_limit: 0xFFFF }),
        Just(ServoGoal::Move { position: -3, torque_limit: 0xFFFF }),
    ]
}

proptest! {
    #[test]
    fn any_goals_and_bytes_are_handled_without_a_panic_or_allocation(
        goals in proptest::collection::vec(any_goal(), 0..20),
        received in proptest::collection::vec(any::<u8>(), 0..400),
        pieces in 1usize..50,
    ) {
        for protocol in [Protocol::Feetech, Protocol::Dynamixel] {
            let ids: Vec<ServoId> = (0..16).map(ServoId).collect();
            let mut client = client_with(protocol, &ids);
            let capacity = client.request.capacity();
            for round in 0..3 {
                if round > 0 {
                    (0..16).for_each(|index| client.renew(index, Some(127)));
                    client.restart_servo(3);
                }
                client.begin_cycle(&goals);
                prop_assert_eq!(client.request.capacity(), capacity);
                for piece in received.chunks(pieces) {
                    client.feed(piece);
                }
                prop_assert_eq!(client.finish().len(), 16);
            }
        }
    }
}

/// Sync writes of registers 98, 108 and 112 (e-manual: Bus Watchdog, in units of 20 ms, Profile Acceleration,
/// Profile Velocity).
#[test]
fn settings_and_watchdog_of_one_servo_come_before_the_goals_of_one_cycle() {
    let packet = |body: &[u8]| {
        let length = u8::try_from(body.len() + 2).unwrap();
        let mut packet = [&[0xFF, 0xFF, 0xFD, 0x00, 0xFE, length, 0x00], body].concat();
        packet.extend(slow_crc(&packet));
        packet
    };
    let mut client = client(Protocol::Dynamixel);
    let usual = client.begin_cycle(&MOVING).to_vec();
    let usual_deadline = client.reply_deadline();
    client.renew(1, Some(10));
    let expected = [
        packet(&[0x83, 98, 0, 1, 0, 2, 0]),
        packet(&[0x83, 108, 0, 4, 0, 2, 0, 0, 0, 0]),
        packet(&[0x83, 112, 0, 4, 0, 2, 0, 0, 0, 0]),
        packet(&[0x83, 98, 0, 1, 0, 2, 10]),
        usual.clone(),
    ];
    assert_eq!(client.begin_cycle(&MOVING), expected.concat());
    // 70 bytes of 10 us each, and a quarter more.
    assert_eq!(client.reply_deadline(), usual_deadline + Duration::from_micros(875));
    assert_eq!(client.begin_cycle(&MOVING), usual, "once asked for, once done");
    assert_eq!(client.begin_watchdog(0), packet(&[0x83, 98, 0, 1, 0, 1, 0, 2, 0]));
    assert!(client.is_complete(), "nobody answers");
}

/// Wiki, memory-sts: register 41, acceleration, 0 for the largest.
#[test]
fn feetech_servos_have_no_watchdog_and_get_their_acceleration_again() {
    let mut client = client(Protocol::Feetech);
    let usual = client.begin_cycle(&MOVING).to_vec();
    client.renew(0, Some(10));
    let acceleration = vec![0xFF, 0xFF, 0xFE, 6, 0x83, 41, 1, 1, 0, 0x4D];
    assert_eq!(client.begin_cycle(&MOVING), [acceleration, usual].concat());
    assert!(client.begin_watchdog(0).is_empty());
}

/// The restart is the last packet of its cycle: ROBOTIS e-manual, Protocol 2.0, Reboot, the example for id 1;
/// Feetech wiki, ft-scs 4.12, for id 1.
#[test]
fn a_restart_is_the_last_request_of_its_cycle_and_no_servo_is_asked() {
    let reboot = vec![0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x08, 0x2F, 0x4E];
    let restart = vec![0xFF, 0xFF, 0x01, 0x02, 0x08, 0xF4];
    let goals = [ServoGoal::Limp, MOVING[1]];
    for (protocol, packet, read_bytes) in
        [(Protocol::Dynamixel, reboot, 14 + 2), (Protocol::Feetech, restart, 8 + 2)]
    {
        let mut client = client(protocol);
        let usual = client.begin_cycle(&goals).to_vec();
        client.restart_servo(0);
        let writes = &usual[..usual.len() - read_bytes];
        assert_eq!(client.begin_cycle(&goals), [writes, &packet].concat(), "{protocol:?}");
        assert!(client.is_complete() && client.reply_deadline().is_zero());
        assert_eq!(client.finish(), [Slot::Missing; 2]);
        assert_eq!(client.begin_cycle(&goals), usual);
    }
}

/// Torque Enable: 64 and 40; Hardware Error Status: 70; status: 65.
#[test]
fn a_question_in_place_of_feedback_gets_an_answer_from_each_servo() {
    use crate::signals::ServoAnswer;
    for (protocol, torque, alarms) in [(Protocol::Dynamixel, 64, 70), (Protocol::Feetech, 40, 65)] {
        let is_feetech = protocol == Protocol::Feetech;
        let reply = if is_feetech { feetech_status } else { dynamixel_status };
        let mut client = client(protocol);
        for (question, address, told) in [
            (Question::Torque, torque, [ServoAnswer::Torque(true), ServoAnswer::Torque(false)]),
            (Question::Alarms, alarms, [ServoAnswer::Alarms(1), ServoAnswer::Alarms(0)]),
        ] {
            client.ask(question);
            let request = client.begin_cycle(&MOVING).to_vec();
            let asks: &[u8] =
                if is_feetech { &[0x82, address, 1, 1, 2] } else { &[0x82, address, 0, 1, 0, 1, 2] };
            assert!(request.windows(asks.len()).any(|window| window == asks), "{request:02X?}");
            client.feed(&[reply(1, 0, &[1]), reply(2, 0, &[0])].concat());
            assert!(client.is_complete());
            assert_eq!(client.finish(), told.map(Slot::Answered));
            // Feedback is not an answer, and the next cycle asks for it again.
            assert!(matches!(
                exchange(&mut client, &usual_replies(protocol))[..],
                [Slot::Fresh(_), Slot::Fresh(_)]
            ));
            client.ask(question);
            assert_eq!(exchange(&mut client, &usual_replies(protocol)), [Slot::Corrupt; 2]);
        }
    }
}

fn usual_replies(protocol: Protocol) -> Vec<u8> {
    match protocol {
        Protocol::Feetech => STS_REPLIES.to_vec(),
        Protocol::Dynamixel => dynamixel_replies(false),
    }
}

#[test]
fn a_servo_that_should_keep_its_goal_gets_no_goal() {
    let mut both = client(Protocol::Feetech);
    let mut alone = client_with(Protocol::Feetech, &IDS[1..]);
    let kept = both.begin_cycle(&[ServoGoal::Keep, MOVING[1]]).to_vec();
    let other = alone.begin_cycle(&MOVING[1..]).to_vec();
    assert_eq!(kept[..kept.len() - 10], other[..other.len() - 9], "all but the read");
}
