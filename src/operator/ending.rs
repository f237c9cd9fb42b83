//! The end that a person has asked for, the same for every rig.

use super::{Instruction, Key};
use crate::motion::Order;

/// The end asked for, if any. It stays; only an emergency stop can replace it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ending(Option<Instruction>);

impl Ending {
    /// Asks for an orderly stop.
    pub fn stop(&mut self) {
        self.0.get_or_insert(Order::Stop.into());
    }

    /// Asks for the stop action at once.
    pub fn stop_at_once(&mut self) {
        self.0 = Some(Order::StopAtOnce.into());
    }

    /// True if `key` asks for an end; notes that end.
    pub fn takes(&mut self, key: Key) -> bool {
        match key {
            Key::Escape | Key::Character('x') => self.stop_at_once(),
            // Ctrl-D, the end of the input.
            Key::Character('q' | '\x04') => self.stop(),
            Key::Gone => {
                let reason = "the keyboard's terminal is gone";
                self.0.get_or_insert(Instruction { order: Order::Stop, reason });
            }
            _ => return false,
        }
        true
    }

    /// The end asked for, or `order` if there is none.
    pub fn or(&self, order: Order) -> Instruction {
        self.0.unwrap_or(order.into())
    }
}
