//! Servo buses: goals out, replies in, one slot a servo.

pub mod port;
mod reply;

pub use reply::{Feedback, ServoGoal, Slot};
