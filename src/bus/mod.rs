//! Servo buses: goals out, replies in, one slot a servo.
//!
//! [`feetech`] and [`dynamixel`] turn requests into bytes and bytes into packets; [`client`] runs one bus
//! on them, without I/O; [`Buses`] runs all of them at the same time over the [`port`]s.

mod buses;
pub mod client;
mod codec;
pub mod dynamixel;
mod error;
pub mod feetech;
pub mod packet;
pub mod port;
mod register;
mod reply;
pub mod serial;
mod sim;
#[cfg(test)]
mod testing;
pub mod timing;

pub use buses::{BusDevice, BusStatistics, Buses, Disagreement, ExchangeTimes, StartError, watchdog_time};
pub use client::{Answer, BusClient, Counters, ServoGoal};
pub use error::{Request, ServoPlace, TransactionError};
pub use port::{PortError, Ports};
pub use reply::{Feedback, Slot};
pub use serial::SerialPorts;
pub use sim::SimPorts;
