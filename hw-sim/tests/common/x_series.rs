//! Dynamixel X servos, one on a bus with the id 1: what their tests share.

use super::*;
use hw_sim::{FaultScript, Model, Shaft};

pub(crate) const RESULT_FAIL: u8 = 1;
pub(crate) const DATA_RANGE: u8 = 4;
pub(crate) const DATA_LENGTH: u8 = 5;
pub(crate) const DATA_LIMIT: u8 = 6;
pub(crate) const ACCESS: u8 = 7;

/// Operating modes.
pub(crate) const CURRENT: u8 = 0;
pub(crate) const VELOCITY: u8 = 1;
pub(crate) const EXTENDED: u8 = 4;
pub(crate) const CURRENT_POSITION: u8 = 5;
pub(crate) const PWM: u8 = 16;

/// 0.229 rpm, count/s.
pub(crate) const VELOCITY_UNIT: f64 = 0.229 / 60.0 * 4096.0;
/// The same, rad/s.
pub(crate) const VELOCITY_UNIT_RAD_S: f64 = 0.229 * std::f64::consts::TAU / 60.0;

/// The shaft is jammed from the start.
pub(crate) const STUCK: &str = "[[fault]]\nat_s = 0\nkind = 'stuck'";

pub(crate) fn dynamixels() -> impl Iterator<Item = &'static Model> {
    Model::all().iter().filter(|model| model.protocol == Protocol::Dynamixel)
}

pub(crate) fn named(name: &str) -> &'static Model {
    Model::named(name).unwrap()
}

/// A servo at its nominal voltage, with its shaft there.
pub(crate) fn one_at(model: &str, position_counts: f64) -> World {
    one_with(model, position_counts, "")
}

/// The same with faults.
pub(crate) fn one_with(model: &str, position_counts: f64, script: &str) -> World {
    let servo = ServoConfig { position_counts, ..servo(model, 1) };
    let bus = BusConfig { supply_v: named(model).nominal_voltage_v, ..dynamixel_bus(vec![servo]) };
    World::new(&[bus], FaultScript::from_toml(script).unwrap(), 1).unwrap()
}

/// Status packet.
pub(crate) fn status(id: u8, error: u8, data: &[u8]) -> Vec<u8> {
    dynamixel(id, &[&[0x55, error], data].concat())
}

/// Error field of what comes back.
pub(crate) fn tell(world: &mut World, body: &[u8]) -> u8 {
    exchange(world, &dynamixel(1, body))[8]
}

/// Error field of the answer to a write.
pub(crate) fn write(world: &mut World, address: u16, data: &[u8]) -> u8 {
    tell(world, &[&[3], &address.to_le_bytes()[..], data].concat())
}

/// What a read gives.
pub(crate) fn read(world: &mut World, address: u16, count: u8) -> Vec<u8> {
    let request = [&[2], &address.to_le_bytes()[..], &[count, 0]].concat();
    let reply = exchange(world, &dynamixel(1, &request));
    assert_eq!(reply[8], 0, "{address}");
    reply[9..reply.len() - 2].to_vec()
}

/// A register, with its sign, whatever the line.
pub(crate) fn get(world: &World, address: u16, size: u16) -> i32 {
    let bytes = (0..size).map(|n| u32::from(world.register(0, 1, address + n).unwrap()) << (8 * n));
    let shift = 32 - 8 * u32::from(size);
    (bytes.sum::<u32>() << shift).cast_signed() >> shift
}

/// Writes, and waits 0.3 ms: the write takes effect when the request of 16 bytes at most has crossed, and the answer
/// has 11.
pub(crate) fn set(world: &mut World, address: u8, size: usize, value: i32) {
    let request = [&[3, address, 0], &value.to_le_bytes()[..size]].concat();
    world.host_send(0, &dynamixel(1, &request)).unwrap();
    world.advance_to(world.now_ns() + 3 * MS / 10);
    received(world, 0);
}

pub(crate) fn mode(world: &mut World, mode: u8) {
    set(world, 11, 1, mode.into());
}

pub(crate) fn torque_on(world: &mut World) {
    set(world, 64, 1, 1);
}

pub(crate) fn goal(world: &mut World, counts: i32) {
    set(world, 116, 4, counts);
}

pub(crate) fn shaft(world: &World) -> Shaft {
    world.shaft(0, 1).unwrap()
}

pub(crate) fn wait(world: &mut World, ms: u64) {
    world.advance_to(world.now_ns() + ms * MS);
}

/// Position (counts) and Velocity Trajectory (its own unit).
pub(crate) fn trajectory(world: &World) -> (f64, f64) {
    (get(world, 140, 4).into(), get(world, 136, 4).into())
}
