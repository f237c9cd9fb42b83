//! Servo buses: send goals, receive replies, one slot per servo.
//!
//! `feetech` and `dynamixel` turn requests into bytes and bytes into packets, and say all that is known of their servos;
//! `protocols` lists them. `client` runs one bus on them, without I/O; [`Buses`] runs all of them at the same time over the
//! [`port`]s.

pub(crate) mod ask;
mod buses;
mod client;
mod codec;
pub mod costs;
mod dynamixel;
mod error;
mod feetech;
pub(crate) mod frame;
mod packet;
pub mod port;
pub(crate) mod protocols;
mod register;
mod replies;
pub mod serial;
mod sim;
pub mod table;
#[cfg(test)]
mod testing;
pub mod timing;

pub use crate::signals::{Feedback, ServoGoal, Slot};
pub use buses::{BusDevice, BusStatistics, Buses, Disagreement, ExchangeTimes, StartError, watchdog_time};
pub use client::Counters;
pub use error::{Request, ServoPlace, TransactionError};
pub use port::{PortError, Ports};
pub(crate) use register::{decode, encode};
pub use replies::{Reply, replies_in, replies_to_fast_read_in};
pub use serial::SerialPorts;
pub use sim::SimPorts;
