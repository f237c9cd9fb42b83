//! Servo buses: goals out, replies in, one slot a servo.

pub mod feetech;
pub mod packet;
pub mod port;
mod reply;

pub use reply::{Feedback, Slot};
