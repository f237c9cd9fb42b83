//! Every packet the manual spells out, in both directions, byte for byte. Source: ROBOTIS e-manual, Protocol 2.0.
//! Two of its requests have a misprinted CRC; both are marked.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::{BusConfig, World};

/// Status of an instruction that gives nothing back, from id 1.
const DONE: &str = "FF FF FD 00 01 04 00 55 00 A1 0C";

fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

/// XM430-W210 with these ids, at these counts.
fn servos(at: &[(u8, f64)]) -> BusConfig {
    let place = |&(id, position_counts)| hw_sim::ServoConfig { position_counts, ..servo("XM430-W210", id) };
    dynamixel_bus(at.iter().map(place).collect())
}

fn one() -> World {
    world(servos(&[(1, 2048.0)]))
}

fn word(world: &World, id: u8, address: u16, size: u16) -> u32 {
    (0..size).map(|n| u32::from(world.register(0, id, address + n).unwrap()) << (8 * n)).sum()
}

/// Sends the manual's request and wants the manual's answer.
fn say(world: &mut World, request: &str, answer: &str) {
    assert_eq!(exchange(world, &bytes(request)), bytes(answer), "{request}");
}

#[test]
fn read() {
    say(
        &mut world(servos(&[(1, 166.0)])),
        "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15",
        "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0",
    );
}

#[test]
fn write() {
    let mut world = one();
    say(&mut world, "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89", DONE);
    assert_eq!(word(&world, 1, 116, 4), 512);
}

#[test]
fn reg_write_and_action() {
    let mut world = one();
    say(&mut world, "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E", DONE);
    // Registered Instruction says so, and Goal Velocity is not written yet.
    assert_eq!((word(&world, 1, 69, 1), word(&world, 1, 104, 4)), (1, 330));
    say(&mut world, "FF FF FD 00 01 03 00 05 02 CE", DONE);
    assert_eq!((word(&world, 1, 69, 1), word(&world, 1, 104, 4)), (0, 200));
}

#[test]
fn factory_reset_reboot_and_clear() {
    say(&mut one(), "FF FF FD 00 01 04 00 06 01 A1 E6", DONE);
    say(&mut one(), "FF FF FD 00 01 03 00 08 2F 4E", DONE);
    say(&mut one(), "FF FF FD 00 01 08 00 10 01 44 58 4C 22 B1 DC", DONE);
}

#[test]
fn control_table_backup() {
    let mut world = one();
    say(&mut world, "FF FF FD 00 01 08 00 20 01 43 54 52 4C 16 F5", DONE);
    // The manual has 92 for the first byte of the CRC.
    say(&mut world, "FF FF FD 00 01 08 00 20 02 43 54 52 4C 9E F5", DONE);
}

#[test]
fn sync_read() {
    say(
        &mut world(servos(&[(1, 166.0), (2, 2079.0)])),
        "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
        "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0 \
         FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE",
    );
}

#[test]
fn sync_write() {
    let mut world = world(servos(&[(1, 0.0), (2, 0.0)]));
    say(&mut world, "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87", "");
    assert_eq!((word(&world, 1, 116, 4), word(&world, 2, 116, 4)), (150, 170));
}

#[test]
fn fast_sync_read() {
    say(
        &mut world(servos(&[(3, 166.0), (7, 2079.0), (4, 1023.0)])),
        "FF FF FD 00 FE 0A 00 8A 84 00 04 00 03 07 04 20 F2",
        "FF FF FD 00 FE 19 00 55 00 03 A6 00 00 00 84 08 \
         00 07 1F 08 00 00 16 CA \
         00 04 FF 03 00 00 D1 9E",
    );
}

#[test]
fn bulk_read() {
    let bus = BusConfig { supply_v: 11.9, ..servos(&[(1, 0.0), (2, 0.0)]) };
    let warm = "[[fault]]\nat_s = 0\nkind = 'hot'\nid = 2\ncelsius = 36\nbus = 'legs'";
    let mut world = world_with_faults(bus, warm);
    world.advance_to(10 * MS);
    say(
        &mut world,
        "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05",
        "FF FF FD 00 01 06 00 55 00 77 00 C3 69 \
         FF FF FD 00 02 05 00 55 00 24 8B A9",
    );
}

#[test]
fn bulk_write() {
    let mut world = world(servos(&[(1, 0.0), (2, 0.0)]));
    // Other values, so that the manual's are seen to be written.
    dynamixel_write(&mut world, 1, 32, &[150, 0]);
    dynamixel_write(&mut world, 2, 31, &[70]);
    say(&mut world, "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68", "");
    assert_eq!((word(&world, 1, 32, 2), word(&world, 2, 31, 1)), (160, 80));
}

#[test]
fn fast_bulk_read() {
    let faults = "
        [[fault]]\nat_s = 0\nkind = 'stuck'
        [[fault]]\nat_s = 0\nkind = 'hot'\nbus = 'legs'\nid = 4\ncelsius = 31";
    let mut world = world_with_faults(servos(&[(3, 166.0), (7, 2079.0), (4, 1023.0)]), faults);
    // Present PWM of servo 7 is to be 421.
    dynamixel_write(&mut world, 7, 11, &[16]);
    dynamixel_write(&mut world, 7, 100, &421i16.to_le_bytes());
    dynamixel_write(&mut world, 7, 64, &[1]);
    say(
        &mut world,
        // The manual has 20 F2 for the CRC: that of its fast sync read.
        "FF FF FD 00 FE 12 00 9A 03 84 00 04 00 07 7C 00 02 00 04 92 00 01 00 DA 2D",
        "FF FF FD 00 FE 14 00 55 00 03 A6 00 00 00 67 A4 \
         00 07 A5 01 24 74 \
         00 04 1F D9 C1",
    );
}
