//! Dynamixel packets through a world, byte for byte. Vectors: ROBOTIS e-manual, Protocol 2.0.

mod common;
use common::x_series::{ACCESS, DATA_LENGTH, DATA_LIMIT, DATA_RANGE, status};
use common::*;
use hw_sim::{BusConfig, World};

fn one(model: &str) -> World {
    world(dynamixel_bus(vec![servo(model, 1)]))
}

fn goal(counts: i32) -> [u8; 4] {
    counts.to_le_bytes()
}

#[test]
fn ping_of_the_e_manual() {
    // The manual's reply is of firmware 38; byte 12 and the CRC after it are ours.
    let ping = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E];
    let reply = exchange(&mut one("XM430-W210"), &ping);
    assert_eq!(reply[..11], [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00, 0x06, 0x04]);
    assert_eq!(reply, status(1, 0, &[0x06, 0x04, 46]));
}

#[test]
fn torque_on_as_robotis_support_spells_it() {
    let mut world = one("XM430-W210");
    let torque_on = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x06, 0x00, 0x03, 0x40, 0x00, 0x01, 0xDB, 0x66];
    assert_eq!(exchange(&mut world, &torque_on), status(1, 0, &[]));
    assert!(world.shaft(0, 1).unwrap().torque_on);
}

#[test]
fn broadcast_ping_is_answered_by_all_in_order_of_id_and_broadcast_write_by_none() {
    let mut world = world(dynamixel_bus(vec![servo("XM430-W350", 7), servo("XL430-W250", 3)]));
    let ping = [0xFF, 0xFF, 0xFD, 0x00, 0xFE, 0x03, 0x00, 0x01, 0x31, 0x42];
    // 12 V is within both models' limits.
    let expected = [status(3, 0, &[0x24, 0x04, 46]), status(7, 0, &[0xFC, 0x03, 46])].concat();
    assert_eq!(exchange(&mut world, &ping), expected);
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &[3, 65, 0, 1])), []);
    assert_eq!(world.register(0, 3, 65), Some(1));
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &[2, 65, 0, 1, 0])), []);
}

#[test]
fn unknown_instructions_get_error_2() {
    let known = [0x01..=0x06, 0x08..=0x08, 0x10..=0x10, 0x20..=0x20, 0x55..=0x55];
    let mut world = one("XM430-W210");
    for instruction in (0..=0xFF).filter(|instruction| !known.iter().any(|known| known.contains(instruction)))
    {
        let reply = exchange(&mut world, &dynamixel(1, &[instruction]));
        assert_eq!(reply, status(1, 2, &[]), "{instruction:#04x}");
    }
    // So does Action when nothing is registered.
    assert_eq!(exchange(&mut world, &dynamixel(1, &[5])), status(1, 2, &[]));
}

#[test]
fn refusals_name_their_reason() {
    let mut world = one("XM430-W210");
    let mut write = |address: u8, data: &[u8]| dynamixel_write(&mut world, 1, address, data)[8];
    assert_eq!(write(132, &goal(5)), ACCESS, "read only");
    assert_eq!(write(14, &[0]), ACCESS, "undefined");
    assert_eq!(write(116, &[0, 0]), DATA_LENGTH, "half a register");
    assert_eq!(write(116, &[]), DATA_LENGTH, "nothing");
    assert_eq!(write(116, &goal(4096)), DATA_LIMIT, "past the position limit");
    assert_eq!(write(116, &goal(-1)), DATA_LIMIT, "below the position limit");
    assert_eq!(write(116, &goal(1_048_576)), DATA_RANGE, "past 256 turns");
    assert_eq!(write(36, &500i16.to_le_bytes()), 0);
    assert_eq!(write(100, &501i16.to_le_bytes()), DATA_LIMIT, "past the new PWM limit");
    assert_eq!(write(64, &[1]), 0);
    assert_eq!(write(36, &885i16.to_le_bytes()), ACCESS, "EEPROM under torque");
    assert_eq!(write(116, &goal(4095)), 0);
    assert_eq!(dynamixel_read(&mut world, 1, 147, 2)[8], ACCESS, "read past a gap");
    assert_eq!(dynamixel_read(&mut world, 1, 132, 0)[8], DATA_LENGTH, "read of nothing");
}

#[test]
fn a_refused_block_changes_nothing() {
    let mut world = one("XM430-W210");
    // Profile velocity is good, the goal behind it is not.
    let block = [&100u32.to_le_bytes()[..], &goal(9999)].concat();
    assert_eq!(dynamixel_write(&mut world, 1, 112, &block)[8], DATA_LIMIT);
    assert_eq!(world.register(0, 1, 112), Some(0));
}

#[test]
fn every_register_accepts_the_range_of_the_manual() {
    // Address, size, lowest and highest number taken in position mode, and what those next to them get.
    let limited = DATA_LIMIT;
    let rows: &[(u8, usize, i32, i32, u8)] = &[
        (7, 1, 0, 252, DATA_RANGE),
        (9, 1, 0, 254, DATA_RANGE),
        (20, 4, -1_044_479, 1_044_479, DATA_RANGE),
        (24, 4, 0, 1023, DATA_RANGE),
        (31, 1, 0, 100, DATA_RANGE),
        (32, 2, 95, 160, DATA_RANGE),
        (36, 2, 0, 885, DATA_RANGE),
        (38, 2, 0, 1193, DATA_RANGE),
        (44, 4, 0, 1023, DATA_RANGE),
        (48, 4, 0, 4095, DATA_RANGE),
        (60, 1, 0, 3, DATA_RANGE),
        (64, 1, 0, 1, DATA_RANGE),
        (68, 1, 0, 2, DATA_RANGE),
        (84, 2, 0, 16_383, DATA_RANGE),
        (98, 1, 0, 127, DATA_RANGE),
        (100, 2, -885, 885, DATA_RANGE),
        (104, 4, -330, 330, limited),
        (108, 4, 0, 32_767, DATA_RANGE),
        (116, 4, 0, 4095, limited),
    ];
    for &(address, size, low, high, error) in rows {
        for (value, expected) in [(low, 0), (high, 0), (low - 1, error), (high + 1, error)] {
            let mut world = one("XM430-W210");
            // The id may change under which it would answer later; the status is still of id 1.
            let reply = dynamixel_write(&mut world, 1, address, &value.to_le_bytes()[..size]);
            // One byte below 0 is one of the highest numbers of an unsigned register.
            assert_eq!(reply[8], expected, "{value} to {address}");
        }
    }
    // 12 V are too much for the XL330, and bit 7 says so.
    let mode = |model: &str, mode: u8| dynamixel_write(&mut one(model), 1, 11, &[mode])[8] & 0x7F;
    for number in 0..=20 {
        let with_current = if matches!(number, 0 | 1 | 3 | 4 | 5 | 16) { 0 } else { DATA_RANGE };
        let without = if matches!(number, 1 | 3 | 4 | 16) { 0 } else { DATA_RANGE };
        for model in ["XL330-M288", "XM430-W210", "XM430-W350"] {
            assert_eq!(mode(model, number), with_current, "{model} {number}");
        }
        assert_eq!(mode("XL430-W250", number), without, "XL430 {number}");
    }
}

#[test]
fn profile_registers_that_hold_times_take_slightly_smaller_values() {
    for (drive_mode, highest) in [(0, 32_767u32), (4, 32_737)] {
        let mut world = one("XM430-W210");
        dynamixel_write(&mut world, 1, 10, &[drive_mode]);
        for address in [108, 112] {
            assert_eq!(dynamixel_write(&mut world, 1, address, &highest.to_le_bytes())[8], 0);
            assert_eq!(dynamixel_write(&mut world, 1, address, &(highest + 1).to_le_bytes())[8], DATA_RANGE);
        }
    }
}

#[test]
fn a_limit_written_is_the_new_value_of_its_goal_and_of_no_other() {
    let mut world = one("XM430-W210");
    dynamixel_write(&mut world, 1, 100, &200u16.to_le_bytes());
    dynamixel_write(&mut world, 1, 38, &500u16.to_le_bytes());
    assert_eq!(dynamixel_read(&mut world, 1, 100, 4)[9..13], [200, 0, 0xF4, 1]);
    dynamixel_write(&mut world, 1, 36, &700u16.to_le_bytes());
    assert_eq!(dynamixel_read(&mut world, 1, 100, 4)[9..13], [0xBC, 2, 0xF4, 1]);
}

#[test]
fn model_numbers_and_line_rates() {
    for (model, number, highest_baud) in
        [("XL330-M288", 1200, 6), ("XL430-W250", 1060, 7), ("XM430-W210", 1030, 7), ("XM430-W350", 1020, 7)]
    {
        let mut world = one(model);
        let [low, high] = u16::to_le_bytes(number);
        assert_eq!(exchange(&mut world, &dynamixel(1, &[1]))[9..11], [low, high], "{model}");
        assert_eq!(dynamixel_write(&mut world, 1, 8, &[highest_baud + 1])[8] & 0x7F, DATA_RANGE, "{model}");
        assert_eq!(dynamixel_write(&mut world, 1, 8, &[highest_baud])[8] & 0x7F, 0, "{model}");
    }
}

#[test]
fn a_request_with_a_bad_crc_gets_error_3_from_the_servo_it_names_and_does_nothing() {
    let mut world = world(dynamixel_bus(vec![servo("XM430-W210", 1), servo("XM430-W210", 2)]));
    let mut led_on = dynamixel(1, &[3, 65, 0, 1]);
    *led_on.last_mut().unwrap() ^= 1;
    assert_eq!(exchange(&mut world, &led_on), status(1, 3, &[]));
    assert_eq!(world.register(0, 1, 65), Some(0));
    led_on[4] = 0xFE;
    assert_eq!(exchange(&mut world, &led_on), [], "nobody answers for all");
    // The next good packet is understood.
    assert_eq!(dynamixel_write(&mut world, 1, 65, &[1]), status(1, 0, &[]));
}

#[test]
fn reg_write_is_refused_as_a_write_would_be_and_the_last_one_counts() {
    let mut world = one("XM430-W210");
    let reg_write = |world: &mut World, address: u8, data: &[u8]| {
        exchange(world, &dynamixel(1, &[&[4, address, 0], data].concat()))[8]
    };
    assert_eq!(reg_write(&mut world, 132, &goal(1)), ACCESS);
    assert_eq!(reg_write(&mut world, 116, &goal(5000)), DATA_LIMIT);
    assert_eq!(world.register(0, 1, 69), Some(0));
    assert_eq!(reg_write(&mut world, 116, &goal(1000)), 0);
    assert_eq!(reg_write(&mut world, 36, &500u16.to_le_bytes()), 0);
    // Torque on locks the EEPROM, the target of the registered write.
    dynamixel_write(&mut world, 1, 64, &[1]);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[5])), status(1, ACCESS, &[]));
    assert_eq!(world.register(0, 1, 69), Some(0));
    assert_eq!(exchange(&mut world, &dynamixel(1, &[5])), status(1, 2, &[]), "it is gone");
}

#[test]
fn a_broadcast_action_is_carried_out_by_all_at_once_and_gets_no_answer() {
    let mut world = world(dynamixel_bus((1..=3).map(|id| servo("XM430-W210", id)).collect()));
    for id in 1..=3 {
        exchange(&mut world, &dynamixel(id, &[4, 65, 0, 1]));
    }
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &[5])), []);
    for id in 1..=3 {
        assert_eq!(world.register(0, id, 65), Some(1));
    }
}

/// The example of the e-manual, Secondary (Shadow) ID.
#[test]
fn a_secondary_id_is_obeyed_in_silence() {
    let mut world = world(dynamixel_bus((1..=5).map(|id| servo("XM430-W210", id)).collect()));
    let led = |world: &World| (1..=5).map(|id| world.register(0, id, 65).unwrap()).collect::<Vec<_>>();
    for id in 1..=5 {
        dynamixel_write(&mut world, id, 12, &[5]);
    }
    assert_eq!(dynamixel_write(&mut world, 1, 65, &[1]), status(1, 0, &[]));
    assert_eq!(led(&world), [1, 0, 0, 0, 0]);
    assert_eq!(dynamixel_write(&mut world, 5, 65, &[1]), status(5, 0, &[]), "the one whose own id it is");
    assert_eq!(led(&world), [1; 5]);
    for id in 1..=5 {
        dynamixel_write(&mut world, id, 12, &[100]);
    }
    assert_eq!(dynamixel_write(&mut world, 100, 65, &[0]), []);
    assert_eq!(led(&world), [0; 5]);
    // Nor is a ping of it answered, and its EEPROM is out of reach.
    assert_eq!(exchange(&mut world, &dynamixel(100, &[1])), []);
    dynamixel_write(&mut world, 100, 31, &[60]);
    assert_eq!(world.register(0, 1, 31), Some(80));
    // A sync write reaches a group too.
    exchange(&mut world, &dynamixel(0xFE, &[0x83, 65, 0, 1, 0, 100, 1]));
    assert_eq!(led(&world), [1; 5]);
    // From 253 on there is no secondary id.
    dynamixel_write(&mut world, 1, 12, &[253]);
    dynamixel_write(&mut world, 253, 65, &[0]);
    assert_eq!(led(&world), [1; 5]);
}

#[test]
fn bulk_instructions_have_an_address_per_servo_and_skip_truncated_items() {
    let mut world = world(dynamixel_bus(vec![servo("XM430-W210", 1), servo("XM430-W210", 2)]));
    // To 1: LED. To 2: goal 700. A third whose data are missing.
    let mut rows = vec![0x93, 1, 65, 0, 1, 0, 1, 2, 116, 0, 4, 0];
    rows.extend(goal(700));
    rows.extend([1, 116, 0, 4, 0, 9]);
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &rows)), []);
    assert_eq!((world.register(0, 1, 65), world.register(0, 1, 116)), (Some(1), Some(0)));
    // One that is not there takes its time and the next goes on; one that refuses says why.
    let read = [0x92, 2, 116, 0, 4, 0, 9, 0, 0, 1, 0, 1, 14, 0, 1, 0];
    let replies = exchange(&mut world, &dynamixel(0xFE, &read));
    assert_eq!(replies, [status(2, 0, &goal(700)), status(1, ACCESS, &[])].concat());
}

#[test]
fn a_fast_read_gives_a_refusal_in_its_block() {
    let mut world = world(dynamixel_bus(vec![servo("XM430-W210", 1), servo("XM430-W210", 2)]));
    let fast = exchange(&mut world, &dynamixel(0xFE, &[0x9A, 1, 14, 0, 1, 0, 2, 65, 0, 1, 0]));
    assert_eq!(fast.len(), 8 + 2 * 5);
    assert_eq!(fast[8..11], [ACCESS, 1, 0]);
    assert_eq!(fast[13..16], [0, 2, 0]);
    let (body, check) = fast.split_at(fast.len() - 2);
    assert_eq!(check, crc(body).to_le_bytes());
}

#[test]
fn group_instructions_for_one_id_are_unknown() {
    for instruction in [0x82, 0x83, 0x8A, 0x92, 0x93, 0x9A] {
        let reply = exchange(&mut one("XM430-W210"), &dynamixel(1, &[instruction, 65, 0, 1, 0, 1]));
        assert_eq!(reply, status(1, 2, &[]));
    }
}

#[test]
fn xl430_has_no_current_registers() {
    let mut world = one("XL430-W250");
    assert_eq!(dynamixel_read(&mut world, 1, 38, 2)[8], ACCESS);
    assert_eq!(dynamixel_write(&mut world, 1, 102, &[1, 0])[8], ACCESS);
    assert_eq!(dynamixel_write(&mut world, 1, 11, &[5])[8], DATA_RANGE);
}

#[test]
fn status_return_level() {
    let mut world = one("XM430-W210");
    dynamixel_write(&mut world, 1, 68, &[1]);
    assert_eq!(dynamixel_write(&mut world, 1, 65, &[1]), []);
    assert_eq!(dynamixel_read(&mut world, 1, 65, 1), status(1, 0, &[1]));
    dynamixel_write(&mut world, 1, 68, &[0]);
    assert_eq!(dynamixel_read(&mut world, 1, 65, 1), []);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])), status(1, 0, &[0x06, 0x04, 46]));
}

#[test]
fn a_servo_obeys_at_any_status_return_level_and_answers_according_to_it() {
    let mut world = one("XM430-W210");
    // The write that silences it is answered as it was before.
    assert_eq!(dynamixel_write(&mut world, 1, 68, &[0]), status(1, 0, &[]));
    for body in [&[4u8, 65, 0, 1][..], &[5], &[0x77], &[2, 65, 0, 1, 0], &[3, 132, 0, 1]] {
        assert_eq!(exchange(&mut world, &dynamixel(1, body)), []);
    }
    assert_eq!(world.register(0, 1, 65), Some(1));
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &[0x82, 65, 0, 1, 0, 1])), []);
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &[0x8A, 65, 0, 1, 0, 1])), []);
}

#[test]
fn sync_write_and_both_sync_reads() {
    let mut world = world(dynamixel_bus((1..=3).map(|id| servo("XM430-W210", id)).collect()));
    let mut body = vec![0x83, 116, 0, 4, 0];
    for id in 1..=3 {
        body.push(id);
        body.extend(goal(1000 + i32::from(id)));
    }
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &body)), []);
    let replies = exchange(&mut world, &dynamixel(0xFE, &[0x82, 116, 0, 4, 0, 3, 1, 2]));
    let expected = [3, 1, 2].map(|id| status(id, 0, &goal(1000 + i32::from(id)))).concat();
    assert_eq!(replies, expected);
    assert_eq!(replies.len(), 3 * (11 + 4));

    let fast = exchange(&mut world, &dynamixel(0xFE, &[0x8A, 116, 0, 4, 0, 3, 1, 2]));
    let mut expected = vec![0xFF, 0xFF, 0xFD, 0x00, 0xFE, 25, 0, 0x55];
    for id in [3, 1, 2] {
        expected.extend([0, id]);
        expected.extend(goal(1000 + i32::from(id)));
        expected.extend(crc(&expected).to_le_bytes());
    }
    assert_eq!(fast, expected);
    assert_eq!(fast.len(), 8 + 3 * (4 + 4));
}

#[test]
fn a_missing_servo_ends_a_fast_sync_read_but_not_a_sync_read() {
    let mut world = world(dynamixel_bus(vec![servo("XM430-W210", 1), servo("XM430-W210", 2)]));
    let fast = exchange(&mut world, &dynamixel(0xFE, &[0x8A, 65, 0, 1, 0, 1, 9, 2]));
    assert_eq!(fast.len(), 8 + 5);
    assert_eq!(fast[8..11], [0, 1, 0]);
    let plain = exchange(&mut world, &dynamixel(0xFE, &[0x82, 65, 0, 1, 0, 1, 9, 2]));
    assert_eq!(plain, [status(1, 0, &[0]), status(2, 0, &[0])].concat());
}

#[test]
fn replies_are_stuffed() {
    let mut world = one("XM430-W210");
    // Indirect data hold any byte: FF FF FD must come back as FF FF FD FD.
    let mut write = vec![0xFF, 0xFF, 0xFD, 0x00, 1, 9, 0, 3, 224, 0, 0xFF, 0xFF, 0xFD, 0xFD];
    write.extend(crc(&write).to_le_bytes());
    assert_eq!(exchange(&mut world, &write), status(1, 0, &[]));
    assert_eq!(dynamixel_read(&mut world, 1, 224, 3), status(1, 0, &[0xFF, 0xFF, 0xFD, 0xFD]));
}

#[test]
fn two_s_complement_below_zero_with_torque_off_and_one_turn_with_torque_on() {
    let mut config = servo("XM430-W210", 1);
    config.position_counts = -5.0;
    let mut world = world(dynamixel_bus(vec![config]));
    // At power-on in position mode the register is an angle within one turn.
    assert_eq!(dynamixel_read(&mut world, 1, 132, 4), status(1, 0, &goal(4091)));
    dynamixel_write(&mut world, 1, 20, &goal(-4200));
    dynamixel_write(&mut world, 1, 11, &[4]);
    assert_eq!(dynamixel_read(&mut world, 1, 132, 4), status(1, 0, &goal(-109)));
}

#[test]
fn a_servo_set_to_another_baud_falls_silent() {
    let mut world = one("XM430-W210");
    assert_ne!(exchange(&mut world, &dynamixel(1, &[1])), []);
    assert_eq!(dynamixel_write(&mut world, 1, 8, &[1]), status(1, 0, &[]));
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])), []);
}

#[test]
fn voltage_outside_the_limits_raises_the_alert_bit_and_shuts_down_the_models_whose_mask_says_so() {
    let bus = dynamixel_bus(vec![servo("XM430-W210", 1), servo("XL330-M288", 2)]);
    let mut world = world(BusConfig { supply_v: 8.0, ..bus });
    for id in [1, 2] {
        assert_eq!(dynamixel_read(&mut world, id, 70, 1), status(id, 0x80, &[1]));
    }
    // Shutdown is 52 on the XM430: no voltage bit. On the XL330 it is 53.
    assert_eq!(dynamixel_write(&mut world, 1, 64, &[1]), status(1, 0x80, &[]));
    assert!(world.shaft(0, 1).unwrap().torque_on);
    assert_eq!(dynamixel_write(&mut world, 2, 64, &[1]), status(2, 0x81, &[]));
    assert!(!world.shaft(0, 2).unwrap().torque_on);
}
