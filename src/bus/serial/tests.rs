use std::io::{Read, Write};
use std::path::PathBuf;

use serialport::SerialPort;

use super::*;

/// The far end of a line, and the device of the near end.
fn line(bus: &str, baud: u32) -> (TTYPort, Device) {
    let (far, near) = TTYPort::pair().unwrap();
    let path = PathBuf::from(near.name().unwrap());
    (far, Device { bus: bus.into(), path, baud, adapter_latency_us: 1000 })
}

/// A time so late that a working test never reaches it.
fn much_later(ports: &mut SerialPorts) -> Time {
    ports.now() + Duration::from_secs(60)
}

#[test]
fn every_rate_of_both_protocols_can_be_set() {
    let feetech = [38_400, 57_600, 76_800, 115_200, 128_000, 250_000, 500_000, 1_000_000];
    let dynamixel = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000];
    for baud in feetech.into_iter().chain(dynamixel) {
        let (_far, device) = line("legs", baud);
        let ports = SerialPorts::open(&[device]).unwrap();
        assert_eq!(ports.line(0).unwrap().baud_rate().unwrap(), baud);
    }
}

#[test]
fn every_byte_passes_unchanged_in_both_directions() {
    let (mut far, device) = line("legs", 1_000_000);
    let mut ports = SerialPorts::open(&[device]).unwrap();
    let all: Vec<u8> = (0..=255).collect();
    let mut read = [0; 256];

    ports.send(0, &all).unwrap();
    far.read_exact(&mut read).unwrap();
    assert_eq!(read.to_vec(), all);

    far.write_all(&all).unwrap();
    let mut received = Vec::new();
    let deadline = much_later(&mut ports);
    while received.len() < all.len() {
        ports.wait_for_input(deadline);
        let count = ports.receive(0, &mut read).unwrap();
        received.extend_from_slice(&read[..count]);
    }
    assert_eq!(received, all);
    assert_eq!(ports.receive(0, &mut read), Ok(0));
}

#[test]
fn input_on_any_line_ends_the_wait_and_without_input_it_lasts_until_the_deadline() {
    let (_quiet, first) = line("left", 1_000_000);
    let (mut far, second) = line("right", 1_000_000);
    let mut ports = SerialPorts::open(&[first, second]).unwrap();
    let deadline = ports.now() + Duration::from_millis(2);
    ports.wait_for_input(deadline);
    assert!(ports.now() >= deadline);

    far.write_all(b"here").unwrap();
    let deadline = much_later(&mut ports);
    ports.wait_for_input(deadline);
    assert!(ports.now() < deadline);
    assert_eq!(ports.receive(0, &mut [0; 8]), Ok(0));
    assert!(ports.receive(1, &mut [0; 8]).unwrap() > 0);
}

#[test]
fn old_input_is_discarded() {
    let (mut far, device) = line("legs", 1_000_000);
    let mut ports = SerialPorts::open(&[device]).unwrap();
    far.write_all(&[7; 3000]).unwrap();
    let deadline = much_later(&mut ports);
    ports.wait_for_input(deadline);
    // A terminal hands over a burst piece by piece.
    while ports.line(0).unwrap().bytes_to_read().unwrap() < 3000 && ports.now() < deadline {}
    ports.discard_input(0).unwrap();
    assert_eq!(ports.receive(0, &mut [0; 8]), Ok(0));
}

#[test]
fn only_one_program_can_open_a_line() {
    let (_far, device) = line("legs", 1_000_000);
    let first = SerialPorts::open(std::slice::from_ref(&device)).unwrap();
    let error = SerialPorts::open(std::slice::from_ref(&device)).unwrap_err();
    assert_eq!(error.faults[0].cause, OpenCause::Busy);
    let text = error.to_string();
    assert!(text.starts_with(&format!("bus legs: {} is in use", device.path.display())), "{text}");
    drop(first);
    SerialPorts::open(&[device]).unwrap();
}

#[test]
fn if_one_device_fails_to_open_none_stays_open() {
    let (_far, good) = line("left", 1_000_000);
    let bad = Device { bus: "right".into(), path: "/nowhere".into(), ..good.clone() };
    let error = SerialPorts::open(&[good.clone(), bad]).unwrap_err();
    assert_eq!(error.faults.len(), 1);
    SerialPorts::open(&[good]).unwrap();
}

#[test]
fn a_line_that_hung_up_is_gone_and_ends_only_the_first_wait() {
    let (far, device) = line("legs", 1_000_000);
    let mut ports = SerialPorts::open(&[device]).unwrap();
    drop(far);
    let deadline = much_later(&mut ports);
    ports.wait_for_input(deadline);
    assert!(ports.now() < deadline, "a hang-up is news");
    assert_eq!(ports.receive(0, &mut [0; 8]), Err(PortError::Gone { bus: 0 }));
    assert_eq!(ports.send(0, b"x"), Err(PortError::Gone { bus: 0 }));
    assert_eq!(ports.discard_input(0), Err(PortError::Gone { bus: 0 }));

    let deadline = ports.now() + Duration::from_millis(2);
    ports.wait_for_input(deadline);
    assert!(ports.now() >= deadline, "a line that is gone is not listened to");
}

#[test]
fn a_line_that_does_not_drain_costs_no_time() {
    let (_far, device) = line("legs", 1_000_000);
    let mut ports = SerialPorts::open(&[device]).unwrap();
    // No program reads the far end: the terminal is full after a while.
    for _ in 0..1000 {
        ports.send(0, &[0x55; 700]).unwrap();
    }
}

#[test]
fn a_bus_that_does_not_exist_is_gone() {
    let mut ports = SerialPorts::open(&[]).unwrap();
    assert_eq!(ports.send(3, b"x"), Err(PortError::Gone { bus: 3 }));
    assert_eq!(ports.receive(3, &mut [0; 8]), Err(PortError::Gone { bus: 3 }));
}

#[test]
fn the_line_of_the_imu_is_read_without_waiting_and_ends_no_wait() {
    let (_quiet, bus) = line("legs", 1_000_000);
    let (mut far, imu) = line("imu", 115_200);
    let mut ports = SerialPorts::open_with_imu(&[bus], Some(&imu)).unwrap();
    assert_eq!(ports.receive_imu(&mut [0; 8]), Ok(0));
    far.write_all(b"here").unwrap();
    // The wait for servos ignores these bytes and lasts as long as without them.
    let deadline = ports.now() + Duration::from_millis(2);
    ports.wait_for_input(deadline);
    assert!(ports.now() >= deadline);
    let (mut received, mut piece) = (Vec::new(), [0; 8]);
    let deadline = much_later(&mut ports);
    while received.len() < 4 && ports.now() < deadline {
        let count = ports.receive_imu(&mut piece).unwrap();
        received.extend_from_slice(&piece[..count]);
    }
    assert_eq!(received, b"here");
    assert_eq!(ports.receive(0, &mut piece), Ok(0), "it is no bus");
    drop(far);
    assert_eq!(ports.receive_imu(&mut piece), Err(PortError::ImuGone));
    assert_eq!(ports.receive(0, &mut piece), Ok(0), "the bus is there");
    // Without a unit there is nothing to read, and no error.
    let (_far, bus) = line("arms", 1_000_000);
    assert_eq!(SerialPorts::open(&[bus]).unwrap().receive_imu(&mut piece), Ok(0));
}
