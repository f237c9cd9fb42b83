//! Duration of an exchange on each bus, which limits the loop rate.

use std::time::Duration;

use super::timing::{GroupRead, adapter_time, cycle_cost};
use crate::model::Robot;

/// Duration of one exchange on one bus.
#[derive(Debug, Clone, PartialEq)]
pub struct BusCost {
    /// Name of the bus.
    pub name: String,
    /// Number of servos on it.
    pub servos: usize,
    /// Time of the bytes on the wire and of the servos' return delays.
    pub wire: Duration,
    /// Time the adapter adds.
    pub adapter: Duration,
}

impl BusCost {
    /// Duration of the whole exchange.
    pub fn total(&self) -> Duration {
        self.wire + self.adapter
    }

    /// The loop rate at which exchanges follow each other without a pause, Hz.
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
