//! Any bytes into the client's decoders: no panic, and a good packet behind them is found after all.
//!
//! "After all": behind a packet that the bytes happen to hold in the good one's place, that one sent once more.
#![no_main]

use hippocamp::bus::{replies_in, replies_to_fast_read_in};
use hippocamp::imu::{Frame, frames_in};
use hippocamp::model::Protocol;
use hippocamp::units::ServoId;
use libfuzzer_sys::fuzz_target;

/// Of servo 1, model 1030, firmware 38, to a ping (e-manual, Protocol 2.0).
const DYNAMIXEL: [u8; 14] = [0xFF, 0xFF, 0xFD, 0x00, 1, 7, 0, 0x55, 0, 6, 4, 0x26, 0x65, 0x5D];
/// Of servo 1 at 1304 (Feetech wiki, protocol ft-scs).
const FEETECH: [u8; 8] = [0xFF, 0xFF, 1, 4, 0, 0x18, 0x05, 0xDD];
/// An inertial measurement unit at 45 degrees of roll (WT901 datasheet, 5.1.4).
const IMU: [u8; 11] = [0x55, 0x53, 0x00, 0x20, 0, 0, 0, 0, 0, 0, 0xC8];

fuzz_target!(|noise: &[u8]| {
    let twice = |good: &[u8]| [noise, good, good, good].concat();
    let dynamixel = twice(&DYNAMIXEL);
    let found = replies_in(Protocol::Dynamixel, 8, &dynamixel);
    assert_eq!(found.last(), Some(&(1, 0, vec![6, 4, 0x26])));
    replies_to_fast_read_in(Protocol::Dynamixel, &[1, 2, 3].map(ServoId), 8, &dynamixel);
    let found = replies_in(Protocol::Feetech, 8, &twice(&FEETECH));
    assert_eq!(found.last(), Some(&(1, 0, vec![0x18, 0x05])));
    assert_eq!(frames_in(&twice(&IMU)).last(), Some(&Frame::Angle([0x2000, 0, 0])));
});
