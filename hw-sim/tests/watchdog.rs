//! The bus watchdog of Dynamixel servos. Facts: ROBOTIS e-manual, X-series, Bus Watchdog (98): unit 20 ms; runs
//! with torque on; stops the servo, reads -1 and makes goals read-only (range error, 4) until 0 is written.

#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::World;

const WATCHDOG: u8 = 98;
const GOAL_PWM: u8 = 100;
const GOAL_POSITION: u8 = 116;
const RANGE_ERROR: u8 = 4;

/// Servos 1 and 2 at count 1000, servo 1 with its watchdog at `units`.
fn watched(units: u8) -> World {
    let mut servos = vec![servo("XM430-W210", 1), servo("XM430-W210", 2)];
    servos[0].position_counts = 1000.0;
    let mut world = world(dynamixel_bus(servos));
    assert_eq!(error_of(&dynamixel_write(&mut world, 1, WATCHDOG, &[units])), 0);
    world
}

/// Error field of a status packet.
fn error_of(status: &[u8]) -> u8 {
    status[8]
}

fn held(world: &World) -> Option<u8> {
    world.register(0, 1, WATCHDOG.into())
}

/// A quarter turn that takes more than 150 ms.
fn start_turning(world: &mut World) {
    dynamixel_write(world, 1, 64, &[1]);
    world
        .host_send(0, &dynamixel(1, &[&[3, GOAL_POSITION, 0][..], &4000i32.to_le_bytes()].concat()))
        .unwrap();
}

#[test]
fn a_servo_that_hears_nothing_stops_in_time_and_stays_stopped() {
    let mut world = watched(5);
    start_turning(&mut world);
    world.advance_to(world.now_ns() + 95 * MS);
    assert_eq!(held(&world), Some(5));
    assert!(world.shaft(0, 1).unwrap().speed_rad_s > 5.0, "under way");
    // 100 ms after the last packet, which took a part of the first millisecond.
    world.advance_to(world.now_ns() + 7 * MS);
    assert_eq!(held(&world), Some(0xFF));
    let at_the_trip = world.shaft(0, 1).unwrap().position_counts;
    world.advance_to(world.now_ns() + 200 * MS);
    let later = world.shaft(0, 1).unwrap();
    assert!(later.speed_rad_s.abs() < 0.05, "{later:?}");
    assert!((later.position_counts - at_the_trip).abs() < 150.0, "near where it was stopped: {later:?}");
    assert!(later.position_counts < 3500.0, "not at its old goal: {later:?}");
}

#[test]
fn without_the_watchdog_a_servo_continues_to_its_goal() {
    let mut world = watched(0);
    start_turning(&mut world);
    world.advance_to(world.now_ns() + 2 * S);
    assert!((world.shaft(0, 1).unwrap().position_counts - 4000.0).abs() < 15.0);
}

#[test]
fn any_instruction_packet_resets_the_watchdog() {
    let mut world = watched(5);
    dynamixel_write(&mut world, 1, 64, &[1]);
    for _ in 0..20 {
        // A ping of the other servo; each exchange takes 50 ms.
        exchange(&mut world, &dynamixel(2, &[1]));
    }
    assert_eq!(held(&world), Some(5));
    // Noise and status packets are no instructions.
    for _ in 0..20 {
        exchange(&mut world, &dynamixel(2, &[0x55, 0]));
        exchange(&mut world, &[0xFF, 0xFF, 0xFD]);
    }
    assert_eq!(held(&world), Some(0xFF));
}

#[test]
fn the_watchdog_starts_with_the_torque() {
    let mut world = watched(1);
    world.advance_to(world.now_ns() + S);
    assert_eq!(held(&world), Some(1));
    // Torque on: the packet that says so is the first sign of life.
    world.host_send(0, &dynamixel(1, &[3, 64, 0, 1])).unwrap();
    world.advance_to(world.now_ns() + 15 * MS);
    assert_eq!(held(&world), Some(1));
    world.advance_to(world.now_ns() + 10 * MS);
    assert_eq!(held(&world), Some(0xFF));
}

#[test]
fn goals_are_refused_until_0_is_written() {
    let mut world = watched(1);
    dynamixel_write(&mut world, 1, 64, &[1]);
    dynamixel_write(&mut world, 1, 112, &[9, 0, 0, 0]);
    assert_eq!(held(&world), Some(0xFF), "an exchange takes 50 ms");
    assert_eq!(dynamixel_read(&mut world, 1, WATCHDOG, 1)[9], 0xFF);
    let goal = 1200i32.to_le_bytes();
    assert_eq!(error_of(&dynamixel_write(&mut world, 1, GOAL_POSITION, &goal)), RANGE_ERROR);
    assert_eq!(error_of(&dynamixel_write(&mut world, 1, GOAL_PWM, &[100, 0])), RANGE_ERROR);
    // Torque can still be taken off.
    assert_eq!(error_of(&dynamixel_write(&mut world, 1, 64, &[0])), 0);
    assert!(!world.shaft(0, 1).unwrap().torque_on);
    assert_eq!(error_of(&dynamixel_write(&mut world, 1, 64, &[1])), 0);
    assert_eq!(error_of(&dynamixel_write(&mut world, 1, GOAL_POSITION, &goal)), RANGE_ERROR);

    assert_eq!(error_of(&dynamixel_write(&mut world, 1, WATCHDOG, &[0])), 0);
    assert_eq!(error_of(&dynamixel_write(&mut world, 1, GOAL_POSITION, &goal)), 0);
    // Profile Velocity is 9: 141 counts a second.
    world.advance_to(world.now_ns() + 2 * S);
    assert!((world.shaft(0, 1).unwrap().position_counts - 1200.0).abs() < 15.0);
}

#[test]
fn a_spinning_servo_stops_too() {
    let mut world = watched(0);
    dynamixel_write(&mut world, 1, 11, &[16]);
    dynamixel_write(&mut world, 1, 64, &[1]);
    dynamixel_write(&mut world, 1, WATCHDOG, &[10]);
    assert!(world.shaft(0, 1).unwrap().speed_rad_s > 5.0);
    world.advance_to(world.now_ns() + 300 * MS);
    assert!(world.shaft(0, 1).unwrap().speed_rad_s.abs() < 1e-9);
}
