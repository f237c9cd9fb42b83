//! Plugging single servos, turning their shafts, servos out of the box, and the host's line rate.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::World;

/// Ping of a Feetech servo with id 1, and its answer (Feetech wiki, protocol ft-scs).
const PING: [u8; 6] = [0xFF, 0xFF, 0x01, 0x02, 0x01, 0xFB];
const ANSWER: [u8; 6] = [0xFF, 0xFF, 0x01, 0x02, 0x00, 0xFC];

fn three() -> World {
    world(feetech_bus((1..=3).map(|id| servo("STS3215-12V", id)).collect()))
}

fn position(world: &World, place: usize) -> f64 {
    world.shaft_at(0, place).unwrap().position_counts
}

#[test]
fn new_servos_can_only_be_told_apart_one_at_a_time() {
    let mut world = three();
    for place in 0..3 {
        world.make_new(0, place);
        world.pull_servo_out(0, place);
    }
    assert!(exchange(&mut world, &PING).is_empty(), "nobody is there");
    world.plug_servo_in(0, 0);
    assert_eq!(exchange(&mut world, &PING), ANSWER);
    world.plug_servo_in(0, 1);
    let both = exchange(&mut world, &PING);
    assert!(!both.is_empty() && both != ANSWER, "two that talk at once are not understood: {both:?}");
    // Both obey, since both have this id.
    exchange(&mut world, &feetech(1, 3, &[55, 0]));
    exchange(&mut world, &feetech(1, 3, &[5, 7]));
    assert_eq!((world.id_at(0, 0), world.id_at(0, 1), world.id_at(0, 2)), (Some(7), Some(7), Some(1)));
}

#[test]
fn a_new_dynamixel_answers_as_id_1_at_57600_baud() {
    let mut world = world(dynamixel_bus(vec![servo("XM430-W210", 9)]));
    world.make_new(0, 0);
    assert!(exchange(&mut world, &dynamixel(1, &[1])).is_empty(), "another rate than the host's");
    world.set_host_baud(0, 57_600);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])).len(), 14);
    // Return delay as shipped: 250 units of 2 us. Ten and 14 bytes at 57600 baud.
    world.host_send(0, &dynamixel(1, &[1])).unwrap();
    let ends_ns = world.now_ns() + 500_000 + 24 * 10 * S / 57_600;
    world.advance_to(ends_ns - 10_000);
    assert_eq!(world.host_pending(0), 13);
    world.advance_to(ends_ns + 10_000);
    assert_eq!(received(&mut world, 0).len(), 14);
    // A rate written takes effect.
    exchange(&mut world, &dynamixel(1, &[3, 8, 0, 6]));
    assert!(exchange(&mut world, &dynamixel(1, &[1])).is_empty());
    world.set_host_baud(0, 4_000_000);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1])).len(), 14);
}

#[test]
fn a_host_that_changes_its_rate_while_it_is_answered_hears_garbage() {
    let mut world = three();
    world.host_send(0, &PING).unwrap();
    world.advance_to(60_000 + 25_000);
    world.set_host_baud(0, 500_000);
    world.advance_to(S);
    let heard = received(&mut world, 0);
    assert_eq!(heard[..2], ANSWER[..2]);
    assert!(heard[2..].iter().zip(&ANSWER[2..]).all(|(heard, said)| heard != said), "{heard:?}");
}

#[test]
fn a_servo_that_was_pulled_out_keeps_its_eeprom_and_nothing_else() {
    let mut world = world(dynamixel_bus(vec![servo("XM430-W210", 1), servo("XM430-W210", 2)]));
    dynamixel_write(&mut world, 1, 31, &[77]); // temperature limit, in the EEPROM
    dynamixel_write(&mut world, 1, 84, &[0x2C, 0x01]); // position P gain, not
    dynamixel_write(&mut world, 1, 64, &[1]);
    world.pull_servo_out(0, 0);
    assert!(!world.is_servo_plugged_in(0, 0) && world.is_servo_plugged_in(0, 1));
    assert!(!world.shaft_at(0, 0).unwrap().torque_on);
    assert!(exchange(&mut world, &dynamixel(1, &[1])).is_empty());
    assert_eq!(exchange(&mut world, &dynamixel(2, &[1])).len(), 14, "the others stay");
    world.plug_servo_in(0, 0);
    let byte = |world: &mut World, address| dynamixel_read(world, 1, address, 1)[9];
    assert_eq!((byte(&mut world, 31), byte(&mut world, 84), byte(&mut world, 64)), (77, 0x20, 0));
}

#[test]
fn a_hand_turns_a_limp_shaft_half_a_turn_a_second_and_no_other() {
    let mut world = three();
    // Goal 2048, then torque.
    exchange(&mut world, &feetech(3, 3, &[42, 0, 8]));
    exchange(&mut world, &feetech(3, 3, &[40, 1]));
    world.turn(0, 0, 1024.0);
    world.turn(0, 2, 1024.0);
    world.advance_to(world.now_ns() + 250 * MS);
    assert!((position(&world, 0) - 1536.0).abs() < 4.0, "{}", position(&world, 0));
    assert!(world.is_turning(0, 0) && !world.is_turning(0, 2), "a hand lets go of a shaft that has torque");
    assert!((position(&world, 2) - 2048.0).abs() < 4.0, "{}", position(&world, 2));
    world.advance_to(world.now_ns() + 300 * MS);
    assert!(!world.is_turning(0, 0));
    assert!((position(&world, 0) - 1024.0).abs() < 1e-6);
    // The register follows the shaft: 0x0400.
    let read = exchange(&mut world, &feetech(1, 2, &[56, 2]));
    assert_eq!(read[5..7], [0x00, 0x04]);
    // Past the end of the encoder's turn.
    world.turn(0, 0, -100.0);
    world.advance_to(world.now_ns() + S);
    assert!((position(&world, 0) + 100.0).abs() < 1e-6);
}
