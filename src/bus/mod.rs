//! Servo buses: goals out, replies in, one slot a servo.
//!
//! [`feetech`] and [`dynamixel`] turn requests into bytes and bytes into packets; [`client`] runs one bus
//! on them, without I/O; [`port`] is what it all runs over.

pub mod client;
mod codec;
pub mod dynamixel;
pub mod feetech;
pub mod packet;
pub mod port;
mod register;
mod reply;
#[cfg(test)]
mod testing;
pub mod timing;

pub use client::{Answer, BusClient, Counters, ServoGoal};
pub use reply::{Feedback, Slot};
