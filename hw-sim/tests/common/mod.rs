//! Builders the integration tests share. Packets are built here from the manuals, not with the crate's codecs.
#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

pub(crate) mod x_series;

use hw_sim::{BusConfig, FaultScript, Model, Protocol, ServoConfig, World};

pub(crate) const MS: u64 = 1_000_000;
pub(crate) const S: u64 = 1_000_000_000;

pub(crate) fn servo(model: &str, id: u8) -> ServoConfig {
    ServoConfig {
        model: Model::named(model).unwrap().clone(),
        id,
        return_delay_us: 0,
        position_counts: 2048.0,
    }
}

/// A Feetech bus at 1 Mbit/s, no adapter latency, 12 V.
pub(crate) fn feetech_bus(servos: Vec<ServoConfig>) -> BusConfig {
    BusConfig {
        name: "legs".into(),
        protocol: Protocol::Feetech,
        baud: 1_000_000,
        adapter_latency_us: 0,
        supply_v: 12.0,
        supply_ohm: 0.0,
        servos,
    }
}

/// A Dynamixel bus at 1 Mbit/s, no adapter latency, 12 V.
pub(crate) fn dynamixel_bus(servos: Vec<ServoConfig>) -> BusConfig {
    BusConfig { protocol: Protocol::Dynamixel, ..feetech_bus(servos) }
}

pub(crate) fn world(bus: BusConfig) -> World {
    World::new(&[bus], FaultScript::default(), 1).unwrap()
}

pub(crate) fn world_with_faults(bus: BusConfig, script: &str) -> World {
    World::new(&[bus], FaultScript::from_toml(script).unwrap(), 1).unwrap()
}

/// Everything that has arrived by now.
pub(crate) fn received(world: &mut World, bus: usize) -> Vec<u8> {
    let mut bytes = vec![0; 4096];
    let count = world.host_receive(bus, &mut bytes).unwrap();
    bytes.truncate(count);
    bytes
}

/// Sends, waits 50 ms, and returns what has come.
pub(crate) fn exchange(world: &mut World, request: &[u8]) -> Vec<u8> {
    world.host_send(0, request).unwrap();
    world.advance_to(world.now_ns() + 50 * MS);
    received(world, 0)
}

/// A Feetech packet; `fifth` is the instruction, or the status bits.
pub(crate) fn feetech(id: u8, fifth: u8, parameters: &[u8]) -> Vec<u8> {
    let mut packet = vec![0xFF, 0xFF, id, u8::try_from(parameters.len()).unwrap() + 2, fifth];
    packet.extend(parameters);
    let sum = packet[2..].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    packet.push(!sum);
    packet
}

/// A Dynamixel packet from everything after the length field but the CRC, which must need no stuffing.
pub(crate) fn dynamixel(id: u8, body: &[u8]) -> Vec<u8> {
    let mut packet = vec![0xFF, 0xFF, 0xFD, 0x00, id];
    packet.extend(u16::try_from(body.len() + 2).unwrap().to_le_bytes());
    packet.extend(body);
    packet.extend(crc(&packet).to_le_bytes());
    packet
}

/// CRC-16, polynomial 0x8005, bit by bit by its definition as a shift register.
pub(crate) fn crc(bytes: &[u8]) -> u16 {
    let mut register = 0u16;
    for byte in bytes {
        for bit in (0..8).rev() {
            let feedback = (register >> 15) ^ u16::from(byte >> bit & 1);
            register <<= 1;
            if feedback == 1 {
                register ^= 0x8005;
            }
        }
    }
    register
}

/// Feetech write.
pub(crate) fn feetech_write(world: &mut World, id: u8, address: u8, data: &[u8]) -> Vec<u8> {
    exchange(world, &feetech(id, 3, &[&[address], data].concat()))
}

/// Dynamixel write.
pub(crate) fn dynamixel_write(world: &mut World, id: u8, address: u8, data: &[u8]) -> Vec<u8> {
    exchange(world, &dynamixel(id, &[&[3, address, 0], data].concat()))
}

/// Dynamixel read.
pub(crate) fn dynamixel_read(world: &mut World, id: u8, address: u8, count: u8) -> Vec<u8> {
    exchange(world, &dynamixel(id, &[2, address, 0, count, 0]))
}
