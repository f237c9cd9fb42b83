//! Every fault kind, seen from the host.

mod common;
use common::*;
use hw_sim::{BusConfig, FaultScript, Unplugged, World};

fn one(script: &str) -> World {
    world_with_faults(feetech_bus(vec![servo("STS3215-12V", 1), servo("STS3215-12V", 2)]), script)
}

fn ping(world: &mut World, id: u8) -> Vec<u8> {
    exchange(world, &feetech(id, 1, &[]))
}

#[test]
fn silent_servo_neither_answers_nor_listens_until_it_is_over() {
    let mut world = one("[[fault]]\nat_s = 1\nfor_s = 1\nkind = 'silent'\nbus = 'legs'\nid = 1");
    assert_eq!(ping(&mut world, 1), feetech(1, 0, &[]));
    world.advance_to(S);
    assert_eq!(ping(&mut world, 1), []);
    assert_eq!(feetech_write(&mut world, 1, 41, &[7]), []);
    assert_eq!(world.register(0, 1, 41), Some(0));
    assert_eq!(ping(&mut world, 2), feetech(2, 0, &[]));
    world.advance_to(2 * S);
    assert_eq!(ping(&mut world, 1), feetech(1, 0, &[]));
}

#[test]
fn bit_flip_changes_exactly_one_bit_of_each_reply() {
    let mut world = one("[[fault]]\nat_s = 0\nkind = 'bit-flip'\nbus = 'legs'\nid = 1");
    let mut places = std::collections::BTreeSet::new();
    for _ in 0..50 {
        let reply = ping(&mut world, 1);
        let clean = feetech(1, 0, &[]);
        assert_eq!(reply.len(), clean.len());
        let flipped: Vec<u32> = reply.iter().zip(&clean).map(|(a, b)| u32::from(a ^ b)).collect();
        assert_eq!(flipped.iter().map(|bits| bits.count_ones()).sum::<u32>(), 1);
        places.insert(flipped);
    }
    assert!(places.len() > 10, "the place varies");
    assert_eq!(ping(&mut world, 2), feetech(2, 0, &[]));
}

#[test]
fn noise_runs_ahead_of_the_reply() {
    let mut world = one("[[fault]]\nat_s = 0\nkind = 'noise'");
    for _ in 0..20 {
        let reply = ping(&mut world, 1);
        assert!(reply.len() > 6 && reply.len() <= 6 + 8);
        assert!(reply.ends_with(&feetech(1, 0, &[])));
    }
}

#[test]
fn noise_does_not_split_a_fast_sync_read() {
    let bus = dynamixel_bus(vec![servo("XM430-W210", 1), servo("XM430-W210", 2)]);
    let mut clean = world(bus.clone());
    let mut noisy = world_with_faults(bus, "[[fault]]\nat_s = 0\nkind = 'noise'");
    let request = dynamixel(0xFE, &[0x8A, 132, 0, 4, 0, 1, 2]);
    let (clean, noisy) = (exchange(&mut clean, &request), exchange(&mut noisy, &request));
    assert!(noisy.len() > clean.len() && noisy.ends_with(&clean));
}

#[test]
fn echo_gives_the_host_its_own_bytes_as_they_leave() {
    let mut world = one("[[fault]]\nat_s = 0\nkind = 'echo'\nbus = 'legs'");
    let request = feetech(1, 1, &[]);
    world.host_send(0, &request).unwrap();
    world.advance_to(60_000);
    assert_eq!(received(&mut world, 0), request);
    world.advance_to(S);
    assert_eq!(received(&mut world, 0), feetech(1, 0, &[]));
}

#[test]
fn an_unplugged_adapter_refuses_writes_and_loses_bytes_under_way() {
    let mut world = one("[[fault]]\nat_s = 0.0001\nfor_s = 1\nkind = 'unplugged'");
    world.host_send(0, &feetech(1, 1, &[])).unwrap();
    // The reply runs from 60 to 120 µs; the plug goes at 100.
    world.advance_to(99_999);
    assert_eq!(world.host_pending(0), 3);
    world.advance_to(100_000);
    assert_eq!(world.host_pending(0), 0);
    assert_eq!(world.host_send(0, &[1]), Err(Unplugged));
    assert_eq!(world.host_receive(0, &mut [0; 8]), Err(Unplugged));
    assert!(!world.advance_to_input(S / 2));
    world.advance_to(S + 100_000);
    assert_eq!(received(&mut world, 0), []);
    assert_eq!(ping(&mut world, 1), feetech(1, 0, &[]));
}

#[test]
fn unplugging_cuts_a_request_off_and_no_servo_obeys_it() {
    let mut world = one("[[fault]]\nat_s = 0.00005\nfor_s = 0.001\nkind = 'unplugged'");
    world.host_send(0, &feetech(1, 3, &[41, 9])).unwrap();
    world.advance_to(S);
    assert_eq!(world.register(0, 1, 41), Some(0));
    assert_eq!(world.wire_statistics(0).unwrap().bytes_from_host, 4);
}

#[test]
fn an_adapter_unplugged_by_hand_acts_as_one_unplugged_by_a_script() {
    let mut world = one("");
    world.host_send(0, &feetech(1, 3, &[41, 9])).unwrap();
    world.advance_to(50_000);
    world.unplug(0, S);
    assert_eq!(world.host_send(0, &[1]), Err(Unplugged));
    world.advance_to(S);
    assert_eq!((world.register(0, 1, 41), world.is_unplugged(0)), (Some(0), true));
    world.advance_to(S + 50_000);
    assert_eq!(ping(&mut world, 1), feetech(1, 0, &[]));
    world.unplug(0, u64::MAX);
    world.plug_in(0);
    assert_eq!(ping(&mut world, 1), feetech(1, 0, &[]));
}

#[test]
fn a_late_host_fault_happens_once_when_due() {
    let mut world = one("[[fault]]\nat_s = 1\nkind = 'late-host'\ndelay_ms = 30");
    assert_eq!(world.host_stall_ns(), 0);
    world.advance_to(S + 5);
    assert_eq!(world.host_stall_ns(), 30 * MS);
    assert_eq!(world.host_stall_ns(), 0);
}

#[test]
fn a_stuck_shaft_stays_and_then_continues() {
    let mut world = one("[[fault]]\nat_s = 0\nfor_s = 1\nkind = 'stuck'\nbus = 'legs'\nid = 1");
    for id in [1, 2] {
        feetech_write(&mut world, id, 42, &[0x00, 0x0C]);
        feetech_write(&mut world, id, 40, &[1]);
    }
    world.advance_to(S - 1);
    let counts = |world: &World, id| world.shaft(0, id).unwrap().position_counts;
    assert!((counts(&world, 1) - 2048.0).abs() < 1e-9);
    assert!((counts(&world, 2) - 3072.0).abs() < 5.0);
    world.advance_to(3 * S);
    assert!((counts(&world, 1) - 3072.0).abs() < 5.0);
}

#[test]
fn low_voltage_shows_in_the_register_the_alarm_bit_and_the_motor() {
    let mut world = one("[[fault]]\nat_s = 1\nfor_s = 1\nkind = 'low-voltage'\nvolts = 3.5\nbus = 'legs'");
    assert_eq!(exchange(&mut world, &feetech(2, 2, &[62, 1])), feetech(2, 0, &[120]));
    world.advance_to(S + 2 * MS);
    assert_eq!(exchange(&mut world, &feetech(2, 2, &[62, 1])), feetech(2, 1, &[35]));
    assert!((world.shaft(0, 1).unwrap().supply_v - 3.5).abs() < 1e-9);
    world.advance_to(2 * S + 2 * MS);
    assert_eq!(exchange(&mut world, &feetech(2, 2, &[62, 1])), feetech(2, 0, &[120]));
}

#[test]
fn hot_servo_reports_its_heat_and_unloads() {
    let mut world = one("[[fault]]\nat_s = 1\nkind = 'hot'\ncelsius = 82\nbus = 'legs'\nid = 1");
    feetech_write(&mut world, 1, 40, &[1]);
    assert!(world.shaft(0, 1).unwrap().torque_on);
    world.advance_to(S + 2 * MS);
    assert_eq!(exchange(&mut world, &feetech(1, 2, &[63, 1])), feetech(1, 4, &[82]));
    assert!(!world.shaft(0, 1).unwrap().torque_on);
    assert_eq!(exchange(&mut world, &feetech(2, 2, &[63, 1])), feetech(2, 0, &[30]));
}

#[test]
fn a_hot_dynamixel_shuts_down_and_refuses_torque() {
    let script = "[[fault]]\nat_s = 0\nfor_s = 0.1\nkind = 'hot'\ncelsius = 95";
    let mut world = world_with_faults(dynamixel_bus(vec![servo("XM430-W210", 1)]), script);
    world.advance_to(S);
    let reply = dynamixel_write(&mut world, 1, 64, &[1]);
    assert_eq!(reply, dynamixel(1, &[0x55, 0x81]));
    assert_eq!(world.register(0, 1, 70), Some(4));
}

#[test]
fn a_fault_on_an_unknown_target_lists_the_known_ones() {
    let build = |script: &str| {
        let bus = feetech_bus(vec![servo("STS3215-12V", 1), servo("STS3215-12V", 4)]);
        World::new(&[bus], FaultScript::from_toml(script).unwrap(), 0).err().unwrap()
    };
    let both = build(
        "[[fault]]\nat_s = 0\nkind = 'echo'\nbus = 'wings'\n[[fault]]\nat_s = 0\nkind = 'silent'\nid = 2",
    );
    assert_eq!(
        both.to_string(),
        "fault script:4: fault[0].bus = \"wings\": expected the name of a bus: \"legs\"\n\
         fault script:8: fault[1].id = 2: expected the id of a servo: 1, 4 on \"legs\""
    );
}

#[test]
fn a_fault_needs_no_bus_if_only_one_bus_has_the_id() {
    let buses = || {
        let legs = feetech_bus(vec![servo("STS3215-12V", 1), servo("STS3215-12V", 2)]);
        let arms = BusConfig { name: "arms".into(), ..feetech_bus(vec![servo("STS3215-12V", 2)]) };
        [legs, arms]
    };
    let silent = |id: u8| FaultScript::from_toml(&format!("[[fault]]\nat_s = 0\nkind = 'silent'\nid = {id}"));
    let mut world = World::new(&buses(), silent(1).unwrap(), 0).unwrap();
    let ping = |id: u8| feetech(id, 1, &[]);
    assert_eq!(exchange(&mut world, &ping(1)), []);
    assert_eq!(exchange(&mut world, &ping(2)), feetech(2, 0, &[]));
    let error = World::new(&buses(), silent(2).unwrap(), 0).err().unwrap().to_string();
    assert!(error.contains("fault[0].id = 2: expected an id that only one bus has"), "{error}");
    assert!(error.contains("\"legs\", \"arms\" have this one"), "{error}");
}

#[test]
fn a_slow_servo_answers_late_and_the_others_behind_it() {
    let mut world = one("[[fault]]\nat_s = 0\nkind = 'slow'\ndelay_ms = 3\nbus = 'legs'\nid = 1");
    world.host_send(0, &feetech(0xFE, 0x82, &[56, 2, 1, 2])).unwrap();
    // Request 10 bytes, reply 8, 10 µs each.
    world.advance_to(100_000 + 3 * MS + 80_000 - 1);
    assert_eq!(world.host_pending(0), 7);
    world.advance_to(100_000 + 3 * MS + 160_000);
    assert_eq!(world.host_pending(0), 16);
}

#[test]
fn a_garbled_reply_keeps_only_the_length() {
    let mut world = one("[[fault]]\nat_s = 0\nkind = 'garbled'\nbus = 'legs'\nid = 1");
    for _ in 0..20 {
        let (reply, clean) = (ping(&mut world, 1), feetech(1, 0, &[]));
        assert_eq!(reply.len(), clean.len());
        assert!(reply.iter().zip(&clean).all(|(a, b)| a != b), "{reply:02X?}");
    }
    assert_eq!(ping(&mut world, 2), feetech(2, 0, &[]));
}

#[test]
fn a_scrambled_reply_changes_all_after_its_length_and_sometimes_passes_its_checksum() {
    let mut world = one("[[fault]]\nat_s = 0\nkind = 'scrambled'\nshare = 0.5\nbus = 'legs'\nid = 1");
    // Position: FF FF id length error low high sum.
    let read = feetech(1, 2, &[56, 2]);
    let clean = exchange(&mut world, &feetech(2, 2, &[56, 2]));
    let (mut scrambled, mut passed) = (0, 0);
    for _ in 0..6000 {
        let reply = exchange(&mut world, &read);
        assert_eq!((reply.len(), &reply[..2], reply[2], reply[3]), (8, &clean[..2], 1, 4));
        let sum = reply[2..7].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        let is_true = reply[4..7] == clean[4..7];
        scrambled += usize::from(!is_true);
        passed += usize::from(!is_true && reply[7] == !sum);
    }
    assert!((2800..3200).contains(&scrambled), "{scrambled}: half of them");
    assert!((3..30).contains(&passed), "{passed}: one of 256");
}

#[test]
fn a_reply_that_is_cut_short_begins_as_it_should() {
    let mut world = one("[[fault]]\nat_s = 0\nkind = 'cut-short'");
    let clean = feetech(1, 0, &[]);
    let mut lengths = std::collections::BTreeSet::new();
    for _ in 0..50 {
        let reply = ping(&mut world, 1);
        assert!(clean.starts_with(&reply) && !reply.is_empty());
        lengths.insert(reply.len());
    }
    assert_eq!(lengths.into_iter().collect::<Vec<_>>(), [1, 2, 3, 4, 5]);
}

#[test]
fn a_servo_with_a_wrong_id_answers_to_that_one_alone() {
    let mut world = one("[[fault]]\nat_s = 0\nfor_s = 1\nkind = 'wrong-id'\nas_id = 9\nbus = 'legs'\nid = 1");
    assert_eq!(ping(&mut world, 1), []);
    assert_eq!(ping(&mut world, 9), feetech(9, 0, &[]));
    world.advance_to(S);
    assert_eq!(ping(&mut world, 1), feetech(1, 0, &[]));
}

#[test]
fn two_servos_with_one_id_talk_over_each_other() {
    let mut world = one("[[fault]]\nat_s = 0\nkind = 'wrong-id'\nas_id = 2\nbus = 'legs'\nid = 1");
    let reply = ping(&mut world, 2);
    let clean = feetech(2, 0, &[]);
    assert_eq!(reply.len(), 2 * clean.len(), "both, at the same time");
    assert!(world.wire_statistics(0).unwrap().bytes_garbled >= 12);
    // 6 bytes of request and 6 of both replies at once.
    assert_eq!(world.wire_statistics(0).unwrap().busy_ns, 120_000);
}

/// Torque on and a goal, then whatever `script` does at one second.
fn holding(script: &str) -> World {
    let mut world = one(script);
    for id in [1, 2] {
        feetech_write(&mut world, id, 42, &[0x00, 0x08]);
        feetech_write(&mut world, id, 40, &[1]);
    }
    world.advance_to(S + 2 * MS);
    world
}

#[test]
fn a_servo_that_resets_is_away_for_1800_ms_and_limp_with_its_ram_as_new() {
    let mut world = holding("[[fault]]\nat_s = 1\nkind = 'reset'\nbus = 'legs'\nid = 1");
    assert!(!world.shaft(0, 1).unwrap().torque_on);
    assert_eq!(ping(&mut world, 1), []);
    assert_eq!(ping(&mut world, 2), feetech(2, 0, &[]));
    world.advance_to(2_790 * MS);
    assert_eq!(ping(&mut world, 1), []);
    world.advance_to(2_900 * MS);
    assert_eq!(ping(&mut world, 1), feetech(1, 0, &[]));
    assert_eq!((world.register(0, 1, 40), world.register(0, 1, 43)), (Some(0), Some(0)));
    assert_eq!((world.register(0, 2, 40), world.register(0, 2, 43)), (Some(1), Some(8)));
}

#[test]
fn a_brown_out_takes_every_servo_of_the_bus_until_it_has_started_again() {
    let mut world = holding("[[fault]]\nat_s = 1\nfor_s = 0.5\nkind = 'brown-out'\nbus = 'legs'");
    assert!((world.shaft(0, 2).unwrap().supply_v).abs() < 1e-9);
    for id in [1, 2] {
        assert!(!world.shaft(0, id).unwrap().torque_on);
        assert_eq!(ping(&mut world, id), []);
    }
    // Half a second without supply, 1.8 to start.
    world.advance_to(3_200 * MS);
    assert_eq!(ping(&mut world, 1), []);
    world.advance_to(3_310 * MS);
    for id in [1, 2] {
        assert_eq!(ping(&mut world, id), feetech(id, 0, &[]));
        assert_eq!(world.register(0, id, 40), Some(0));
    }
}

#[test]
fn an_unplugged_servo_is_silent_and_the_rest_of_the_bus_works() {
    let mut world = holding("[[fault]]\nat_s = 1\nfor_s = 0.5\nkind = 'unplugged'\nbus = 'legs'\nid = 1");
    assert!(!world.is_unplugged(0), "the adapter is there");
    assert_eq!((ping(&mut world, 1), ping(&mut world, 2)), (vec![], feetech(2, 0, &[])));
    assert!(!world.shaft(0, 1).unwrap().torque_on && world.shaft(0, 2).unwrap().torque_on);
    world.advance_to(3_310 * MS);
    assert_eq!(ping(&mut world, 1), feetech(1, 0, &[]));
    assert!(!world.shaft(0, 1).unwrap().torque_on);
}

#[test]
fn restarted_dynamixel_servos_keep_their_eeprom() {
    let script = "[[fault]]\nat_s = 1\nkind = 'reset'\nid = 1";
    let mut world = world_with_faults(dynamixel_bus(vec![servo("XM430-W210", 1)]), script);
    dynamixel_write(&mut world, 1, 31, &[60]);
    dynamixel_write(&mut world, 1, 64, &[1]);
    dynamixel_write(&mut world, 1, 100, &[100, 0]);
    world.advance_to(S + 2 * MS);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])), []);
    world.advance_to(4 * S);
    assert_ne!(exchange(&mut world, &dynamixel(1, &[1])), []);
    // Temperature limit, torque, goal PWM.
    let registers = [31, 64, 100, 101].map(|address| world.register(0, 1, address));
    assert_eq!(registers, [60, 0, 0x75, 0x03].map(Some));
}
