//! Servo buses: goals out, replies in, one slot a servo.

pub mod dynamixel;
pub mod feetech;
pub mod packet;
pub mod port;
mod reply;
#[cfg(test)]
mod testing;

pub use reply::{Feedback, Slot};
