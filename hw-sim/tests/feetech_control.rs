//! The behaviour of a Feetech servo: modes, moves to a goal, protection, flags. Rules: Feetech wiki, memory-sts and
//! memory-scscl.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::{BusConfig, Shaft, World};

const STUCK: &str = "[[fault]]\nat_s = 0\nkind = 'stuck'";

fn sts(position_counts: f64) -> BusConfig {
    let mut config = servo("STS3215-12V", 1);
    config.position_counts = position_counts;
    feetech_bus(vec![config])
}

fn scs(position_counts: f64) -> World {
    let mut config = servo("SCS0009", 1);
    config.position_counts = position_counts;
    world(BusConfig { supply_v: 6.0, ..feetech_bus(vec![config]) })
}

/// A write that takes no time worth counting: 1 ms.
fn write(world: &mut World, address: u8, data: &[u8]) {
    world.host_send(0, &feetech(1, 3, &[&[address], data].concat())).unwrap();
    world.advance_to(world.now_ns() + MS);
    received(world, 0);
}

fn write_word(world: &mut World, address: u8, value: u16) {
    write(world, address, &value.to_le_bytes());
}

fn after(world: &mut World, ns: u64) -> Shaft {
    world.advance_to(world.now_ns() + ns);
    world.shaft(0, 1).unwrap()
}

fn byte(world: &World, address: u16) -> u8 {
    world.register(0, 1, address).unwrap()
}

fn word(world: &World, address: u16) -> u16 {
    u16::from_le_bytes([byte(world, address), byte(world, address + 1)])
}

/// counts/s.
fn speed(shaft: &Shaft) -> f64 {
    shaft.speed_rad_s * 4096.0 / std::f64::consts::TAU
}

/// Share of the duty register, sign in bit 10.
fn load(world: &World) -> f64 {
    let raw = word(world, 60);
    f64::from(raw & 0x3FF) / if raw & 0x400 == 0 { 1000.0 } else { -1000.0 }
}

#[test]
fn speed_mode_holds_the_speed_it_is_given_either_way_and_0_stops_it() {
    let mut world = world(sts(0.0));
    write(&mut world, 33, &[1]);
    write(&mut world, 40, &[1]);
    for (raw, wanted) in [(1000, 1000.0), (0x8000 | 2000, -2000.0), (0, 0.0)] {
        write_word(&mut world, 46, raw);
        let shaft = after(&mut world, 2 * S);
        assert!((speed(&shaft) - wanted).abs() < 50.0, "{} for {wanted}", speed(&shaft));
        assert_eq!(byte(&world, 66), u8::from(wanted != 0.0), "moving");
    }
    // It turns for good: no overload at full speed.
    write_word(&mut world, 46, 3400);
    assert!(speed(&after(&mut world, 10 * S)) > 2900.0);
    assert_eq!(byte(&world, 65), 0);
}

#[test]
fn the_phase_says_what_a_unit_of_speed_is() {
    let mut world = world(sts(0.0));
    write(&mut world, 18, &[28 - 4]);
    write(&mut world, 33, &[1]);
    write(&mut world, 40, &[1]);
    write_word(&mut world, 46, 20);
    let shaft = after(&mut world, 2 * S);
    assert!((speed(&shaft) - 1000.0).abs() < 50.0, "{}", speed(&shaft));
    assert!(word(&world, 58).abs_diff(20) <= 1);
}

#[test]
fn acceleration_counts_in_hundreds_of_steps_a_second_squared() {
    let mut world = world(sts(0.0));
    write(&mut world, 33, &[1]);
    write(&mut world, 41, &[10]);
    write(&mut world, 40, &[1]);
    write_word(&mut world, 46, 2000);
    // 1000 counts/s²: half the speed after a second, all of it after two.
    assert!((speed(&after(&mut world, S)) - 1000.0).abs() < 100.0);
    assert!((speed(&after(&mut world, 1500 * MS)) - 2000.0).abs() < 60.0);
}

#[test]
fn a_goal_is_reached_in_the_time_of_its_trapezoid_and_not_before() {
    let mut world = world(sts(1000.0));
    write_word(&mut world, 42, 1000);
    write(&mut world, 40, &[1]);
    write(&mut world, 41, &[20]);
    write_word(&mut world, 46, 1000);
    write_word(&mut world, 42, 3000);
    // 2000 counts at 1000 counts/s, and half a second for 2000 counts/s² to get there.
    let mut top = 0f64;
    for _ in 0..24 {
        top = top.max(speed(&after(&mut world, 100 * MS)).abs());
    }
    let nearly = world.shaft(0, 1).unwrap().position_counts;
    assert!((2900.0..2999.0).contains(&nearly), "{nearly} after 2.4 s");
    assert!((950.0..1080.0).contains(&top), "{top}");
    let there = after(&mut world, 300 * MS);
    assert!((there.position_counts - 3000.0).abs() < 20.0 && there.speed_rad_s.abs() < 0.05, "{there:?}");
}

#[test]
fn the_moving_flag_is_up_from_the_goal_to_the_arrival() {
    let mut world = world(sts(2048.0));
    write_word(&mut world, 42, 2048);
    write(&mut world, 40, &[1]);
    assert_eq!(byte(&world, 66), 0);
    write_word(&mut world, 46, 1000);
    write_word(&mut world, 42, 3048);
    assert_eq!(byte(&world, 66), 1);
    after(&mut world, 900 * MS);
    assert_eq!(byte(&world, 66), 1);
    after(&mut world, 400 * MS);
    assert_eq!(byte(&world, 66), 0);
    assert_eq!(word(&world, 67), 3048, "goal, read back");
}

#[test]
fn step_mode_continues_from_its_last_goal_and_shows_the_remaining_distance() {
    let mut world = world(sts(2048.0));
    write(&mut world, 33, &[3]);
    write(&mut world, 40, &[1]);
    for step in 1..=3u32 {
        write_word(&mut world, 42, 3000);
        let shaft = after(&mut world, 1500 * MS);
        let wanted = 2048.0 + 3000.0 * f64::from(step);
        assert!((shaft.position_counts - wanted).abs() < 20.0, "{} for {wanted}", shaft.position_counts);
        assert!(word(&world, 56) & 0x7FFF < 20, "no way left: {}", word(&world, 56));
    }
    write_word(&mut world, 42, 0x8000 | 3000);
    let shaft = after(&mut world, 1500 * MS);
    assert!((shaft.position_counts - 8048.0).abs() < 20.0, "{}", shaft.position_counts);
}

/// huggingface/lerobot#3585: the register keeps the goal, the servo stops at the limit.
#[test]
fn a_goal_beyond_the_angle_limit_is_kept_and_reached_as_far_as_the_limit() {
    let mut world = world(sts(2048.0));
    write(&mut world, 9, &[0xE8, 0x03, 0xB8, 0x0B]);
    write_word(&mut world, 42, 3900);
    let shaft = after(&mut world, 2 * S);
    assert_eq!(word(&world, 42), 3900);
    assert!((shaft.position_counts - 3000.0).abs() < 20.0, "{}", shaft.position_counts);
}

#[test]
fn pwm_mode_drives_by_its_share_either_way() {
    let mut world = world(sts(0.0));
    write(&mut world, 33, &[2]);
    write(&mut world, 40, &[1]);
    // A positive value turns to smaller counts (huggingface/lerobot#4547, firmware 3.10).
    for (raw, sign) in [(500, -1.0), (0x400 | 500, 1.0)] {
        write_word(&mut world, 44, raw);
        let shaft = after(&mut world, S);
        // Half of 45 rpm, less friction.
        assert!((sign * speed(&shaft) - 1536.0).abs() < 100.0, "{}", speed(&shaft));
        assert!((load(&world) - sign * 0.5).abs() < 1e-9);
    }
}

#[test]
fn drive_and_feedback_reversed_turn_the_other_way_to_the_same_numbers() {
    let mut world = world(sts(1000.0));
    // Bits 0 and 7 beside those shipped.
    write(&mut world, 18, &[28 + 1 + 128]);
    write(&mut world, 40, &[1]);
    let start = word(&world, 56);
    assert_eq!(start, 4096 - 1000);
    write_word(&mut world, 42, start + 500);
    let shaft = after(&mut world, 2 * S);
    assert!((shaft.position_counts - 500.0).abs() < 20.0, "{}", shaft.position_counts);
    assert!(word(&world, 56).abs_diff(start + 500) < 20);
}

#[test]
fn the_resolution_makes_steps_of_several_counts() {
    let mut world = world(sts(2000.0));
    write(&mut world, 9, &[0; 4]);
    write(&mut world, 30, &[4]);
    assert_eq!(word(&world, 56), 500);
    write(&mut world, 40, &[1]);
    write_word(&mut world, 42, 1000);
    assert!((after(&mut world, 2 * S).position_counts - 4000.0).abs() < 20.0);
}

#[test]
fn the_servo_does_not_drive_inside_the_dead_band() {
    let mut world = world(sts(2048.0));
    write(&mut world, 26, &[16, 16]);
    write_word(&mut world, 42, 2048 + 16);
    write(&mut world, 40, &[1]);
    assert!((after(&mut world, S).position_counts - 2048.0).abs() < 1e-9);
    assert!(load(&world).abs() < 1e-9);
}

#[test]
fn outside_the_dead_band_the_drive_is_a_quarter_of_p_a_count_and_the_start_torque_at_least() {
    let mut world = world_with_faults(sts(2048.0), STUCK);
    write(&mut world, 40, &[1]);
    for (goal, drive) in [(2048 + 50, 0.4), (2048 - 50, -0.4), (2048 + 95, 0.76), (2048 - 2, -0.016)] {
        write_word(&mut world, 42, goal);
        after(&mut world, 10 * MS);
        assert!((load(&world) - drive).abs() < 1e-9, "{} for {drive}", load(&world));
    }
    write(&mut world, 24, &[100]);
    after(&mut world, 10 * MS);
    assert!((load(&world) + 0.1).abs() < 1e-9);
}

/// As measured on a servo whose motor does not turn: 0.769 of the supply at 95 counts, and 0.2 at 100.
#[test]
fn overload_leaves_the_holding_torque_after_the_protection_time() {
    let mut world = world_with_faults(sts(2048.0), STUCK);
    write(&mut world, 40, &[1]);
    write_word(&mut world, 42, 2048 + 95);
    after(&mut world, 10 * S);
    assert_eq!((byte(&world, 65), word(&world, 60)), (0, 760), "below 80 %");
    write_word(&mut world, 42, 2048 + 110);
    after(&mut world, 1990 * MS);
    assert_eq!((byte(&world, 65), word(&world, 60)), (0, 880));
    after(&mut world, 20 * MS);
    assert_eq!((byte(&world, 65), word(&world, 60)), (32, 200));
    // Every answer has the alarm, and is still valid.
    assert_eq!(exchange(&mut world, &feetech(1, 2, &[42, 2])), feetech(1, 32, &[0x6E, 0x08]));
    after(&mut world, 5 * S);
    assert_eq!(word(&world, 60), 200);
    // A goal on the other side ends it.
    write_word(&mut world, 42, 2048 - 20);
    after(&mut world, 10 * MS);
    assert_eq!((byte(&world, 65), word(&world, 60)), (0, 0x400 | 160));
}

#[test]
fn overload_follows_its_registers_and_its_bit_in_the_mask() {
    let mut world = world_with_faults(sts(2048.0), STUCK);
    // Holding torque 35 %, 0.5 s, from 50 % on.
    write(&mut world, 34, &[35, 50, 50]);
    write_word(&mut world, 42, 2048 + 70);
    write(&mut world, 40, &[1]);
    after(&mut world, 480 * MS);
    assert_eq!((byte(&world, 65), word(&world, 60)), (0, 560));
    after(&mut world, 40 * MS);
    assert_eq!((byte(&world, 65), word(&world, 60)), (32, 350));
    // After torque off and on it starts again.
    write(&mut world, 40, &[0]);
    write(&mut world, 40, &[1]);
    after(&mut world, 10 * MS);
    assert_eq!((byte(&world, 65), word(&world, 60)), (0, 560));
    write(&mut world, 19, &[0x0C]);
    after(&mut world, S);
    assert_eq!((byte(&world, 65), word(&world, 60)), (32, 560), "told, and not acted on");
}

#[test]
fn a_scripted_overload_acts_as_a_real_one() {
    let script = "[[fault]]\nat_s = 1\nfor_s = 1\nkind = 'overload'";
    let mut world = world_with_faults(sts(2048.0), script);
    write(&mut world, 40, &[1]);
    write_word(&mut world, 42, 2048);
    world.advance_to(S + 2 * MS);
    assert_eq!(byte(&world, 65), 32);
    world.advance_to(2 * S + 2 * MS);
    assert_eq!(byte(&world, 65), 0);
}

#[test]
fn too_much_current_for_too_long_lets_go_until_the_host_has_switched_off() {
    let mut world = world_with_faults(sts(2048.0), STUCK);
    // 2.7 A at stall; 300 units are 1.95 A, 0.7 A of them at the 20 % that overload leaves: no overload here.
    write(&mut world, 19, &[8]);
    write_word(&mut world, 28, 300);
    write(&mut world, 38, &[50]);
    write_word(&mut world, 42, 2048 + 120);
    write(&mut world, 40, &[1]);
    after(&mut world, 480 * MS);
    assert_eq!((byte(&world, 65), byte(&world, 40)), (0, 1));
    assert!((f64::from(word(&world, 69)) * 0.0065 - 0.96 * 2.7).abs() < 0.01);
    after(&mut world, 40 * MS);
    assert_eq!((byte(&world, 65), byte(&world, 40)), (8, 0));
    write(&mut world, 40, &[1]);
    after(&mut world, 10 * MS);
    assert_eq!((byte(&world, 65), byte(&world, 40)), (8, 0), "not yet");
    write(&mut world, 40, &[0]);
    write(&mut world, 40, &[1]);
    assert_eq!((byte(&world, 65), byte(&world, 40)), (0, 1));
}

#[test]
fn voltage_and_heat_raise_their_bits_and_unload_as_the_mask_says() {
    let script = "[[fault]]\nat_s = 0\nkind = 'low-voltage'\nvolts = 14.5\n[[fault]]\nat_s = 1\nkind = 'hot'\ncelsius = 71";
    let mut world = world_with_faults(sts(2048.0), script);
    write(&mut world, 40, &[1]);
    assert_eq!((byte(&world, 65), byte(&world, 40)), (1, 1), "voltage is not in the mask as shipped");
    world.advance_to(S + 2 * MS);
    assert_eq!((byte(&world, 65), byte(&world, 40)), (1 + 4, 0));
    write(&mut world, 19, &[0]);
    write(&mut world, 40, &[1]);
    assert_eq!((byte(&world, 65), byte(&world, 40)), (1 + 4, 1));
    write(&mut world, 19, &[1]);
    assert_eq!(byte(&world, 40), 0);
}

#[test]
fn scs_goes_to_its_goal_in_the_time_or_at_the_speed_it_is_given() {
    let mut world = scs(500.0);
    write(&mut world, 42, &[0x01, 0xF4]);
    write(&mut world, 40, &[1]);
    // Goal 800, a second, no speed; the high byte first.
    write(&mut world, 42, &[0x03, 0x20, 0x03, 0xE8, 0, 0]);
    let half = after(&mut world, 500 * MS).position_counts;
    assert!((half - 650.0).abs() < 20.0, "{half}");
    assert!((after(&mut world, 600 * MS).position_counts - 800.0).abs() < 6.0);
    // Goal 600 at 100 steps a second: two seconds.
    write(&mut world, 42, &[0x02, 0x58, 0, 0, 0, 100]);
    let half = after(&mut world, S).position_counts;
    assert!((half - 700.0).abs() < 15.0, "{half}");
    assert!((after(&mut world, 1100 * MS).position_counts - 600.0).abs() < 6.0);
}

#[test]
fn scs_holds_goals_inside_its_limits_and_is_a_motor_without_them() {
    let mut world = scs(500.0);
    write(&mut world, 42, &[0x03, 0xFF]);
    assert_eq!((byte(&world, 42), byte(&world, 43)), (0x03, 0xEB), "1003");
    write(&mut world, 9, &[0; 4]);
    write(&mut world, 44, &[0x05, 0xF4]);
    write(&mut world, 40, &[1]);
    // -500: half of 100 rpm the other way.
    let shaft = after(&mut world, S);
    assert!((shaft.speed_rad_s + 5.24).abs() < 0.3, "{shaft:?}");
    assert_eq!((byte(&world, 56), byte(&world, 57)), (0, 0), "a potentiometer ends");
}
