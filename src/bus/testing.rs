//! Replies as servos send them, built for tests from the manuals and not from the code under test.

/// A Feetech status packet.
pub(super) fn feetech_status(id: u8, alarms: u8, data: &[u8]) -> Vec<u8> {
    let mut packet = vec![0xFF, 0xFF, id, u8::try_from(data.len() + 2).unwrap(), alarms];
    packet.extend(data);
    let sum: u32 = packet[2..].iter().map(|byte| u32::from(*byte)).sum();
    packet.push(!sum.to_le_bytes()[0]);
    packet
}

/// CRC-16, polynomial 0x8005, bit by bit.
pub(super) fn slow_crc(bytes: &[u8]) -> [u8; 2] {
    let mut crc = 0u16;
    for byte in bytes {
        for bit in (0..8).rev() {
            let carry = (crc >> 15 == 1) != (byte >> bit & 1 == 1);
            crc <<= 1;
            if carry {
                crc ^= 0x8005;
            }
        }
    }
    crc.to_le_bytes()
}

/// A Dynamixel status packet, stuffed.
pub(super) fn dynamixel_status(id: u8, error: u8, data: &[u8]) -> Vec<u8> {
    let mut body = vec![0x55];
    for byte in [&[error], data].concat() {
        body.push(byte);
        if body.ends_with(&[0xFF, 0xFF, 0xFD]) {
            body.push(0xFD);
        }
    }
    let [low, high] = u16::try_from(body.len() + 2).unwrap().to_le_bytes();
    let mut packet = vec![0xFF, 0xFF, 0xFD, 0x00, id, low, high];
    packet.extend(body);
    packet.extend(slow_crc(&packet));
    packet
}

/// A reply to a fast sync read: (id, error, data) of each servo.
pub(super) fn dynamixel_fast(servos: &[(u8, u8, &[u8])]) -> Vec<u8> {
    let blocks: usize = servos.iter().map(|(_, _, data)| data.len() + 4).sum();
    let [low, high] = u16::try_from(blocks + 1).unwrap().to_le_bytes();
    let mut packet = vec![0xFF, 0xFF, 0xFD, 0x00, 0xFE, low, high, 0x55];
    for (id, error, data) in servos {
        packet.extend([error, id]);
        packet.extend(*data);
        packet.extend(slow_crc(&packet));
    }
    packet
}
