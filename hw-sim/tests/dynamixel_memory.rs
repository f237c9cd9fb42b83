//! Registers that Dynamixel servos keep and lose: reboot, factory reset, backup, startup configuration, clear.
//! Facts: ROBOTIS e-manual, Protocol 2.0 and X-series.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::x_series::*;
use common::*;
use hw_sim::World;

const MODELS: [&str; 4] = ["XL330-M288", "XL430-W250", "XM430-W210", "XM430-W350"];
const BACKUP: [u8; 6] = [0x20, 1, 0x43, 0x54, 0x52, 0x4C];
const RESTORE: [u8; 6] = [0x20, 2, 0x43, 0x54, 0x52, 0x4C];
const CLEAR: [u8; 6] = [0x10, 1, 0x44, 0x58, 0x4C, 0x22];

/// Longer than a servo needs to start: 0.4 s were measured (ROBOTIS-GIT/emanual#1698).
const START_NS: u64 = 600 * MS;

fn wait_for_start(world: &mut World) {
    world.advance_to(world.now_ns() + START_NS);
}

#[test]
fn a_reboot_answers_at_once_then_the_servo_is_silent_and_ram_is_reset() {
    for model in MODELS {
        let mut world = one_at(model, 2048.0);
        write(&mut world, 31, &[60]);
        write(&mut world, 65, &[1]);
        write(&mut world, 84, &[1, 0]);
        tell(&mut world, &[4, 65, 0, 1]);
        write(&mut world, 64, &[1]);
        assert!(world.shaft(0, 1).unwrap().torque_on);
        assert_eq!(exchange(&mut world, &dynamixel(1, &[8])), status(1, 0, &[]), "{model}");
        assert!(!world.shaft(0, 1).unwrap().torque_on);
        world.advance_to(world.now_ns() + 200 * MS);
        assert_eq!(exchange(&mut world, &dynamixel(1, &[1])), [], "{model}: it is starting");
        wait_for_start(&mut world);
        assert_eq!(exchange(&mut world, &dynamixel(1, &[1])).len(), 14);
        assert_eq!(read(&mut world, 31, 1), [60], "{model}: EEPROM stays");
        let factory_p: u16 = match model {
            "XL330-M288" => 400,
            "XL430-W250" => 640,
            _ => 800,
        };
        assert_eq!(read(&mut world, 84, 2), factory_p.to_le_bytes());
        assert_eq!((read(&mut world, 64, 1), read(&mut world, 65, 1)), (vec![0], vec![0]));
        assert_eq!(read(&mut world, 69, 1), [0], "what was registered is gone");
        assert_eq!(tell(&mut world, &[5]), 2);
    }
}

#[test]
fn the_tick_register_begins_at_the_start_and_wraps() {
    let mut world = one_at("XM430-W210", 2048.0);
    let tick = |world: &World| get(world, 120, 2);
    world.advance_to(1_500 * MS);
    assert_eq!(tick(&world), 1_500);
    world.advance_to(32_767 * MS);
    assert_eq!(tick(&world), 32_767);
    world.advance_to(32_768 * MS);
    assert_eq!(tick(&world), 0);
    world.host_send(0, &dynamixel(1, &[8])).unwrap();
    world.advance_to(world.now_ns() + 1_000 * MS);
    let after = tick(&world);
    assert!((300..800).contains(&after), "{after}");
}

#[test]
fn a_reboot_clears_a_shutdown() {
    let hot = "[[fault]]\nat_s = 0.1\nfor_s = 0.1\nkind = 'hot'\ncelsius = 90";
    let mut world = world_with_faults(dynamixel_bus(vec![servo("XM430-W210", 1)]), hot);
    write(&mut world, 64, &[1]);
    world.advance_to(150 * MS);
    assert!(!world.shaft(0, 1).unwrap().torque_on);
    assert_eq!(get(&world, 70, 1), 4);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1]))[8], 0x80, "alert");
    world.advance_to(300 * MS);
    assert_eq!(write(&mut world, 64, &[1]), 0x80 | RESULT_FAIL);
    // The simulated heat goes away slowly; the limit can be raised.
    write(&mut world, 31, &[100]);
    tell(&mut world, &[8]);
    wait_for_start(&mut world);
    assert_eq!(write(&mut world, 64, &[1]), 0);
    assert!(world.shaft(0, 1).unwrap().torque_on);
}

#[test]
fn factory_reset_keeps_the_registers_of_its_option() {
    for (option, id, baud) in [(0xFF, 1, 57_600), (0x01, 9, 57_600), (0x02, 9, 1_000_000)] {
        let mut world = world(dynamixel_bus(vec![servo("XM430-W210", 9)]));
        dynamixel_write(&mut world, 9, 31, &[60]);
        dynamixel_write(&mut world, 9, 10, &[1]);
        assert_eq!(exchange(&mut world, &dynamixel(9, &[6, option])), status(9, 0, &[]));
        assert_eq!(exchange(&mut world, &dynamixel(9, &[1])), [], "it is starting");
        wait_for_start(&mut world);
        world.set_host_baud(0, if baud == 57_600 { 1_000_000 } else { 57_600 });
        assert_eq!(exchange(&mut world, &dynamixel(id, &[1])), [], "{option}: another rate");
        world.set_host_baud(0, baud);
        assert_eq!(exchange(&mut world, &dynamixel(id, &[1])), status(id, 0, &[0x06, 0x04, 46]));
        // Temperature limit, drive mode and return delay as shipped.
        assert_eq!(dynamixel_read(&mut world, id, 31, 1)[9], 80);
        assert_eq!(dynamixel_read(&mut world, id, 9, 2)[9..11], [250, 0]);
    }
}

#[test]
fn a_broadcast_factory_reset_is_ignored() {
    let mut world = world(dynamixel_bus(vec![servo("XM430-W210", 8), servo("XM430-W210", 9)]));
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &[6, 0xFF])), []);
    assert_eq!(exchange(&mut world, &dynamixel(9, &[1])).len(), 14);
    // With another option it is, by all.
    dynamixel_write(&mut world, 8, 31, &[60]);
    dynamixel_write(&mut world, 9, 31, &[60]);
    assert_eq!(exchange(&mut world, &dynamixel(0xFE, &[6, 2])), []);
    wait_for_start(&mut world);
    assert_eq!((world.register(0, 8, 31), world.register(0, 9, 31)), (Some(80), Some(80)));
    let reply = exchange(&mut world, &dynamixel(9, &[6, 3]));
    assert_eq!(reply, status(9, DATA_RANGE, &[]), "no such option");
    assert_eq!(exchange(&mut world, &dynamixel(9, &[6])), status(9, DATA_LENGTH, &[]));
}

#[test]
fn a_backup_restores_the_eeprom_and_with_ram_restore_part_of_the_ram() {
    for (startup, p_gain, pointer, led) in [(0, 800, 224, 0), (2, 300, 65, 0)] {
        let mut world = one_at("XM430-W210", 2048.0);
        assert_eq!(tell(&mut world, &RESTORE), RESULT_FAIL, "there is none");
        assert_eq!(get(&world, 147, 1), 0);
        write(&mut world, 60, &[startup]);
        write(&mut world, 31, &[60]);
        write(&mut world, 84, &300u16.to_le_bytes());
        write(&mut world, 112, &[77, 0, 0, 0]);
        write(&mut world, 168, &[65, 0]);
        write(&mut world, 65, &[1]);
        assert_eq!(tell(&mut world, &BACKUP), 0);
        assert_eq!(get(&world, 147, 1), 1);
        write(&mut world, 31, &[50]);
        write(&mut world, 84, &400u16.to_le_bytes());
        assert_eq!(tell(&mut world, &RESTORE), 0);
        wait_for_start(&mut world);
        assert_eq!(read(&mut world, 31, 1), [60]);
        assert_eq!(read(&mut world, 147, 1), [1], "the backup outlives the reboot");
        assert_eq!(read(&mut world, 84, 2), u16::to_le_bytes(p_gain));
        assert_eq!(read(&mut world, 112, 1), [if startup == 2 { 77 } else { 0 }]);
        assert_eq!(read(&mut world, 168, 2), u16::to_le_bytes(pointer));
        assert_eq!(read(&mut world, 65, 1), [led], "the LED is no part of it");
    }
}

#[test]
fn a_backup_needs_torque_off_and_its_key() {
    let mut world = one_at("XM430-W210", 2048.0);
    assert_eq!(tell(&mut world, &[0x20, 1, 0x43, 0x54, 0x52, 0x4D]), DATA_RANGE);
    assert_eq!(tell(&mut world, &[0x20, 3, 0x43, 0x54, 0x52, 0x4C]), DATA_RANGE);
    assert_eq!(tell(&mut world, &[0x20, 1]), DATA_LENGTH);
    write(&mut world, 64, &[1]);
    assert_eq!(tell(&mut world, &BACKUP), RESULT_FAIL);
    assert_eq!(get(&world, 147, 1), 0);
}

#[test]
fn startup_torque_on_holds_the_shaft_where_it_is() {
    let mut world = one_at("XM430-W210", 2048.0);
    write(&mut world, 60, &[1]);
    tell(&mut world, &[8]);
    world.advance_to(world.now_ns() + 100 * MS);
    assert!(!world.shaft(0, 1).unwrap().torque_on, "not while it starts");
    wait_for_start(&mut world);
    let shaft = world.shaft(0, 1).unwrap();
    assert!(shaft.torque_on);
    assert!((shaft.position_counts - 2048.0).abs() < 1.0);
    assert_eq!(read(&mut world, 64, 1), [1]);
    assert_eq!(write(&mut world, 116, &3000i32.to_le_bytes()), 0);
    world.advance_to(world.now_ns() + S);
    assert!((world.shaft(0, 1).unwrap().position_counts - 3000.0).abs() < 15.0);
}

#[test]
fn clear_forgets_turns_if_the_shaft_stands_and_does_not_move_it() {
    let mut config = servo("XM430-W210", 1);
    config.position_counts = 500.0;
    let mut world = world(dynamixel_bus(vec![config]));
    write(&mut world, 11, &[4]);
    write(&mut world, 64, &[1]);
    write(&mut world, 116, &(500i32 + 2 * 4096).to_le_bytes());
    assert_eq!(tell(&mut world, &CLEAR), RESULT_FAIL, "it is moving");
    world.advance_to(world.now_ns() + 5 * S);
    let before = world.shaft(0, 1).unwrap().position_counts;
    assert!((before - 8692.0).abs() < 15.0);
    assert!((get(&world, 132, 4) - 8692).abs() < 15);
    assert_eq!(tell(&mut world, &CLEAR), 0);
    assert!((get(&world, 132, 4) - 500).abs() < 15);
    world.advance_to(world.now_ns() + S);
    assert!((world.shaft(0, 1).unwrap().position_counts - before).abs() < 1.0, "it stays where it is");
    // A goal is taken from the new count on.
    write(&mut world, 116, &1000i32.to_le_bytes());
    world.advance_to(world.now_ns() + S);
    assert!((world.shaft(0, 1).unwrap().position_counts - 9192.0).abs() < 15.0);
    assert_eq!(tell(&mut world, &[0x10, 1, 0x44, 0x58, 0x4C, 0x23]), DATA_RANGE, "wrong key");
    assert_eq!(tell(&mut world, &[0x10, 2, 0x44, 0x58, 0x4C, 0x22]), DATA_RANGE, "nothing else to clear");
    assert_eq!(tell(&mut world, &[0x10, 1]), DATA_LENGTH);
}

#[test]
fn a_servo_set_to_another_protocol_is_deaf() {
    let mut world = one_at("XM430-W210", 2048.0);
    assert_eq!(write(&mut world, 13, &[1]), 0);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])), []);
    let mut world = one_at("XL330-M288", 2048.0);
    assert_eq!(write(&mut world, 13, &[19]), DATA_RANGE);
    assert_eq!(write(&mut world, 13, &[20]), 0, "remote control");
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])), []);
}
