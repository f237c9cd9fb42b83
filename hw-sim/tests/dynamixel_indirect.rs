//! Indirect addresses of Dynamixel servos. Facts: ROBOTIS e-manual, X-series, Indirect Address.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::x_series::*;
use common::*;

const MODELS: [&str; 4] = ["XL330-M288", "XL430-W250", "XM430-W210", "XM430-W350"];

/// First pair of a model: address register, data byte; and how many pairs it has.
fn indirect(model: &str) -> (u16, u16, u16) {
    if model.starts_with("XL330") { (168, 208, 20) } else { (168, 224, 56) }
}

/// The examples of the e-manual, Indirect Address.
#[test]
fn indirect_data_are_the_registers_they_point_at() {
    for model in MODELS {
        let mut world = one_at(model, 2048.0);
        let (address, data, _) = indirect(model);
        assert_eq!(write(&mut world, address, &[65, 0]), 0);
        assert_eq!(write(&mut world, data, &[1]), 0);
        assert_eq!(get(&world, 65, 1), 1, "{model}: the LED is on");
        assert_eq!(write(&mut world, data, &[0]), 0);
        assert_eq!(get(&world, 65, 1), 0);
        // The four bytes of Goal Position from the second pair on, in one go with the LED before them.
        assert_eq!(write(&mut world, address + 2, &[116, 0, 117, 0, 118, 0, 119, 0]), 0);
        assert_eq!(write(&mut world, data, &[1, 0x00, 0x04, 0, 0]), 0);
        assert_eq!((get(&world, 65, 1), get(&world, 116, 4)), (1, 1024), "{model}");
        assert_eq!(read(&mut world, data, 5), [1, 0x00, 0x04, 0, 0]);
    }
}

#[test]
fn every_pair_works_in_every_kind_of_read_and_write() {
    for model in MODELS {
        let mut world = one_at(model, 2048.0);
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
                    assert_eq!(get(&world, 65, 1), value);
                }
                tell(&mut world, &[4, low, high, 1]);
                tell(&mut world, &[5]);
                assert_eq!(get(&world, 65, 1), 1);
            }
        }
    }
}

#[test]
fn indirect_data_have_size_range_and_access_of_their_targets() {
    let mut world = one_at("XM430-W210", 2048.0);
    // Goal Position, but its bytes in the wrong order; then a piece of it only.
    write(&mut world, 168, &[116, 0, 118, 0, 117, 0, 119, 0]);
    assert_eq!(write(&mut world, 224, &[0, 4, 0, 0]), DATA_LENGTH);
    write(&mut world, 168, &[116, 0, 117, 0, 118, 0, 119, 0]);
    assert_eq!(write(&mut world, 224, &[0, 4]), DATA_LENGTH);
    assert_eq!(write(&mut world, 224, &[0, 0x10, 0, 0]), 6, "4096 is past the position limit");
    assert_eq!(get(&world, 116, 4), get(&world, 132, 4), "nothing was written");
    // A gap of the table.
    write(&mut world, 168, &[66, 0]);
    assert_eq!(write(&mut world, 224, &[1]), ACCESS);
    // Pointers cannot reach the EEPROM, nor addresses past the table.
    assert_eq!(write(&mut world, 168, &[63, 0]), DATA_RANGE);
    assert_eq!(write(&mut world, 168, &[0x96, 0x02]), DATA_RANGE, "662");
    // A pointer to indirect data means that byte, not the byte that it points to in turn.
    write(&mut world, 170, &[65, 0]);
    write(&mut world, 168, &[225, 0]);
    assert_eq!(write(&mut world, 224, &[1]), 0);
    assert_eq!(get(&world, 65, 1), 0);
}
