//! How long an exchange takes on each bus, and so how fast the loop can be.

use std::time::Duration;

use crate::bus::timing::{GroupRead, adapter_time, cycle_cost};
use crate::model::Robot;

/// What one exchange costs on one bus.
#[derive(Debug, Clone, PartialEq)]
pub struct BusCost {
    /// Name of the bus.
    pub name: String,
    /// Servos on it.
    pub servos: usize,
    /// Time of the bytes on the wire and of the servos' return delays.
    pub wire: Duration,
    /// Time the adapter adds.
    pub adapter: Duration,
}

impl BusCost {
    /// The whole exchange.
    pub fn total(&self) -> Duration {
        self.wire + self.adapter
    }

    /// The loop rate at which one exchange follows the other, Hz.
    pub fn highest_rate_hz(&self) -> f64 {
        1.0 / self.total().as_secs_f64()
    }
}

/// Costs of all buses, in the robot's order. On a Dynamixel bus with plain sync reads: fast ones are shorter,
/// but the loop must keep its rate without them.
pub fn of_robot(robot: &Robot) -> Vec<BusCost> {
    let of_bus = |(index, bus): (usize, &crate::model::Bus)| {
        let mut servos =
            robot.joints.iter().filter_map(|joint| joint.servo.filter(|servo| servo.bus == index));
        let registers = servos.next()?.model.registers;
        let count = 1 + servos.count();
        let cost = cycle_cost(bus, registers, count, GroupRead::Plain);
        let adapter = adapter_time(bus, registers, count);
        Some(BusCost {
            name: bus.name.clone(),
            servos: count,
            wire: cost.time.saturating_sub(adapter),
            adapter,
        })
    };
    robot.buses.iter().enumerate().filter_map(of_bus).collect()
}
