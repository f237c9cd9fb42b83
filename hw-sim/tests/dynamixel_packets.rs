//! Dynamixel packets through a world, byte for byte. Vectors: ROBOTIS e-manual, Protocol 2.0.

mod common;
use common::*;
use hw_sim::{BusConfig, World};

const DATA_RANGE: u8 = 4;
const DATA_LENGTH: u8 = 5;
const ACCESS: u8 = 7;

fn one(model: &str) -> World {
    world(dynamixel_bus(vec![servo(model, 1)]))
}

fn status(id: u8, error: u8, data: &[u8]) -> Vec<u8> {
    dynamixel(id, &[&[0x55, error], data].concat())
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
fn read_present_position_of_the_e_manual() {
    let mut config = servo("XM430-W210", 1);
    config.position_counts = 166.0;
    let mut world = world(dynamixel_bus(vec![config]));
    let read = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x02, 0x84, 0x00, 0x04, 0x00, 0x1D, 0x15];
    let reply = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x08, 0x00, 0x55, 0x00, 0xA6, 0x00, 0x00, 0x00, 0x8C, 0xC0];
    assert_eq!(exchange(&mut world, &read), reply);
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
    for instruction in [0x04, 0x05, 0x06, 0x08, 0x10, 0x20, 0x92, 0x93, 0x9A, 0x77] {
        assert_eq!(exchange(&mut one("XM430-W210"), &dynamixel(1, &[instruction])), status(1, 2, &[]));
    }
}

#[test]
fn refusals_name_their_reason() {
    let mut world = one("XM430-W210");
    let mut write = |address: u8, data: &[u8]| dynamixel_write(&mut world, 1, address, data)[8];
    assert_eq!(write(132, &goal(5)), ACCESS, "read only");
    assert_eq!(write(14, &[0]), ACCESS, "undefined");
    assert_eq!(write(116, &[0, 0]), DATA_LENGTH, "half a register");
    assert_eq!(write(116, &[]), DATA_LENGTH, "nothing");
    assert_eq!(write(116, &goal(4096)), DATA_RANGE, "past the position limit");
    assert_eq!(write(116, &goal(-1)), DATA_RANGE, "below the position limit");
    assert_eq!(write(100, &886i16.to_le_bytes()), DATA_RANGE, "past the PWM limit");
    assert_eq!(write(36, &500i16.to_le_bytes()), 0);
    assert_eq!(write(100, &501i16.to_le_bytes()), DATA_RANGE, "past the new PWM limit");
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
    assert_eq!(dynamixel_write(&mut world, 1, 112, &block)[8], DATA_RANGE);
    assert_eq!(world.register(0, 1, 112), Some(0));
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
fn a_missing_servo_ends_a_fast_sync_read_at_its_place_and_a_sync_read_goes_on() {
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
