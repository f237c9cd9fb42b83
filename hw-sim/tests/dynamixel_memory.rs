//! What Dynamixel servos keep and what they lose: indirect addresses, reboot, factory reset, backup, startup
//! configuration, clear. Facts: ROBOTIS e-manual, Protocol 2.0 and X-series.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::World;

const RESULT_FAIL: u8 = 1;
const DATA_RANGE: u8 = 4;
const DATA_LENGTH: u8 = 5;
const ACCESS: u8 = 7;
const MODELS: [&str; 4] = ["XL330-M288", "XL430-W250", "XM430-W210", "XM430-W350"];

/// Longer than a servo needs to start: 0.4 s were measured (ROBOTIS-GIT/emanual#1698).
const START_NS: u64 = 600 * MS;

fn one(model: &str) -> World {
    let supply_v = if model.starts_with("XL330") { 5.0 } else { 12.0 };
    world(hw_sim::BusConfig { supply_v, ..dynamixel_bus(vec![servo(model, 1)]) })
}

fn status(id: u8, error: u8, data: &[u8]) -> Vec<u8> {
    dynamixel(id, &[&[0x55, error], data].concat())
}

/// Error field of what comes back.
fn tell(world: &mut World, body: &[u8]) -> u8 {
    exchange(world, &dynamixel(1, body))[8]
}

fn write(world: &mut World, address: u16, data: &[u8]) -> u8 {
    tell(world, &[&[3], &address.to_le_bytes()[..], data].concat())
}

fn read(world: &mut World, address: u16, count: u8) -> Vec<u8> {
    let reply = exchange(world, &dynamixel(1, &[&[2], &address.to_le_bytes()[..], &[count, 0]].concat()));
    assert_eq!(reply[8], 0, "{address}");
    reply[9..reply.len() - 2].to_vec()
}

fn word(world: &World, address: u16, size: u16) -> u32 {
    (0..size).map(|n| u32::from(world.register(0, 1, address + n).unwrap()) << (8 * n)).sum()
}

fn wait_for_start(world: &mut World) {
    world.advance_to(world.now_ns() + START_NS);
}

/// First pair of a model: address register, data byte; and how many pairs it has.
fn indirect(model: &str) -> (u16, u16, u16) {
    if model.starts_with("XL330") { (168, 208, 20) } else { (168, 224, 56) }
}

/// The examples of the e-manual, Indirect Address.
#[test]
fn indirect_data_are_what_they_point_at() {
    for model in MODELS {
        let mut world = one(model);
        let (address, data, _) = indirect(model);
        assert_eq!(write(&mut world, address, &[65, 0]), 0);
        assert_eq!(write(&mut world, data, &[1]), 0);
        assert_eq!(word(&world, 65, 1), 1, "{model}: the LED is on");
        assert_eq!(write(&mut world, data, &[0]), 0);
        assert_eq!(word(&world, 65, 1), 0);
        // The four bytes of Goal Position from the second pair on, in one go with the LED before them.
        assert_eq!(write(&mut world, address + 2, &[116, 0, 117, 0, 118, 0, 119, 0]), 0);
        assert_eq!(write(&mut world, data, &[1, 0x00, 0x04, 0, 0]), 0);
        assert_eq!((word(&world, 65, 1), word(&world, 116, 4)), (1, 1024), "{model}");
        assert_eq!(read(&mut world, data, 5), [1, 0x00, 0x04, 0, 0]);
    }
}

#[test]
fn every_pair_works_in_every_kind_of_read_and_write() {
    for model in MODELS {
        let mut world = one(model);
        let (_, _, pairs) = indirect(model);
        for n in 0..pairs {
            // Past the 28th the other block.
            let (address, data) = match (n, indirect(model)) {
                (28.., _) => (578 + 2 * (n - 28), 634 + n - 28),
                (_, (address, data, _)) => (address + 2 * n, data + n),
            };
            let [low, high] = data.to_le_bytes();
            assert_eq!(read(&mut world, address, 2), [low, high], "{model}: as shipped it stands for itself");
            assert_eq!(write(&mut world, address, &[146, 0]), 0, "{model} pair {n}");
            let celsius = read(&mut world, 146, 1);
            assert_eq!(read(&mut world, data, 1), celsius, "{model} pair {n}");
            if n % 19 == 0 {
                let answer = status(1, 0, &celsius);
                let mut say = |body: &[u8]| exchange(&mut world, &dynamixel(0xFE, body));
                assert_eq!(say(&[0x82, low, high, 1, 0, 1]), answer);
                assert_eq!(say(&[0x92, 1, low, high, 1, 0]), answer);
                assert_eq!(say(&[0x8A, low, high, 1, 0, 1])[10], celsius[0]);
                assert_eq!(say(&[0x9A, 1, low, high, 1, 0])[10], celsius[0]);
                assert_eq!(write(&mut world, data, &[0]), ACCESS, "it is read only, as what it stands for");
                write(&mut world, address, &[65, 0]);
                for (value, body) in
                    [(1, &[0x83, low, high, 1, 0, 1, 1][..]), (0, &[0x93, 1, low, high, 1, 0, 0])]
                {
                    exchange(&mut world, &dynamixel(0xFE, body));
                    assert_eq!(word(&world, 65, 1), value);
                }
                tell(&mut world, &[4, low, high, 1]);
                tell(&mut world, &[5]);
                assert_eq!(word(&world, 65, 1), 1);
            }
        }
    }
}

#[test]
fn indirect_data_take_on_size_range_and_access_of_what_they_stand_for() {
    let mut world = one("XM430-W210");
    // Goal Position, but its bytes in the wrong order; then a piece of it only.
    write(&mut world, 168, &[116, 0, 118, 0, 117, 0, 119, 0]);
    assert_eq!(write(&mut world, 224, &[0, 4, 0, 0]), DATA_LENGTH);
    write(&mut world, 168, &[116, 0, 117, 0, 118, 0, 119, 0]);
    assert_eq!(write(&mut world, 224, &[0, 4]), DATA_LENGTH);
    assert_eq!(write(&mut world, 224, &[0, 0x10, 0, 0]), 6, "4096 is past the position limit");
    assert_eq!(word(&world, 116, 4), word(&world, 132, 4), "nothing was written");
    // A gap of the table.
    write(&mut world, 168, &[66, 0]);
    assert_eq!(write(&mut world, 224, &[1]), ACCESS);
    // EEPROM cannot be pointed at, nor what is past the table.
    assert_eq!(write(&mut world, 168, &[63, 0]), DATA_RANGE);
    assert_eq!(write(&mut world, 168, &[0x96, 0x02]), DATA_RANGE, "662");
    // Data that point at data mean that byte, not what it points at in its turn.
    write(&mut world, 170, &[65, 0]);
    write(&mut world, 168, &[225, 0]);
    assert_eq!(write(&mut world, 224, &[1]), 0);
    assert_eq!(word(&world, 65, 1), 0);
}

#[test]
fn a_reboot_answers_at_once_then_the_servo_is_away_and_ram_is_as_at_power_on() {
    for model in MODELS {
        let mut world = one(model);
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
fn the_clock_of_a_servo_begins_with_its_start_and_wraps() {
    let mut world = one("XM430-W210");
    let tick = |world: &World| word(world, 120, 2);
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
fn a_reboot_is_the_way_out_of_a_shutdown() {
    let hot = "[[fault]]\nat_s = 0.1\nfor_s = 0.1\nkind = 'hot'\ncelsius = 90";
    let mut world = world_with_faults(dynamixel_bus(vec![servo("XM430-W210", 1)]), hot);
    write(&mut world, 64, &[1]);
    world.advance_to(150 * MS);
    assert!(!world.shaft(0, 1).unwrap().torque_on);
    assert_eq!(word(&world, 70, 1), 4);
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
fn factory_reset_spares_what_its_option_says() {
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
fn factory_reset_of_all_ids_at_once_is_not_done() {
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

const BACKUP: [u8; 6] = [0x20, 1, 0x43, 0x54, 0x52, 0x4C];
const RESTORE: [u8; 6] = [0x20, 2, 0x43, 0x54, 0x52, 0x4C];

#[test]
fn a_backup_brings_the_eeprom_back_and_with_ram_restore_some_of_ram_too() {
    for (startup, p_gain, pointer, led) in [(0, 800, 224, 0), (2, 300, 65, 0)] {
        let mut world = one("XM430-W210");
        assert_eq!(tell(&mut world, &RESTORE), RESULT_FAIL, "there is none");
        assert_eq!(word(&world, 147, 1), 0);
        write(&mut world, 60, &[startup]);
        write(&mut world, 31, &[60]);
        write(&mut world, 84, &300u16.to_le_bytes());
        write(&mut world, 112, &[77, 0, 0, 0]);
        write(&mut world, 168, &[65, 0]);
        write(&mut world, 65, &[1]);
        assert_eq!(tell(&mut world, &BACKUP), 0);
        assert_eq!(word(&world, 147, 1), 1);
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
fn backup_wants_torque_off_and_its_key() {
    let mut world = one("XM430-W210");
    assert_eq!(tell(&mut world, &[0x20, 1, 0x43, 0x54, 0x52, 0x4D]), DATA_RANGE);
    assert_eq!(tell(&mut world, &[0x20, 3, 0x43, 0x54, 0x52, 0x4C]), DATA_RANGE);
    assert_eq!(tell(&mut world, &[0x20, 1]), DATA_LENGTH);
    write(&mut world, 64, &[1]);
    assert_eq!(tell(&mut world, &BACKUP), RESULT_FAIL);
    assert_eq!(word(&world, 147, 1), 0);
}

#[test]
fn startup_torque_on_holds_the_shaft_where_it_is() {
    let mut world = one("XM430-W210");
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

const CLEAR: [u8; 6] = [0x10, 1, 0x44, 0x58, 0x4C, 0x22];

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
    assert!((word(&world, 132, 4).cast_signed() - 8692).abs() < 15);
    assert_eq!(tell(&mut world, &CLEAR), 0);
    assert!((word(&world, 132, 4).cast_signed() - 500).abs() < 15);
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
fn a_servo_of_another_protocol_is_deaf() {
    let mut world = one("XM430-W210");
    assert_eq!(write(&mut world, 13, &[1]), 0);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])), []);
    let mut world = one("XL330-M288");
    assert_eq!(write(&mut world, 13, &[19]), DATA_RANGE);
    assert_eq!(write(&mut world, 13, &[20]), 0, "remote control");
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])), []);
}
