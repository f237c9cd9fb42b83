//! Every instruction of FT-SCS. Packets are the examples of the Feetech wiki, protocol ft-scs, section 4; what they do
//! is its text and that of memory-sts and memory-scscl.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::{BusConfig, World};

/// Answer of servo 1 without alarms or data.
const DONE: [u8; 6] = [0xFF, 0xFF, 1, 2, 0, 0xFC];
const AWAY_NS: u64 = 1_800 * MS;

fn one_at(position_counts: f64) -> World {
    let mut config = servo("STS3215-12V", 1);
    config.position_counts = position_counts;
    world(feetech_bus(vec![config]))
}

fn one() -> World {
    one_at(2048.0)
}

/// A register pair of servo 1, low byte first.
fn word(world: &World, address: u16) -> u16 {
    u16::from_le_bytes([address, address + 1].map(|address| world.register(0, 1, address).unwrap()))
}

fn byte(world: &World, address: u16) -> u8 {
    world.register(0, 1, address).unwrap()
}

fn restart(world: &mut World) {
    assert_eq!(exchange(world, &[0xFF, 0xFF, 1, 2, 8, 0xF4]), [], "a restart is not answered");
    world.advance_to(world.now_ns() + AWAY_NS);
}

#[test]
fn the_wiki_s_write_of_position_and_speed() {
    let mut world = one();
    let request = [0xFF, 0xFF, 1, 9, 3, 0x2A, 0, 8, 0, 0, 0xE8, 3, 0xD5];
    assert_eq!(exchange(&mut world, &request), DONE);
    assert_eq!((word(&world, 42), word(&world, 44), word(&world, 46)), (2048, 0, 1000));
}

#[test]
fn the_wiki_s_broadcast_write_of_an_id_is_obeyed_and_not_answered() {
    let mut config = servo("STS3215-12V", 7);
    config.position_counts = 1.0;
    let mut world = world(feetech_bus(vec![config]));
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 0xFE, 4, 3, 5, 1, 0xF4]), []);
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 2, 1, 0xFB]), DONE);
}

#[test]
fn a_new_id_is_answered_by_the_old_one() {
    let mut world = one();
    // FF FF 01 04 03 05 06 EC: LeRobot waits for the answer of id 1 to this (huggingface/lerobot#1384).
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 4, 3, 5, 6, 0xEC]), DONE);
    assert_eq!(exchange(&mut world, &feetech(1, 1, &[])), []);
    assert_eq!(exchange(&mut world, &feetech(6, 1, &[])), feetech(6, 0, &[]));
}

/// huggingface/lerobot#3585, and Feetech's protocol page, section 4.3, example 4, which moves without a torque write.
#[test]
fn a_goal_written_to_a_limp_servo_switches_its_torque_on() {
    let mut world = one_at(2048.0);
    let request = [0xFF, 0xFF, 1, 9, 3, 0x2A, 0, 8, 0, 0, 0xE8, 3, 0xD5];
    assert_eq!(exchange(&mut world, &request), DONE);
    assert!(world.shaft(0, 1).unwrap().torque_on && byte(&world, 40) == 1);
    feetech_write(&mut world, 1, 40, &[0]);
    feetech_write(&mut world, 1, 42, &[0xB8, 0x0B]);
    world.advance_to(world.now_ns() + 2 * S);
    assert!((world.shaft(0, 1).unwrap().position_counts - 3000.0).abs() < 20.0, "it goes to 3000");
}

/// servolab; LeRobot's `connect()` relies on it. Likely, not measured by the project.
#[test]
fn a_servo_without_a_goal_since_power_on_stays_where_it_is() {
    let mut world = one_at(700.0);
    feetech_write(&mut world, 1, 40, &[1]);
    world.advance_to(world.now_ns() + S);
    assert!((world.shaft(0, 1).unwrap().position_counts - 700.0).abs() < 10.0);
}

#[test]
fn an_asynchronous_write_waits_for_its_action() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1), servo("STS3215-12V", 2)]));
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 9, 4, 0x2A, 0, 8, 0, 0, 0xE8, 3, 0xD4]), DONE);
    assert_eq!(
        exchange(&mut world, &[0xFF, 0xFF, 2, 9, 4, 0x2A, 0, 8, 0, 0, 0xE8, 3, 0xD3]),
        [0xFF, 0xFF, 2, 2, 0, 0xFB]
    );
    let held = |world: &World| (word(world, 42), byte(world, 64), world.register(0, 2, 64));
    assert_eq!(held(&world), (0, 1, Some(1)), "kept, and flagged");
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 0xFE, 2, 5, 0xFA]), [], "no answer to all");
    assert_eq!(held(&world), (2048, 0, Some(0)));
    assert_eq!(word(&world, 46), 1000);
    // Nothing waits any more.
    feetech_write(&mut world, 1, 42, &[1, 1]);
    assert_eq!(exchange(&mut world, &feetech(1, 5, &[])), DONE);
    assert_eq!(word(&world, 42), 0x101);
}

#[test]
fn a_restart_takes_1800_ms_and_leaves_the_ram_as_new() {
    let mut world = one();
    feetech_write(&mut world, 1, 16, &[0xF4, 1]);
    feetech_write(&mut world, 1, 40, &[1]);
    feetech_write(&mut world, 1, 41, &[7]);
    exchange(&mut world, &[0xFF, 0xFF, 1, 2, 8, 0xF4]);
    assert!(!world.shaft(0, 1).unwrap().torque_on);
    world.advance_to(world.now_ns() + AWAY_NS - 60 * MS);
    assert_eq!(exchange(&mut world, &feetech(1, 1, &[])), [], "not yet");
    world.advance_to(world.now_ns() + 11 * MS);
    assert_eq!(exchange(&mut world, &feetech(1, 1, &[])), DONE);
    assert_eq!((byte(&world, 40), byte(&world, 41), byte(&world, 55)), (0, 0, 1));
}

#[test]
fn writes_to_locked_eprom_are_lost_without_power() {
    let mut world = one();
    // Locked as shipped: taken at once, and not kept.
    feetech_write(&mut world, 1, 21, &[50]);
    assert_eq!(byte(&world, 21), 50);
    feetech_write(&mut world, 1, 55, &[0]);
    feetech_write(&mut world, 1, 13, &[60]);
    feetech_write(&mut world, 1, 16, &[0xF4, 1]);
    feetech_write(&mut world, 1, 55, &[1]);
    feetech_write(&mut world, 1, 34, &[33]);
    restart(&mut world);
    assert_eq!((byte(&world, 21), byte(&world, 13), byte(&world, 34)), (32, 60, 20));
    assert_eq!(word(&world, 48), 500, "the torque limit starts at the largest torque");
}

#[test]
fn recovery_brings_back_the_factory_or_the_backup_and_keeps_the_id() {
    let mut world = one();
    let recover = feetech(1, 6, &[]);
    assert_eq!(recover, [0xFF, 0xFF, 1, 2, 6, 0xF6]);
    feetech_write(&mut world, 1, 21, &[50]);
    assert_eq!(exchange(&mut world, &recover), DONE);
    assert_eq!(byte(&world, 21), 50, "not while it is locked");
    feetech_write(&mut world, 1, 55, &[0]);
    feetech_write(&mut world, 1, 5, &[4]);
    assert_eq!(exchange(&mut world, &feetech(4, 6, &[])), feetech(4, 0, &[]));
    assert_eq!((world.register(0, 4, 21), world.register(0, 4, 5)), (Some(32), Some(4)));

    feetech_write(&mut world, 4, 21, &[44]);
    assert_eq!(exchange(&mut world, &feetech(4, 9, &[])), feetech(4, 0, &[]));
    feetech_write(&mut world, 4, 21, &[60]);
    exchange(&mut world, &feetech(4, 6, &[]));
    assert_eq!(world.register(0, 4, 21), Some(44));
    exchange(&mut world, &feetech(4, 8, &[]));
    world.advance_to(world.now_ns() + AWAY_NS);
    assert_eq!(world.register(0, 4, 21), Some(44), "and it is kept");
}

#[test]
fn a_backup_needs_an_open_lock() {
    let mut world = one();
    feetech_write(&mut world, 1, 21, &[44]);
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 2, 9, 0xF3]), DONE);
    feetech_write(&mut world, 1, 55, &[0]);
    exchange(&mut world, &feetech(1, 6, &[]));
    assert_eq!(byte(&world, 21), 32);
}

#[test]
fn calibration_makes_the_present_position_the_middle_or_the_number_sent() {
    let mut world = one_at(700.0);
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 2, 0x0B, 0xF1]), DONE);
    assert_eq!(word(&world, 56), 2048);
    // Present is actual less the offset: 700 + 1348; the sign is bit 11.
    assert_eq!(word(&world, 31), 1348 | 0x800);
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 4, 0x0B, 0, 4, 0xEB]), DONE);
    assert_eq!((word(&world, 56), word(&world, 31)), (1024, 324 | 0x800));
    restart(&mut world);
    assert_eq!(word(&world, 56), 1024, "kept");
    feetech_write(&mut world, 1, 40, &[128]);
    assert_eq!((word(&world, 56), byte(&world, 40)), (2048, 0));
    assert!(!world.shaft(0, 1).unwrap().torque_on);
}

#[test]
fn an_offset_that_is_written_moves_the_present_position_the_other_way() {
    let mut world = one_at(1000.0);
    feetech_write(&mut world, 1, 31, &[100, 0]);
    assert_eq!(word(&world, 56), 900);
    feetech_write(&mut world, 1, 31, &[100, 8]);
    assert_eq!(word(&world, 56), 1100);
    // In position mode only (servolab).
    feetech_write(&mut world, 1, 33, &[1]);
    assert_eq!(word(&world, 56), 1000);
}

#[test]
fn a_status_reset_forgets_the_turns() {
    let mut world = one_at(3900.0);
    // Both limits 0: goals beyond a turn.
    feetech_write(&mut world, 1, 9, &[0, 0, 0, 0]);
    feetech_write(&mut world, 1, 42, &[0x88, 0x13]);
    feetech_write(&mut world, 1, 40, &[1]);
    world.advance_to(world.now_ns() + 2 * S);
    assert!(word(&world, 56).abs_diff(5000) < 20, "{}", word(&world, 56));
    feetech_write(&mut world, 1, 40, &[0]);
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 2, 0x0A, 0xF2]), DONE);
    assert!(word(&world, 56).abs_diff(5000 - 4096) < 20, "{}", word(&world, 56));
}

#[test]
fn a_power_loss_forgets_the_turns() {
    let mut world = one_at(-300.4);
    assert_eq!(word(&world, 56), 3796);
    restart(&mut world);
    assert_eq!(word(&world, 56), 3796);
}

#[test]
fn positions_below_zero_are_sign_and_magnitude_and_wrap_if_the_phase_says_so() {
    let mut world = one_at(100.0);
    feetech_write(&mut world, 1, 9, &[0, 0, 0, 0]);
    // -300.
    feetech_write(&mut world, 1, 42, &[0x2C, 0x81]);
    feetech_write(&mut world, 1, 40, &[1]);
    world.advance_to(world.now_ns() + S);
    let magnitude = word(&world, 56) & 0x7FFF;
    assert!(word(&world, 56) & 0x8000 != 0 && magnitude.abs_diff(300) < 20, "{:04X}", word(&world, 56));
    feetech_write(&mut world, 1, 40, &[0]);
    let magnitude = word(&world, 56) & 0x7FFF;
    feetech_write(&mut world, 1, 18, &[12]);
    assert_eq!(word(&world, 56), 4096 - magnitude);
}

#[test]
fn response_level_0_leaves_all_but_pings_and_reads_unanswered() {
    let mut world = one();
    feetech_write(&mut world, 1, 55, &[0]);
    assert_eq!(feetech_write(&mut world, 1, 8, &[0]), []);
    // Recovery is left out: it brings the level back.
    for (instruction, parameters) in
        [(3, &[41, 5][..]), (4, &[41, 6]), (5, &[]), (9, &[]), (0x0A, &[]), (0x0B, &[])]
    {
        assert_eq!(exchange(&mut world, &feetech(1, instruction, parameters))[..], [], "{instruction}");
    }
    assert_eq!(exchange(&mut world, &feetech(1, 2, &[41, 1])), feetech(1, 0, &[6]));
    assert_eq!(exchange(&mut world, &feetech(1, 1, &[])), DONE);
    assert_eq!(exchange(&mut world, &feetech(0xFE, 0x82, &[41, 1, 1])), feetech(1, 0, &[6]));
}

#[test]
fn instructions_that_the_wiki_does_not_have_get_no_answer() {
    let mut world = one();
    for instruction in (0..=255).filter(|n| ![1, 2, 3, 4, 5, 6, 8, 9, 0x0A, 0x0B, 0x82, 0x83].contains(n)) {
        assert_eq!(exchange(&mut world, &feetech(1, instruction, &[])), [], "{instruction:02X}");
    }
    assert_eq!(exchange(&mut world, &feetech(1, 2, &[41])), [], "a read without a count");
    assert_eq!(exchange(&mut world, &feetech(1, 1, &[])), DONE);
}

#[test]
fn all_answer_a_broadcast_ping_in_the_order_of_their_ids() {
    let mut world = world(feetech_bus([7, 3, 5].map(|id| servo("STS3215-12V", id)).to_vec()));
    let answers = exchange(&mut world, &feetech(0xFE, 1, &[]));
    assert_eq!(answers, [3, 5, 7].map(|id| feetech(id, 0, &[])).concat());
}

#[test]
fn an_scs_servo_has_the_high_byte_first_and_its_lock_at_48() {
    let mut config = servo("SCS0009", 1);
    config.position_counts = 700.0;
    let mut world = world(BusConfig { supply_v: 6.0, ..feetech_bus(vec![config]) });
    let read = |world: &mut World, address, count| exchange(world, &feetech(1, 2, &[address, count]));
    assert_eq!(read(&mut world, 2, 3), feetech(1, 0, &[1, 0x05, 0x04]), "big-endian; model 1284");
    assert_eq!(read(&mut world, 9, 4), feetech(1, 0, &[0, 20, 0x03, 0xEB]));
    assert_eq!(read(&mut world, 56, 2), feetech(1, 0, &[0x02, 0xBC]));
    feetech_write(&mut world, 1, 21, &[40]);
    feetech_write(&mut world, 1, 48, &[0]);
    feetech_write(&mut world, 1, 13, &[60]);
    restart(&mut world);
    assert_eq!((byte(&world, 21), byte(&world, 13), byte(&world, 48)), (15, 60, 1));
    assert_eq!(exchange(&mut world, &feetech(1, 0x0B, &[])), [], "no calibration");
    feetech_write(&mut world, 1, 40, &[128]);
    assert_eq!((read(&mut world, 56, 2), byte(&world, 40)), (feetech(1, 0, &[0x02, 0xBC]), 0));
}

#[test]
fn scs_servos_ignore_a_sync_read_and_obey_a_sync_write() {
    let mut world = world(feetech_bus(vec![servo("SCS0009", 1), servo("STS3215-12V", 2)]));
    let answers = exchange(&mut world, &feetech(0xFE, 0x82, &[56, 2, 1, 2]));
    assert_eq!(answers, feetech(2, 0, &[0x00, 0x08]));
    exchange(&mut world, &feetech(0xFE, 0x83, &[42, 2, 1, 0x02, 0x58, 2, 0x58, 0x02]));
    assert_eq!(world.register(0, 1, 42), Some(0x02));
    assert_eq!(world.register(0, 2, 42), Some(0x58));
}
