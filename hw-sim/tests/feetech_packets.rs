//! Feetech packets through a world, byte for byte. Vectors: Feetech wiki, protocol ft-scs.

mod common;
use common::*;
use hw_sim::BusConfig;

#[test]
fn ping_of_the_wiki() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 2, 1, 0xFB]), [0xFF, 0xFF, 1, 2, 0, 0xFC]);
}

#[test]
fn read_position_of_the_wiki() {
    let mut config = servo("STS3215-12V", 1);
    config.position_counts = 1304.0;
    let mut world = world(feetech_bus(vec![config]));
    let reply = exchange(&mut world, &[0xFF, 0xFF, 1, 4, 2, 0x38, 2, 0xBE]);
    assert_eq!(reply, [0xFF, 0xFF, 1, 4, 0, 0x18, 5, 0xDD]);
}

#[test]
fn sync_read_of_the_wiki_is_answered_in_request_order() {
    let servos = vec![servo("STS3215-12V", 2), servo("STS3215-12V", 1)];
    let mut world = world(feetech_bus(servos));
    let reply = exchange(&mut world, &[0xFF, 0xFF, 0xFE, 6, 0x82, 0x38, 8, 1, 2, 0x36]);
    // Position 2048, speed 0, load 0, 12.0 V, 30 °C.
    let data = [0x00, 0x08, 0, 0, 0, 0, 120, 30];
    assert_eq!(reply, [feetech(1, 0, &data), feetech(2, 0, &data)].concat());
}

#[test]
fn sync_write_sets_every_goal_and_gets_no_answer() {
    let mut world = world(feetech_bus((1..=3).map(|id| servo("STS3215-12V", id)).collect()));
    let rows = [42, 2, 1, 0x10, 0x04, 2, 0x20, 0x04, 3, 0x30, 0x04];
    assert_eq!(exchange(&mut world, &feetech(0xFE, 0x83, &rows)), []);
    for (id, low) in [(1, 0x10), (2, 0x20), (3, 0x30)] {
        assert_eq!(world.register(0, id, 42), Some(low));
        assert_eq!(world.register(0, id, 43), Some(0x04));
    }
}

#[test]
fn bad_checksums_other_ids_and_broadcast_writes_get_no_answer() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    assert_eq!(exchange(&mut world, &[0xFF, 0xFF, 1, 2, 1, 0xFA]), []);
    assert_eq!(exchange(&mut world, &feetech(2, 1, &[])), []);
    assert_eq!(exchange(&mut world, &feetech(0xFE, 3, &[41, 9])), []);
    assert_eq!(world.register(0, 1, 41), Some(9));
}

#[test]
fn response_level_0_answers_only_reads_and_pings() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    assert_eq!(feetech_write(&mut world, 1, 41, &[1]), feetech(1, 0, &[]));
    assert_eq!(feetech_write(&mut world, 1, 8, &[0]), []);
    assert_eq!(feetech_write(&mut world, 1, 41, &[2]), []);
    assert_eq!(world.register(0, 1, 41), Some(2));
    assert_eq!(exchange(&mut world, &feetech(1, 2, &[41, 1])), feetech(1, 0, &[2]));
    assert_eq!(exchange(&mut world, &feetech(1, 1, &[])), feetech(1, 0, &[]));
}

#[test]
fn goals_stay_as_written_and_read_only_registers_stay() {
    let mut world = world(feetech_bus(vec![servo("STS3215-12V", 1)]));
    feetech_write(&mut world, 1, 56, &[0, 0]);
    assert_eq!(exchange(&mut world, &feetech(1, 2, &[56, 2])), feetech(1, 0, &[0x00, 0x08]));
    feetech_write(&mut world, 1, 9, &[0xE8, 0x03, 0xB8, 0x0B]);
    feetech_write(&mut world, 1, 42, &[0xFF, 0x0F]);
    assert_eq!(exchange(&mut world, &feetech(1, 2, &[42, 2])), feetech(1, 0, &[0xFF, 0x0F]));
    feetech_write(&mut world, 1, 42, &[0x05, 0x80]);
    assert_eq!(exchange(&mut world, &feetech(1, 2, &[42, 2])), feetech(1, 0, &[0x05, 0x80]));
}

#[test]
fn model_numbers() {
    for (model, number) in [("STS3215-7V4", 777u16), ("STS3215-12V", 777), ("STS3250", 2825)] {
        let mut world = world(BusConfig { supply_v: 7.4, ..feetech_bus(vec![servo(model, 9)]) });
        assert_eq!(exchange(&mut world, &feetech(9, 2, &[3, 2])), feetech(9, 0, &number.to_le_bytes()));
    }
}
