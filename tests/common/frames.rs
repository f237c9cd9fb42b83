//! The commands that the servos of a bus heard, exchange by exchange, each with the time it had crossed the line.

use hippocamp::model::servo_model::Register;
use hippocamp::model::{Protocol, Robot};
use hw_sim::World;

use super::servo;

/// Instructions of both protocols.
const SYNC_READ: u8 = 0x82;
const SYNC_WRITE: u8 = 0x83;
const FAST_SYNC_READ: u8 = 0x8A;

/// One exchange as the servos of a bus heard it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Frame {
    /// Time when all of it had crossed the line, ns since power-up.
    pub(crate) at_ns: u64,
    /// Id and goal position of each servo that got a goal, counts.
    pub(crate) goals: Vec<(u8, u64)>,
    /// Ids of the servos that were ordered to take their torque off.
    pub(crate) let_go: Vec<u8>,
}

/// Every exchange that has crossed the line of `bus`: its goals precede a group read.
pub(crate) fn frames(robot: &Robot, world: &World, bus: usize) -> Vec<Frame> {
    let of_bus = robot.joints.iter().map(servo).find(|servo| servo.bus == bus).unwrap();
    let registers = of_bus.model.registers;
    let mut frames = Vec::new();
    let mut frame = Frame::default();
    for request in world.requests(bus) {
        match request.instruction {
            SYNC_WRITE => {
                let write = |register| written(robot.buses[bus].protocol, &request.parameters, register);
                frame.goals.extend(write(registers.goal_position));
                let torque = write(registers.torque_enable).into_iter();
                frame.let_go.extend(torque.filter(|(_, is_on)| *is_on == 0).map(|(id, _)| id));
            }
            SYNC_READ | FAST_SYNC_READ => {
                frames.push(Frame { at_ns: request.at_ns, ..std::mem::take(&mut frame) });
            }
            _ => {}
        }
    }
    frames
}

/// Id and value of each servo, if these are the parameters of a sync write to `register`.
fn written(protocol: Protocol, parameters: &[u8], register: Register) -> Vec<(u8, u64)> {
    let address = register.address.to_le_bytes();
    let head = match protocol {
        Protocol::Feetech => vec![address[0], register.bytes],
        Protocol::Dynamixel => vec![address[0], address[1], register.bytes, 0],
    };
    let Some(rows) = parameters.strip_prefix(head.as_slice()) else { return Vec::new() };
    let value = |bytes: &[u8]| bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte));
    rows.chunks_exact(usize::from(register.bytes) + 1).map(|row| (row[0], value(&row[1..]))).collect()
}

/// Time after `from_ns` when the last servo of `robot` was ordered to take its torque off; `None` until all were.
pub(crate) fn all_let_go_ns(robot: &Robot, world: &World, from_ns: u64) -> Option<u64> {
    let mut last_ns = 0;
    for bus in 0..robot.buses.len() {
        let frames = frames(robot, world, bus);
        for servo in robot.joints.iter().map(servo).filter(|servo| servo.bus == bus) {
            let tells = |frame: &&Frame| frame.at_ns >= from_ns && frame.let_go.contains(&servo.id.0);
            last_ns = last_ns.max(frames.iter().find(tells)?.at_ns);
        }
    }
    Some(last_ns)
}
